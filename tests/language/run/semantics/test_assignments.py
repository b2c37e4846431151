"""Instructions that give variables their values."""

from __future__ import annotations

import pytest

from tests.language.run.semantics.asked import PART, close
from tests.language.running import StillRobot, run_lines
from vrs_cli.kinematics.transform import Transform, translation


def test_here_takes_the_place_or_the_joints() -> None:
    run = run_lines("HERE a", "HERE #a", "HERE row[2]")
    assert run.value("a") == translation(0.5, 0.1, -0.2)
    assert run.value("#a") == StillRobot().angles
    assert run.environment.reference("row", 2).value() == translation(0.5, 0.1, -0.2)


@pytest.mark.parametrize("line", ["HERE a:b:part", "SET a:b:part = HERE", "POINT a:b:part = HERE"])
def test_a_compound_defines_its_last_name(line: str) -> None:
    run = run_lines("SET a = TRANS(100)", "SET b = RZ(90)", line, "SET again = a:b:part")
    again = run.value("again")
    assert isinstance(again, Transform)
    assert close(again, StillRobot().pose)


def test_the_names_before_the_last_must_be_defined() -> None:
    assert str(run_lines("HERE base1:part").error).startswith("*Undefined value* base1 (HERE base1 or ")


def test_decompose_fills_six_elements() -> None:
    run = run_lines(PART, "DECOMPOSE x[2] = part", "SET #p = #PPOINT(10, 20, 30)", "DECOMPOSE j[0] = #p")
    assert [run.environment.reference("x", i).value() for i in range(2, 8)] == [500, 150, -100, 90, 90, 0]
    assert [run.environment.reference("j", i).value() for i in range(6)] == [10, 20, 30, 0, 0, 0]
