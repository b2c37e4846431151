"""Lines of a body that another program moves: set points, and reports."""

from __future__ import annotations

import json
from math import pi

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrs_cli.errors import FileDamaged
from vrs_cli.kinematics.joints import JointKind, JointUnits
from vrs_cli.trajectory.state import JointState
from vrs_cli.values.measured import BodyMode, Report
from vrs_cli.wire.reports import LineFormat, heading, read_report, setpoint_line

MIXED = JointUnits((JointKind.REVOLUTE, JointKind.PRISMATIC))
JOINTS = st.tuples(*[st.floats(-10, 10)] * 2)


@given(JOINTS, JOINTS, st.floats(-3000.0, 9.0))
@pytest.mark.parametrize("form", LineFormat)
def test_a_set_point_without_its_mode_is_a_report(
    form: LineFormat, joints: tuple[float, float], velocity: tuple[float, float], t: float
) -> None:
    line = setpoint_line(form, t, JointState(joints, velocity), BodyMode.FOLLOWS, MIXED)
    report = read_report(line.removesuffix(",follows"), 0.0, MIXED, 2)
    assert report.t == pytest.approx(t, rel=1e-8, abs=1e-8)
    assert report.joints == pytest.approx(joints, abs=1e-6)
    assert report.velocity == pytest.approx(velocity, abs=1e-6)


def test_csv_has_a_heading_and_degrees_and_millimetres() -> None:
    assert heading(2) == "t,jt1,jt2,v1,v2,mode"
    line = setpoint_line(LineFormat.CSV, 2.5, JointState((pi / 2, 0.1), (-0.0, 0.0)), BodyMode.HOLDS, MIXED)
    assert line == "2.5,90,100,0,0,holds"


def test_json_says_what_it_knows() -> None:
    line = json.dumps({"joints": [90, 100], "effort": [1, 2], "mode": "stopped"})
    assert read_report(line, 4.0, MIXED, 2) == Report(4.0, (pi / 2, 0.1), None, (1.0, 2.0), BodyMode.STOPPED)


@pytest.mark.parametrize(
    ("line", "told"),
    [
        ("", "1 field"),
        ("1,2", "2 fields"),
        ("1,2,3,4", "4 fields"),
        ("1,2,x", "no number"),
        ("1,2,nan", "not finite"),
        ("inf,2,3", "not finite"),
        ("{", "truncated"),
        ('{"joints": [1]}', "1 number of joints"),
        ('{"joints": [1, 2], "velocity": [1, 2, 3]}', "3 numbers of velocity"),
        ('{"joints": [1, 2], "mode": "flies"}', "flies"),
        ('{"joints": [1, 2], "speed": 3}', "speed"),
        ('{"t": 1}', "joints"),
        ("{" * 5000, "malformed"),
    ],
)
def test_what_is_no_report(line: str, told: str) -> None:
    with pytest.raises(FileDamaged) as refused:
        read_report(line, 0.0, MIXED, 2)
    assert told in str(refused.value)
    assert len(str(refused.value)) < 300
