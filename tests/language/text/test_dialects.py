"""Test dialects: the grouping of operators, the words, and how a file or an option names the dialect."""

from __future__ import annotations

import pytest
from hypothesis import given

from tests.examples import examples
from tests.language.trees import expressions, without_places
from vrs_cli.interfaces.inspection import inspect
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.language.text import ast
from vrs_cli.language.text.parser import parse_file, parse_prompt, parse_step
from vrs_cli.language.text.printer import expression_text, print_file, statement_text
from vrs_cli.language.words.instructions import INSTRUCTIONS
from vrs_cli.values.diagnostics import Dialect

PUMA = load_robot("puma560")


def grouped(line: str, dialect: Dialect) -> str:
    statement = parse_step(line, 1, dialect).statement
    assert statement is not None
    return statement_text(statement)


@pytest.mark.parametrize(
    ("typed", "val2"),
    [
        ("x = a > 2 AND b < 3", "x = (a > (2 AND b)) < 3"),
        ("x = NOT a == b", "x = (NOT a) == b"),
        ("x = a == 1 OR b == 2", "x = (a == (1 OR b)) == 2"),
        ("x = (a > 2) AND (b < 3)", "x = (a > 2) AND (b < 3)"),
        ("x = a AND b", "x = a AND b"),
        ("x = a + 1 > b * 2", "x = a+1 > b*2"),
        ("x = -a ** 2", "x = -a**2"),
    ],
)
def test_val2_groups_by_its_own_table(typed: str, val2: str) -> None:
    assert grouped(typed, Dialect.VAL2) == val2
    assert grouped(typed, Dialect.VAL) == val2
    assert grouped(val2, Dialect.VPLUS) == val2  # the parentheses say it to every dialect
    assert grouped(val2, Dialect.VAL2) == val2


@given(expressions)
@examples(200)
def test_what_is_printed_of_a_val2_program_means_the_same_everywhere(expression: ast.Expression) -> None:
    first = parse_prompt(f"TYPE {expression_text(expression)}", (), Dialect.VAL2)
    assert isinstance(first, ast.DoInstruction)
    assert first.statement is not None
    text = statement_text(first.statement)
    for dialect in Dialect:
        assert without_places(parse_prompt(text, (), dialect), groups=False) == without_places(first, groups=False), (
            text
        )


PROGRAM = """{line}.PROGRAM main()
    IF a > 2 AND b < 3 THEN
        TYPE RX(3)
    END
.END
"""


@pytest.mark.parametrize(
    ("line", "dialect"),
    [
        ("", Dialect.VPLUS),
        ("; dialect: val2\n", Dialect.VAL2),
        (";  DIALECT = VAL2  as it was\n", Dialect.VAL2),
        ("; a cell\n\n; dialect: val\n", Dialect.VAL),
        ("; dialect: vplus\n", Dialect.VPLUS),
        ("; of no dialect\n", Dialect.VPLUS),
        ("\f; dialect: val2\n", Dialect.VAL2),
    ],
)
def test_a_file_says_its_dialect_above_its_first_program(line: str, dialect: Dialect) -> None:
    file, found = parse_file(PROGRAM.format(line=line))
    assert not found
    programs = [part for part in file.parts if isinstance(part, ast.Program)]
    assert [one.dialect for one in programs] == [dialect]


def test_a_file_comes_before_the_option() -> None:
    file, _ = parse_file(PROGRAM.format(line="; dialect: vplus\n"), Dialect.VAL2)
    assert [part.dialect for part in file.parts if isinstance(part, ast.Program)] == [Dialect.VPLUS]
    file, _ = parse_file(PROGRAM.format(line=""), Dialect.VAL2)
    assert [part.dialect for part in file.parts if isinstance(part, ast.Program)] == [Dialect.VAL2]


def test_an_unknown_dialect_is_told() -> None:
    _, found = parse_file(PROGRAM.format(line="; dialect: karel\n"))
    assert [(one.span.line, one.hint) for one in found] == [(1, "there are val, val2, vplus")]


def test_a_printed_file_keeps_its_dialect_and_its_meaning() -> None:
    text = print_file(parse_file(PROGRAM.format(line="; dialect: val2\n"))[0])
    assert text.startswith("; dialect: val2\n")
    assert "IF (a > (2 AND b)) < 3 THEN" in text
    assert print_file(parse_file(text)[0]) == text


def test_words_of_later_dialects_are_refused_by_name() -> None:
    found = inspect(PROGRAM.format(line="; dialect: val2\n"), PUMA)
    (refused,) = (one for one in found if one.code == -453)
    assert refused.detail == "RX is of V+, and this program is in VAL-II"
    assert refused.hint == "in VAL-II: TRANS(0, 0, 0, o, a, t)"
    assert not any(one.code == 56 for one in found)  # nothing is ambiguous where the dialect is said


def test_val_has_neither_blocks_nor_functions() -> None:
    found = inspect(PROGRAM.format(line=""), PUMA, Dialect.VAL)
    assert [one.hint for one in found if one.code == -453] == [
        "IF a EQ b THEN 10 branches",
        "in VAL: there is nothing like it",  # AND
        "in VAL: TRANS(0, 0, 0, o, a, t)",
    ]


OLD = """; dialect: val
.PROGRAM OLD
   SETI n = 3
10 GO p
   SETI n = n-1
   IF n GT 0 THEN 10
   IFSIG 1, -2 THEN 20
   GOSUB SUBR
20 TYPEI n
.END
.PROGRAM SUBR
   DRAW 0,0,50
   RETURN
.END
.LOCATIONS
p 300 400 -100 90 90 0
.END
"""


def test_a_program_of_val_is_one() -> None:
    assert not inspect(OLD, PUMA)


def test_each_dialect_has_the_words_of_those_before_it() -> None:
    of = {name: [dialect.knows(row.where) for dialect in (Dialect.VAL, Dialect.VAL2, Dialect.VPLUS)]
          for name, row in INSTRUCTIONS.items()}  # fmt: skip
    assert not [name for name, knows in of.items() if knows != sorted(knows) or not knows[-1]]
