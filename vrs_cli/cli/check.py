"""Carry out `vrs check` and `vrs fmt`: find mistakes in program files, and format them. No program is executed."""

from __future__ import annotations

import sys
from argparse import Namespace
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from functools import cache, partial
from io import StringIO
from typing import TYPE_CHECKING, Any

from msgspec import Struct, structs

from vrs_cli.cli import commands, main, sources
from vrs_cli.cli.command_line import chosen_dialect, chosen_robot, refuse
from vrs_cli.errors import FileError, UndefinedName
from vrs_cli.files.opening import stamp
from vrs_cli.values.numbers import count

if TYPE_CHECKING:
    from vrs_cli.interfaces.inspection import Beside, Inspector
    from vrs_cli.kinematics.model import RobotModel
    from vrs_cli.values.diagnostics import Diagnostic


ROUNDS = 10  # maximum number of rounds of corrections; more than one, because a correction may uncover another mistake


class Finding(Struct, frozen=True):
    """The diagnostics of a file, sorted by line. `mended`: the number of mistakes that were already corrected."""

    source: sources.Source
    diagnostics: tuple[Diagnostic, ...]
    mended: int = 0


def _text(findings: Sequence[Finding]) -> None:
    """Print all diagnostics and how many there are, in colours if the output is a terminal. Print nothing about files
    without mistakes."""
    for finding in findings:
        if sys.stdout.isatty():
            from vrs_cli.render.console import TerminalRenderer
            from vrs_cli.values.replies import Diagnosed, DiagnosticsReport

            lines = ["", *finding.source.text.split("\n"), ""]
            items = [Diagnosed(one, lines[one.span.line], finding.source.path) for one in finding.diagnostics]
            TerminalRenderer(sys.stdout).draw(DiagnosticsReport(tuple(items)))
        else:
            print(finding.source.diagnostics_text(finding.diagnostics), end="")
    everything = [diagnostic for finding in findings for diagnostic in finding.diagnostics]
    errors = sum(sources.has_errors([diagnostic]) for diagnostic in everything)
    mended = sum(finding.mended for finding in findings)
    if everything or mended:
        text = f"{count(errors, 'error')}, {count(len(everything) - errors, 'warning')}"
        print(f"{text}, {mended} mended" if mended else text)


def _json(findings: Sequence[Finding]) -> None:
    import json

    files = [{"path": finding.source.path, "diagnostics": [*map(_object, finding.diagnostics)]} for finding in findings]
    print(json.dumps({"files": files}, indent=2))


def _object(one: Diagnostic) -> dict[str, Any]:
    return {
        "severity": one.severity.value,
        "code": one.code,
        "label": one.label,
        "message": one.message,
        "text": one.text,
        "detail": one.detail,
        "hint": one.hint,
        "line": one.span.line,
        "column": one.span.column,
        "end": one.span.end,
        "mend": one.mend or None,
    }


def _github(findings: Sequence[Finding]) -> None:
    """Print diagnostics as workflow commands; GitHub Actions reads these from the output of a step."""
    for finding in findings:
        for one in finding.diagnostics:
            properties = {
                "file": finding.source.path,
                "line": one.span.line,
                "col": one.span.column,
                "endColumn": one.span.end,
                "title": f"{one.text} ({one.label})",
            }
            shown = ",".join(f"{name}={_escape(str(value), _PROPERTY)}" for name, value in properties.items())
            print(f"::{one.severity.value} {shown}::{_escape(one.message, _DATA)}")


# characters that must be escaped in a workflow command (GitHub Actions toolkit, @actions/core)
_DATA: Mapping[str, str] = {"%": "%25", "\r": "%0D", "\n": "%0A"}
_PROPERTY: Mapping[str, str] = {**_DATA, ":": "%3A", ",": "%2C"}


def _escape(text: str, table: Mapping[str, str]) -> str:
    return text.translate({ord(character): code for character, code in table.items()})


FORMATS: Mapping[str, Callable[[Sequence[Finding]], None]] = {"text": _text, "json": _json, "github": _github}


# --- corrections (--fix): those that are certainly right are written into the file in one step ------------------------


def mend(finding: Finding, find: Callable[[str], tuple[Diagnostic, ...]]) -> Finding:
    """Correct the mistakes in a file whose correction is certain. Return the corrected text and the remaining
    diagnostics. `find`: returns the diagnostics of a program text; it is called after each round of corrections,
    because a correction may uncover another mistake."""
    from vrs_cli.values.diagnostics import in_order

    now = finding
    for _ in range(ROUNDS):
        mends = tuple(_apart(now.diagnostics))
        lines = now.source.text.split("\n")
        for one in reversed(in_order(mends)):
            line, span = lines[one.span.line - 1], one.span
            lines[span.line - 1] = f"{line[: span.column - 1]}{one.mend}{line[span.end - 1 :]}"
        text = "\n".join(lines)
        now = Finding(sources.Source(now.source.path, text), find(text), now.mended + len(mends)) if mends else now
    return now


