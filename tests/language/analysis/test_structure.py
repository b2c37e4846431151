"""Blocks and labels."""

from __future__ import annotations

import pytest

from vrs_cli.language.analysis.names import Block, BlockKind
from vrs_cli.language.analysis.structure import Structure, structure_of
from vrs_cli.language.text import ast
from vrs_cli.language.text.parser import parse_file


def structure(text: str) -> Structure:
    file, diagnostics = parse_file(f".PROGRAM p()\n{text}\n.END\n")
    assert diagnostics == ()
    program = file.parts[0]
    assert isinstance(program, ast.Program)
    return structure_of(program)


def test_every_kind_of_block() -> None:
    found = structure(
        "FOR i = 1 TO 3\nIF x THEN\nELSE\nEND\nEND\n"
        "WHILE x DO\nDO\nUNTIL x\nEND\nCASE x OF\nVALUE 1:\nVALUE 2:\nANY\nEND"
    )
    assert found.diagnostics == []
    assert set(found.blocks) == {
        Block(BlockKind.FOR, 0, (), 4),
        Block(BlockKind.IF, 1, (2,), 3),
        Block(BlockKind.WHILE, 5, (), 8),
        Block(BlockKind.DO, 6, (), 7),
        Block(BlockKind.CASE, 9, (10, 11, 12), 13),
    }


def test_labels() -> None:
    found = structure("10 x = 1\nGOTO 20\n20\nIF x GOTO 10")
    assert found.diagnostics == []
    assert found.labels == {10: 0, 20: 2}


def test_a_label_whose_line_cannot_be_read_is_there_all_the_same() -> None:
    file, diagnostics = parse_file(".PROGRAM p()\nGOTO 10\nGOTO 20\n10 MOVVE a\n.END\n")
    assert len(diagnostics) == 1
    program = file.parts[0]
    assert isinstance(program, ast.Program)
    assert [one.span.line for one in structure_of(program).diagnostics] == [3]


def test_messages_name_the_opener() -> None:
    found = structure("x = 1\nIF x THEN\nDO\nEND")
    assert [one.message for one in found.diagnostics] == [
        "*Control structure error* DO at step 3 has no UNTIL before END at step 4"
    ]
    found = structure("WHILE x DO\nELSE")
    assert [one.message for one in found.diagnostics] == [
        "*Control structure error* ELSE without IF, inside WHILE at step 1",
        "*Control structure error* WHILE at step 1 has no END",
    ]


def test_a_comment_before_the_first_value_is_fine() -> None:
    assert structure("CASE x OF\n;which?\n\nVALUE 1:\nEND").diagnostics == []


@pytest.mark.parametrize(
    "steps",
    [
        "IF x = = 3 THEN\nx = 1\nEND",
        "IF x THN\nx = 1\nELSE\nx = 2\nEND",
        "IF x = = 3\nx = 1\nEND",
        "WHILE DO\nEXIT\nEND",
        "WHIEL x DO\nx = 1\nEND",
        "FOR i 1 TO 3\nNEXT\nEND",
        "10 CASE x OFF\nVALUE 1:\nx = 1\nEND",
        "CASE x OF\nVALUE ,:\nx = 1\nEND",
        "IF x THEN\nx = 1\nELSE 3 3\nEND",
        "DO\nx = 1\nUNTIL x = = 3",
        "WHILE x DO\nIF y = = 1 GOTO 10\nEND\n10",
        "WHILE x DO\nIF y = = 1 THEN 10\nEND\n10",
        "WHILE x DO\nIF y = = 1\nEND",  # whose end it is cannot be told
        "IF x THEN\nELIF y THEN\nEND",
        "IF x THEN\nELSE IF y THEN\nEND",
        "DO MOVE a\nx = 1",
        "IF x THEN\nDO MOVE a\nELSE\nEND",
        "CASE x OF\nVALUE 1:\nIF y = = 1\nVALUE 2:\nEND",
        "IF x THEN\nend = = 3\nEND",
        'IF x THEN\nTYPE "THEN" ; DO\nMOVEE a ; THEN\nEND',
    ],
)
def test_a_line_that_cannot_be_read_is_one_mistake(steps: str) -> None:
    """Of a faulty IF, WHILE, FOR, CASE, VALUE, ELSE, UNTIL or END, its own mistake is told alone."""
    program = parse_file(f".PROGRAM p()\n{steps}\n.END\n")[0].parts[0]
    assert isinstance(program, ast.Program)
    assert any(isinstance(step.statement, ast.BadLine) for step in program.steps)
    assert structure_of(program).diagnostics == []


@pytest.mark.parametrize(
    ("steps", "wrong"),
    [
        ("IF x = = 3 THEN\nEND\nEND", 3),
        ("IF x = = 3 THEN\nx = 1", 1),
        ("WHILE x DO\nFOR i 1 TO 3\nEND", 1),
        ("IF x = = 3\nEND\nWHILE x DO\nDO\nUNTIL x\nIF x THEN", 3),
        ("TYPE (\nEND", 2),
    ],
)
def test_other_blocks_are_told_beside_it(steps: str, wrong: int) -> None:
    program = parse_file(f".PROGRAM p()\n{steps}\n.END\n")[0].parts[0]
    assert isinstance(program, ast.Program)
    assert [one.span.line - 1 for one in structure_of(program).diagnostics] == [wrong]
