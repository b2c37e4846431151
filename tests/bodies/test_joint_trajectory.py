"""A timeline as trajectories for joint_trajectory_controller: a stand-in for that follows them as g says."""

from __future__ import annotations

import json
from itertools import pairwise
from math import pi
from pathlib import Path

import pytest

import vrs_cli as vrs
from tests.bodies.controller import Controller
from vrs_cli.bodies.joint_trajectory import (
    MARGIN,
    MIN_LENGTH,
    PAST,
    RosJoint,
    read_joints,
    standing_points,
    trajectory_begins,
    trajectory_message,
    trajectory_points,
)
from vrs_cli.engine.position import joint_state_at
from vrs_cli.errors import FileDamaged, IllegalValue, NonexistentFile
from vrs_cli.kinematics.joints import JointKind

OFFSET = 1.7e9  # [s] the clock of ROS minus the robot's
NAMES = tuple(RosJoint(f"arm_{i}", (-1) ** i, 0.1 * i) for i in range(6))


def moved(profile: str = "LSPB", *, straight: bool = False) -> vrs.Robot:
    robot = vrs.Robot("puma560")
    robot.do(f"PARAMETER PROFILE = {profile}")
    robot.move(0, -45, 150, 0, 45, 0)
    if straight:
        robot.moves(vrs.trans(300, 450, -200, 90, 90, 0))
    robot.move(40, -60, 120, 20, 30, 90)
    return robot


def largest_error(robot: vrs.Robot, begin: float, *, replaces: bool = False) -> float:
    """The largest difference of the stand-in from g [rad]."""
    arm, timeline = robot.held.arm, robot.timeline
    start = [one.sign * q + one.offset for one, q in zip(NAMES, joint_state_at(arm, timeline, begin)[0], strict=True)]
    controller = Controller([one.name for one in reversed(NAMES)], start[::-1], replaces=replaces)
    message = trajectory_message(trajectory_points(arm, timeline, begin), NAMES, OFFSET)
    controller.receive(json.loads(json.dumps(message)), begin + OFFSET)
    worst = 0.0
    for k in range(1001):
        t = begin + (timeline.end + 1.0 - begin) * k / 1000
        expected = joint_state_at(arm, timeline, t).joints
        found = controller.state(t + OFFSET)[0][::-1]
        worst = max(
            worst, *(abs(one.sign * (p - one.offset) - q) for one, p, q in zip(NAMES, found, expected, strict=True))
        )
    return worst


@pytest.mark.parametrize("profile", ["LSPB", "SCURVE", "QUINTIC"])
@pytest.mark.parametrize("straight", [False, True])
def test_a_controller_that_follows_the_points_is_where_g_is(profile: str, straight: bool) -> None:
    robot = moved(profile, straight=straight)
    for begin in (0.0, 0.37 * robot.timeline.end, robot.timeline.end + 5.0):  # clocks of ROS have 2e-7 s in a double
        assert largest_error(robot, begin) < 2e-6


def test_points_are_at_boundaries_and_every_20_ms_on_lines() -> None:
    robot = moved()
    points = trajectory_points(robot.held.arm, robot.timeline, 0.0)
    assert [one.t for one in points] == sorted({0.0, *(one.start for one in robot.timeline), robot.timeline.end})
    robot = moved(straight=True)
    arm, timeline = robot.held.arm, robot.timeline
    on_line = [one for one in timeline if not hasattr(one.path, "degree")]
    assert on_line
    times = [one.t for one in trajectory_points(arm, timeline, 0.0)]
    gaps = [b - a for a, b in pairwise(times) if on_line[0].start <= a < on_line[-1].finish]
    assert max(gaps) <= 0.02 + 1e-9


def test_accelerations_are_there_unless_they_jump() -> None:
    def missing(profile: str) -> int:
        robot = moved(profile)
        return sum(not one.acceleration for one in trajectory_points(robot.held.arm, robot.timeline, 0.0))

    assert missing("LSPB") > 2
    assert missing("SCURVE") == missing("QUINTIC") == 0


def test_a_robot_at_rest_has_a_trajectory_that_has_not_ended() -> None:
    robot = vrs.Robot("puma560")
    points = trajectory_points(robot.held.arm, robot.timeline, 3.0)
    assert [one.t for one in points] == [3.0, 3.0 + MIN_LENGTH]
    assert points[0].joints == points[1].joints == joint_state_at(robot.held.arm, robot.timeline, 3.0).joints
    assert standing_points(points[0].joints, 3.0) == points


def test_one_trajectory_that_waits_is_replaced_and_never_forgotten() -> None:
    assert trajectory_begins(10.0, 12.0, None, replaces=False) == [10.0 - PAST]
    assert trajectory_begins(10.0, 12.0, None, replaces=True) == [12.0]
    assert trajectory_begins(10.0, 9.0, None, replaces=True) == [10.0 - PAST]
    assert trajectory_begins(10.0, 12.0, 9.0, replaces=True) == [12.0]
    assert trajectory_begins(10.0, 12.0, 11.0, replaces=True) == [11.0]
    assert trajectory_begins(10.0, 11.0, 12.0, replaces=True) == [11.0]
    assert trajectory_begins(10.0, 10.0 + MARGIN / 2, 12.0, replaces=True) == [10.0 - PAST, 12.0]


def test_joints_have_names_signs_and_offsets(tmp_path: Path) -> None:
    kinds = (JointKind.REVOLUTE, JointKind.PRISMATIC)
    assert read_joints(None, kinds) == (RosJoint("joint_1"), RosJoint("joint_2"))
    assert read_joints("pan, lift", kinds) == (RosJoint("pan"), RosJoint("lift"))
    path = tmp_path / "joints.toml"
    path.write_text('[[joint]]\nname = "pan"\nsign = -1\noffset = 90\n[[joint]]\nname = "lift"\noffset = 5\n')
    assert read_joints(str(path), kinds) == (RosJoint("pan", -1, pi / 2), RosJoint("lift", 1, 0.005))


@pytest.mark.parametrize("names", ["pan", "pan,pan", "pan,", "a,b,c"])
def test_joints_that_are_not_one_each_are_refused(names: str) -> None:
    with pytest.raises(IllegalValue, match="joints"):
        read_joints(names, (JointKind.REVOLUTE,) * 2)


@pytest.mark.parametrize(
    ("text", "error"),
    [
        ("[[joint]]\nname = 3\n", FileDamaged),
        ("[[joint]\n", FileDamaged),
        ("[[joint]]\nname = ''\n", FileDamaged),
        ("joint = 5\n", FileDamaged),
        ("[[joint]]\nname = 'a'\nturns = 1\n", FileDamaged),
        ("[[joint]]\nname = 'a'\nsign = 2\n", FileDamaged),
        ("[[joint]]\nname = 'a'\noffset = nan\n", FileDamaged),
        (b"\xff\xfe", FileDamaged),
        (None, NonexistentFile),
    ],
)
def test_files_of_joints_that_are_wrong_are_refused(
    text: str | bytes | None, error: type[Exception], tmp_path: Path
) -> None:
    path = tmp_path / "joints.toml"
    if text is not None:
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(error):
        read_joints(str(path), (JointKind.REVOLUTE,))
