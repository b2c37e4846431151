"""Joint rates of parallel axes in closed form are those of the Jacobian."""

from __future__ import annotations

from random import Random

import pytest

from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import IDENTITY, Transform, compose, rotation_z, translation


@pytest.mark.parametrize("name", ["cobra600", "planar2", "planar3"])
@pytest.mark.parametrize("tool", [IDENTITY, compose(translation(0.03, -0.02, 0.1), rotation_z(0.4))])
def test_rates_bring_back_the_twist_of_any_tool(name: str, tool: Transform) -> None:
    random, arm = Random(1), arm_for(load_robot(name))
    for _ in range(20):
        q = tuple(map(random.uniform, arm.model.lower, arm.model.upper))
        qd = tuple([random.uniform(-2.0, 2.0) for _ in q])
        if arm.singularity(q).elbow > 0.05:
            assert arm.joint_velocity(q, arm.twist(q, qd, tool), tool) == pytest.approx(qd, abs=1e-11)


def test_they_are_those_of_the_jacobian_next_to_the_singular_pose_too() -> None:
    arm = arm_for(load_robot("cobra600"))
    for elbow in (1e-2, 1.1e-3, 0.9e-3, 1e-5):
        q = (0.3, elbow, 0.05, 0.2)
        twist = arm.twist(q, (0.1, 0.2, 0.05, 0.3))
        assert arm.joint_velocity(q, twist) == pytest.approx(RobotArm.joint_velocity(arm, q, twist), rel=1e-6)
