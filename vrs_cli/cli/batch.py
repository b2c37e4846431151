"""A batch run: its terminal (TYPE goes out as it happens, PROMPT reads standard input, nobody answers other questions),
what is reported of it (one JSON object, or the error of a program in words), and the runs of several files."""

from __future__ import annotations

import sys
from argparse import Namespace
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import Any, NamedTuple, TextIO

from msgspec import Struct

from vrs_cli.cli.command_line import CommandLineError
from vrs_cli.cli.main import OK, status_of
from vrs_cli.cli.sources import position_object
from vrs_cli.engine.engine import Engine
from vrs_cli.errors import EndOfInput, VrsError
from vrs_cli.interfaces.dialogue import Reading, Running
from vrs_cli.render.control import for_stream
from vrs_cli.render.progress import RunProgress
from vrs_cli.trajectory.instant import shown
from vrs_cli.values.diagnostics import Diagnostic, Severity
from vrs_cli.values.numbers import count
from vrs_cli.values.questions import Answer, LineWanted, Question
from vrs_cli.values.replies import Reply
from vrs_cli.values.results import ProgramFault, RunResult

Object = dict[str, Any]
ALONE = ("save", "csv", "plot", "report", "record_units")  # options that name one file, of one run
BROKEN = "not executed"
NO_NUMBERS: Mapping[str, object] = MappingProxyType({})


class BatchTerminal(Struct, frozen=True):
    """Writes to `output`; `quiet` leaves out all but what programs TYPE. `lines`: what PROMPT reads."""

    output: TextIO
    alive: RunProgress
    lines: Iterator[str]
    quiet: bool = False
    attended: bool = False

    def progress(self, doing: Running | Reading) -> None:
        """The line on standard error."""
        if isinstance(doing, Running):
            self.alive(doing.clock)

    def type(self, text: str, newline: bool) -> None:
        """TYPE output."""
        self._write(f"{text}\n" if newline else text)

    def show(self, reply: Reply) -> None:
        """An answer of the session."""
        from vrs_cli.render.text import plain_text

        if not self.quiet:
            self._write(plain_text(reply))

    def ask(self, question: Question) -> Answer:
        """One line of standard input; no other question is answered. Raises EndOfInput, which names the PROMPT."""
        if not isinstance(question, LineWanted) or (question.wrong and not sys.stdin.isatty()):
            return None
        self._write(f"{question.wrong}\n" if question.wrong else "")
        self._write(question.text)
        line = next(self.lines, "")
        if not sys.stdin.isatty():
            self._write("\n")  # no terminal has shown the end of the line
        if not line:
            raise EndOfInput(f"PROMPT {question.text!r} has nothing more to read", "give its answers on standard input")
        return line.rstrip("\r\n")

    def _write(self, text: str) -> None:
        self.alive.hide()
        self.output.write(for_stream(text, self.output))
        self.output.flush()


# --- reports ------------------------------------------------------------------------------------------------------


def run_object(engine: Engine, result: RunResult | None, errors: list[Object]) -> Object:
    """The object of `--json` (design.md section 5); `result` is None when nothing could be executed.

    `segments` counts those of motions: the initial pose is none.
    """
    return {
        "program": result.program if result else None,
        "cycles": result.cycles if result else 0,
        "duration_s": shown(result.ended - result.started) if result else 0.0,
        "segments": len(engine.timeline) - len(engine.book.initial),
        "commands": [
            {
                "text": record.text,
                "t_iss": record.issued,
                "t_asked": record.asked,  # None for a motion that follows another
                "t_exec": record.executed,
                "t_end": record.end,
            }
            for record in engine.book.records()
        ],
        "final": position_object(engine.position(engine.end), engine.model.units),
        "typed": list(result.typed) if result else [],
        "errors": errors,
    }


def fault_object(fault: ProgramFault) -> Object:
    """An error of a running program."""
    place = (fault.program, fault.step, fault.line)
    return _object(Severity.ERROR, fault.code, fault.message, *place, numbers=fault.numbers)


def diagnostic_objects(diagnostics: Iterable[Diagnostic]) -> list[Object]:
    """The errors and warnings of a file that could not be executed."""
    return [_object(one.severity, one.code, one.message, line=one.span.line) for one in diagnostics]


def error_object(error: VrsError) -> Object:
    """An error that came before a program could be executed."""
    return _object(Severity.ERROR, error.code, str(error), numbers=error.numbers)


def _object(
    severity: Severity,
    code: int,
    message: str,
    program: str | None = None,
    step: int | None = None,
    line: int | None = None,
    numbers: Mapping[str, object] = NO_NUMBERS,
) -> Object:
    """An error or a warning, with the numbers behind it where there are any [m, rad]."""
    place = {"program": program, "step": step, "line": line}
    return {"severity": severity.value, "code": code, "message": message, **place, **numbers}


def fault_text(path: str, fault: ProgramFault) -> str:
    """Say where a program stopped and why, with its line and a caret."""
    place = f"{path}:{fault.line}: " if fault.line else ""
    source = fault.source.strip()
    lines = [f"{place}{fault.message}"]
    if source:
        lines += [f"    {source}", f"    {'^' * len(source)}"]
    return "\n".join([*lines, f"Program {fault.program} stopped at step {fault.step}"])


# --- several files: each by itself, one after the other, and one summary of all -----------------------------------


class Heard(NamedTuple):
    """Callbacks of one run of several: `ended` gets its result, `printed` its object of --json."""

    ended: Callable[[RunResult], None]
    printed: Callable[[Object], None]


class FileSummary(NamedTuple):
    """A file of the summary; the seconds are the robot's."""

    path: str
    status: int
    said: str
    seconds: float | None = None


Run = Callable[[Namespace, str, Heard], int]


def run_many(options: Namespace, files: Sequence[str], run: Run) -> int:
    """Execute the first program of each file; the worst status. Raises CommandLineError."""
    for name in ALONE:
        if getattr(options, name) is not None:
            raise CommandLineError(f"--{name.replace('_', '-')} is for one file", "run the files one by one for it")
    rows, objects = list[FileSummary](), list[Object]()
    for path in files:
        if not (options.json or options.quiet):
            print(f"==> {path} <==")
        rows.append(_row(options, path, objects, run))
        sys.stdout.flush()
    if options.json:
        import json

        print(json.dumps({"files": objects}, indent=2))
    elif not options.quiet:
        _tell(rows)
    return max(row.status for row in rows)


def _row(options: Namespace, path: str, objects: list[Object], run: Run) -> FileSummary:
    results = list["RunResult"]()
    try:
        status = run(options, path, Heard(results.append, lambda found: objects.append({"file": path, **found})))
    except VrsError as error:  # of this file: the others are executed all the same
        print(f"{options.prog}: {error}", file=sys.stderr)
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
