"""Test that usual lines of a section, which are read without the grammar, give the same as the grammar."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.examples import examples
from vrs_cli.language.text.ast import Entry
from vrs_cli.language.text.line_parser import LineParser, usual_entry
from vrs_cli.values.diagnostics import LineRefused

names = st.sampled_from(
    ["x", "a.b_2", "#p", "$s", "%b", "and", "COM", "pi", "here", "time", "Move", "sin", "a1", "_x", "é"]
)
indexes = st.sampled_from(["", "", "[3]", "[ 3]", "[1,2]", "[]", "[i]", "[1.5]", "[007]"])
numbers = st.sampled_from(
    [
        "1",
        "-2.5",
        "+.5",
        "5.",
        "1e3",
        "-1E-3",
        "1e999",
        "^HFF",
        "'A",
        "1x",
        "--1",
        '"text"',
        ";",
        "1;2",
        "=1",
        "0",
        "-0",
    ]
)
blanks = st.sampled_from([" ", "  ", "\t", "", "\xa0"])


@examples(400)
@given(st.tuples(blanks, names, indexes), st.lists(st.tuples(blanks, numbers), max_size=4), blanks)
def test_a_usual_entry_is_what_the_grammar_reads(head: tuple[str, ...], tail: list[tuple[str, str]], end: str) -> None:
    text = "".join([*head, *(part for pair in tail for part in pair), end])
    usual = usual_entry(text, 7)
    if usual is not None:
        assert repr(usual) == repr(by_grammar(text))


def by_grammar(text: str) -> Entry | str | None:
    """Return the entry of a line by the grammar. Raises LineRefused."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("vrs_cli.language.text.line_parser.usual_entry", lambda _text, _line: None)
        return _PARSER.entry(text, 7)


_PARSER = LineParser()


@pytest.mark.parametrize("text", ["x 1", "\tx  -1.5e3 ", "#p 1 2 3 4 5 6", "row[3] 7", "pi 3", "p 1 2 3 90 -0 .5"])
def test_these_are_usual(text: str) -> None:
    assert repr(usual_entry(text, 7)) == repr(by_grammar(text))
    assert usual_entry(text, 7) is not None


@pytest.mark.parametrize("text", ["1 2,3 , -.5e1", "\t0", "1. ; a;b", "0 ;", "1,2"])
def test_numbers_alone_are_read(text: str) -> None:
    line, _, comment = text.partition(";")
    found = tuple(float(number) for number in line.replace(",", " ").split())
    assert _PARSER.numbers(text) == (found, comment if ";" in text else None)


@pytest.mark.parametrize("text", ["", "; 1", "x 1", "1,,2", "1 2,", ",1", "1e999", "1-2", "^H1", "1x"])
def test_other_lines_are_no_numbers_alone(text: str) -> None:
    assert _PARSER.numbers(text) is None


LONG = {
    "one number": "1" * 100_000 + "x",
    "numbers": "1 " * 20_000 + "x",
    "a value": "x " + "1" * 100_000 + "x",
    "commas": "1, " * 20_000,
}


@pytest.mark.parametrize("line", LONG.values(), ids=LONG)
def test_a_long_line_is_refused_at_once(line: str) -> None:
    """A pattern that tries all ways to divide a line would take too long."""
    assert _PARSER.numbers(line) is None
    with pytest.raises(LineRefused):
        _PARSER.entry(line, 1)


@pytest.mark.parametrize("text", ["x", "x ^HFF", "$s 1", "and 1", "x 1e999", "x 1 ; one", "x[1,2] 3", "", "; x 1"])
def test_the_grammar_reads_all_others(text: str) -> None:
    assert usual_entry(text, 7) is None
    try:
        by_grammar(text)
    except LineRefused:
        return
