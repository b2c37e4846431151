"""Inverse kinematics, one pose at a time: singular wrists, the border of the reach, turns and limits."""

from __future__ import annotations

import random
from math import cos, pi, radians, sin

import pytest
from msgspec import structs

from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.joints import ALL, Joints
from vrs_cli.kinematics.model import Link, RobotModel
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import Transform, angle_between, compose, distance, rotation_y, translation

PUMA = load_robot("puma560")
ARM = arm_for(PUMA)
READY = PUMA.poses["ready"]


def deg(*joints: float) -> Joints:
    return tuple(map(radians, joints))


def apart(a: Transform, b: Transform) -> float:
    return max(distance(a, b), angle_between(a, b))


def random_joints(rng: random.Random, model: RobotModel = PUMA) -> Joints:
    return tuple(rng.uniform(low, high) for low, high in zip(model.lower, model.upper, strict=True))


def flange_with_wrist_at(x: float, y: float, z: float) -> Transform:
    """A level tool whose wrist centre is at a point [m]."""
    return compose(compose(translation(x, y, z), rotation_y(pi / 2)), translation(0, 0, 0.05625))


def test_eight_solutions_in_the_fixed_order() -> None:
    rng = random.Random(1)
    for _ in range(300):
        q = random_joints(rng)
        T = ARM.forward(q)
        solutions = ARM.inverse_all(T)
        assert tuple(s.configuration for s in solutions) == ALL
        assert tuple(s.joints for s in solutions) == ARM.branches(T)
        for s in solutions:
            assert s.joints is not None
            assert apart(ARM.forward(s.joints), T) < 1e-12
            assert ARM.configuration(s.joints) == s.configuration
            assert s.usable == ARM.limits_ok(s.joints)
            expected = [
                i
                for i, (angle, low, high) in enumerate(zip(s.joints, PUMA.lower, PUMA.upper, strict=True), 1)
                if not low <= angle <= high
            ]
            assert list(s.outside) == expected


def test_one_branch_gives_the_joints_back() -> None:
    rng = random.Random(2)
    for _ in range(1000):
        q = random_joints(rng)
        found = ARM.inverse_branch(ARM.forward(q), ARM.configuration(q), q)
        assert found == pytest.approx(q, abs=1e-8)


def test_one_branch_agrees_with_all_eight() -> None:
    rng = random.Random(3)
    for _ in range(200):
        near = random_joints(rng)
        T = ARM.forward(random_joints(rng))
        for configuration, joints in zip(ALL, ARM.branches(T), strict=True):
            one = ARM.branch_joints(T, configuration, near)
            assert one is not None
            assert joints is not None
            for a, b, n in zip(one, joints, near, strict=True):
                assert abs(a - n) <= pi + 1e-12
                assert sin((a - b) / 2) == pytest.approx(0.0, abs=1e-12)


def test_turns_stay_near_whatever_the_limits() -> None:
    T = ARM.forward(deg(0, -45, 180, 0, 45, 100))
    near = deg(0, -45, 180, 0, 45, -250)
    c = ARM.configuration(near)
    assert ARM.branch_joints(T, c, near) == pytest.approx(deg(0, -45, 180, 0, 45, -260))
    near = deg(0, -45, 180, 0, 45, -265)
    T = ARM.forward(deg(0, -45, 180, 0, 45, 90))
    assert ARM.branch_joints(T, c, near) == pytest.approx(deg(0, -45, 180, 0, 45, -270))
    assert ARM.inverse_branch(T, c, near) == pytest.approx(deg(0, -45, 180, 0, 45, 90))


def test_a_joint_at_its_very_limit_is_inside() -> None:
    rng = random.Random(4)
    for i in range(6):
        for limit in (PUMA.lower[i], PUMA.upper[i]):
            for _ in range(50):
                q = list(random_joints(rng))
                q[i] = limit
                found = ARM.inverse_branch(ARM.forward(tuple(q)), ARM.configuration(tuple(q)), tuple(q))
                assert found is not None
                assert found == pytest.approx(q, abs=1e-8)
                assert all(a <= b <= c for a, b, c in zip(PUMA.lower, found, PUMA.upper, strict=True))


@pytest.mark.parametrize("q4", [-100, -40, 0, 25, 160])
def test_at_a_singular_wrist_joint_4_stays(q4: float) -> None:
    q = deg(10, -60, 140, q4, 0, 30)
    T = ARM.forward(q)
    for configuration in ALL[4:6]:  # LEFTY ABOVE, both wrists: they are one here
        assert ARM.branch_joints(T, configuration, q) == pytest.approx(q, abs=1e-12)
    two = ARM.branches(T)[4:6]
    assert two[0] == two[1]
    assert two[0] is not None
    assert two[0][3] == 0.0
    assert apart(ARM.forward(two[0]), T) < 1e-12