def _apart(found: Iterable[Diagnostic]) -> Iterator[Diagnostic]:
    """Yield the diagnostics that have a correction. If two corrections overlap, yield only the one that begins
    first."""
    line, end = 0, 0
    for one in found:
        span = one.span
        if one.mend and (span.line, span.column) >= (line, end):
            yield one
            line, end = span.line, span.end


# --- vrs check ----------------------------------------------------------------------------------------------------


def check(options: Namespace) -> int:
    """Print the diagnostics of all files; return the exit status."""
    no_file = commands.STANDARD_STREAM in options.files and (options.fix or options.watch)
    refuse(
        (no_file, "--fix and --watch are for files, not for standard input", "name files"),
        (options.diff and not options.fix, "--diff shows what --fix would write", "give --fix too"),
    )
    model = chosen_robot(options)
    if options.watch:
        return _watch(options, model)
    return _check(options, model)


def _check(options: Namespace, model: RobotModel) -> int:
    """Check all files once; return the exit status."""
    from vrs_cli.values import diagnostics

    findings, before, status = list[Finding](), dict[str, str](), main.OK
    groups, unreadable = _groups(options)
    for path, error in unreadable.items():  # the other files are still checked
        print(f"{options.prog}: {error}", file=sys.stderr)
        status = max(status, main.status_of(error))
        if options.format != "text":
            found = diagnostics.error(type(error), diagnostics.Span(1, 1, 2), error.detail, error.hint)
            findings.append(Finding(sources.Source(path, ""), (found,)))
    for group in groups:
        new = [source for source in group if source.path not in before]
        before |= {source.path: source.text for source in new}
        findings += _findings(group, new, options, model)
    if not options.diff:
        FORMATS[options.format](findings)
    for one in findings:
        if one.mended and options.diff:
            _show(_difference(one.source.path, before[one.source.path], one.source.text))
        elif one.mended:
            _write(one.source.path, one.source.text)
    wrong = any(
        finding.diagnostics if options.strict else sources.has_errors(finding.diagnostics) for finding in findings
    )
    return max(status, main.FAILED if wrong or (options.diff and any(one.mended for one in findings)) else main.OK)


def _groups(options: Namespace) -> tuple[list[tuple[sources.Source, ...]], dict[str, FileError]]:
    """Return the groups of files that share a name space: each file with the files that it names (`; with: lib.v2`), or
    all files together. Also return the errors of unreadable files, by path."""
    files = sources.program_files(options.files)
    groups, unreadable = list[tuple[sources.Source, ...]](), dict[str, FileError]()
    for path in files:
        try:
            groups.append(sources.sources_of((path,), samples=False))
        except FileError as error:
            unreadable[path] = error
    if sources.are_together(options.files, files, options.project):
        together = {source.path: source for group in groups for source in group}
        groups = [tuple(together.values())] if together else []
    named = {source.path for group in groups for source in group[1:]}
    return [group for group in groups if len(group) > 1 or group[0].path not in named], unreadable


def _findings(
    group: Sequence[sources.Source], wanted: Sequence[sources.Source], options: Namespace, model: RobotModel
) -> Iterator[Finding]:
    """Yield the findings for the `wanted` files of a `group`, which shares one name space."""
    from vrs_cli.interfaces.inspection import Inspector, beside_each
    from vrs_cli.kinematics.robot_file import load_robot
    from vrs_cli.language.run.signals import NO_CELL

    robots = () if options.robot else (sources.robot_of(options.prog, source) for source in group)
    named = next((name for name in robots if name), None)
    its, cell, found = load_robot(named) if named else model, NO_CELL, sources.cell_file(options, group[0])
    if found is not None:
        from vrs_cli.files.cell_file import read_cell

        cell = read_cell(found[0])
    inspectors = [Inspector(its, chosen_dialect(options), cell) for _ in group]
    read = [one.read(source.text, source.name) for one, source in zip(inspectors, group, strict=True)]
    for source, inspector, beside in zip(group, inspectors, beside_each(read), strict=True):
        if source in wanted:
            find = partial(_find, source, inspector, beside, options)
            finding = Finding(source, find(source.text))
            yield mend(finding, find) if options.fix else finding


