"""The least of a quadratic function in a box: never above any of many points of the box."""

from __future__ import annotations

import numpy as np
import pytest

from vrs_cli.kinematics.numeric.steady.batch import OVER, least_in_box

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
