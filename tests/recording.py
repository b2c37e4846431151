"""Figures as they were recorded: lines of words and numbers under titles, in text files beside their tests.

They show that no change of the code alone changes what is computed or said. Who changes it on purpose records anew.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

import pytest

TITLE = "# "


def numbers(values: Iterable[float], digits: int = 6) -> str:
    """Numbers as a record has them, without a negative zero."""
    return " ".join(f"{round(value, digits) + 0.0:.{digits}f}" for value in values)


def write_record(path: Path, lines: Mapping[str, Iterable[str]]) -> None:
    """Write the lines of each title."""
    text = [row for title, rows in lines.items() for row in (f"{TITLE}{title}", *rows)]
    path.write_text("\n".join(text) + "\n", encoding="utf-8")


def check_recorded(path: Path, title: str, lines: Iterable[str], rounding: float) -> None:
    """Check that lines are those under a title: word by word, and numbers but for rounding."""
    known, made = _recorded(path, title), list(lines)
    assert len(made) == len(known)
    for now, before in zip(made, known, strict=True):
        words = [_number(word) for word in _words(before)]
        wanted = [pytest.approx(word, abs=rounding) if isinstance(word, float) else word for word in words]
        assert [_number(word) for word in _words(now)] == wanted, now


def _recorded(path: Path, title: str) -> list[str]:
    for part in path.read_text(encoding="utf-8").split(f"\n{TITLE}"):
        first, *rows = part.removeprefix(TITLE).splitlines()
        if first == title:
            return rows
    raise AssertionError(f"{path.name} has no record of {title}")


def _words(line: str) -> list[str]:
    return line.replace(",", " ,").replace(";", " ;").split()


def _number(word: str) -> float | str:
    try:
        return float(word)
    except ValueError:
        return word
