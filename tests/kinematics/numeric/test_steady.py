"""Starts of arms of four and five joints: they lead to every pose that was had, in few steps, and to no wrong place."""

from __future__ import annotations

from contextlib import suppress
from random import Random

import numpy as np
import pytest

from tests.examples import some
from tests.kinematics.short_arms import random_arm
from vrs_cli.errors import LocationOutOfRange, MotionError
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.numeric.steady.arm import SteadyArm
from vrs_cli.kinematics.numeric.steady.batch import OVER, least_in_box
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import (
    IDENTITY,
    Transform,
    at_position,
    compose,
    position,
    rotation_about,
    translation,
)

TIPS = {"flange": IDENTITY, "tool": translation(0.03, -0.01, 0.08)}
ARMS = {"so100": load_robot("so100"), "four": random_arm(3, 4), "five": random_arm(3, 5), "another": random_arm(5, 5)}
ANY_AXES = {"any four": random_arm(4, 4), "any five": random_arm(6, 5)}  # not parallel: their starts are sampled
POSES = some(36)
MOST_ROWS = 800  # of all steps of one pose: about 20 ms
MOST_STEPS, MOST_STARTS = 75, 33  # of all rounds of one pose, and of a round
EXACT = 1e-4  # [rad] a turn that is none, also where the bars are nearly stretched


def steady(model: RobotModel, tool: Transform) -> SteadyArm:
    arm = arm_for(model).for_tool(tool)
    assert isinstance(arm, SteadyArm)
    return arm


@pytest.mark.parametrize("tool", TIPS.values(), ids=TIPS)
@pytest.mark.parametrize("model", (ARMS | ANY_AXES).values(), ids=ARMS | ANY_AXES)
def test_every_pose_that_an_arm_has_had_is_found(model: RobotModel, tool: Transform) -> None:
    arm, random = steady(model, tool), Random(25)
    had = [tuple(map(random.uniform, model.lower, model.upper)) for _ in range(POSES)]
    poses = [arm.forward(q) for q in had]
    for T in poses:
        q = arm.select(T, model.poses["ready"])
        assert arm.limits_ok(q)
        assert np.abs(np.subtract(arm.forward(q), T)).max() < EXACT
    _, joints, inside = arm.batch.every_inverse(np.reshape(poses, (-1, 3, 4)))
    assert inside.all()
    assert [arm.missing_turn(tuple(q), T) for (q,), T in zip(joints.tolist(), poses, strict=True)] == pytest.approx(
        [0.0] * POSES, abs=EXACT
    )


def test_a_second_way_that_hardly_reaches_a_place_crowds_out_no_other() -> None:
    """With joint 1 turned by half a turn the folded bars miss the place by less than the slack of a start."""
    arm = steady(ARMS["so100"], IDENTITY)
    q = (-1.4268, 1.5353, -2.884, -0.4509, 3.0214)
    assert arm.missing_turn(arm.select(arm.forward(q), q), arm.forward(q)) < EXACT


@pytest.mark.parametrize("model", (ARMS | ANY_AXES).values(), ids=ARMS | ANY_AXES)
def test_joints_that_are_found_are_within_the_limits_and_at_the_place(model: RobotModel) -> None:
    """A search that put a joint back to its limit took the place that it had left for the one that it reached."""
    arm, random = steady(model, IDENTITY), Random(27)
    poses = [turned_anyhow(arm, random) for _ in range(POSES)]
    poses += [at_position(T, *(random.uniform(-0.4, 0.4) for _ in range(3))) for T in poses]
    _, joints, inside = arm.batch.every_inverse(np.reshape(poses, (-1, 3, 4)))
    found = [(tuple(q), T) for (q,), (there,), T in zip(joints.tolist(), inside, poses, strict=True) if there]
    for T in poses:
        with suppress(MotionError):
            found.append((arm.select(T, model.poses["ready"]), T))
    assert len(found) > POSES
    for q, T in found:
        assert arm.limits_ok(q)
        assert position(arm.forward(q)) == pytest.approx(position(T), abs=1e-6)


