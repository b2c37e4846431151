"""Every instruction: that it is carried out, and what it refuses."""

from __future__ import annotations

import pytest

from tests.language.run.semantics.asked import PART
from tests.language.running import run_lines
from vrs_cli.errors import (
    ArithmeticOverflow,
    IllegalArrayIndex,
    IllegalJoint,
    IllegalSignal,
    IllegalValue,
    TypeMismatch,
    UndefinedValue,
    VrsError,
)
from vrs_cli.language.run.effects import Failed
from vrs_cli.language.run.environment import HANDLERS
from vrs_cli.language.words.instructions import DECLARATIONS, INSTRUCTIONS
from vrs_cli.language.words.word import State


@pytest.mark.parametrize(
    ("line", "error"),
    [
        ("MOVE nowhere", UndefinedValue),
        ("MOVE #nowhere", UndefinedValue),
        ("APPRO part, x", UndefinedValue),
        ("DRIVE 7, 10", IllegalJoint),
        ("DRIVE 0, 10", IllegalJoint),
        ("DRIVE 1, 10, 0", IllegalValue),
        ("DRIVE 1, 10, 101", IllegalValue),
        ("MOVE part AT -1", IllegalValue),
        ("MOVE part IN -1", IllegalValue),
        ("MOVE part AT 1/0", ArithmeticOverflow),
        ("SPEED 0", IllegalValue),
        ("SPEED 50, -1", IllegalValue),
        ("DURATION -1", IllegalValue),
        ("DELAY -1", IllegalValue),
        ("COARSE 0", IllegalValue),
        ("ACCEL 0", IllegalValue),
        ("SIGNAL 600", IllegalSignal),
        ("SIGNAL 1001", IllegalSignal),
        ("BITS 1, 4 = 1E9", IllegalValue),
        ("TIMER 99 = 0", IllegalValue),
        ("DECOMPOSE x = part", TypeMismatch),
        ("DECOMPOSE x[-1] = part", IllegalArrayIndex),
    ],
)
def test_mistakes(line: str, error: type[VrsError]) -> None:
    run = run_lines(PART, line)
    assert type(run.error) is error
    assert isinstance(run.last, Failed)
    assert (run.last.fault.step, run.last.fault.source) == (2, line)


BY_THE_COMPILER = {"EXIT", "NEXT", "CALL", "CALLS", "GOSUB", "WAIT", "IFSIG", *DECLARATIONS}
BY_THE_PARSER = {"REMARK"}  # a comment


def test_every_supported_instruction_is_carried_out() -> None:
    supported = {name for name, word in INSTRUCTIONS.items() if word.state is State.SUPPORTED}
    assert supported <= HANDLERS.keys() | BY_THE_COMPILER | BY_THE_PARSER
    assert HANDLERS.keys() <= supported
