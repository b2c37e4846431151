"""Tests of the path of a tool: its derivatives against differences."""

from __future__ import annotations

import pytest

from vrs_cli.kinematics.joints import NONE
from vrs_cli.kinematics.transform import from_oat
from vrs_cli.trajectory.polynomial import Polynomial, derivative, second_derivative, third_derivative, value
from vrs_cli.trajectory.segment import CartesianPath, JointPath, Turn

H = 1e-4
TURNS = (
    Turn((1.0, 0.0, 0.0), (0.1, 0.5, -0.3, 0.7)),
    Turn((0.0, 0.6, 0.8), (0.0, -0.4, 0.9, 0.2)),
    Turn((0.6, -0.8, 0.0), (0.2, 0.3, 0.1)),
)


@pytest.mark.parametrize("count", [0, 1, 2, 3])
def test_the_rates_of_a_twist_are_its_differences(count: int) -> None:
    position = ((0.1, 0.2, 0.3, 0.4), (0.5, -0.2, 0.1), (0.3, 0.7))
    path = CartesianPath(position, from_oat(0.0, 0.0, 0.0, 0.3, 0.4, 0.5), TURNS[:count], NONE, (), 1.0)
    for s in (0.0, 0.3, 0.9):
        before, here, after = (path.twist(s + h) for h in (-H, 0.0, H))
        rate, change = path.twist_rates(s)
        assert rate == path.twist_rate(s)
        assert rate == pytest.approx([(b - a) / (2.0 * H) for a, b in zip(before, after, strict=True)], abs=1e-6)
        second = [(a - 2.0 * m + b) / H**2 for a, m, b in zip(before, here, after, strict=True)]
        assert change == pytest.approx(second, abs=1e-5)


@pytest.mark.parametrize("more", [(), (0.0,), (0.0, 0.0)])
def test_a_joint_that_turns_back_beyond_its_range_does_not_stay_inside(more: Polynomial) -> None:
    for side in (1.0, -1.0):  # it turns back at 1 rad, half way, and comes back to 0
        path = JointPath(((0.0, 4.0 * side, -4.0 * side, *more),))
        assert path.stays_inside((-1.0,), (1.0,), 1.0)
        assert not path.stays_inside((-0.9,), (0.9,), 1.0)
        assert path.stays_inside((-0.9,), (0.9,), 0.2), "it has not come so far"
        assert not path.stays_inside((-0.1,), (0.1,), 0.2)


def test_the_seed_is_that_of_the_nearest_time() -> None:
    places = ((0.1,), (0.2,), (0.3,)), from_oat(0.0, 0.0, 0.0, 0.3, 0.4, 0.5), (), NONE
    for count in (1, 2, 3):
        path = CartesianPath(*places, tuple([(float(k),) for k in range(count)]), 0.5)
        nearest = [min(k, count - 1) for k in (0, 0, 1, 1, 2, 2)]
        assert [path.seed(s) for s in (-0.1, 0.2, 0.3, 0.7, 0.8, 9.0)] == [(float(k),) for k in nearest]


@pytest.mark.parametrize("a", [(1.0,), (1.0, 2.0), (1.0, 2.0, 3.0), (1.0, 2.0, 3.0, 4.0), (1.0, 2.0, 3.0, 4.0, 5.0)])
def test_derivatives_of_polynomials_of_every_degree(a: Polynomial) -> None:
    twice = derivative(derivative(a))
    assert second_derivative(a, 0.7) == pytest.approx(value(twice, 0.7))
    assert third_derivative(a, 0.7) == pytest.approx(value(derivative(twice), 0.7))
