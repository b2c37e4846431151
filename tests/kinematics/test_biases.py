"""Accelerations and jerks of the joints against differences of the velocity of a tool, on a way of the joints."""

from __future__ import annotations

import random
from dataclasses import replace
from math import pi

import pytest

from vrs_cli.errors import StraightLineSingular
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.model import Link
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import IDENTITY, Transform, from_oat

PUMA = load_robot("puma560")
ARM = arm_for(PUMA)
PEDESTAL = arm_for(replace(PUMA, name="pedestal", links=(Link(0.15, 0.5, -pi / 2), *PUMA.links[1:])))
READY = PUMA.poses["ready"]
TOOL = from_oat(0.03, -0.05, 0.12, 0.4, 0.5, 0.6)


def rates(source: random.Random) -> Joints:
    return tuple(source.uniform(-2.0, 2.0) for _ in range(6))


def on_way(t: float, *derivatives: Joints) -> Joints:
    """Joints of which these, from the value on, are the derivatives at time 0."""
    powers = (1.0, t, t * t / 2.0, t**3 / 6.0)
    return tuple(sum(a * b for a, b in zip(powers, row, strict=False)) for row in zip(*derivatives, strict=True))


@pytest.mark.parametrize("arm", [ARM, PEDESTAL, *map(arm_for, map(load_robot, ("ur5e", "irb120", "cobra600")))])
@pytest.mark.parametrize("tool", [IDENTITY, TOOL])
def test_they_give_the_tool_its_acceleration_and_jerk(arm: RobotArm, tool: Transform) -> None:
    source, h, tried = random.Random(1), 1e-3, 0
    for _ in range(40):
        q = tuple(map(source.uniform, arm.model.lower, arm.model.upper))
        if min(arm.singularity(q)) < 0.1:
            continue
        tried += 1
        ways = [q, *(rates(source)[: len(q)] for _ in range(3))]
        before, now, after = (arm.twist(on_way(t, *ways), on_way(t, *ways[1:]), tool) for t in (-h, 0.0, h))
        acceleration = tuple((b - a) / (2.0 * h) for a, b in zip(before, after, strict=True))
        jerk = tuple((a + b - 2.0 * m) / (h * h) for a, m, b in zip(before, now, after, strict=True))
        assert arm.joint_acceleration(q, ways[1], acceleration, tool) == pytest.approx(ways[2], abs=2e-3)
        assert arm.joint_jerk(q, ways[1], ways[2], jerk, tool) == pytest.approx(ways[3], abs=2e-3)
    assert tried > 10


def test_a_lost_direction_is_refused_as_for_velocities() -> None:
    still = (0.0,) * 6
    down = ARM.joint_acceleration(READY, still, (0.0, 0.0, -1.0, 0.0, 0.0, 0.0))
    assert down == pytest.approx(ARM.joint_velocity(READY, (0.0, 0.0, -1.0, 0.0, 0.0, 0.0)))
    with pytest.raises(StraightLineSingular, match="wrist"):
        ARM.joint_acceleration(READY, still, (0.0, 0.0, 0.0, 0.5, 0.0, 0.0))
    with pytest.raises(StraightLineSingular, match="wrist"):
        ARM.joint_jerk(READY, still, still, (0.0, 0.0, 0.0, 0.5, 0.0, 0.0))
