"""Test tokens: the decisions by the first word of a statement and by the tables."""

from __future__ import annotations

import pytest

from vrs_cli.errors import CannotInterpret, InvalidName
from vrs_cli.language.text.lexer import MAX_TOKENS, Lexer
from vrs_cli.language.text.line_parser import LineParser
from vrs_cli.language.words.foreign import FOREIGN_SIGNS
from vrs_cli.values.diagnostics import LineRefused, Span

PATTERNS = LineParser()._patterns


def lexer(text: str, line: int = 1) -> Lexer:
    return Lexer(PATTERNS, text, line)


def types(text: str) -> list[str]:
    return [token.type for token in lexer(text).step()]


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("MOVE to", ["WORD", "NAME"]),
        ("FOR i = 1 TO 5", ["FOR", "NAME", "EQUAL", "NUMBER", "TO", "NUMBER"]),
        ("FOR to = to TO to", ["FOR", "NAME", "EQUAL", "NAME", "TO", "NAME"]),
        ("MOVE at AT at", ["WORD", "NAME", "AT", "NAME"]),
        ("READY AT 5", ["WORD", "AT", "NUMBER"]),
        ("WAIT in > 5", ["WORD", "NAME", "INFIX", "NUMBER"]),
        ("COARSE ALWAYS", ["WORD", "ALWAYS"]),
        ("COARSE 50 ALWAYS", ["WORD", "NUMBER", "ALWAYS"]),
        ("SPEED monitor MONITOR ALWAYS", ["WORD", "NAME", "UNIT", "ALWAYS"]),
        ("x = -a - -b", ["NAME", "EQUAL", "PREFIX", "NAME", "INFIX", "PREFIX", "NAME"]),
        ("x = NOT a AND COM b", ["NAME", "EQUAL", "PREFIX", "NAME", "INFIX", "PREFIX", "NAME"]),
        ("TYPE /F6.2, a/F6", ["WORD", "FORMAT", "COMMA", "NAME", "INFIX", "NAME"]),
        ("VALUE 1, 2 :", ["VALUE", "NUMBER", "COMMA", "NUMBER", "COLON"]),
        ("VALUE 1: ;x", ["VALUE", "NUMBER", "COLON", "COMMENT"]),
        ("MOVE a:b", ["WORD", "NAME", "INFIX", "NAME"]),
        ("10 MOVE a", ["LABEL", "WORD", "NAME"]),
        ("move = 5", ["NAME", "EQUAL", "NUMBER"]),
        ("move[1] = 5", ["NAME", "LSQB", "NUMBER", "RSQB", "EQUAL", "NUMBER"]),
        ("MOVE#p", ["WORD", "NAME"]),
        ("IF(x)THEN", ["IF", "LPAR", "NAME", "RPAR", "THEN"]),
        ("DEFBELT 1001, pick ; soon", ["WORD", "REST", "COMMENT"]),
        ('MC TYPE "a;b" ;c', ["WORD", "REST", "COMMENT"]),
        ("REMARK any words: +-*", ["COMMENT"]),
        ("", []),
        ("   ", []),
    ],
)
def test_types(text: str, wanted: list[str]) -> None:
    assert types(text) == wanted


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("DO MOVE a", ["DO_COMMAND", "WORD", "NAME"]),
        ("DO x = 1", ["DO_COMMAND", "NAME", "EQUAL", "NUMBER"]),
        ("EXPLAIN MOVE a", ["EXPLAIN_COMMAND", "WORD", "NAME"]),
        ("EXPLAIN a:b", ["EXPLAIN_COMMAND", "NAME", "INFIX", "NAME"]),
        ("EXPLAIN OAT a", ["EXPLAIN_COMMAND", "TOPIC", "NAME"]),
        ("EXPLAIN OAT:a", ["EXPLAIN_COMMAND", "NAME", "INFIX", "NAME"]),
        ("LOAD C:\\cells\\pick.v2 ;x", ["WORD", "RAW", "COMMENT"]),
        ('STORE "a b.v2" = pick,place', ["WORD", "RAW", "EQUAL", "RAW", "COMMA", "RAW"]),
        ("WHERE FROM 1 TO to STEP .5", ["WORD", "LEAD", "NUMBER", "LEAD", "NAME", "LEAD", "NUMBER"]),
        ("WHERE AT 5", ["WORD", "AT", "NUMBER"]),
        ("HELP THEN", ["WORD", "RAW"]),
    ],
)
def test_types_at_the_prompt(text: str, wanted: list[str]) -> None:
    assert [token.type for token in lexer(text).prompt(())] == wanted


