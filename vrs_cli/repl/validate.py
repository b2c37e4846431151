"""Whether a line may be sent: its first mistake, with the place, before anything is done."""

from __future__ import annotations

from collections.abc import Container, Mapping

from vrs_cli.language.analyzer import check_line
from vrs_cli.language.ast import Kind, ProgramHeader, Statement
from vrs_cli.language.diagnostics import Diagnostic, LineRefused, Severity
from vrs_cli.language.parser import parse_prompt, parse_step


def first_mistake(
    line: str, known: Mapping[str, Kind], header: str | None = None, names: Container[str] | None = None
) -> Diagnostic | None:
    """The first error in a line of the prompt, or in a step of the program that `header` begins.

    `known`: the kinds of the variables that have a value; `names`: those that a line may show, where there are more.
    Several lines (pasted) are not checked here.
    """
    if not line.strip() or "\n" in line:
        return None
    try:
        if header is None:
            return _first_error(_command(line, known if names is None else names), known)
        return _first_error(parse_step(line).statement, _outside(header, known), in_program=True)
    except LineRefused as refused:
        return refused.diagnostic


def _command(line: str, names: Container[str]) -> Statement | None:
    parsed = parse_prompt(line, names)
    return None if isinstance(parsed, ProgramHeader) else parsed


def _outside(header: str, known: Mapping[str, Kind]) -> Mapping[str, Kind]:
    """Without the names that are parameters of the program: there they mean something else."""
    parsed = parse_prompt(header)
    own = {variable.key for variable in parsed.parameters} if isinstance(parsed, ProgramHeader) else set()
    return {key: kind for key, kind in known.items() if key not in own}


def _first_error(
    statement: Statement | None, known: Mapping[str, Kind], *, in_program: bool = False
) -> Diagnostic | None:
    if statement is None:
        return None
    found = check_line(statement, known, in_program=in_program)
    return next((one for one in found if one.severity is Severity.ERROR), None)
