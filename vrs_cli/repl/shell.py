"""Run the shell: with a prompt on a terminal, otherwise with the lines of a pipe. `Local` describes a shell's robot in
this process."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

from msgspec import Struct, structs

from vrs_cli.version import __version__

if TYPE_CHECKING:
    from vrs_cli.devices.outside import Outside
    from vrs_cli.engine.clock import RobotClock
    from vrs_cli.interfaces.dialogue import Terminal
    from vrs_cli.kinematics.model import RobotModel
    from vrs_cli.repl.front_end import FrontEnd, Place
    from vrs_cli.repl.local_robot import Recorder
    from vrs_cli.values.diagnostics import Dialect


BANNER = f"""\
vrs {__version__}: VAL-II for a virtual robot. HELP TUTORIAL lists lines to try first, EXIT leaves.
SHOW pictures the arm here; vrs view, typed outside this prompt, in a browser."""


class Local(Struct):
    """A robot in this process. `model`: the robot; None for the default robot. `file`: the file to load first.
    `recorder`: writes the file of --save. `clock`: a real-time clock; None for virtual time. `recovery`: the folder
    where shells keep unsaved work. `outside`: the devices that programs use. `dialect`: the dialect of typed lines.
    `cell`: the file that describes the robot's cell."""

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
        from vrs_cli.files.recovery import recovery_files

        return bool(recovery_files(self.recovery))  # whether shells that were killed have left files

    def front_end(self, terminal: Terminal) -> FrontEnd:
        from vrs_cli.repl.local_robot import ShellRobot

        return ShellRobot(terminal, *structs.astuple(self)).front_end


def run(place: Local, save: str | None = None) -> int:
    """Run the shell with a robot in this process until the user leaves. Return the exit status.

    `save`: a trajectory file to begin or to continue; if no model is given, the file's robot is used. The status is 1
    if that file is not complete and, on a pipe, if a line could not be carried out. Raises FileError.
    """
    if save is not None:
        from vrs_cli.repl.local_robot import Recorder

        place.recorder = Recorder(save)
        place.model = place.model or place.recorder.model
    sound = True
    try:
        if on_terminal():
            from vrs_cli.repl.config import state_folder

            place.recovery = state_folder(os.environ) / "recovery"
        status = at(place)
    finally:
        if place.recorder is not None:
            sound = place.recorder.close()
    return status if sound else 1


def at(place: Place) -> int:
    """Run the shell with the robot at a place, on a terminal or a pipe. Return the exit status. Raises VrsError."""
    if on_terminal():
        from vrs_cli.repl.interactive import Shell

        return Shell(place).run()
    return on_pipe(place, sys.stdin, sys.stdout)


def on_pipe(place: Place, source: Iterable[str], sink: TextIO) -> int:
    """Run the shell with a robot and without a terminal. Return 1 if a line could not be carried out, else 0."""
    from vrs_cli.repl.loop import run_on_pipe

    return run_on_pipe(place.front_end, source, sink, live=place.lives and not place.remote)


def on_terminal() -> bool:
    return sys.stdin.isatty() and sys.stdout.isatty()