def test_numbers_of_a_section_have_their_signs() -> None:
    tokens = lexer("p[1] 5 -2.5,+3 ;x", 7).entry()
    assert [token.text for token in tokens] == ["p", "[", "1", "]", "5", "-2.5", ",", "+3", ";x"]
    assert {token.span.line for token in tokens} == {7}


def test_columns() -> None:
    tokens = lexer("  10 MOVE  part ;x", 3).step()
    assert [token.span for token in tokens] == [Span(3, 3, 5), Span(3, 6, 10), Span(3, 12, 16), Span(3, 17, 19)]


@pytest.mark.parametrize(
    "line", ['"abc', 'TYPE "abc', '10 TYPE "a", x, "abc ; not a remark', 'TYPE /F6.2,"abc', 'CALL q("abc)']
)
def test_a_missing_quote_is_placed_from_the_one_that_opens(line: str) -> None:
    with pytest.raises(LineRefused) as caught:
        lexer(line).step()
    span = caught.value.diagnostic.span
    assert (span.column, span.end) == (line.rindex('"') + 1, len(line) + 1)


@pytest.mark.parametrize("name", ["\u212a1", "\u017fin"], ids=["Kelvin sign", "long s"])
def test_names_have_ascii_letters_only(name: str) -> None:
    with pytest.raises(LineRefused) as refused:
        lexer(f"x = {name}").step()
    assert refused.value.diagnostic.code == InvalidName.code


def test_words_in_full_and_signs_in_one_spelling() -> None:
    tokens = lexer("calib").step()
    assert (tokens[0].value, tokens[0].text) == ("CALIBRATE", "calib")
    assert [token.value for token in lexer("x = a =< b => c").step()][3::2] == ["<=", ">="]


def test_a_line_without_end_is_refused() -> None:
    text = "x = 1" + "+1" * MAX_TOKENS
    with pytest.raises(LineRefused) as caught:
        lexer(text).step()
    assert caught.value.diagnostic.code == CannotInterpret.code


def test_by_is_a_comma_of_shift_but_not_of_a_function_in_it() -> None:
    tokens = lexer("SHIFT a BY DX(SCALE(b BY 2)), 1").step()
    assert [token.type for token in tokens if token.text == "BY"] == ["COMMA", "BY"]


@pytest.mark.parametrize("line", ["x := 5", "x[1, 2] := 5", "$s:=5"])
def test_colon_equal_is_refused_as_such(line: str) -> None:
    with pytest.raises(LineRefused) as caught:
        lexer(line).step()
    found = caught.value.diagnostic
    assert found.detail == ":= is no sign of VAL-II"
    assert (found.span.column, found.span.end) == (line.index(":=") + 1, line.index(":=") + 3)


@pytest.mark.parametrize(("sign", "hint"), FOREIGN_SIGNS.items())
def test_signs_of_other_languages_lead_to_ours(sign: str, hint: str) -> None:
    with pytest.raises(LineRefused) as caught:
        lexer(f"IF x {sign} 3 THEN").step()
    found = caught.value.diagnostic
    assert (found.detail, found.hint) == (f"{sign} is no sign of VAL-II", hint)
    assert (found.span.column, found.span.end) == (6, 6 + len(sign))
