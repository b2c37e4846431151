"""Whether a line may be sent: its first mistake, with the place, before anything is done."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from vrs_cli.language.diagnostics import Diagnostic, LineRefused, Severity

if TYPE_CHECKING:
    from vrs_cli.language.ast import Kind


def first_mistake(line: str, known: Mapping[str, Kind], *, in_program: bool = False) -> Diagnostic | None:
    """The first error in a line, at the prompt or as a step of a program. Several lines (pasted) are not checked."""
    if not line.strip() or "\n" in line:
        return None
    from vrs_cli.language.analyzer import check_line
    from vrs_cli.language.ast import ProgramHeader, Step
    from vrs_cli.language.parser import parse_prompt, parse_step

    try:
        parsed = parse_step(line) if in_program else parse_prompt(line)
    except LineRefused as refused:
        return refused.diagnostic
    statement = parsed.statement if isinstance(parsed, Step) else parsed
    if statement is None or isinstance(statement, ProgramHeader):
        return None
    diagnostics = check_line(statement, known)
    return next((one for one in diagnostics if one.severity is Severity.ERROR), None)
