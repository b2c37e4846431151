"""`vrs check`: all that is wrong with program files, without running them."""

from __future__ import annotations

import re
import sys
from argparse import ArgumentTypeError, Namespace
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from vrs_cli.cli.command_line import (
    CELL,
    DIALECT,
    ROBOT,
    STANDARD_STREAM,
    CommandLineError,
    Parser,
    chosen_dialect,
    chosen_robot,
    option,
)
from vrs_cli.cli.findings import FORMATS, Finding, mended
from vrs_cli.cli.main import FAILED, OK, status_of
from vrs_cli.cli.sources import has_errors, program_files, read_source, robot_of
from vrs_cli.errors import FileError
from vrs_cli.files.opening import stamp

if TYPE_CHECKING:
    from vrs_cli.kinematics.model import RobotModel
    from vrs_cli.language.run.signals import Cell
    from vrs_cli.values.diagnostics import Diagnostic

LOOKED_EVERY = 0.25  # [s] at the files, with --watch

EPILOG = """\
Codes are V and digits; the first of these stand for all that begin so. Errors are always told: a program
with one does not run. A comment at the end of a line does without its warnings, one anywhere without those of
the file:

    MOVE part        ; vrs: ignore V401
    ; vrs: ignore-file V056, V058

Exit status: 0 without errors (there may be warnings; with --strict there are none), else 1.

  vrs check pick.v2 place.v2
  vrs check cell                    all program files in a folder, and below it
  vrs check "cell/**/*.v2" --ignore V056 --strict
  vrs check cell --fix              mend what is sure: parentheses, words of VAL
  vrs check pick.v2 --cell c.toml   what the cell fills has a value
  vrs check pick.v2 --watch         again whenever a file changes, until Ctrl-C
  vrs check cell --format github    annotations of a GitHub workflow
"""


def main(options: Namespace) -> int:
    """Print all diagnostics of all files."""
    if STANDARD_STREAM in options.files and (options.fix or options.watch):
        raise CommandLineError("--fix and --watch are for files, not for standard input", "name files")
    model, cell = chosen_robot(options), _chosen_cell(options)
    if options.watch:
        return _watch(options, model, cell)
    return _check(options, model, cell)


def parser(prog: str) -> Parser:
    return Parser(
        prog,
        "Find all mistakes in program files. Nothing is run.",
        EPILOG,
        option("files", metavar="FILE.v2", nargs="+", help="files, folders or patterns (- is standard input)"),
        option("--format", choices=tuple(FORMATS), default="text", help="text (default), json or github"),
        option("--select", metavar="CODES", type=_codes, default=("V",), help="warnings to tell: V401,V05"),
        option("--ignore", metavar="CODES", type=_codes, default=(), help="warnings not to tell"),
        option("--strict", action="store_true", help="status 1 for warnings too"),
        option("--fix", action="store_true", help="rewrite what can surely be mended, and tell the rest"),
        option("--watch", action="store_true", help="check again whenever a file changes"),
        *ROBOT,
        DIALECT,
        CELL,
    )


def _chosen_cell(options: Namespace) -> Cell:
    """That of --cell; without it, one that fills nothing."""
    if options.cell is None:
        from vrs_cli.language.run.signals import NO_CELL

        return NO_CELL
    from vrs_cli.files.cell_file import read_cell

    return read_cell(options.cell)


def _codes(text: str) -> tuple[str, ...]:
    """V401,V05: codes, or how they begin."""
    codes = tuple(code.strip().upper() for code in text.split(","))
    wrong = next((code for code in codes if not re.fullmatch("V[0-9]{0,4}", code)), None)
    if wrong is not None:
        raise ArgumentTypeError(f"{wrong!r} is no code, as V401 and V05 are")
    return codes


def _check(options: Namespace, model: RobotModel, cell: Cell) -> int:
    """Check all files once."""
    findings, status = [], OK
    for path in program_files(options.files):
        try:
            findings.append(_finding(path, options, model, cell))
        except FileError as unreadable:  # the other files are checked all the same
            print(f"{options.prog}: {unreadable}", file=sys.stderr)
            status = max(status, status_of(unreadable))
            if options.format != "text":
                findings.append(Finding.of_file(path, unreadable))
    FORMATS[options.format](findings)
    wrong = any(finding.diagnostics if options.strict else has_errors(finding.diagnostics) for finding in findings)
    return max(status, FAILED if wrong else OK)


def _finding(path: str, options: Namespace, model: RobotModel, cell: Cell) -> Finding:
    from vrs_cli.interfaces.inspection import inspect
    from vrs_cli.kinematics.robot_file import load_robot

    source = read_source(path)
    named = None if options.robot else robot_of(options.prog, source)
    its = load_robot(named) if named else model

    def found_in(text: str) -> tuple[Diagnostic, ...]:
        """All errors, and the warnings that are wanted."""
        return tuple(
            one
            for one in inspect(text, its, chosen_dialect(options), cell)
            if has_errors([one]) or (one.label.startswith(options.select) and not one.label.startswith(options.ignore))
        )

    found = Finding(source, found_in(source.text))
    return mended(found, found_in) if options.fix else found


# --- --watch -----------------------------------------------------------------------------------------------------


def _watch(options: Namespace, model: RobotModel, cell: Cell) -> int:
    """Check again and again. Ctrl-C ends it."""
    import time

    seen: object = None
    while True:
        now = _state(options.files)
        if now != seen:
            if sys.stdout.isatty():
                print("\033[H\033[2J\033[3J", end="")
            _check(options, model, cell)
            print(f"{time.strftime('%H:%M:%S')} checked; Ctrl-C ends it", file=sys.stderr, flush=True)
            sys.stdout.flush()
            seen = _state(options.files) if options.fix else now
        time.sleep(LOOKED_EVERY)


def _state(named: Sequence[str]) -> object:
    """What changes when a file does."""
    try:
        return [(path, stamp(Path(path))) for path in program_files(named)]
    except FileError as error:
        return str(error)
