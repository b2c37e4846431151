"""What a MOVE chooses, and what it says when there is nothing to choose."""

from __future__ import annotations

import random
from itertools import pairwise
from math import pi, radians

import pytest

from vrs_cli.errors import JointOutOfRange, LocationTooClose, LocationTooFar
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.joints import Arm, Configuration, Elbow, Joints, Wrist, largest_change
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import (
    Transform,
    angle_between,
    compose,
    distance,
    from_oat,
    rotation_y,
    rotation_z,
    translation,
)

PUMA = load_robot("puma560")
ARM = arm_for(PUMA)
READY = PUMA.poses["ready"]


def deg(*joints: float) -> Joints:
    return tuple(map(radians, joints))


def pointing_down(x: float, y: float, z: float) -> Transform:
    return from_oat(x, y, z, pi / 2, pi / 2, 0.0)


def test_a_move_keeps_arm_and_elbow() -> None:
    rng = random.Random(1)
    kept = 0
    for _ in range(500):
        near, goal = (
            tuple(rng.uniform(low, high) for low, high in zip(PUMA.lower, PUMA.upper, strict=True)) for _ in "ab"
        )
        T = ARM.forward(goal)
        try:
            q = ARM.select(T, near)
        except JointOutOfRange:
            continue
        kept += 1
        assert ARM.configuration(q).arm is ARM.configuration(near).arm
        assert ARM.configuration(q).elbow is ARM.configuration(near).elbow
        assert ARM.limits_ok(q)
        assert distance(ARM.forward(q), T) < 1e-9
    assert kept > 100


def test_from_where_it_is_a_move_goes_nowhere() -> None:
    for q in (READY, PUMA.poses["nest"], deg(20, -60, 150, 10, 30, -40), deg(20, -60, 150, 10, -30, 200)):
        assert ARM.select(ARM.forward(q), q) == pytest.approx(q, abs=1e-12)


def test_the_wrist_reached_sooner_is_taken_unless_one_is_asked_for() -> None:
    near = deg(20, -60, 150, 10, 1, -40)
    T = ARM.forward(deg(20, -60, 150, 10, -2, -40))
    assert ARM.select(T, near) == pytest.approx(deg(20, -60, 150, 10, -2, -40), abs=1e-9)
    strict = ARM.select(T, deg(20, -60, 150, -10, 1, -40), Configuration.of(wrist=Wrist.FLIP))
    assert ARM.configuration(strict).wrist is Wrist.FLIP
    with pytest.raises(JointOutOfRange) as refused:
        ARM.select(T, near, Configuration.of(wrist=Wrist.NOFLIP))
    assert str(refused.value) == (
        "*Joint 4 out of range* would be 190.00 deg, its range is -110.00 to 170.00 deg (in reach FLIP; say FLIP first)"
    )
    assert refused.value.joint == 4


def test_words_given_are_kept_strictly() -> None:
    T = pointing_down(0.4, 0.3, 0.0)
    for arm in Arm:
        for elbow in Elbow:
            try:
                q = ARM.select(T, READY, Configuration.of(arm, elbow))
            except JointOutOfRange:
                continue
            assert (ARM.configuration(q).arm, ARM.configuration(q).elbow) == (arm, elbow)


def test_a_hint_names_the_words_that_help() -> None:
    near = deg(0, -200, -30, 0, 50, 0)  # RIGHTY ABOVE
    T = ARM.forward(deg(-10, 0, 120, 0, 50, 0))
    with pytest.raises(JointOutOfRange, match=r"\(in reach LEFTY; say LEFTY first\)"):
        ARM.select(T, near)
    assert ARM.select(T, near, Configuration.of(arm=Arm.LEFTY)) == pytest.approx(deg(-10, 0, 120, 0, 50, 0))


def test_too_far_says_how_far() -> None:
    with pytest.raises(LocationTooFar) as refused:
        ARM.select(pointing_down(1.0, 0.14909, -0.05625), READY)
    assert str(refused.value) == (
        "*Location too far* the wrist would be 1000.0 mm from the shoulder, the arm reaches 865.3 mm "
        "(move the location 134.7 mm nearer)"
    )


def test_too_close_to_the_axis_says_how_close() -> None:
    with pytest.raises(LocationTooClose) as refused:
        ARM.select(pointing_down(0.1, 0.0, 0.3), READY)
    assert str(refused.value) == (
        "*Location too close* the wrist would be 100.0 mm from the axis of joint 1, "
        "it cannot come nearer than 149.1 mm (move the location 49.1 mm away from the axis)"
    )


def test_too_close_to_the_shoulder_says_how_close() -> None:
    with pytest.raises(
        LocationTooClose, match=r"0\.5 mm from the shoulder, .* no nearer than 1\.7 mm \(move .* 1\.2 mm"
    ):
        ARM.select(pointing_down(0.0005, ARM.reach.side, -0.05625), READY)


def test_nothing_else_helps_is_said_too() -> None:
    T = from_oat(0.55, 0.41, -0.13, 0.0, -pi / 3, 0.0)  # the tool points back up at the arm: joint 5 cannot bend so far
    with pytest.raises(JointOutOfRange, match="no other configuration reaches the location either"):
        ARM.select(T, READY)


def test_straight_lines_never_flip() -> None:
    rng = random.Random(9)
    lines = 0
    while lines < 60:
        q = tuple(rng.uniform(low, high) for low, high in zip(PUMA.lower, PUMA.upper, strict=True))
        start = ARM.forward(q)
        step = translation(*(rng.uniform(-0.002, 0.002) for _ in range(3)))
        turn = compose(rotation_z(rng.uniform(-0.01, 0.01)), rotation_y(rng.uniform(-0.01, 0.01)))
        line = [start]
        for _ in range(50):
            line.append(compose(line[-1], compose(step, turn)))
        c = ARM.configuration(q)
        path = [q]
        for T in line:
            here = ARM.branch_joints(T, c, path[-1])
            if here is None:
                break
            path.append(here)
        if len(path) < len(line) + 1 or min(min(ARM.singularity(p)) for p in path) < 0.1:
            continue
        lines += 1
        assert all(ARM.configuration(p) == c for p in path)
        assert max(largest_change(a, b) for a, b in pairwise(path)) < 0.3
        assert all(angle_between(ARM.forward(p), T) < 1e-9 for p, T in zip(path[1:], line, strict=True))
