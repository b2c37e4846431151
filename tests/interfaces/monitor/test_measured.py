"""WHERE MEASURED and COMPARE MEASURED, as they are typed."""

from __future__ import annotations

from math import radians

import pytest

from vrs_cli.api.robot import Robot
from vrs_cli.errors import UsageError, VrsError
from vrs_cli.values.replies import MeasuredComparisonTable, MeasuredWhereabouts, Message, WhereaboutsTable

OFF = 0.25  # [deg] of joint 2


@pytest.fixture
def robot() -> Robot:
    it = Robot("puma560").move(10, -45, 180, 0, 45, 0).move(-40, -45, 170, 0, 45, 0)
    for k in (*range(100), *range(200, 250)):
        t = 0.01 * k
        joints = it.where(t).joints.copy()
        joints[1] += OFF if k == 220 else 0.0
        it.report(t, joints)
    return it


def test_where_the_robot_was_measured_at_a_time_and_last(robot: Robot) -> None:
    (there,) = robot.do("WHERE MEASURED AT 2.2")
    assert isinstance(there, MeasuredWhereabouts)
    assert there.at.errors[1] == pytest.approx(radians(OFF))
    assert there.at.distance > 1e-3
    (last,) = robot.do("WHERE measured")
    assert isinstance(last, MeasuredWhereabouts)
    assert (last.is_last, last.at.measured.time) == (True, 0.01 * 249)
    assert last.at.distance < 1e-9


@pytest.mark.parametrize(
    ("time", "why"),
    [("1.5", "no report for more than 0.500 s about then"), ("9", "the last report is of 2.490 s")],
)
def test_where_it_is_unknown_it_says_so(robot: Robot, time: str, why: str) -> None:
    (told,) = robot.do(f"WHERE MEASURED AT {time}")
    assert isinstance(told, Message)
    assert told.text.endswith(why)


def test_over_a_stretch_of_time_the_known_times_are_listed(robot: Robot) -> None:
    table, rest = robot.do("WHERE MEASURED FROM 0 TO 3 STEP 0.5")
    assert isinstance(table, WhereaboutsTable)
    assert [row.time for row in table.positions] == [0.0, 0.5, 2.0]
    assert rest.text == "The measured robot is unknown at 4 other times"  # type: ignore[union-attr]


def test_a_comparison_finds_the_greatest_difference_and_the_gap(robot: Robot) -> None:
    robot.do("BRANCH trial")
    robot.undo(1)  # the record stays, and is compared with any branch
    for line, branch in (("COMPARE MEASURED, main", "main"), ("COMPARE MEASURED", "trial")):
        (table,) = robot.do(line)
        assert isinstance(table, MeasuredComparisonTable)
        assert (table.branch, table.comparison.reports) == (branch, 150)
    (table,) = robot.do("COMPARE MEASURED, main")
    assert isinstance(table, MeasuredComparisonTable)
    told = table.comparison
    assert told.joints[1].greatest.distance == pytest.approx(radians(OFF))
    assert told.joints[1].greatest.time == told.tool.greatest.time == 0.01 * 220
    assert told.joints[1].rms == pytest.approx(radians(OFF) / 150**0.5)
    assert told.joints[0].greatest.distance < 1e-12
    assert told.turned.greatest.distance == pytest.approx(radians(OFF), abs=1e-6)
    assert told.unknown == pytest.approx(1.01)


def test_what_cannot_be_told_is_refused(robot: Robot) -> None:
    with pytest.raises(UsageError, match="no body has reported"):
        Robot("puma560").do("WHERE MEASURED")
    with pytest.raises(UsageError, match="no body has reported"):
        Robot("puma560").do("COMPARE MEASURED")
    with pytest.raises(UsageError, match="no branch nix"):
        robot.do("COMPARE MEASURED, nix")
    with pytest.raises(VrsError, match="take another name"):
        robot.do("BRANCH measured")
