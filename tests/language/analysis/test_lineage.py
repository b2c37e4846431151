"""VPLUS off: what V+ alone has is refused at the prompt, on LOAD and when a program is executed."""

from __future__ import annotations

import pytest

from tests.interfaces.terminals import RecordingTerminal
from vrs_cli.errors import NotAvailable, ProgramNotExecutable
from vrs_cli.interfaces.session.session import Session
from vrs_cli.language.analysis.lineage import beyond, line_beyond
from vrs_cli.language.text.ast import Program, Statement, Step
from vrs_cli.language.text.parser import parse_prompt, parse_step
from vrs_cli.language.words.functions import FUNCTIONS, LINKS, OPERATORS
from vrs_cli.language.words.instructions import INSTRUCTIONS
from vrs_cli.language.words.word import State
from vrs_cli.values.diagnostics import Diagnostic, Dialect, LineRefused, Severity
from vrs_cli.values.results import RunOutcome


def columns(line: str, *, at_prompt: bool = False) -> list[int]:
    statement = parse_prompt(line) if at_prompt else parse_step(line).statement
    assert statement is not None
    found = line_beyond(statement, Dialect.VPLUS, vplus=False) if at_prompt else of_step(statement)  # type: ignore[arg-type]
    return [one.span.column for one in found]


def of_step(statement: Statement) -> list[Diagnostic]:
    """What V+ alone has, in a program of this statement."""
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
    """What is only of V+ is refused, and everything else but what else stands in its example is not."""
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
