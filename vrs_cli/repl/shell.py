"""Run the shell: with a prompt on a terminal, otherwise with the lines of a pipe."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable
from typing import TextIO

from vrs_cli.repl.place import Local, Place

FAILED = 1


def run(place: Local, save: str | None = None) -> int:
    """Run the shell with a robot of this process until the user leaves. Return the exit status.

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
    return status if sound else FAILED


def at(place: Place) -> int:
    """Run the shell with a robot. Return the exit status. Raises VrsError."""
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
