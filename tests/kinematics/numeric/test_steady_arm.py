"""Arms of four and five joints that bring the tip to its place, the tool turned as nearly as can be."""

from __future__ import annotations

from functools import cache
from random import Random

import numpy as np
import pytest

from tests.kinematics.short_arms import Array, forward, kept_place, random_arm, turn_between
from vrs_cli.errors import LocationTooFar
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.joints import NONE, Joints
from vrs_cli.kinematics.numeric.steady.arm import SteadyArm
from vrs_cli.kinematics.transform import IDENTITY, Transform, compose, position, rotation_about, translation

ARMS = [(seed, joints) for joints in (4, 5) for seed in (1, 2)]
TIPS = (IDENTITY, translation(0.02, -0.03, 0.1))
NEARBY = 1e-3  # [rad, m] how far off joints are that keep the place


@cache
def arm_of(seed: int, joints: int, tool: Transform = IDENTITY) -> RobotArm:
    return arm_for(random_arm(seed, joints)).for_tool(tool)


def joints_of(arm: RobotArm, random: Random, inside: float = 0.1) -> Joints:
    limits = zip(arm.model.lower, arm.model.upper, strict=True)
    return tuple(low + random.uniform(inside, 1.0 - inside) * (high - low) for low, high in limits)


def matrix(T: Transform) -> Array:
    return np.vstack((np.reshape(T, (3, 4)), (0.0, 0.0, 0.0, 1.0)))


def tip(tool: Transform) -> Array:
    return np.array(position(tool))


def places(arm: RobotArm, q: Joints, T: Transform, tool: Transform) -> tuple[Array, Array]:
    """Of the tip: where the joints have it, and where the pose of the flange would."""
    have, want = forward(arm.model, np.array(q)), matrix(T)
    return have[:3, :3] @ tip(tool) + have[:3, 3], want[:3, :3] @ tip(tool) + want[:3, 3]


def asked_for(arm: RobotArm, q: Joints, random: Random) -> Transform:
    """A pose near that of the joints, which the arm can hardly have."""
    x, y, z = (random.gauss(0.0, 0.02) for _ in range(3))
    turned = rotation_about((0.6, 0.0, 0.8), random.gauss(0.0, 0.4))
    return compose(compose(arm.forward(q), translation(x, y, z)), turned)


@pytest.mark.parametrize("tool", TIPS, ids=["flange", "tool"])
@pytest.mark.parametrize(("seed", "joints"), ARMS)
def test_a_pose_that_the_arm_has_had_is_had_again(seed: int, joints: int, tool: Transform) -> None:
    arm, random = arm_of(seed, joints, tool), Random(seed)
    for _ in range(3):
        q, near = joints_of(arm, random, 0.0), joints_of(arm, random)
        T = arm.forward(q)
        found = forward(arm.model, np.array(arm.select(T, near)))
        assert np.abs(found[:3, 3] - matrix(T)[:3, 3]).max() < 1e-4
        assert turn_between(found[:3, :3], matrix(T)[:3, :3]) < 2e-4
        begin = [x + random.uniform(-0.01, 0.01) for x in q]
        there = arm.branch_joints(T, NONE, tuple(begin))
        if there is not None and arm.singularity(q).elbow > 0.05:
            assert there == pytest.approx(q, abs=1e-9)


@pytest.mark.parametrize("tool", TIPS, ids=["flange", "tool"])
@pytest.mark.parametrize(("seed", "joints"), ARMS)
def test_the_place_is_exact_and_no_joints_beside_turn_the_tool_nearer(seed: int, joints: int, tool: Transform) -> None:
    arm, random, checked = arm_of(seed, joints, tool), Random(seed), 0
    noise = np.random.default_rng(seed)
    for _ in range(3):
        q = joints_of(arm, random)
        T = asked_for(arm, q, random)
        found = arm.branch_joints(T, NONE, q)
        if found is None:
            continue
        have, want = places(arm, found, T, tool)
        assert have == pytest.approx(want, abs=1e-10)
        turn = turn_between(forward(arm.model, np.array(found))[:3, :3], matrix(T)[:3, :3])
        assert isinstance(arm, SteadyArm)
        assert arm.missing_turn(found, T) == pytest.approx(turn, abs=1e-7)
        for _ in range(2):
            beside = kept_place(arm.model, np.array(found), tip(tool), noise.normal(size=joints) * NEARBY)
            assert beside is not None
            assert turn_between(forward(arm.model, beside)[:3, :3], matrix(T)[:3, :3]) >= turn - 1e-9
        checked += 1
    assert checked >= 1


def test_how_far_a_place_is_beyond_the_reach_is_said_of_the_tip() -> None:
    arm = arm_of(1, 4, TIPS[1])
    with pytest.raises(LocationTooFar, match=r"the tool would be 30\d\d\.\d mm from the axis of joint 1"):
        arm.select(translation(3.0, 0.0, 0.0), arm.model.poses["ready"])
