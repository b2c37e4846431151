"""Test variables with the names of instructions, which may have been meant as instructions."""

from __future__ import annotations

import pytest

from tests.language.analysis.test_analyzer import analysed


@pytest.mark.parametrize(
    ("steps", "told"),
    [
        ("speed = 5", ["speed is a variable here, and nothing reads it"]),
        ("speed[1] = 5", []),
        ("speed = 5\nTYPE speed", []),
        ("speed = 5\nCALL q(speed)", []),
        ('$speed = "a"', []),
        ("x = 5", []),
        ("x = DX(here)", []),
    ],
)
def test_an_instruction_that_became_a_variable_is_told(steps: str, told: list[str]) -> None:
    found = [one.message for one in analysed(steps).diagnostics]
    words = [message for message in found if "is a variable" in message]
    assert len(words) == len(told), words
    assert all(one in message for one, message in zip(told, words, strict=True))
