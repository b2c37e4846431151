"""Where a shell has its robot: in this process, or at the other end of a connection."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from msgspec import Struct

if TYPE_CHECKING:
    from vrs_cli.devices.outside import Outside
    from vrs_cli.engine.clock import RobotClock
    from vrs_cli.interfaces.dialogue import Terminal
    from vrs_cli.interfaces.port.port import Port
    from vrs_cli.kinematics.model import RobotModel
    from vrs_cli.repl.front_end import FrontEnd
    from vrs_cli.repl.recorder import Recorder
    from vrs_cli.values.dialect import Dialect


class Place(Protocol):
    """Where a shell has its robot. `lives`: things happen there while a line is typed; `waits`: something is said or
    asked before the first line; `remote`: an answer takes its time.
    """

    @property
    def lives(self) -> bool: ...
    @property
    def waits(self) -> bool: ...
    @property
    def remote(self) -> bool: ...
    def front_end(self, terminal: Terminal) -> FrontEnd:
        """Raises VrsError."""


class Local(Struct):
    """A robot of this process. `file` is loaded first; `recovery`: where shells keep what is in memory alone;
    `outside`: whom programs may talk to; `dialect`: of what is typed; `cell`:
    the file of what stands around the robot.
    """

    model: RobotModel | None = None
    file: str | None = None
    recorder: Recorder | None = None
    clock: RobotClock | None = None
    recovery: Path | None = None
    outside: Outside | None = None
    dialect: Dialect | None = None
    cell: str | None = None

    remote = False

    @property
    def lives(self) -> bool:
        return self.clock is not None

    @property
    def waits(self) -> bool:
        return self.recorder is not None or self.file is not None or self._left_behind()

    def _left_behind(self) -> bool:
        """Whether shells that were killed have left something."""
        if self.recovery is None or not self.recovery.is_dir():
            return False
        from vrs_cli.files.recovery import files_in

        return bool(files_in(self.recovery))

    def front_end(self, terminal: Terminal) -> FrontEnd:
        from vrs_cli.repl.local_robot import ShellRobot

        ours = (self.model, self.file, self.recorder, self.clock, self.recovery, self.outside, self.dialect, self.cell)
        return ShellRobot(terminal, *ours).front_end


class Remote(Struct):
    """A robot behind a connection, which is there. `told` hears what becomes of that."""

    port: Port
    told: Callable[[str], None]

    remote = lives = waits = True

    def front_end(self, terminal: Terminal) -> FrontEnd:
        from vrs_cli.repl.connection import ConnectionWords
        from vrs_cli.repl.front_end import FrontEnd

        return ConnectionWords(FrontEnd(terminal, self.port, self.told)).front_end
