"""A step of Newton's method, written out for one arm, is that of the Jacobian and what is missing."""

from pathlib import Path
from random import Random

import numpy as np
import pytest

from tests.kinematics.random_arms import draw_arm
from tests.kinematics.seven_joints import seven_joints
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.numeric.search import missing, newton

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
