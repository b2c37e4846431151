"""Test that words of other languages lead to ours."""

import pytest

from vrs_cli.language.text.parser import parse_prompt
from vrs_cli.language.words.foreign import own_word, theirs
from vrs_cli.language.words.instructions import PROGRAM_WORDS
from vrs_cli.language.words.monitor import COMMANDS
from vrs_cli.language.words.word import State
from vrs_cli.values.diagnostics import LineRefused


@pytest.mark.parametrize(
    ("typed", "ours"),
    [
        ('PRINT "a"', "TYPE"),
        ("SLEEP 2", "DELAY"),
        ("HOME", "READY"),
        ("MOVEJ part", "MOVE"),
        ("MOVEL part", "MOVES"),
        ("LMOVE part", "MOVES"),
        ("DATE", "TIME"),
        ("GRIP", "CLOSEI"),
        ("CLEAR", "Ctrl-L"),
        ("def f", ".PROGRAM name begins a program"),
        ("x := 3", "x = 5 assigns"),
        ("// why", "a comment begins with ;"),
        ("# why", "a comment begins with ;"),
        ("x = 3 // three", "a comment begins with ;"),
        ("MOVE part # there", "a comment begins with ;"),
    ],
)
def test_a_line_of_another_language_is_told_the_way(typed: str, ours: str) -> None:
    with pytest.raises(LineRefused) as refused:
        parse_prompt(typed)
    assert ours in refused.value.hint


def test_each_leads_to_a_word_that_there_is() -> None:
    rows = {**PROGRAM_WORDS, **COMMANDS}
    for foreign in theirs():
        assert foreign not in rows
        assert rows[own_word(foreign)].state is State.SUPPORTED
