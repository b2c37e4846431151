"""Warnings that a file does not want: `; vrs: ignore V401, V056` ends the line of one, `; vrs: ignore-file V401` stands
anywhere. Without codes all are meant. Errors are told whatever a comment says: a program with one does not run.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from typing import Final

from vrs_cli.language.text.source import MAX_LINE_CHARS
from vrs_cli.values.diagnostics import Diagnostic, Severity

_MARK: Final = "vrs:"
_COMMENT: Final = re.compile(r";.*\bvrs:\s*ignore(-file)?((?:[\s,]+V\d{3,4})*)\s*$", re.IGNORECASE)


def heeded(lines: Sequence[str], found: Iterable[Diagnostic]) -> tuple[Diagnostic, ...]:
    """Diagnostics without the warnings that comments of the lines suppress."""
    everything = tuple(found)
    asked = [(number, line) for number, line in enumerate(lines, 1) if _MARK in line and len(line) <= MAX_LINE_CHARS]
    if not asked or not everything:
        return everything
    unwanted: dict[int, set[str]] = {}  # by line, 0 for the whole file
    for number, line in asked:
        if comment := _COMMENT.search(line):
            place = 0 if comment[1] else number
            unwanted.setdefault(place, set()).update(re.findall(r"V\d{3,4}", comment[2].upper()) or [""])
    return tuple(one for one in everything if not _suppressed(one, unwanted))


def _suppressed(one: Diagnostic, unwanted: dict[int, set[str]]) -> bool:
    codes = unwanted.get(0, set()) | unwanted.get(one.span.line, set())
    return one.severity is Severity.WARNING and not codes.isdisjoint(("", one.label))
