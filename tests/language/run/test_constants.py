"""What constants show by themselves, with the place of what is wrong."""

from __future__ import annotations

import pytest

from vrs_cli.engine.engine import Engine
from vrs_cli.errors import (
    AboveFullSpeed,
    ArithmeticOverflow,
    IllegalJoint,
    IllegalSignal,
    IllegalValue,
    NegativeSquareRoot,
    UsageError,
    VrsError,
)
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.language.analysis.analyzer import analyze
from vrs_cli.language.run.constants import Constants
from vrs_cli.language.run.environment import Environment
from vrs_cli.language.run.memory import Context
from vrs_cli.language.text.ast import Program
from vrs_cli.language.text.parser import parse_file
from vrs_cli.language.words.functions import FUNCTIONS
from vrs_cli.language.words.instructions import INSTRUCTIONS
from vrs_cli.language.words.word import State
from vrs_cli.values.diagnostics import Diagnostic, Severity


def found(*lines: str) -> list[Diagnostic]:
    file, diagnostics = parse_file("\n".join([".PROGRAM p", *lines, ".END", ""]))
    assert not diagnostics
    (program,) = file.parts
    engine = Engine(load_robot("puma560"))
    constants = Constants(Context(Environment(), engine))
    return list(constants.findings(program))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("line", "kind", "place"),
    [
        ("SIGNAL 5000", IllegalSignal, "5000"),
        ("SIGNAL 3, 5000", IllegalSignal, "5000"),
        ("SIGNAL 5000, n", IllegalSignal, "5000"),
        ("SIGNAL 1001", IllegalSignal, "1001"),
        ("SPEED 0", IllegalValue, "0"),
        ("SPEED 50, -1 ALWAYS", IllegalValue, "-1"),
        ("SPEED 400 MONITOR", IllegalValue, "400"),
        ("ACCEL 200", AboveFullSpeed, "200"),
        ("SPEED 500", AboveFullSpeed, "500"),
        ("SPEED 101, 50 ALWAYS", AboveFullSpeed, "101"),
        ("DELAY -1", IllegalValue, "-1"),
        ("DELAY 2-3", IllegalValue, "2-3"),
        ("DURATION -0.5", IllegalValue, "-0.5"),
        ("DRIVE 9, 10", IllegalJoint, "9"),
        ("DRIVE 9, x, y", IllegalJoint, "9"),
        ("DRIVE 1, 10, 101", IllegalValue, "101"),
        ("LOCK 200", IllegalValue, "200"),
        ("REACT 1001, stop, 300", IllegalValue, "300"),
        ("TIMER 99 = 0", IllegalValue, "99"),
        ("BITS 1, 4 = 1E9", IllegalValue, "1E9"),
        ("ABORT 40", IllegalValue, "40"),
        ("EXECUTE 40 elsewhere", IllegalValue, "40"),
        ("PARAMETER HAND.TIME = -1", IllegalValue, "-1"),
        ("SELECT ROBOT = 2", IllegalValue, "2"),
        ("RETURN -1", IllegalValue, "-1"),
        ("FOPENR (40) \"a\"", IllegalValue, "40"),
        ("MOVE p AT -1", IllegalValue, "-1"),
        ("MOVE p IN 2-5", IllegalValue, "2-5"),
        ("x = 1/0", ArithmeticOverflow, "1/0"),
        ("x = y + 1/0 + z", ArithmeticOverflow, "1/0"),
        ("x = 5 MOD 0", ArithmeticOverflow, "5 MOD 0"),
        ("x = 1E30*1E30", ArithmeticOverflow, "1E30*1E30"),
        ("a[1/0] = 2", ArithmeticOverflow, "1/0"),
        ("IF SQRT(-1) > x THEN", NegativeSquareRoot, "SQRT(-1)"),
        ("x = y*SQRT(2-3)", NegativeSquareRoot, "SQRT(2-3)"),
        ("x = SIG(5000)", IllegalSignal, "SIG(5000)"),
        ("WAIT SIG(1001, 5000)", IllegalSignal, "SIG(1001, 5000)"),
        ("WAIT 5000", IllegalSignal, "5000"),
        ("x = TIMER(99)", IllegalValue, "TIMER(99)"),
        ("TYPE 1/0, x", ArithmeticOverflow, "1/0"),
        ("CALL q(1/0)", ArithmeticOverflow, "1/0"),
        ("FOR i = 1 TO 3 STEP 0", IllegalValue, "0"),
        ("VALUE 1/0:", ArithmeticOverflow, "1/0"),
        ("x = SWITCH(foo)", UsageError, "foo"),
        ("x = PARAMETER(foo)+1", UsageError, "foo"),
        ("MOVE TRANS(1/0)", ArithmeticOverflow, "1/0"),
    ],
)  # fmt: skip
def test_what_can_never_be_right(line: str, kind: type[VrsError], place: str) -> None:
    (one,) = found(line)
    assert (one.code, one.severity) == (kind.code, Severity.WARNING)
    assert line[one.span.column - 1 : one.span.end - 1] == place
    assert one.detail


@pytest.mark.parametrize(
    "line",
    [
        "SIGNAL 5, -6, n",
        "SIGNAL n",
        "SPEED n, 0.5 ALWAYS",
        "DELAY n-3",
        "DRIVE n, 10",
        "BITS 1, n = 100",
        "x = SQRT(TIMER(1)-5)",
        "x = 1/SIG(1001)",
        "x = 1/RANDOM",
        "x = 1/y",
        "REACT 1001, elsewhere",
        "EXECUTE elsewhere",
        "EXECUTE 3 elsewhere",
        "PARAMETER PROFILE = SCURVE",
        "PARAMETER HAND.TIME = x",
        "ENABLE CP",
        "x = SWITCH(CP)",
        "DISABLE POWER",
        "ATTACH (n, 4)",
        "DETACH (5)",
        "FCLOSE (5)",
        "x = GETC(4)",
        'PROMPT "?", x',
        'PROMPT "press Return"',
        "MOVE TRANS(9999, 0)",
        "MOVE p AT 5",
        "WAIT 3",
        "WAIT",
        "SHIFT p BY 5",
        "x = DEFINED(y)",
        "READ (5) $x",
        "GRASP 20",
        "HERE p",
    ],
)
def test_what_may_be_right(line: str) -> None:
    assert found(line) == []


EXAMPLES = [row.example for row in (*INSTRUCTIONS.values(), *FUNCTIONS.values()) if row.state is State.SUPPORTED]


def test_the_examples_of_the_tables_are_right() -> None:
    wrong = [(line, one.message) for line in EXAMPLES for one in found(*_as_steps(line))]
    assert wrong == []


def _as_steps(example: str) -> tuple[str, ...]:
    """An example as a line of a program; one that is an expression alone is assigned."""
    return next(((line,) for line in (example, f"x = {example}", f"$x = {example}") if _executable(line)), ())


def _executable(line: str) -> bool:
    file, _ = parse_file(f".PROGRAM p\n{line}\n.END\n")
    return all(isinstance(part, Program) and analyze(part).executable for part in file.parts)


def test_a_very_deep_expression_is_left_alone() -> None:
    assert found("x = " + "-" * 390 + "1") == []
