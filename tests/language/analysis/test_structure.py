"""Test blocks and labels, and the words that a dialect does not have."""

from __future__ import annotations

import pytest

from tests.interfaces.terminals import RecordingTerminal
from vrs_cli.errors import NotAvailable, ProgramNotExecutable
from vrs_cli.interfaces.session.session import Session
from vrs_cli.language.analysis.names import Block, BlockKind
from vrs_cli.language.analysis.structure import Structure, beyond, line_beyond, structure_of
from vrs_cli.language.text import ast
from vrs_cli.language.text.ast import Program, Statement, Step
from vrs_cli.language.text.parser import parse_file, parse_prompt, parse_step
from vrs_cli.language.words.functions import FUNCTIONS, LINKS, OPERATORS
from vrs_cli.language.words.instructions import INSTRUCTIONS
from vrs_cli.language.words.word import State
from vrs_cli.values.diagnostics import Diagnostic, Dialect, LineRefused, Severity
from vrs_cli.values.results import RunOutcome


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
    """A faulty IF, WHILE, FOR, CASE, VALUE, ELSE, UNTIL or END gives one error."""
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


def columns(line: str, *, at_prompt: bool = False) -> list[int]:
    statement = parse_prompt(line) if at_prompt else parse_step(line).statement
    assert statement is not None
    found = line_beyond(statement, Dialect.VPLUS, vplus=False) if at_prompt else of_step(statement)  # type: ignore[arg-type]
    return [one.span.column for one in found]


def of_step(statement: Statement) -> list[Diagnostic]:
    """Return the errors for words of V+ in a program of this statement."""
    span = statement.span
    return list(beyond(Program("p", (), (Step(None, statement, None, span=span),), None, span=span), vplus=False))


@pytest.mark.parametrize(
    ("line", "found"),
    [
        ("x = 2**3", [5]),
        ("x = a[1,2]+b[3]", [5]),
        ("CALL sum(m[1,])", [10]),
        ("EXIT", [1]),
        ("IF DEFINED(x) AND (LAST(a[]) > 2) THEN", [4, 20]),
        ("SET p = a:RX(90):RZ(b[1,2])", [11, 18, 21]),
        ("SPEED 30 MONITOR", [1]),
        ("SPEED 30 MMPS ALWAYS", []),
        ("PCEXECUTE watch, -1", []),
        ("GOSUB pick", []),
        ("IF a EQ b THEN 10", []),
        ("MOVE part AT 2.5", []),
        ("$s = $CHR(34)+$MID($s, 1, 3)", []),
    ],
)
def test_what_a_line_has_of_v_plus(line: str, found: list[int]) -> None:
    assert columns(line) == found


def test_the_prompt_has_its_own_table() -> None:
    assert columns("EXECUTE pick, 5", at_prompt=True) == []
    assert columns("EXECUTE 2 pick", at_prompt=True) == [9]
    assert columns("DO EXECUTE pick", at_prompt=True) == [4]
    assert columns("BPT pick, 3", at_prompt=True) == [1]
    assert columns("UNDO", at_prompt=True) == []


ALL = [
    *((row.name, row.example, row.where) for row in INSTRUCTIONS.values() if row.state is State.SUPPORTED),
    *((row.name, row.example, row.where) for row in [*OPERATORS.values(), *LINKS.values()]),
    *((row.name, f"x = {row.name}", row.where) for row in FUNCTIONS.values() if row.constant),
]


def test_the_column_of_the_tables_decides() -> None:
    """Words that only V+ has are refused. Others are not, unless their example has a word of V+."""
    trees = {name: parse_step(example).statement for name, example, _ in ALL if name != "REMARK"}
    refused = {name for name, tree in trees.items() if any(name in one.detail for one in of_step(tree))}  # type: ignore[arg-type]
    assert refused == {name for name, _, where in ALL if where == "+"}


TEXT = """
.PROGRAM main()
    x = 1
    CALL power
.END
.PROGRAM power()
    x = 2**3
.END
"""


def test_programs_in_memory_are_looked_at_when_they_are_executed() -> None:
    session = Session(RecordingTerminal())
    assert not session.load_text(TEXT)
    session.perform("DISABLE VPLUS")
    with pytest.raises(ProgramNotExecutable, match=r"power, step 1: .* is of V.*in VAL-II: a"):
        session.execute("power")
    result = session.execute("main")
    assert result.outcome is RunOutcome.FAILED
    assert result.fault is not None
    assert (result.fault.program, result.fault.step, result.fault.code) == ("main", 2, -307)
    with pytest.raises(LineRefused) as refused:
        session.perform("x = 2**3")
    assert refused.value.diagnostic.code == NotAvailable.code
    session.perform("ENABLE VPLUS")
    session.perform("x = 2**3")
    assert session.execute("main").outcome is RunOutcome.COMPLETED


def test_a_file_is_looked_at_when_it_is_loaded() -> None:
    session = Session(RecordingTerminal())
    session.perform("DISABLE VPLUS")
    found = session.load_text(TEXT)
    assert [(one.severity, one.code, one.span.line) for one in found] == [(Severity.ERROR, NotAvailable.code, 7)]
    session.perform("ENABLE VPLUS")
    assert session.execute("main").outcome is RunOutcome.COMPLETED
