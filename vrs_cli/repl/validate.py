"""Whether a line may be sent: its first mistake, with the place, before anything is done."""

from __future__ import annotations

from collections.abc import Container, Iterable, Mapping, Sequence

from vrs_cli.language.analysis.analyzer import check_line
from vrs_cli.language.text.ast import ProgramHeader
from vrs_cli.language.text.diagnostics import Diagnostic, LineRefused, Severity
from vrs_cli.language.text.meaning import resolve_line
from vrs_cli.language.text.parser import parse_prompt, parse_step, variables_in
from vrs_cli.language.words.kind import Kind


def first_mistake(
    line: str, known: Mapping[str, Kind], entered: Sequence[str] = (), names: Container[str] | None = None
) -> Diagnostic | None:
    """The first error in a line of the prompt, or in a step of a program of which the heading and some steps are
    `entered`.

    `known`: the kinds of the variables that have a value; `names`: those that a line may show, where there are more.
    Several lines (pasted) are not checked here.
    """
    if not line.strip() or "\n" in line:
        return None
    try:
        if entered:
            return _mistake_in_step(line, known, *entered)
        return _mistake_in_command(line, known, known if names is None else names)
    except LineRefused as refused:
        return refused.diagnostic


def _mistake_in_command(line: str, known: Mapping[str, Kind], names: Container[str]) -> Diagnostic | None:
    parsed = parse_prompt(line, names)
    if parsed is None or isinstance(parsed, ProgramHeader):
        return None
    return _first_error(check_line(parsed, known))


def _mistake_in_step(line: str, known: Mapping[str, Kind], header: str, *steps: str) -> Diagnostic | None:
    """The parameters of the program mean something else than variables of their names outside."""
    statement, heading = parse_step(line).statement, parse_prompt(header)
    if statement is None:
        return None
    parameters = heading.parameters if isinstance(heading, ProgramHeader) else ()
    own = {variable.key for variable in parameters}
    outside = {key: kind for key, kind in known.items() if key not in own}
    meant = resolve_line(statement, variables_in((header, *steps)))
    return _first_error(check_line(meant, outside, in_program=True))


def _first_error(found: Iterable[Diagnostic]) -> Diagnostic | None:
    return next((one for one in found if one.severity is Severity.ERROR), None)
