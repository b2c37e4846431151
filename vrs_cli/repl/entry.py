"""Typing a program line by line: `.PROGRAM name` opens it, `.END` closes it. Pure: knows no terminal."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field

INDENT = "    "  # a block (val2 section 7)

_HEADER = re.compile(r"\s*\.PRO(?:G|GR|GRA|GRAM)?\b", re.IGNORECASE)
_END = re.compile(r"\s*\.E(?:N|ND)?\s*(?:;.*)?$", re.IGNORECASE)
_LABEL = re.compile(r"^\s*\d+\s+")
_COMMENT = re.compile(r";.*|\"[^\"]*\"")
_FIRST = re.compile(r"[A-Z][\w.]*", re.IGNORECASE)

CLOSERS = frozenset({"END", "UNTIL"})
MIDDLES = frozenset({"ELSE", "VALUE", "ANY"})
OPENERS = frozenset({"FOR", "WHILE", "CASE"})


def opens_program(line: str) -> bool:
    """Whether a line at the prompt is the header of a program."""
    return _HEADER.match(line) is not None


def closes_program(line: str) -> bool:
    """Whether a line is `.END`."""
    return _END.match(line) is not None


@dataclass
class ProgramEntry:
    """The lines typed so far; the first is the header."""

    header: str
    lines: list[str] = field(default_factory=list)

    @property
    def prompt(self) -> str:
        """The step that comes next, as VAL's editor asks for it."""
        return f"{len(self.lines) + 1:5d}.? "

    @property
    def indent(self) -> str:
        """The blanks before the next line: one INDENT for each open block, and one for the program."""
        return INDENT * (1 + depth(self.lines))

    def add(self, line: str) -> None:
        """Take a line, a block's END or ELSE moved back under its beginning."""
        text = line.strip()
        before = depth(self.lines)
        back = 1 if before and _first_word(text) in CLOSERS | MIDDLES else 0
        self.lines.append(INDENT * (1 + before - back) + text if text else "")

    @property
    def text(self) -> str:
        """The program as a file would hold it."""
        return "\n".join([self.header.strip(), *self.lines, ".END", ""])


def depth(lines: Sequence[str]) -> int:
    """How many blocks are open after these lines."""
    open_blocks = 0
    for line in lines:
        word, words = _first_word(line), _words(line)
        if word in CLOSERS:
            open_blocks = max(0, open_blocks - 1)
        elif word in OPENERS or (word == "IF" and words[-1:] == ["THEN"]) or words == ["DO"]:
            open_blocks += 1
    return open_blocks


def _first_word(line: str) -> str:
    found = _FIRST.match(_LABEL.sub("", line.lstrip(), count=1))
    return found.group().upper() if found else ""


def _words(line: str) -> list[str]:
    return _LABEL.sub("", _COMMENT.sub("", line), count=1).upper().split()