def _find(
    source: sources.Source, inspector: Inspector, beside: Beside, options: Namespace, text: str
) -> tuple[Diagnostic, ...]:
    """Return the errors in a program text, and the warnings that the options select. A call of a program in another
    file of the same folder is not an error."""
    parts = inspector.read(text, source.name)
    everything = inspector.inspect(parts, beside)
    if source.is_file and any(one.code == UndefinedName.code for one in everything):
        from vrs_cli.files.program_file import programs_beside

        near = structs.replace(beside, elsewhere=programs_beside(source.path))
        everything = inspector.inspect(parts, near)
    return tuple(
        one
        for one in everything
        if sources.has_errors([one])
        or (one.label.startswith(options.select) and not one.label.startswith(options.ignore))
    )


# --- --watch -----------------------------------------------------------------------------------------------------


def _watch(options: Namespace, model: RobotModel) -> int:
    """Check all files again whenever one of them changes, until Ctrl-C."""
    import time

    seen: object = None
    while True:
        now = _state(options.files)
        if now != seen:
            if sys.stdout.isatty():
                print("\033[H\033[2J\033[3J", end="")
            _check(options, model)
            print(f"{time.strftime('%H:%M:%S')} checked; Ctrl-C ends it", file=sys.stderr, flush=True)
            sys.stdout.flush()
            seen = _state(options.files) if options.fix else now
        time.sleep(0.25)


def _state(named: Sequence[str]) -> object:
    """Return a value that changes when one of the files changes."""
    try:
        files = [(path, stamp(path)) for path in sources.program_files(named)]
        return [(path, stamp(path)) for file in files for path in (file[0], *_files_named_in(*file))]
    except FileError as error:
        return str(error)


@cache
def _files_named_in(path: str, _stamp: tuple[int, ...]) -> tuple[str, ...]:
    """Return the files that a file names (`; with: lib.v2`). `_stamp`: identifies the file's version, so that a changed
    file is read again."""
    with suppress(FileError):
        return tuple(source.path for source in sources.sources_of((path,), samples=False)[1:])
    return ()


# --- vrs fmt --------------------------------------------------------------------------------------------------------


def fmt(options: Namespace) -> int:
    """Print, rewrite or compare files. Return 1 if a file has mistakes, or if it would change (with --check or
    --diff)."""
    from_stream = commands.STANDARD_STREAM in options.files
    refuse((options.write and from_stream, "--write cannot change standard input", "leave --write out"))
    from vrs_cli.language.analysis.structure import canonical_text

    dialect = chosen_dialect(options)
    formatted, wrong = list[tuple[sources.Source, str]](), False
    for path in sources.program_files(options.files):
        source = sources.read_source(path, samples=False)
        text = canonical_text(source.text, dialect, source.name)
        if isinstance(text, str):
            formatted.append((source, text))
        else:
            print(source.diagnostics_text(text), end="", file=sys.stderr)
            wrong = True
    for source, text in formatted:
        if not (options.check or options.write or options.diff):
            print(text, end="")
        elif text != source.text and options.diff:
            _show(_difference(source.path, source.text, text))
        elif text != source.text and options.check:
            print(f"{source.path} would change")
        elif text != source.text:
            _write(source.path, text)
            print(f"{source.path} rewritten")
    compared = options.check or options.diff
    would_change = compared and any(text != source.text for source, text in formatted)
    return main.FAILED if wrong or would_change else main.OK


def _write(path: str, text: str) -> None:
    """Write a file. Raises FileError."""
    from vrs_cli.files.atomic import write_atomically

    write_atomically(path, text)


def _difference(path: str, before: str, after: str) -> Iterable[str]:
    """Yield the lines of a diff in the format of `diff -u`, which `patch -p0` accepts."""
    from difflib import unified_diff

    for line in unified_diff(list(StringIO(before)), list(StringIO(after)), path, path):
        yield line.rstrip("\n")
        if not line.endswith("\n"):
            yield "\\ No newline at end of file"


def _show(lines: Iterable[str]) -> None:
    """Print lines of a diff, in colours if the output is a terminal."""
    if not sys.stdout.isatty():
        print("\n".join(lines))
        return
    from vrs_cli.render.blocks import line
    from vrs_cli.render.colours import Ink
    from vrs_cli.render.console import TerminalRenderer, rich_text

    console, inks = TerminalRenderer(sys.stdout).console, {"-": Ink.ERROR, "+": Ink.STRING, "@": Ink.INSTRUCTION}
    for text in lines:
        console.print(rich_text(line(text, inks.get(text[0], Ink.TEXT))), soft_wrap=True)
