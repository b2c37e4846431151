"""`vrs` without a subcommand: the interactive shell on a terminal, the plain one on a pipe."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from vrs_cli.engine.clock import Clock
    from vrs_cli.kinematics.model import RobotModel

DEFAULT_ROBOT = "puma560"


def main(robot: str | None = None, file: str | None = None, clock: Clock | None = None) -> int:
    """Run the shell until the user leaves; returns the exit status. Raises VrsError for a robot that is not there.

    On a pipe the status is 1 when a line could not be carried out.
    """
    if sys.stdin.isatty() and sys.stdout.isatty():
        from vrs_cli.repl.interactive import run

        return run(None if robot is None else load(robot), file, clock)
    from vrs_cli.repl import plain

    return plain.run(load(robot), file, sys.stdin, sys.stdout, clock)


def load(robot: str | None) -> RobotModel:
    """The robot of that name or file, or the usual one."""
    from vrs_cli.kinematics.model import load_robot

    return load_robot(robot or DEFAULT_ROBOT)
