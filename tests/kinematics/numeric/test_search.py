"""A step of Newton's method, written out for one arm, is that of the Jacobian and what is missing."""

from math import pi
from pathlib import Path
from random import Random

import numpy as np
import pytest

from tests.kinematics.random_arms import draw_arm
from tests.kinematics.seven_joints import seven_joints
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.model import ArmTask, RobotModel
from vrs_cli.kinematics.numeric.batch import MISSING
from vrs_cli.kinematics.numeric.search import Aim, missing, newton, step_within
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import (
    IDENTITY,
    Transform,
    at_position,
    compose,
    rotation_about,
    rotation_x,
    translation,
)

FEW = 20


def check_steps(model: RobotModel, source: Random) -> None:
    arm, step_of = arm_for(model), newton(model.links, model.base, model.flange)
    count = model.joint_count
    for _ in range(FEW):
        q = tuple(source.uniform(low, high) for low, high in zip(model.lower, model.upper, strict=True))
        T = arm.forward(tuple(x + source.uniform(-0.3, 0.3) for x in q))
        weights = [tuple(source.gauss(0.0, 1.0) for _ in q) for _ in range(count - 6)]
        values, rates = ([source.gauss(0.0, 1.0) for _ in weights] for _ in range(2))
        twist = tuple(source.gauss(0.0, 1.0) for _ in range(6))
        rows = np.array([*arm.jacobian(q), *weights])
        sums = [value - np.dot(row, q) for row, value in zip(weights, values, strict=True)]
        found = step_of(q, T, tuple(zip(weights, values, strict=True)), twist, rates)
        if np.linalg.cond(rows) > 1e6:
            continue
        assert found is not None
        for x, wanted in zip(found, ((*missing(model.task, arm.forward(q), T), *sums), (*twist, *rates)), strict=True):
            assert rows @ np.array(x) == pytest.approx(np.array(wanted), abs=1e-8 * max(1.0, np.abs(x).max()))


@pytest.mark.parametrize("name", ["panda", "sawyer", "xarm7"])
def test_of_arms_of_seven_joints(name: str) -> None:
    check_steps(seven_joints(name), Random(name))


@pytest.mark.parametrize("seed", range(6))
def test_of_arms_as_they_come(seed: int, tmp_path: Path) -> None:
    check_steps(draw_arm(Random(seed), 6 + seed % 2).model(tmp_path), Random(seed))


def test_in_a_singular_pose_there_is_none() -> None:
    model = seven_joints("panda")
    arm, stretched = arm_for(model), (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    step_of = newton(model.links, model.base, model.flange)
    weights = ((1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), 0.0)
    assert step_of(stretched, arm.forward(stretched), (weights,), (1.0, 0.0, 0.0, 0.0, 0.0, 0.0), [0.0]) is None


@pytest.mark.parametrize("task", [ArmTask.POSE, ArmTask.POINTING])
def test_what_is_missing_is_the_same_for_arrays(task: ArmTask) -> None:
    source = Random(7)
    have = [rotation_about((source.gauss(0.0, 1.0), 1.0, 0.5), 3.0) for _ in range(20)]
    want = [compose(T, rotation_about((0.0, 1.0, 0.0), source.uniform(-3.0, 3.0))) for T in have]
    have, want = [*have, IDENTITY, IDENTITY, IDENTITY], [*want, IDENTITY, rotation_x(pi), translation(0.1, 0.2, 0.3)]
    with np.errstate(invalid="ignore", divide="ignore"):  # where a rotation is 0
        found = MISSING(task, *(Transform(*np.array(poses).T) for poses in (have, want)))
    alone = np.array([missing(task, a, b) for a, b in zip(have, want, strict=True)])
    assert np.stack(found, axis=1) == pytest.approx(alone, abs=1e-14)


PUMA = arm_for(load_robot("puma560"))
BENT = (0.3, -2.0, 0.6, 0.4, 0.9, -0.5)


def miss(rows: list[Joints], error: list[float], damping: float, d: list[float]) -> float:
    left = [sum(a * x for a, x in zip(row, d, strict=True)) - e for row, e in zip(rows, error, strict=True)]
    return sum(x * x for x in left) + damping * sum(x * x for x in d)


def test_a_held_joint_that_would_move_inwards_is_released() -> None:
    rows, room = [(1.0, 0.9), (0.0, 0.1)], [(0.0, 5.0), (-5.0, 0.1)]
    # without bounds joint 1 moves below 0 and joint 2 above 0.1; with joint 2 held, joint 1 moves up
    found = step_within(rows, [0.5, 1.0], 1e-6, room)
    assert found == pytest.approx((0.41, 0.1), abs=1e-5)


@pytest.mark.parametrize("seed", range(60))
def test_a_step_within_bounds_is_the_best_for_the_joints_that_are_not_held(seed: int) -> None:
    source, n = Random(seed), 4
    rows = [tuple(source.gauss(0.0, 1.0) for _ in range(n)) for _ in range(source.choice((2, 4, 6)))]
    error = [source.gauss(0.0, 1.0) for _ in rows]
    room = [(-source.choice((0.0, 0.1, 5.0)), source.choice((0.0, 0.1, 5.0))) for _ in range(n)]
    found, damping = step_within(rows, error, 1e-3, room), 1e-3
    assert all(low <= x <= high for x, (low, high) in zip(found, room, strict=True))
    for i, (x, bounds) in enumerate(zip(found, room, strict=True)):
        beside = [*found[:i], x + 1e-5, *found[i + 1 :]], [*found[:i], x - 1e-5, *found[i + 1 :]]
        if x not in bounds:
            assert miss(rows, error, damping, list(found)) <= min(miss(rows, error, damping, d) for d in beside) + 1e-12
    free = step_within(rows, error, damping, ())
    if all(low <= x <= high for x, (low, high) in zip(free, room, strict=True)):
        assert found == free


def test_a_pose_near_by_is_reached() -> None:
    pose = PUMA.forward(tuple(x + 0.1 for x in BENT))
    found = Aim(PUMA, pose).nearest(BENT, PUMA.model.lower, PUMA.model.upper)
    assert Aim(PUMA, pose).miss(found.joints).within(1e-6, 1e-5)
    assert found.gain > 0.999
    assert not any(found.pressed)


def test_a_joint_at_its_bound_is_pressed() -> None:
    pose = PUMA.forward((BENT[0] + 0.4, *BENT[1:]))
    upper = (BENT[0] + 0.1, *PUMA.model.upper[1:])
    found = Aim(PUMA, pose).nearest(BENT, PUMA.model.lower, upper)
    assert found.joints[0] == upper[0]
    assert found.pressed[0] == 1


def test_beyond_reach_it_is_the_place_on_the_edge_that_counts() -> None:
    """All links in one line, towards the place that is wished."""
    pose, q = at_position(PUMA.forward(BENT), 0.0, -3.0, 0.0), BENT
    for _ in range(40):
        q = Aim(PUMA, pose).nearest(q, PUMA.model.lower, PUMA.model.upper).joints
    reached = PUMA.forward(q)
    most = 0.4318 + 0.4336 + 0.05625
    assert 3.0 - most - 0.03 < Aim(PUMA, pose).miss(q).away < 3.0 - most + 0.03
    assert reached.py < -0.85
