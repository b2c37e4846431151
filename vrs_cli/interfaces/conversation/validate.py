"""Whether a line of a program that is being typed may be sent: its first mistake, before anything is done."""

from __future__ import annotations

from collections.abc import Mapping

from vrs_cli.interfaces.conversation.entry import ProgramEntry, closes_entry
from vrs_cli.interfaces.editor.lines import outside
from vrs_cli.language.analysis.analyzer import check_line
from vrs_cli.language.text.ast import ProgramHeader
from vrs_cli.language.text.meaning import resolve_line
from vrs_cli.language.text.parser import parse_prompt, parse_step, variables_in
from vrs_cli.language.words.values import Kind
from vrs_cli.values.diagnostics import Diagnostic, LineRefused, first_error


def mistake_in_entry(entry: ProgramEntry, line: str, known: Mapping[str, Kind]) -> Diagnostic | None:
    """The first error in the next line of a program. `known`: the kinds of the variables that have a value, but those
    that bear the name of a parameter, which means something else.
    """
    if closes_entry(line) or not entry.program:
        return None
    try:
        statement, heading = parse_step(line).statement, parse_prompt(entry.header)
    except LineRefused as refused:
        return refused.diagnostic
    if statement is None:
        return None
    parameters = heading.parameters if isinstance(heading, ProgramHeader) else ()
    meant = resolve_line(statement, variables_in((entry.header, *entry.lines)))
    return first_error(check_line(meant, outside(parameters, known), in_program=True))
