"""Test the warning of a DELAY that seems meant to pause the program: once a program."""

from __future__ import annotations

import pytest

from vrs_cli.errors import PauseOfArm
from vrs_cli.language.analysis.analyzer import delays
from vrs_cli.language.text.ast import Program
from vrs_cli.language.text.parser import parse_file


def warned(*steps: str) -> list[int]:
    """Return the steps with a warning."""
    file, found = parse_file("\n".join((".PROGRAM p", *steps, ".END")))
    assert not found
    (program,) = (part for part in file.parts if isinstance(part, Program))
    diagnostics = list(delays(program))
    assert all(one.code == PauseOfArm.code for one in diagnostics)
    return [one.span.line - 1 for one in diagnostics]


@pytest.mark.parametrize(
    "steps",
    [
        ("DELAY 2", "TYPE TIME()"),
        ("DELAY 2", "", "; later", 'TYPE "two seconds are over"'),
        ("DELAY 2", "x = 1", "SIGNAL 1", "TYPE x"),
        ("DELAY 2", "x = TIMER(1)"),
        ("DELAY 2", 'PROMPT "now? ", x'),
        ("DELAY 1", "DELAY 1", "TYPE $TIME"),
    ],
)
def test_what_shows_that_no_time_has_passed(steps: tuple[str, ...]) -> None:
    assert warned(*steps) == [1]


@pytest.mark.parametrize(
    "steps",
    [
        ("DELAY 2", "MOVE a", "TYPE TIME()"),
        ("DELAY 2", "BREAK", "TYPE TIME()"),
        ("DELAY 2", "OPENI", "TYPE TIME()"),
        ("DELAY 2", "WAIT TIMER(1) > 2", "TYPE TIME()"),
        ("DELAY 2", "CALL other", "TYPE TIME()"),
        ("DELAY 2", "IF x THEN", "TYPE TIME()", "END"),
        ("FOR i = 1 TO 3", "TYPE i", "DELAY 1", "END"),
        ("TYPE TIME()", "DELAY 2"),
        ("DELAY 2", "x = 1"),
        ("DELAY 2", "WHILE TIMER(1) < 2 DO", "END"),
    ],
)
def test_what_does_not(steps: tuple[str, ...]) -> None:
    assert not warned(*steps)


def test_once_a_program() -> None:
    assert warned("MOVE a", "DELAY 2", "TYPE 1", "MOVE b", "DELAY 2", "TYPE 2") == [2]
