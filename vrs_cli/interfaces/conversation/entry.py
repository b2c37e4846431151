"""Typing a program line by line: `.PROGRAM name` opens it, `.END` closes it. Pure: knows no terminal.

The sections of a file (`.LOCATIONS`, `.REALS`, `.STRINGS`) are taken too, so that a whole file can be pasted.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import reduce

from msgspec import Struct, field

from vrs_cli.language.text.source import END, PROGRAM, SECTIONS, lines_of

INDENT = "    "  # a block (val2 section 7)

_LABEL = re.compile(r"^\s*\d+\s+")
_COMMENT = re.compile(r";.*|\"[^\"]*\"")
_FIRST = re.compile(r"[A-Z][\w.]*(?!\s*(?:\[|=(?!=)))(?![\w.])", re.IGNORECASE)  # end = 5 ends no block

CLOSERS = frozenset({"END", "UNTIL"})
MIDDLES = frozenset({"ELSE", "VALUE", "ANY"})
OPENERS = frozenset({"FOR", "WHILE", "CASE"})


def opens_entry(line: str) -> bool:
    """Return whether a line at the prompt begins a program or a section."""
    return _directive(line) in (PROGRAM, *SECTIONS)


def closes_entry(line: str) -> bool:
    """Return whether a line is `.END`."""
    return _directive(line) == END


def _directive(line: str) -> str:
    lines = lines_of(line)
    return lines[0].directive if lines else ""


class ProgramEntry(Struct):
    """The lines typed so far; the first is the header."""

    header: str
    lines: list[str] = field(default_factory=list)
    blocks: int = 0  # that are open after these lines

    def __post_init__(self) -> None:
        self.blocks = depth(self.lines)

    @property
    def program(self) -> bool:
        """Return whether it is a program, and no section."""
        return _directive(self.header) == PROGRAM

    @property
    def prompt(self) -> str:
        """The step that comes next, as VAL's editor asks for it."""
        return f"{len(self.lines) + 1:5d}.? "

    @property
    def indent(self) -> str:
        """The blanks before the next line: one INDENT for each open block, and one for the program."""
        return INDENT * (1 + self.blocks) if self.program else ""

    def add(self, line: str) -> None:
        """Take a line, a block's END or ELSE moved back under its beginning."""
        text = line.strip()
        if not self.program:
            self.lines.append(text)
            return
        before, self.blocks = self.blocks, _blocks_after(self.blocks, text)
        back = 1 if before and _first_word(text) in CLOSERS | MIDDLES else 0
        self.lines.append(INDENT * (1 + before - back) + text if text else "")

    @property
    def text(self) -> str:
        """Return the whole program as a file would hold it."""
        return "\n".join([self.header.strip(), *self.lines, ".END", ""])


def depth(lines: Sequence[str]) -> int:
    """Return how many blocks are open after these lines."""
    return reduce(_blocks_after, lines, 0)


def _blocks_after(before: int, line: str) -> int:
    word, words = _first_word(line), _words(line)
    if word in CLOSERS:
        return max(0, before - 1)
    opens = word in OPENERS or (word == "IF" and words[-1:] == ["THEN"]) or words == ["DO"]
    return before + opens


def _first_word(line: str) -> str:
    found = _FIRST.match(_LABEL.sub("", line.lstrip(), count=1))
    return found.group().upper() if found else ""


def _words(line: str) -> list[str]:
    return _LABEL.sub("", _COMMENT.sub("", line), count=1).upper().split()