def turned_anyhow(arm: SteadyArm, random: Random) -> Transform:
    """A place that the arm reaches, where it cannot turn the tool as the pose asks."""
    there = arm.forward(tuple(map(random.uniform, arm.model.lower, arm.model.upper)))
    return compose(there, rotation_about((0.6, 0.0, 0.8), random.uniform(-3.0, 3.0)))


@pytest.mark.parametrize("model", (ARMS | ANY_AXES).values(), ids=ARMS | ANY_AXES)
def test_one_pose_takes_few_steps(model: RobotModel, monkeypatch: pytest.MonkeyPatch) -> None:
    """Searches along limits that went on and off them took 60 steps, and all searches of one pose up to a second."""
    arm, random, steps = steady(model, IDENTITY), Random(26), counted_steps(model, monkeypatch)
    for _ in range(POSES):
        T = turned_anyhow(arm, random)
        steps.clear()
        arm.batch.every_inverse(np.reshape(T, (1, 3, 4)))
        assert 0 < len(steps) <= MOST_STEPS
        assert max(steps) <= MOST_STARTS
        assert sum(steps) <= MOST_ROWS


@pytest.mark.parametrize("model", ARMS.values(), ids=ARMS)
def test_a_place_out_of_reach_takes_no_steps(model: RobotModel, monkeypatch: pytest.MonkeyPatch) -> None:
    arm, steps = steady(model, IDENTITY), counted_steps(model, monkeypatch)
    with pytest.raises(LocationOutOfRange):
        arm.select(at_position(IDENTITY, 3.0, 0.0, 0.5), model.poses["ready"])
    assert not any(steps)


def counted_steps(model: RobotModel, monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """The rows of each step that the searches of an arm take from now on."""
    conditions, steps = steady(model, IDENTITY).batch.conditions, list[int]()
    terms = conditions.terms

    def counted(q, T):  # type: ignore[no-untyped-def]
        steps.append(len(q))
        return terms(q, T)

    monkeypatch.setattr(conditions, "terms", counted)
    return steps


BOXES, POINTS = 60, 400


@pytest.mark.parametrize("joints", [4, 5])
def test_no_point_of_the_box_is_below_the_least_one(joints: int) -> None:
    random = np.random.default_rng(joints)
    ways = np.zeros((BOXES, joints, 2))
    free = np.linalg.qr(random.normal(size=(BOXES, joints, 3)), mode="complete")[0][:, :, 3:]
    ways[:, :, : joints - 3] = free
    slope, bend = random.normal(size=(BOXES, 2)), random.normal(size=(BOXES, 2, 2))
    bend = bend + np.swapaxes(bend, 1, 2)  # upwards, downwards, or either
    if joints == 4:
        slope[:, 1], bend[:, 1], bend[:, 0, 1] = 0.0, (0.0, 1.0), 0.0
    low, high = -random.uniform(0.0, 0.5, (BOXES, joints)), random.uniform(0.0, 0.5, (BOXES, joints))
    step = least_in_box(ways, slope, bend, low, high)
    assert (step <= high + OVER).all()
    assert (step >= low - OVER).all()
    z = random.uniform(-0.7, 0.7, (POINTS, 1, 2))
    points = (ways @ z[..., None])[..., 0]
    inside = ((points <= high) & (points >= low)).all(axis=2)
    assert inside.any(axis=0).sum() > BOXES / 2
    own = (np.swapaxes(ways, 1, 2) @ step[:, :, None])[:, :, 0]
    values = np.where(inside, value(slope, bend, z), np.inf)
    assert (value(slope, bend, own) <= values.min(axis=0) + 1e-9).all()


def value(slope, bend, z):  # type: ignore[no-untyped-def]
    return (z * slope).sum(axis=-1) + 0.5 * (z * (bend @ z[..., None])[..., 0]).sum(axis=-1)


def test_a_box_that_no_step_reaches_is_left_least() -> None:
    ways = np.array([[[1.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.0, 0.0]]])
    low, high = np.array([[0.2, -0.4, -0.1, -0.1]]), np.array([[0.3, 0.1, 0.1, 0.1]])  # 0.2 and 0.1 for the same joint
    step = least_in_box(ways, np.zeros((1, 2)), np.eye(2)[None], low, high)
    assert np.maximum(step - high, low - step).max() == pytest.approx(0.1)
