"""A robot of vrs in the names and units of LeRobot."""

from __future__ import annotations

import numpy as np
import pytest

import vrs_cli as vrs
from vrs_cli.errors import TooLate, UsageError

NAMES = ["shoulder_pan.pos", "shoulder_lift.pos", "elbow_flex.pos", "wrist_flex.pos", "wrist_roll.pos", "gripper.pos"]


def so100() -> tuple[vrs.Robot, vrs.LeRobotArm]:
    robot = vrs.Robot("so100")
    return robot, vrs.LeRobotArm(robot)


def test_an_observation_has_the_names_and_units_of_lerobot() -> None:
    robot, arm = so100()
    low, high = (np.degrees(bound) for bound in (robot.held.arm.model.lower, robot.held.arm.model.upper))
    seen = arm.observation()
    assert list(seen) == NAMES
    assert list(seen.values())[:5] == pytest.approx((robot.where().joints - 0.5 * (low + high)) / (high - low) * 200.0)
    in_degrees = vrs.LeRobotArm(robot, degrees=True, reversed_motors=["elbow_flex"]).observation()
    assert in_degrees["shoulder_lift.pos"] == pytest.approx(robot.where().joints[1] - 0.5 * (low[1] + high[1]))
    assert in_degrees["elbow_flex.pos"] == pytest.approx(0.5 * (low[2] + high[2]) - robot.where().joints[2])


@pytest.mark.parametrize("degrees", [False, True])
@pytest.mark.parametrize("named", [False, True])
def test_a_chunk_is_followed_and_seen_again(degrees: bool, named: bool) -> None:
    robot = vrs.Robot("so100")
    arm = vrs.LeRobotArm(robot, degrees=degrees)
    rows = np.array(list(arm.observation().values())) + np.linspace(0.0, 12.0, 40)[:, None] * [1, 1, -1, -1, 1, 0]
    rows[15:, 5] = 80.0
    actions = [dict(zip(NAMES, row, strict=True)) for row in rows.tolist()] if named else rows
    report = arm.follow(actions, 0.5)
    assert report.begin == pytest.approx(0.5)
    assert list(arm.observation(report.end).values())[:5] == pytest.approx(rows[-1, :5])
    opens = 0.5 + 15 / 30
    assert [arm.observation(t)["gripper.pos"] for t in (opens - 0.01, opens + 0.01)] == [0.0, 100.0]


def test_actions_before_the_arrival_are_left_out() -> None:
    _, arm = so100()
    rows = np.array([list(arm.observation().values())] * 30)
    rows[:, 5] = 100.0
    assert arm.follow(rows, 0.0, arrival=0.25).begin == pytest.approx(8 / 30)
    assert arm.observation(8 / 30)["gripper.pos"] == 0.0
    assert arm.observation(8 / 30 + 0.06)["gripper.pos"] == 100.0
    with pytest.raises(TooLate, match="all 30 actions have passed"):
        arm.follow(rows, 0.0, arrival=2.0)


def test_what_fits_no_motor_is_refused() -> None:
    with pytest.raises(UsageError, match="5 motors for the 6 joints of puma560"):
        vrs.LeRobotArm(vrs.Robot("puma560"))
    robot, arm = so100()
    with pytest.raises(UsageError, match="there is no motor elbow"):
        vrs.LeRobotArm(robot, reversed_motors=["elbow"])
    with pytest.raises(UsageError, match=r"an action without shoulder_lift\.pos"):
        arm.follow([{"shoulder_pan.pos": 1.0}], 0.0)
    with pytest.raises(ValueError, match=r"actions \(N, 5\) or \(N, 6\) are wanted, not \(4,\)"):
        arm.follow([1.0, 2.0, 3.0, 4.0], 0.0)
