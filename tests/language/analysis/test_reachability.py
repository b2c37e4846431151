from __future__ import annotations

import pytest

from vrs_cli.language.analysis.analyzer import analyze
from vrs_cli.language.analysis.structure import unreachable
from vrs_cli.language.text import ast
from vrs_cli.language.text.parser import parse_file
from vrs_cli.values.diagnostics import Diagnostic


def lines(*steps: str) -> list[int]:
    """Return the steps with a warning."""
    return [one.span.line - 1 for one in warnings(*steps)]


def warnings(*steps: str) -> list[Diagnostic]:
    file, found = parse_file("\n".join((".PROGRAM p", *steps, ".END")))
    assert not found
    analysis = analyze(next(part for part in file.parts if isinstance(part, ast.Program)))
    assert analysis.executable, analysis.diagnostics
    return list(unreachable(analysis.program, analysis.blocks, analysis.labels))


@pytest.mark.parametrize("word", ["RETURN", "STOP", "HALT", "GOTO 10"])
def test_what_stands_after_the_end(word: str) -> None:
    assert lines("10 x = 1", word, "x = 2", "x = 3") == [3]


@pytest.mark.parametrize("word", ["RETURN", "GOTO 10"])
def test_what_cannot_be_reached_says_after_what(word: str) -> None:
    (warning,) = warnings("10 x = 1", word, "; a remark", "x = 2")
    assert f"this is never carried out, after {word.split()[0]} at step 2" in warning.message


@pytest.mark.parametrize(
    "steps",
    [
        ("GOTO 10", "; a remark", "", "10 x = 1"),
        ("IF x THEN", "RETURN", "END", "x = 1"),
        ("IF x GOTO 10", "RETURN", "10 x = 1"),
        ("x = 1", "WHILE TRUE DO", "x = 2", "END", "x = 3"),
        ("DO", "x = 1", "GOTO 10", "UNTIL x", "10 x = 2"),
        ("x = 1", "CASE x OF", "VALUE 1:", "RETURN", "VALUE 2:", "x = 2", "END", "x = 3"),
        ("FOR i = 1 TO 3", "RETURN", "END", "x = 1"),
        ("10 x = 1", "GOTO 10"),
        ("PAUSE", "x = 1"),
        ("IF x EQ 1 THEN 10", "RETURN", "10 x = 1"),
        ("IFSIG 1, -2 THEN 10", "RETURN", "10 x = 1"),
        ("GRASP 20, 10", "RETURN", "10 x = 1"),
    ],
)
def test_what_can_be_reached(steps: tuple[str, ...]) -> None:
    assert lines(*steps) == []


def test_after_both_branches_end() -> None:
    assert lines("IF x THEN", "RETURN", "ELSE", "STOP", "END", "x = 1") == [6]


def test_each_stretch_is_told_once() -> None:
    assert lines("GOTO 10", "x = 1", "x = 2", "10 RETURN", "x = 3") == [2, 5]
