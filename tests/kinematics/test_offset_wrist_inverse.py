"""The inverse of an arm without a common point of the wrist, where its formulas branch."""

from __future__ import annotations

from dataclasses import replace
from math import pi, sin
from random import Random

import pytest

from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.clearance import SINGULAR
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.joints import Joints, joints_outside
from vrs_cli.kinematics.robot_file import load_robot

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
    random, model = Random(7), replace(ARM.model, lower=(low,) * 6, upper=(low + 2.0 * pi,) * 6)
    arm = arm_for(model)
    for _ in range(POSES):
        T = arm.forward(tuple([random.uniform(low, low + 2.0 * pi) for _ in range(6)]))
        found = [branch for branch in arm.branches(T) if branch is not None]
        assert found
        assert not [branch for branch in found if joints_outside(branch, model.lower, model.upper)]
