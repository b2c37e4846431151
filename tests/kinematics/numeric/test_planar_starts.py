"""Starts of arms with parallel joints 2 to 4: they lead to every pose that was had, in few steps."""

from __future__ import annotations

from random import Random

import numpy as np
import pytest

from tests.kinematics.short_arms import random_arm
from vrs_cli.errors import LocationOutOfRange
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.numeric.search import FREE_STEPS, STEPS
from vrs_cli.kinematics.numeric.steady.arm import SteadyArm
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import IDENTITY, Transform, at_position, compose, rotation_about, translation

TIPS = {"flange": IDENTITY, "tool": translation(0.03, -0.01, 0.08)}
ARMS = {"so100": load_robot("so100"), "four": random_arm(3, 4), "five": random_arm(3, 5), "another": random_arm(5, 5)}
POSES = 8
EXACT = 1e-4  # [rad] a turn that is none, also where the bars are nearly stretched


def steady(model: RobotModel, tool: Transform) -> SteadyArm:
    arm = arm_for(model).holding(tool)
    assert isinstance(arm, SteadyArm)
    return arm


@pytest.mark.parametrize("tool", TIPS.values(), ids=TIPS)
@pytest.mark.parametrize("model", ARMS.values(), ids=ARMS)
def test_every_pose_that_an_arm_has_had_is_found(model: RobotModel, tool: Transform) -> None:
    arm, random = steady(model, tool), Random(25)
    had = [tuple(map(random.uniform, model.lower, model.upper)) for _ in range(POSES)]
    poses = [arm.forward(q) for q in had]
    for T in poses:
        q = arm.select(T, model.poses["ready"])
        assert arm.limits_ok(q)
        assert np.abs(np.subtract(arm.forward(q), T)).max() < EXACT
    _, joints, inside = arm.every_inverse_batch(np.reshape(poses, (-1, 3, 4)))
    assert inside.all()
    assert [arm.missing_turn(tuple(q), T) for (q,), T in zip(joints.tolist(), poses, strict=True)] == pytest.approx(
        [0.0] * POSES, abs=EXACT
    )


def test_a_second_way_that_hardly_reaches_a_place_crowds_out_no_other() -> None:
    """With joint 1 turned by half a turn the folded bars miss the place by less than the slack of a start."""
    arm = steady(ARMS["so100"], IDENTITY)
    q = (-1.4268, 1.5353, -2.884, -0.4509, 3.0214)
    assert arm.missing_turn(arm.select(arm.forward(q), q), arm.forward(q)) < EXACT


@pytest.mark.parametrize("model", ARMS.values(), ids=ARMS)
def test_one_pose_takes_few_steps_and_a_place_out_of_reach_none(
    model: RobotModel, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Hundreds of steps one after the other took seconds."""
    arm, random, steps = steady(model, IDENTITY), Random(26), list[int]()
    conditions = arm._batch.conditions
    terms = conditions.terms

    def counted(q, T):  # type: ignore[no-untyped-def]
        steps.append(len(q))
        return terms(q, T)

    monkeypatch.setattr(conditions, "terms", counted)
    for _ in range(POSES):
        T = compose(
            arm.forward(tuple(map(random.uniform, model.lower, model.upper))),
            rotation_about((0.6, 0.0, 0.8), random.uniform(-3.0, 3.0)),
        )
        steps.clear()
        arm.every_inverse_batch(np.reshape(T, (1, 3, 4)))
        assert 0 < len(steps) <= FREE_STEPS + STEPS + 2
        assert max(steps) <= 16
    steps.clear()
    with pytest.raises(LocationOutOfRange):
        arm.select(at_position(IDENTITY, 3.0, 0.0, 0.5), model.poses["ready"])
    assert not any(steps)
