"""A program file as canonical text, where nothing of it can be lost or misread."""

from __future__ import annotations

from vrs_cli.errors import ControlStructure
from vrs_cli.language.analysis.structure import structure_of
from vrs_cli.language.text.ast import Program
from vrs_cli.language.text.diagnostics import Diagnostic, Severity
from vrs_cli.language.text.parser import parse_file
from vrs_cli.language.text.printer import print_file


def canonical_text(text: str) -> str | tuple[Diagnostic, ...]:
    """Return the canonical text of a file, or its errors if a line cannot be read or a block has no beginning or no
    end: a layout would show such a program as something that it is not.
    """
    file, found = parse_file(text)
    unpaired = (
        one
        for part in file.parts
        if isinstance(part, Program)
        for one in structure_of(part).diagnostics
        if one.code == ControlStructure.code
    )
    wrong = tuple(one for one in (*found, *unpaired) if one.severity is Severity.ERROR)
    return wrong or print_file(file)
