"""Joint rates in closed form are those of the Jacobian, and next to a singular pose they are left to it."""

from __future__ import annotations

from dataclasses import replace
from random import Random
from typing import Any

import pytest

from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.forms import MappedArm, arm_for
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.model import Link
from vrs_cli.kinematics.offset_wrist.arm import CLEAR, OffsetWristArm
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import IDENTITY, Transform, compose, rotation_x, translation

TOOLS = (IDENTITY, translation(0.0, 0.0, 0.1), compose(translation(0.03, -0.02, 0.1), rotation_x(0.4)))


def other_arm() -> OffsetWristArm:
    """One with other lengths, and the arm on its other side."""
    mapped = arm_for(load_robot("ur5e"))
    assert isinstance(mapped, MappedArm)
    lengths = [(0.0, 0.2), (0.3, -0.1), (0.5, -0.2), (0.0, 0.05), (0.0, -0.12), (0.0, 0.07)]
    links = [Link(a, d, link.alpha) for (a, d), link in zip(lengths, mapped.inner.model.links, strict=True)]
    arm = arm_for(replace(mapped.inner.model, links=tuple(links)))
    assert isinstance(arm, MappedArm)
    assert isinstance(arm.inner, OffsetWristArm)
    return arm.inner


@pytest.mark.parametrize("tool", TOOLS)
def test_rates_bring_back_the_twist_of_any_tool(tool: Transform) -> None:
    random = Random(1)
    for arm in (arm_for(load_robot("ur5e")), other_arm()):
        for _ in range(50):
            q, qd = (tuple([random.uniform(-3.0, 3.0) for _ in range(6)]) for _ in range(2))
            if min(arm.singularity(q)) > 0.05:
                assert arm.joint_velocity(q, arm.twist(q, qd, tool), tool) == pytest.approx(qd, abs=1e-11)


@pytest.mark.parametrize("joint", [3, 5])
def test_next_to_a_singular_pose_the_jacobian_gives_them(joint: int, monkeypatch: pytest.MonkeyPatch) -> None:
    arm, general, asked = other_arm(), RobotArm.joint_velocity, list[Joints]()

    def counted(self: RobotArm, q: Joints, *rest: Any) -> Joints:
        asked.append(q)
        return general(self, q, *rest)

    monkeypatch.setattr(RobotArm, "joint_velocity", counted)
    for size, calls in ((1.1 * CLEAR, 0), (0.9 * CLEAR, 1)):
        q = tuple([size if k == joint else 0.5 for k in range(1, 7)])
        assert arm.joint_velocity(q, arm.twist(q, (0.1,) * 6)) == pytest.approx((0.1,) * 6, abs=1e-9)
        assert len(asked) == calls
