"""The inverse of an arm without a common point of the wrist, where its formulas branch."""

from __future__ import annotations

from math import pi, sin
from random import Random
from typing import Any

import pytest
from msgspec import structs

from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.clearance import SINGULAR
from vrs_cli.kinematics.forms import MappedArm, arm_for
from vrs_cli.kinematics.joints import Joints, joints_outside
from vrs_cli.kinematics.model import Link
from vrs_cli.kinematics.offset_wrist.arm import CLEAR, OffsetWristArm
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import IDENTITY, Transform, compose, rotation_x, translation

ARM = arm_for(load_robot("ur5e"))
POSES = 50


def check(arm: RobotArm, q: Joints) -> None:
    """The joints come back as the branch that they are in, and all branches lead to the flange; there are some, unless
    joint 6 could stand anywhere and does not stand where the middle of its range is.
    """
    T = arm.forward(q)
    assert arm.branch_joints(T, arm.configuration(q), q) == pytest.approx(q, abs=1e-7)
    found = [branch for branch in arm.branches(T) if branch is not None]
    assert found or abs(sin(q[4])) < SINGULAR
    assert [arm.forward(branch) == pytest.approx(T, abs=1e-9) for branch in found] == [True] * len(found)


@pytest.mark.parametrize("wrist", [0.0, 1e-12, -1e-7, 1e-3, pi, 1.0])
def test_joint_6_stays_where_the_axes_of_4_and_6_are_parallel(wrist: float) -> None:
    random = Random(3)
    for _ in range(POSES):
        q = [random.uniform(-pi, pi) for _ in range(6)]
        q[2], q[4] = random.choice((-1.0, 1.0)) * random.uniform(0.3, 2.5), wrist
        check(ARM, tuple(q))


@pytest.mark.parametrize("turns", [-1, 0, 1])
def test_every_joint_is_on_the_turn_that_is_near(turns: int) -> None:
    random = Random(4)
    for _ in range(POSES):
        q = [random.uniform(-pi, pi) for _ in range(6)]
        q[2], q[4] = random.choice((-1.0, 1.0)) * random.uniform(0.3, 2.5), random.uniform(0.2, 2.9)
        there = tuple([x + 2.0 * pi * turns * random.choice((0, 1)) for x in q])
        assert ARM.branch_joints(ARM.forward(there), ARM.configuration(there), there) == pytest.approx(there, abs=1e-7)


@pytest.mark.parametrize("name", ["irb120", "ur5e", "kr10", "lrmate200id"])
def test_what_stands_at_the_ends_is_in_the_links_or_beside_them(name: str) -> None:
    random, arm = Random(5), arm_for(load_robot(name))
    for _ in range(POSES):
        check(arm, tuple(map(random.uniform, arm.model.lower, arm.model.upper)))


def test_the_arm_is_stretched_out() -> None:
    random = Random(6)
    for _ in range(POSES):
        T = ARM.forward(tuple([random.uniform(-pi, pi) if joint != 3 else 0.0 for joint in range(1, 7)]))
        found = [branch for branch in ARM.branches(T) if branch is not None]
        assert found
        assert [ARM.forward(branch) == pytest.approx(T, abs=1e-7) for branch in found] == [True] * len(found)


@pytest.mark.parametrize("low", [-5.0, -2.0, 0.5, 9.0])
def test_every_joint_is_on_the_turn_that_is_in_its_range(low: float) -> None:
    random, model = Random(7), structs.replace(ARM.model, lower=(low,) * 6, upper=(low + 2.0 * pi,) * 6)
    arm = arm_for(model)
    for _ in range(POSES):
        T = arm.forward(tuple([random.uniform(low, low + 2.0 * pi) for _ in range(6)]))
        found = [branch for branch in arm.branches(T) if branch is not None]
        assert found
        assert not [branch for branch in found if joints_outside(branch, model.lower, model.upper)]


TOOLS = (IDENTITY, translation(0.0, 0.0, 0.1), compose(translation(0.03, -0.02, 0.1), rotation_x(0.4)))


def other_arm() -> OffsetWristArm:
    """One with other lengths, and the arm on its other side."""
    mapped = arm_for(load_robot("ur5e"))
    assert isinstance(mapped, MappedArm)
    lengths = [(0.0, 0.2), (0.3, -0.1), (0.5, -0.2), (0.0, 0.05), (0.0, -0.12), (0.0, 0.07)]
    links = [Link(a, d, link.alpha) for (a, d), link in zip(lengths, mapped.inner.model.links, strict=True)]
    arm = arm_for(structs.replace(mapped.inner.model, links=tuple(links)))
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
