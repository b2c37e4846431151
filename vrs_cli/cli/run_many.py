"""`vrs run` of several files: each by itself, one after the other, and one summary of all."""

from __future__ import annotations

import sys
from argparse import Namespace
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

from vrs_cli.cli.command_line import CommandLineError
from vrs_cli.cli.main import OK, status_of
from vrs_cli.errors import VrsError
from vrs_cli.values.numbers import count

if TYPE_CHECKING:
    from vrs_cli.values.results import RunResult

ALONE = ("save", "csv", "plot", "report", "record_units")  # options that name one file, of one run
BROKEN = "not executed"

Object = dict[str, Any]


class Heard(NamedTuple):
    """What a run says of itself: how it ended, where it was executed, and its object of --json."""

    ended: Callable[[RunResult], None]
    printed: Callable[[Object], None]


class FileSummary(NamedTuple):
    """A file of the summary; the seconds are the robot's."""

    path: str
    status: int
    said: str
    seconds: float | None = None


Run = Callable[[Namespace, str, Heard], int]


def run_many(prog: str, options: Namespace, files: Sequence[str], run: Run) -> int:
    """Execute the first program of each file; the worst status. Raises CommandLineError."""
    for name in ALONE:
        if getattr(options, name) is not None:
            raise CommandLineError(f"--{name.replace('_', '-')} is for one file", "run the files one by one for it")
    rows, objects = list[FileSummary](), list[Object]()
    for path in files:
        if not (options.json or options.quiet):
            print(f"==> {path} <==")
        rows.append(_row(prog, options, path, objects, run))
        sys.stdout.flush()
    if options.json:
        import json

        print(json.dumps({"files": objects}, indent=2))
    elif not options.quiet:
        _tell(rows)
    return max(row.status for row in rows)


def _row(prog: str, options: Namespace, path: str, objects: list[Object], run: Run) -> FileSummary:
    results = list["RunResult"]()
    try:
        status = run(options, path, Heard(results.append, lambda found: objects.append({"file": path, **found})))
    except VrsError as error:  # of this file: the others are executed all the same
        print(f"{prog}: {error}", file=sys.stderr)
        return FileSummary(path, status_of(error), BROKEN)
    if not results:
        return FileSummary(path, status, BROKEN)
    result = results[0]
    fault, where = result.fault, ""
    if fault is None and result.beside:
        fault, where = result.beside[0].fault, f" of task {result.beside[0].number}"
    said = result.outcome.value if fault is None else f"{fault.message} at step {fault.step}{where}"
    return FileSummary(path, status, said, result.ended - result.started)


def _tell(rows: Sequence[FileSummary]) -> None:
    """On standard error, beside what programs TYPE."""
    width = max(len(row.path) for row in rows)
    for row in rows:
        seconds = "" if row.seconds is None else f"{row.seconds:.3f} s"
        print(f"{row.path:{width}}  {seconds:>12}  {row.said}", file=sys.stderr)
    wrong = sum(row.status != OK for row in rows)
    print(f"{count(len(rows), 'file')}, {count(wrong, 'failure')}", file=sys.stderr)
