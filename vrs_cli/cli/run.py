"""Carry out `vrs run` (execute a program from a file and write the requested output files) and `vrs shell` (load a file
and start the shell).
"""

from __future__ import annotations

import os
import signal
from argparse import Namespace
from collections.abc import Mapping
from contextlib import suppress
from importlib.util import find_spec
from typing import TYPE_CHECKING

from vrs_cli.cli import sources
from vrs_cli.cli.command_line import (
    CommandLineError,
    chosen_dialect,
    chosen_outside,
    chosen_robot,
    clock_of,
    refuse,
    teller,
)
from vrs_cli.cli.outputs import Outputs, make_folder
from vrs_cli.errors import FileError

if TYPE_CHECKING:
    from vrs_cli.kinematics.model import RobotModel


# default limits for programs that nobody watches, on systems that can enforce them
UNWATCHED_LIMITS: Mapping[str, float] = {
    "max_wall": 300.0,  # [s] except on a very slow machine, the limit on steps is reached first
    "max_memory": 4_000_000_000,  # bytes of address space; numpy needs some for each core
}


def run(options: Namespace) -> int:
    """Load, check and execute a program. Return 1 if the file has errors or the program stopped with an error."""
    named = _files(options)
    files = sources.program_files(named)
    together = sources.are_together(named, files, options.project)
    options.apart = not together and (len(files) > 1 or set(files) != set(named))  # each file of a folder is run alone
    options.common = os.path.commonpath([os.path.dirname(os.path.abspath(path)) for path in files])
    if options.keep is not None and not options.apart:
        raise CommandLineError("--keep is for the files of a folder", "a program has the files beside it")
    if options.sandbox is not None or options.apart:
        _set_limits(options)
    if len(files) > 1 and not together:
        from vrs_cli.cli.batch import run_many

        return run_many(options, files)
    options.file = files[0]
    outputs, read = Outputs.of(options), sources.sources_of(files, closed=options.sandbox is not None)
    from vrs_cli.cli.batch import Batch

    return Batch(options, outputs, read).run()


def _files(options: Namespace) -> list[str]:
    """Return the files that the command line names.

    The last of several words is the name of a program, unless it is a program file, a folder or a pattern. Raises
    CommandLineError.
    """
    for name in options.files:
        if (kind := _NO_PROGRAMS.get(os.path.splitext(name)[1].lower())) is not None:
            raise CommandLineError(f"{name} is {kind[0]}, no VAL-II program", kind[1].format(name=name))
    files: list[str] = options.files[:-1]
    last: str = options.files[-1]
    options.program = None
    if not files or sources.is_program(last) or os.path.isdir(last) or set(last) & set("*?["):
        return [*files, last]
    options.program = last
    unknown = (name for name in files[1:] if not (sources.is_program(name) or os.path.exists(name)))
    if (wrong := next(unknown, None)) is not None:
        raise CommandLineError(f"{wrong} is no program file", "one program is executed: its name comes last")
    return files


_NO_PROGRAMS = {  # suffix of a file: the kind of file, and the command that uses it
    ".py": ("a Python program", "python {name} runs it"),
    ".csv": ("a table", "vrs lab steer {name} follows joints over time"),
    ".vrst": ("a trajectory", "vrs replay {name} plays it"),
}


def _set_limits(options: Namespace) -> None:
    """Set the limits that the options do not give, and make the folder of --sandbox. Raises CommandLineError."""
    missing = {
        "max_wall": options.realtime is not None or not hasattr(signal, "setitimer"),
        "max_memory": find_spec("resource") is None,
    }
    for name, most in UNWATCHED_LIMITS.items():
        if getattr(options, name) is None and not missing[name]:
            setattr(options, name, most)
    if options.sandbox is not None:
        make_folder(options.sandbox, f"--sandbox {options.sandbox}", "name a folder", CommandLineError)


def shell(options: Namespace) -> int:
    """Run the shell; return its exit status."""
    outside = chosen_outside(options)
    from vrs_cli.repl.shell import Local, run

    clock, dialect, source = clock_of(options.realtime), chosen_dialect(options), None
    if options.file is not None:
        with suppress(FileError):  # the error is reported when the file is loaded
            source = sources.read_source(options.file)
    cell = sources.cell_file(options, source or sources.Source("", "", is_file=False))
    if cell is not None and options.cell is None:
        teller(options.prog)("the cell is {} ({})".format(*cell))
    path = None if cell is None else cell[0]
    model = _robot(options, source)
    return run(Local(model, options.file, clock=clock, outside=outside, dialect=dialect, cell=path), options.save)


def _robot(options: Namespace, source: sources.Source | None) -> RobotModel | None:
    """Return the robot that the options or the program file name. None: use the robot in the file of --save, or the
    default robot."""
    if options.robot is not None:
        return chosen_robot(options)
    of_file = options.base is not None or options.tip is not None
    refuse(
        (of_file, "--base and --tip are links of a robot's file", "give --robot FILE too"),
        (options.task is not None, "--task is for a robot that is named", "give --robot NAME|FILE too"),
    )
    if source is not None and options.save is None:
        named = sources.robot_of(options.prog, source)
        return None if named is None else chosen_robot(options, named)
    return None
