"""Test that both libraries know the colour of every ink, and the colours of VAL-II lines."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from prompt_toolkit.styles import Style
from rich.style import Style as RichStyle

from tests.render.contrast import LEAST, contrast
from vrs_cli.render.colours import BARS, COLOURS, Bar, Ink, ink_style, scan


def test_every_ink_has_a_colour() -> None:
    assert set(COLOURS) == set(Ink)


@pytest.mark.parametrize("ink", Ink)
def test_both_libraries_take_the_style(ink: Ink) -> None:
    RichStyle.parse(ink_style(ink))
    attributes = Style([]).get_attrs_for_style_str(ink_style(ink))
    assert attributes.bold == COLOURS[ink][1]


@pytest.mark.parametrize("ink", [ink for ink in Ink if COLOURS[ink][0]])
def test_text_is_readable_on_dark_and_on_light_backgrounds(ink: Ink) -> None:
    colour, _ = COLOURS[ink]
    assert contrast(colour, "#000000") >= LEAST
    assert contrast(colour, "#ffffff") >= LEAST


@pytest.mark.parametrize("bar", Bar)
def test_bars_are_readable(bar: Bar) -> None:
    assert contrast(*BARS[bar]) >= LEAST


def test_the_measure_is_that_of_the_standard() -> None:
    assert contrast("#000000", "#ffffff") == 21.0
    assert contrast("#777777", "#ffffff") == pytest.approx(4.48, abs=0.005)  # the known border case


WORDS = [
    ("MOVE part", "MOVE", Ink.INSTRUCTION),
    ("move part", "move", Ink.INSTRUCTION),
    ("MOVE part", "part", Ink.NAME),
    ("WHERE", "WHERE", Ink.COMMAND),
    ("EXEC pick", "EXEC", Ink.COMMAND),
    ("EXEC pick", "pick", Ink.NAME),
    ("DO MOVE part", "MOVE", Ink.INSTRUCTION),
    ("EXPLAIN MOVE part", "MOVE", Ink.INSTRUCTION),
    ("WHILE x > 2 DO", "WHILE", Ink.CONTROL),
    ("WHILE x > 2 DO", "DO", Ink.CONTROL),
    ("x = SIN(30) ; half", "SIN", Ink.FUNCTION),
    ("x = SIN(30) ; half", "; half", Ink.COMMENT),
    ("move = 2", "move", Ink.NAME),
    ("MOVE[3] = 2", "MOVE", Ink.NAME),
    ('TYPE "a;b", x', '"a;b"', Ink.STRING),
    ("x = ^HFF", "^HFF", Ink.NUMBER),
    ("x = 1E-3", "1E-3", Ink.NUMBER),
    ("MOVE #safe", "#safe", Ink.NAME),
    ("MOVE a AT 2.5", "AT", Ink.CONTROL),
    ("WHERE FROM 0 TO 5", "FROM", Ink.CONTROL),
    (".PROGRAM pick", ".PROGRAM", Ink.CONTROL),
    ("MOVF part", "MOVF", Ink.NAME),
    ("x = 6 BAND 3", "BAND", Ink.CONTROL),
    ("IF a EQ b THEN 10", "EQ", Ink.CONTROL),
    ("if a lt b then 10 ; VAL", "lt", Ink.CONTROL),
    ("20 IF a GE b THEN 10", "GE", Ink.CONTROL),
    ("lt = gt+1", "gt", Ink.NAME),
    ("IF lt > 2 THEN", "lt", Ink.NAME),
    ("AUTO REAL i, row[]", "REAL", Ink.CONTROL),
    ("local double x", "double", Ink.CONTROL),
    ("GLOBAL LOC part", "LOC", Ink.CONTROL),
    ("AUTO real", "real", Ink.NAME),
    ("x = real+loc", "loc", Ink.NAME),
    ("FOR step = 1 TO 5 STEP 2", "step", Ink.NAME),
    ("FOR i = 1 TO 5 STEP step", "STEP", Ink.CONTROL),
    ("FOR i = 1 TO 5 STEP step", "step", Ink.NAME),
    ("READY AT at", "AT", Ink.CONTROL),
    ("MOVE at AT 5", "at", Ink.NAME),
    ("x = dx+DX(part)", "dx", Ink.NAME),
    ("x = dx+DX(part)", "DX", Ink.FUNCTION),
    ("stop = status", "stop", Ink.NAME),
    ("stop = status", "status", Ink.NAME),
    ("MOVE HERE", "HERE", Ink.FUNCTION),
]


def test_the_name_of_a_function_that_is_a_variable() -> None:
    assert ("hand", Ink.NAME) in list(scan("x = hand+HAND()", {"hand"}))
    assert ("HAND", Ink.FUNCTION) in list(scan("x = hand+HAND()", {"hand"}))


@pytest.mark.parametrize(("line", "piece", "ink"), WORDS)
def test_ink_of_a_piece(line: str, piece: str, ink: Ink) -> None:
    assert (piece, ink) in list(scan(line))


@given(st.text())
def test_law_the_pieces_are_the_line(line: str) -> None:
    assert "".join(text for text, _ in scan(line)) == line
