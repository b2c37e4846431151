"""`vrs` without a subcommand: the interactive shell on a terminal, the plain one on a pipe."""

from __future__ import annotations

import os
import sys
from typing import TYPE_CHECKING

from vrs_cli.repl.place import Local, Place

if TYPE_CHECKING:
    from vrs_cli.devices.outside import Outside
    from vrs_cli.engine.clock import RobotClock
    from vrs_cli.kinematics.model import RobotModel
    from vrs_cli.repl.recorder import Recorder
    from vrs_cli.values.dialect import Dialect

FAILED = 1


def main(
    model: RobotModel | None = None,
    file: str | None = None,
    save: str | None = None,
    clock: RobotClock | None = None,
    outside: Outside | None = None,
    dialect: Dialect | None = None,
    cell: str | None = None,
) -> int:
    """Run the shell until the user leaves; returns the exit status.

    `save`: a trajectory file that is written on, or begun; without `model` its robot is taken. `outside`:
    whom programs may talk to. The status is 1 when not
    all is in that file, and on a pipe when a line could not be carried out.
    """
    recorder, sound = _recorder(save), True
    try:
        status = _run(Local(model, file, recorder, clock, outside=outside, dialect=dialect, cell=cell))
    finally:
        if recorder is not None:
            sound = recorder.close()
    return status if sound else FAILED


def _run(place: Local) -> int:
    if place.recorder is not None and place.model is None:
        place.model = place.recorder.model
    if on_terminal():
        from vrs_cli.repl.history import recovery_folder

        place.recovery = recovery_folder(os.environ)
    return at(place)


def at(place: Place) -> int:
    """The shell at a robot; returns the exit status. Raises VrsError."""
    if on_terminal():
        from vrs_cli.repl.interactive import Shell

        return Shell(place).run()
    from vrs_cli.repl import plain

    return plain.run(place, sys.stdin, sys.stdout)


def on_terminal() -> bool:
    return sys.stdin.isatty() and sys.stdout.isatty()


def _recorder(path: str | None) -> Recorder | None:
    """What writes the file, which is read first if it is there. Raises FileError."""
    if path is None:
        return None
    from vrs_cli.repl.recorder import Recorder

    return Recorder(path)
