"""`vrs run`: load a program file, execute a program of it, and write what was asked for."""

from __future__ import annotations

import argparse
import os
import signal
from argparse import Namespace
from collections.abc import Mapping
from importlib.util import find_spec

from vrs_cli.cli.command_line import (
    CELL,
    DIALECT,
    OUTSIDE,
    REALTIME,
    ROBOT,
    CommandLineError,
    command,
    group,
    option,
    positive,
    size,
    whole,
)
from vrs_cli.cli.outputs import OUTPUT_OPTIONS, Outputs
from vrs_cli.cli.sources import PROJECT, are_together, is_program, program_files, sources_of

FENCE: Mapping[str, float] = {  # round a program that nobody watches, where the system has such
    "max_wall": 300.0,  # what is counted ends a program first, but on a very slow machine
    "max_memory": 4_000_000_000,  # of address space, of which numpy takes some for each core
}


def run(options: Namespace) -> int:
    """Load, check and execute; returns 1 when the file has errors or the program stopped with one."""
    named = _files(options)
    files = program_files(named)
    together = are_together(named, files, options.project)
    options.apart = not together and (len(files) > 1 or set(files) != set(named))  # a folder run: each file by itself
    options.common = os.path.commonpath([os.path.dirname(os.path.abspath(path)) for path in files])
    if options.keep is not None and not options.apart:
        raise CommandLineError("--keep is for the files of a folder", "a program has the files beside it")
    if options.sandbox is not None or options.apart:
        _fence_in(options)
    if len(files) > 1 and not together:
        from vrs_cli.cli.batch import run_many

        return run_many(options, files)
    options.file = files[0]
    outputs, sources = Outputs.of(options), sources_of(files, closed=options.sandbox is not None)
    from vrs_cli.cli.batch import Batch

    return Batch(options, outputs, sources).run()


def _files(options: Namespace) -> list[str]:
    """The files that are named. The last of several words is the name of a program, unless it is a program file, a
    folder or a pattern. Raises CommandLineError.
    """
    for name in options.files:
        if (kind := _NO_PROGRAMS.get(os.path.splitext(name)[1].lower())) is not None:
            raise CommandLineError(f"{name} is {kind[0]}, no VAL-II program", kind[1].format(name=name))
    files: list[str] = options.files[:-1]
    last: str = options.files[-1]
    options.program = None
    if not files or is_program(last) or os.path.isdir(last) or set(last) & set("*?["):
        return [*files, last]
    options.program = last
    unknown = (name for name in files[1:] if not (is_program(name) or os.path.exists(name)))
    if (wrong := next(unknown, None)) is not None:
        raise CommandLineError(f"{wrong} is no program file", "one program is executed: its name comes last")
    return files


_NO_PROGRAMS = {  # by the ending of a file: what it is, and what takes it
    ".py": ("a Python program", "python {name} runs it"),
    ".csv": ("a table", "vrs lab steer {name} follows joints over time"),
    ".vrst": ("a trajectory", "vrs replay {name} plays it"),
}


def _cycles(text: str) -> int:
    """Read the number of cycles."""
    from vrs_cli.language.run.runtime import MAX_CYCLES

    value = whole(text)
    if value == 0 or value > MAX_CYCLES:
        raise argparse.ArgumentTypeError(f"{text} cycles (1 to {MAX_CYCLES}, or -1 for ever)")
    return value


LIMITS = group(  # of a run, and the fence of the system round it
    "limits",
    option(
        "--max-time",
        rare=True,
        metavar="S",
        type=positive,
        help="seconds of the robot's time (default: a day, 86400; or an hour, 3600)",
    ),
    option(
        "--max-steps",
        rare=True,
        metavar="N",
        type=size,
        help="steps of all programs together (default: 100M, in real time any number; or 10M)",
    ),
    option(
        "--max-elements",
        rare=True,
        metavar="N",
        type=size,
        help="what arrays and strings hold: elements and characters (default: 10M)",
    ),
    option("--max-output", rare=True, metavar="BYTES", type=size, help="what is typed (default: 100M; or 1M)"),
    option("--max-disk", rare=True, metavar="BYTES", type=size, help="what is written to files (default: 1G; or 10M)"),
    option(
        "--max-wall",
        rare=True,
        metavar="SECONDS",
        type=positive,
        help="time on the wall; the machine decides where that ends a run (default: any; or 300)",
    ),
    option(
        "--max-memory",
        rare=True,
        metavar="BYTES",
        type=size,
        help="memory of the process, where the system has such a limit (default: any; or 4G)",
    ),
    about="Where one is reached the program is stopped with an error. The first default is for one file; the second "
    "is for each file of a folder or a pattern, and with --sandbox. K, M and G are 1000, 1000K and 1000M.",
)


run_parser = command(
    "Load a VAL-II file and execute a program of it on the virtual robot.",
    """\
  vrs run pick.v2
  vrs run main.v2 lib.v2            one name space
  vrs run cell                      each file of a folder alone
  vrs run cell.v2 load.part --cycles 5 --save cell.vrst
\f

Files that are named are one name space, in which the first program is executed. Those of a folder are apart.

What a program TYPEs goes to standard output as it happens, errors go to standard error; PROMPT reads
standard input. With --json, or --csv -, the result stands alone on standard output and all else goes to
standard error. Time is the robot's and passes as fast as it computes, unless --realtime is given.

  vrs run cell --keep written       the same; what each wrote is in written/NAME
  vrs run cell.v2 --signals cell.csv --max-time 60
  vrs run pick.v2 --csv pick.csv --rate 50 --plot pick.svg
  vrs run pick.v2 --report pick.html
  vrs run pick.v2 --json | jq .duration_s
  vrs run theirs.v2 --sandbox box
  vrs run driver.v2 --allow-net --record-units peers.jsonl
""",
    option(
        "files",
        metavar="FILE.v2",
        nargs="+",
        help="a program file (- is standard input), and the name of its program (default: the first); "
        "or files, folders",
    ),
    option("--cycles", metavar="N", type=_cycles, default=1, help="how often; negative: without end"),
    PROJECT,
    *ROBOT,
    DIALECT,
    CELL,
    LIMITS,
    option(
        "--sandbox",
        rare=True,
        metavar="FOLDER",
        help="for programs of somebody else: their files are here alone (of several files: each in FOLDER/NAME)",
    ),
    option(
        "--keep",
        rare=True,
        metavar="FOLDER",
        help="keep what each of several files wrote, in FOLDER/NAME (else it is removed)",
    ),
    option("--signals", rare=True, metavar="FILE", help="when input signals change: lines of time, signal, state"),
    REALTIME,
    OUTSIDE,
    option("--save", metavar="T.vrst", help="save the trajectory, motion by motion"),
    *OUTPUT_OPTIONS,
    option("--json", action="store_true", help="print one JSON object"),
    option("--quiet", action="store_true", help="print only what the program TYPEs"),
)


def _fence_in(options: Namespace) -> None:
    """The folder, and the fence where none is given. Raises CommandLineError."""
    missing = {
        "max_wall": options.realtime is not None or not hasattr(signal, "setitimer"),
        "max_memory": find_spec("resource") is None,
    }
    for name, most in FENCE.items():
        if getattr(options, name) is None and not missing[name]:
            setattr(options, name, most)
    if options.sandbox is None:
        return
    try:
        os.makedirs(options.sandbox, exist_ok=True)
    except OSError as error:
        raise CommandLineError(f"--sandbox {options.sandbox}: {error.strerror}", "name a folder") from None
