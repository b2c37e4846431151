"""The closed forms of accelerations and jerks against the recursion for every serial arm."""

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


@pytest.mark.parametrize("arm", [ARM, PEDESTAL])
@pytest.mark.parametrize("tool", [IDENTITY, TOOL])
def test_they_are_those_of_the_recursion(arm: RobotArm, tool: Transform) -> None:
    assert isinstance(arm, RobotArm)
    source = random.Random(1)
    for _ in range(200):
        q = tuple(map(source.uniform, PUMA.lower, PUMA.upper))
        if min(arm.singularity(q)) < 0.05:
            continue
        qd, qdd, twist = rates(source), rates(source), rates(source)
        acceleration = RobotArm.joint_acceleration(arm, q, qd, twist, tool)
        jerk = RobotArm.joint_jerk(arm, q, qd, qdd, twist, tool)
        assert arm.joint_acceleration(q, qd, twist, tool) == pytest.approx(acceleration, rel=1e-9, abs=1e-9)
        assert arm.joint_jerk(q, qd, qdd, twist, tool) == pytest.approx(jerk, rel=1e-9, abs=1e-9)


def test_a_lost_direction_is_refused_as_for_velocities() -> None:
    still = (0.0,) * 6
    down = ARM.joint_acceleration(READY, still, (0.0, 0.0, -1.0, 0.0, 0.0, 0.0))
    assert down == pytest.approx(ARM.joint_velocity(READY, (0.0, 0.0, -1.0, 0.0, 0.0, 0.0)))
    with pytest.raises(StraightLineSingular, match="wrist"):
        ARM.joint_acceleration(READY, still, (0.0, 0.0, 0.0, 0.5, 0.0, 0.0))
    with pytest.raises(StraightLineSingular, match="wrist"):
        ARM.joint_jerk(READY, still, still, (0.0, 0.0, 0.0, 0.5, 0.0, 0.0))
