"""Velocities against finite differences of the forward kinematics, and what happens in the singularities."""

from __future__ import annotations

import random
from math import atan2, pi, radians

import pytest
from msgspec import structs

from vrs_cli.errors import StraightLineSingular
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.joints import Joints, Twist
from vrs_cli.kinematics.model import Link
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import IDENTITY, Transform, axis_angle, compose, from_oat, inverse

PUMA = load_robot("puma560")
ARM = arm_for(PUMA)
PEDESTAL = arm_for(structs.replace(PUMA, name="pedestal", links=(Link(0.15, 0.5, -pi / 2), *PUMA.links[1:])))
READY = PUMA.poses["ready"]
TOOL = from_oat(0.03, -0.05, 0.12, 0.4, 0.5, 0.6)
H = 1e-6


def deg(*joints: float) -> Joints:
    return tuple(map(radians, joints))


def random_joints(rng: random.Random) -> Joints:
    return tuple(rng.uniform(low, high) for low, high in zip(PUMA.lower, PUMA.upper, strict=True))


def moved(q: Joints, qd: Joints, dt: float) -> Joints:
    return tuple(a + b * dt for a, b in zip(q, qd, strict=True))


def measured_twist(arm: RobotArm, q: Joints, qd: Joints, tool: Transform) -> Twist:
    """Central difference of the tool's pose [m/s, rad/s]."""
    before, after = (compose(arm.forward(moved(q, qd, dt)), tool) for dt in (-H, H))
    vx, vy, vz = ((b - a) / (2 * H) for a, b in zip(before[3::4], after[3::4], strict=True))
    axis, angle = axis_angle(compose(after, inverse(before)))
    wx, wy, wz = (x * angle / (2 * H) for x in axis)
    return vx, vy, vz, wx, wy, wz


@pytest.mark.parametrize("arm", [ARM, PEDESTAL])
@pytest.mark.parametrize("tool", [IDENTITY, TOOL, from_oat(0, 0, 0.2, 0, 0, 0)])
def test_columns_are_finite_differences(arm: RobotArm, tool: Transform) -> None:
    rng = random.Random(7)
    for _ in range(100):
        q = random_joints(rng)
        J = arm.jacobian(q, tool)
        for i in range(6):
            qd = tuple(float(i == j) for j in range(6))
            column = [row[i] for row in J]
            assert column == pytest.approx(measured_twist(arm, q, qd, tool), abs=2e-9)
            assert arm.twist(q, qd, tool) == pytest.approx(column, abs=0)


@pytest.mark.parametrize("arm", [ARM, PEDESTAL])
@pytest.mark.parametrize("tool", [IDENTITY, TOOL])
def test_joint_velocity_is_the_inverse_of_twist(arm: RobotArm, tool: Transform) -> None:
    rng = random.Random(8)
    for _ in range(500):
        q = random_joints(rng)
        if min(arm.singularity(q)) < 0.02:
            continue
        qd = tuple(rng.uniform(-2, 2) for _ in range(6))
        found = arm.joint_velocity(q, arm.twist(q, qd, tool), tool)
        assert found == pytest.approx(qd, abs=1e-11)


@pytest.mark.parametrize("tool", [IDENTITY, TOOL])
def test_acceleration_bias_is_the_change_of_the_twist(tool: Transform) -> None:
    rng = random.Random(9)
    for _ in range(200):
        q, qd = random_joints(rng), tuple(rng.uniform(-2, 2) for _ in range(6))
        before, after = (ARM.twist(moved(q, qd, dt), qd, tool) for dt in (-H, H))
        measured = [(b - a) / (2 * H) for a, b in zip(before, after, strict=True)]
        assert ARM.acceleration_bias(q, qd, tool) == pytest.approx(measured, abs=1e-7)


def test_measures_of_the_three_singularities() -> None:
    assert ARM.singularity(READY).nearest == "wrist"
    stretched = (0.0, -1.0, atan2(0.43307, -0.02032), 0.3, 0.5, 0.0)
    assert ARM.singularity(stretched).nearest == "elbow"
    assert ARM.singularity(stretched).elbow == pytest.approx(0.0, abs=1e-15)
    shoulder = (0.0, -pi / 2, radians(90 + 2.6863), 0.3, 0.5, 0.0)
    assert ARM.singularity(shoulder).shoulder < 1e-6
    assert ARM.singularity(shoulder).wrist > 0.4
    level = ARM.singularity((0.0, 0.0, atan2(0.43307, -0.02032), 0.0, pi / 2, 0.0))
    assert level.shoulder == pytest.approx(1.0)
    assert level.wrist == 1.0


def test_straight_down_from_ready_is_possible() -> None:
    """The wrist is singular there, but a tool that keeps its orientation asks nothing of it."""
    qd = ARM.joint_velocity(READY, (0.0, 0.0, -0.1, 0.0, 0.0, 0.0))
    assert ARM.twist(READY, qd) == pytest.approx((0.0, 0.0, -0.1, 0.0, 0.0, 0.0), abs=1e-12)
    assert qd[3] == 0.0


def test_a_turn_about_the_lost_axis_of_the_wrist_is_refused() -> None:
    assert ARM.joint_velocity(READY, (0, 0, 0, 0, 0, 0.5))[5] == pytest.approx(0.5)
    with pytest.raises(StraightLineSingular, match="wrist: the axes of joints 4 and 6 are in one line"):
        ARM.joint_velocity(READY, (0.0, 0.0, 0.0, 0.5, 0.0, 0.0))


def test_the_stretched_arm_turns_as_one_bar_and_no_longer_reaches_out() -> None:
    q = (0.0, -1.0, atan2(0.43307, -0.02032), 0.0, 0.5, 0.0)
    swing = ARM.twist(q, (0.1, 0.2, 0.0, 0.3, 0.4, 0.5))
    assert ARM.joint_velocity(q, swing) == pytest.approx((0.1, 0.2, 0.0, 0.3, 0.4, 0.5), abs=1e-12)
    with pytest.raises(StraightLineSingular, match="elbow: the arm is stretched"):
        ARM.joint_velocity(q, (0.1, 0.0, 0.0, 0.0, 0.0, 0.0))


def test_above_the_waist_the_wrist_cannot_go_sideways() -> None:
    bars = (Link(0.4, 0.0, 0.0), Link(0.0, 0.0, pi / 2), Link(0.0, 0.4, -pi / 2))
    arm = arm_for(structs.replace(PUMA, name="plain", links=(PUMA.links[0], *bars, *PUMA.links[4:])))
    q = (0.0, -pi / 3, radians(30), 0.0, 0.5, 0.0)
    assert arm.singularity(q).shoulder < 1e-15
    with pytest.raises(StraightLineSingular, match="shoulder: the wrist is above or below"):
        arm.joint_velocity(q, (0.0, 0.1, 0.0, 0.0, 0.0, 0.0))
    assert arm.joint_velocity(q, (0.0, 0.0, 0.1, 0.0, 0.0, 0.0))[0] == 0.0
