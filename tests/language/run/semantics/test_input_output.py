"""What programs write, and what they ask."""

from __future__ import annotations

import pytest

from tests.language.run.semantics.asked import only
from tests.language.running import run_lines
from vrs_cli.language.run.effects import Prompt, Type


def test_type() -> None:
    assert only("x = 2", 'TYPE "x =", x, /F6.1, x, /S') == Type("x = 2   2.0", newline=False)
    assert only("TYPE") == Type("")


@pytest.mark.parametrize(
    ("line", "answers", "values"),
    [
        ('PROMPT "n? ", x', ["5"], {"x": 5.0}),
        ('PROMPT "n? ", x', [" -2.5 "], {"x": -2.5}),
        ('PROMPT "n? ", x', [""], {"x": 0.0}),
        ("PROMPT x, y, z", ["1, 2 3"], {"x": 1.0, "y": 2.0, "z": 3.0}),
        ("PROMPT x, y", ["1"], {"x": 1.0, "y": 0.0}),
        ("PROMPT x, y", [",2"], {"x": 0.0, "y": 2.0}),
        ('PROMPT "name? ", $s', ["a b, c"], {"$s": "a b, c"}),
        ("PROMPT $s", [""], {"$s": ""}),
        ("PROMPT $s, x", ["part 7"], {"$s": "part", "x": 7.0}),
        ("PROMPT x", ["five", "5"], {"x": 5.0}),
        ("PROMPT x", ["1 2", "^HFF"], {"x": 255.0}),
    ],
)
def test_prompt(line: str, answers: list[str], values: dict[str, object]) -> None:
    run = run_lines(line, answers=answers)
    assert {name: run.value(name) for name in values} == values
    assert sum(isinstance(event, Prompt) for event in run.events) == len(answers)


def test_prompt_says_what_was_wrong() -> None:
    run = run_lines('PROMPT "n? ", x', answers=["five", "1 2", "3"])
    assert [str(one.wrong or "").split(" (")[0] for one in run.requests if isinstance(one, Prompt)] == [
        "",
        "*Invalid number format* five",
        "*Invalid number format* 1 2",
    ]
    assert run.requests[0] == Prompt("n? ", 1)


def test_prompt_without_variables_waits_for_a_line() -> None:
    assert run_lines('PROMPT "Press ENTER"', answers=[""]).requests == [Prompt("Press ENTER", 0)]
