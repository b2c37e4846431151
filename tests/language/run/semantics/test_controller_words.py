"""Words of V+ that files of controllers have: JMOVE, JHERE, CALLS of a constant, FOPEN with a list, .DOUBLES, ACCEL."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.interfaces.terminals import RecordingTerminal
from vrs_cli.errors import IllegalValue
from vrs_cli.files.opening import Folder
from vrs_cli.interfaces.session.session import Session
from vrs_cli.kinematics.robot_file import load_robot


@pytest.fixture
def session(tmp_path: Path) -> Session:
    return Session(RecordingTerminal(), folder=Folder(tmp_path))


def load(session: Session, *lines: str) -> None:
    found = session.load_text("\n".join([".PROGRAM main()", *lines, ".END", ""]))
    assert not [one for one in found if one.severity.name == "ERROR"], found


def degrees(session: Session) -> tuple[float, ...]:
    return tuple(round(value, 9) for value in session.engine.model.units.to_display(session.engine.position().joints))


def test_jmove_goes_to_joints_and_leaves_others_as_they_are(session: Session) -> None:
    session.perform("JMOVE 10, -80, 90, , 20")
    assert degrees(session) == (10.0, -80.0, 90.0, 0.0, 20.0, 0.0)
    session.perform("JMOVE , , , 30")
    assert degrees(session) == (10.0, -80.0, 90.0, 30.0, 20.0, 0.0)


def test_jmove_of_a_program_counts_from_the_motion_before(session: Session) -> None:
    load(session, "JMOVE 10, -80", "JMOVE , , 80", "BREAK", "JHERE a, b, j[3]")
    assert session.execute("main").fault is None
    values = [session.environment.reference(name).value() for name in ("a", "b")]
    assert [round(value, 9) for value in values if isinstance(value, float)] == [10.0, -80.0]
    assert degrees(session)[:3] == (10.0, -80.0, 80.0)


def test_a_joint_that_slides_is_in_mm(tmp_path: Path) -> None:
    session = Session(RecordingTerminal(), model=load_robot("cobra600"), folder=Folder(tmp_path))
    session.perform("JMOVE 0, 45, 100, 0")
    assert degrees(session) == (0.0, 45.0, 100.0, 0.0)


@pytest.mark.parametrize("line", ["JMOVE 0, 0, 0, 0, 0, 0, 5", "JHERE a, b, c, d, e, f, g"])
def test_more_joints_than_the_robot_has(session: Session, line: str) -> None:
    load(session, line)
    fault = session.execute("main").fault
    assert fault is not None
    assert fault.code == IllegalValue.code
    assert "the robot has 6 joints" in fault.message


def test_calls_of_a_constant_passes_arguments(session: Session) -> None:
    session.load_text(".PROGRAM set.it(a, b)\n a = b\n.END\n")
    load(session, 'CALLS "set.it"(x, 5)')
    assert session.execute("main").fault is None
    assert session.environment.reference("x").value() == 5.0


def test_doubles_are_reals_in_a_file(session: Session) -> None:
    assert not session.load_text(".DOUBLES\nx 1.5\nrow[2] -3\n.END\n")
    assert session.environment.reference("x").value() == 1.5
    assert session.environment.reference("row", 2).value() == -3.0


@pytest.mark.parametrize("percent", [100, 101, 300, 1000])
def test_acceleration_is_limited(session: Session, percent: int) -> None:
    load(session, f"ACCEL {percent}")
    assert session.execute("main").fault is None
    session.perform(f"DO ACCEL {percent}")
    session.perform("DRIVE 1, 30")
    assert session.engine.end == pytest.approx(0.3 + 30 / 82, abs=1e-3)