@pytest.mark.parametrize("q5", [1e-4, 1e-6, 1e-8, 1e-9, 1e-10, 1e-11, 0.0, -1e-9, -1e-7])
def test_near_a_singular_wrist_the_flange_is_still_right(q5: float) -> None:
    rng = random.Random(5)
    for _ in range(100):
        q = (*random_joints(rng)[:4], q5, 1.0)
        T = ARM.forward(q)
        for joints in ARM.branches(T):
            assert joints is not None
            assert apart(ARM.forward(joints), T) < 1e-9
        near = ARM.branch_joints(T, ARM.configuration(q), q)
        assert near is not None
        assert apart(ARM.forward(near), T) < 1e-9


def test_ready_is_singular_and_still_solved() -> None:
    T = ARM.forward(READY)
    assert ARM.configuration(READY) == ALL[0]
    assert ARM.inverse_branch(T, ALL[0], READY) == pytest.approx(READY, abs=1e-12)
    assert ARM.singularity(READY).wrist < 1e-15
    assert ARM.singularity(READY).elbow == pytest.approx(abs(sin(pi / 2 - 1.6176814)), abs=1e-4)


def test_the_stretched_arm_is_the_border_of_the_reach() -> None:
    reach, side = ARM.reach.upper + ARM.reach.fore, ARM.reach.side
    for angle in (0.0, 0.4, 1.2):
        for beyond, solved in ((-1e-6, True), (-1e-12, True), (0.0, True), (1e-12, True), (1e-6, False)):
            r = reach + beyond
            T = flange_with_wrist_at(r * cos(angle), side, r * sin(angle))
            joints = ARM.branch_joints(T, ALL[4], READY)
            assert (joints is not None) == solved
            assert (ARM.branches(T)[4] is not None) == solved
            if joints is not None:
                assert apart(ARM.forward(joints), T) < 1e-9


def test_the_folded_arm_is_the_inner_border() -> None:
    inner, side = abs(ARM.reach.upper - ARM.reach.fore), ARM.reach.side
    for beyond, solved in ((1e-6, True), (0.0, True), (-1e-12, True), (-1e-6, False)):
        T = flange_with_wrist_at(inner + beyond, side, 0.0)
        joints = ARM.branches(T)[4]
        assert (joints is not None) == solved
        if joints is not None:
            assert apart(ARM.forward(joints), T) < 1e-9


def test_the_axis_of_joint_1_cannot_be_reached() -> None:
    side = ARM.reach.side
    for beyond, solved in ((1e-6, True), (0.0, True), (-1e-12, True), (-1e-6, False)):
        T = flange_with_wrist_at(0.0, side + beyond, 0.5)
        assert all((joints is not None) == solved for joints in ARM.branches(T))
        for joints in filter(None, ARM.branches(T)):
            assert apart(ARM.forward(joints), T) < 1e-9


def test_the_shoulder_alignment_keeps_both_arms() -> None:
    T = flange_with_wrist_at(0.0, ARM.reach.side, 0.5)
    righty, lefty = ARM.branches(T)[0], ARM.branches(T)[4]
    assert righty is not None
    assert lefty is not None
    assert righty[0] == pytest.approx(lefty[0], abs=1e-9)


INDUSTRIAL = structs.replace(
    PUMA,  # shoulder offset a1, pedestal d1, no lateral offset: what most six-axis arms are
    name="industrial",
    links=(
        Link(0.15, 0.5, -pi / 2),
        Link(0.6, 0.0, 0.0),
        Link(0.1, 0.0, pi / 2),
        Link(0.0, 0.7, -pi / 2),
        Link(0.0, 0.0, pi / 2),
        Link(0.0, 0.1, 0.0),
    ),
)


def test_the_same_formulas_serve_another_arm() -> None:
    arm = arm_for(INDUSTRIAL)
    rng = random.Random(6)
    for _ in range(300):
        q = random_joints(rng, INDUSTRIAL)
        T = arm.forward(q)
        assert apart(T, arm.frames(q)[-1]) < 2e-15
        for c, joints in zip(ALL, arm.branches(T), strict=True):
            if joints is not None:
                assert apart(arm.forward(joints), T) < 1e-11
                assert arm.configuration(joints) == c
        found = arm.branch_joints(T, arm.configuration(q), q)
        assert found == pytest.approx(q, abs=1e-7)


def test_above_the_waist_joint_1_stays() -> None:
    arm = arm_for(INDUSTRIAL)
    T = compose(translation(0.0, 0.0, 1.2), translation(0.0, 0.0, 0.1))
    for joints in filter(None, (*arm.branches(T), *(arm.branch_joints(T, c, (0.7,) * 6) for c in ALL))):
        assert min(abs(joints[0]), abs(joints[0] - 0.7)) < 1e-12
        assert apart(arm.forward(joints), T) < 1e-12
