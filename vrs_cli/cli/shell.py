"""`vrs` and `vrs shell`: the interactive shell."""

from __future__ import annotations

from argparse import Namespace
from typing import TYPE_CHECKING

from vrs_cli.cli.command_line import (
    CommandLineError,
    chosen_dialect,
    chosen_outside,
    chosen_robot,
    clock_of,
    teller,
)
from vrs_cli.cli.sources import Source, cell_file, read_source, robot_of
from vrs_cli.errors import FileError

if TYPE_CHECKING:
    from vrs_cli.kinematics.model import RobotModel


def shell(options: Namespace) -> int:
    """Run the shell; return its exit status."""
    outside = chosen_outside(options)
    from vrs_cli.repl.place import Local
    from vrs_cli.repl.shell import run

    clock, dialect, source = clock_of(options.realtime), chosen_dialect(options), _source(options)
    cell = cell_file(options, source or Source("", "", is_file=False))
    if cell is not None and options.cell is None:
        teller(options.prog)("the cell is {} ({})".format(*cell))
    path = None if cell is None else cell[0]
    model = _robot(options, source)
    return run(Local(model, options.file, clock=clock, outside=outside, dialect=dialect, cell=path), options.save)


def _source(options: Namespace) -> Source | None:
    """Return the program file to load first; None if it cannot be read."""
    if options.file is None:
        return None
    try:
        return read_source(options.file)
    except FileError:  # it is told when it is loaded
        return None


def _robot(options: Namespace, source: Source | None) -> RobotModel | None:
    """Return the wanted robot; None to take that of the file of --save, or the usual one."""
    if options.robot is not None:
        return chosen_robot(options)
    if options.base is not None or options.tip is not None:
        raise CommandLineError("--base and --tip are links of a robot's file", "give --robot FILE too")
    if options.task is not None:
        raise CommandLineError("--task is for a robot that is named", "give --robot NAME|FILE too")
    if source is not None and options.save is None:
        named = robot_of(options.prog, source)
        return None if named is None else chosen_robot(options, named)
    return None
