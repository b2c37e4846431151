"""The colours of a line."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrs_cli.render.roles import Role
from vrs_cli.render.scan import scan

WORDS = [
    ("MOVE part", "MOVE", Role.INSTRUCTION),
    ("move part", "move", Role.INSTRUCTION),
    ("MOVE part", "part", Role.NAME),
    ("WHERE", "WHERE", Role.COMMAND),
    ("EXEC pick", "EXEC", Role.COMMAND),
    ("EXEC pick", "pick", Role.NAME),
    ("DO MOVE part", "MOVE", Role.INSTRUCTION),
    ("WHILE x > 2 DO", "WHILE", Role.CONTROL),
    ("WHILE x > 2 DO", "DO", Role.CONTROL),
    ("x = SIN(30) ; half", "SIN", Role.FUNCTION),
    ("x = SIN(30) ; half", "; half", Role.COMMENT),
    ("move = 2", "move", Role.NAME),
    ("MOVE[3] = 2", "MOVE", Role.NAME),
    ('TYPE "a;b", x', '"a;b"', Role.STRING),
    ("x = ^HFF", "^HFF", Role.NUMBER),
    ("x = 1E-3", "1E-3", Role.NUMBER),
    ("MOVE #safe", "#safe", Role.NAME),
    ("MOVE a AT 2.5", "AT", Role.CONTROL),
    ("WHERE FROM 0 TO 5", "FROM", Role.CONTROL),
    (".PROGRAM pick", ".PROGRAM", Role.CONTROL),
    ("MOVF part", "MOVF", Role.NAME),
    ("x = 6 BAND 3", "BAND", Role.CONTROL),
    ("IF a EQ b THEN 10", "EQ", Role.CONTROL),
    ("if a lt b then 10 ; VAL", "lt", Role.CONTROL),
    ("20 IF a GE b THEN 10", "GE", Role.CONTROL),
    ("lt = gt+1", "gt", Role.NAME),
    ("IF lt > 2 THEN", "lt", Role.NAME),
    ("AUTO REAL i, row[]", "REAL", Role.CONTROL),
    ("local double x", "double", Role.CONTROL),
    ("GLOBAL LOC part", "LOC", Role.CONTROL),
    ("AUTO real", "real", Role.NAME),
    ("x = real+loc", "loc", Role.NAME),
    ("FOR step = 1 TO 5 STEP 2", "step", Role.NAME),
    ("FOR i = 1 TO 5 STEP step", "STEP", Role.CONTROL),
    ("FOR i = 1 TO 5 STEP step", "step", Role.NAME),
    ("READY AT at", "AT", Role.CONTROL),
    ("MOVE at AT 5", "at", Role.NAME),
    ("x = dx+DX(part)", "dx", Role.NAME),
    ("x = dx+DX(part)", "DX", Role.FUNCTION),
    ("stop = status", "stop", Role.NAME),
    ("stop = status", "status", Role.NAME),
    ("MOVE HERE", "HERE", Role.FUNCTION),
]


def test_the_name_of_a_function_that_is_a_variable() -> None:
    assert ("hand", Role.NAME) in list(scan("x = hand+HAND()", {"hand"}))
    assert ("HAND", Role.FUNCTION) in list(scan("x = hand+HAND()", {"hand"}))


@pytest.mark.parametrize(("line", "piece", "role"), WORDS)
def test_role_of_a_piece(line: str, piece: str, role: Role) -> None:
    assert (piece, role) in list(scan(line))


@given(st.text())
def test_law_the_pieces_are_the_line(line: str) -> None:
    assert "".join(text for text, _ in scan(line)) == line
