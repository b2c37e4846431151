"""Define where the robot of a shell runs: in this process, or at the other end of a connection."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from msgspec import Struct, structs

from vrs_cli.version import __version__

if TYPE_CHECKING:
    from vrs_cli.devices.device import Outside
    from vrs_cli.engine.clock import RobotClock
    from vrs_cli.interfaces.dialogue import Terminal
    from vrs_cli.kinematics.model import RobotModel
    from vrs_cli.repl.front_end import FrontEnd
    from vrs_cli.repl.local_robot import Recorder
    from vrs_cli.values.diagnostics import Dialect


BANNER = f"""\
vrs {__version__}: VAL-II for a virtual robot. HELP TUTORIAL has lines to begin with, EXIT leaves.
SHOW pictures the arm here; vrs view, typed outside this prompt, in a browser."""


class Place(Protocol):
    """Where a shell's robot runs, and how the shell reaches it."""

    @property
    def lives(self) -> bool:
        """Whether the robot continues while a line is typed."""

    @property
    def waits(self) -> bool:
        """Whether the shell shows or asks something before the first line."""

    @property
    def remote(self) -> bool:
        """Whether answers take time, because the robot is behind a connection."""

    @property
    def banner(self) -> str:
        """The text before the first prompt on a terminal; "" for none."""

    def front_end(self, terminal: Terminal) -> FrontEnd:
        """Make the front end of the shell. Raises VrsError."""


class Local(Struct):
    """A robot in this process. `file`: the file to load first. `recovery`: the folder where shells keep unsaved work.
    `outside`: the devices that programs use. `dialect`: the dialect of typed lines. `cell`: the file that describes the
    robot's cell."""

    model: RobotModel | None = None
    file: str | None = None
    recorder: Recorder | None = None
    clock: RobotClock | None = None
    recovery: Path | None = None
    outside: Outside | None = None
    dialect: Dialect | None = None
    cell: str | None = None

    remote = False
    banner = BANNER

    @property
    def lives(self) -> bool:
        return self.clock is not None

    @property
    def waits(self) -> bool:
        if self.recorder is not None or self.file is not None:
            return True
        if self.recovery is None or not self.recovery.is_dir():
            return False
        from vrs_cli.files.program_file import recovery_files

        return bool(recovery_files(self.recovery))  # files that killed shells have left

    def front_end(self, terminal: Terminal) -> FrontEnd:
        from vrs_cli.repl.local_robot import ShellRobot

        return ShellRobot(terminal, *structs.astuple(self)).front_end
