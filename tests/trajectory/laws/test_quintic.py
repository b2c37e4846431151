"""Tests of the polynomial of degree 5 against the textbook: its coefficients, and its extremes from rest to rest."""

from __future__ import annotations

import pytest

from vrs_cli.kinematics.joints import Profile
from vrs_cli.trajectory.laws.law import NoTimes
from vrs_cli.trajectory.laws.quintic import Bounds, from_rest, joint_motion, quintic
from vrs_cli.trajectory.polynomial import derivative, extremes, value
from vrs_cli.trajectory.segment import JointPath, Phase
from vrs_cli.trajectory.state import JointLimits, JointState
from vrs_cli.values.commands import Motion, MotionKind, Start

MOTION = Motion(1, MotionKind.JOINT, Start.AT, profile=Profile.QUINTIC)
FREE = 1e9


def test_from_rest_to_rest_it_is_that_of_the_textbook() -> None:
    assert quintic(1.0, (2.0, 0.0, 0.0), 2.0) == pytest.approx((1.0, 0.0, 0.0, 20.0 / 8.0, -30.0 / 16.0, 12.0 / 32.0))


def test_it_has_the_state_that_it_begins_in_and_ends_at_rest_on_its_way() -> None:
    a = quintic(0.3, (1.2, -0.4, 2.0), 1.7)
    first, second = derivative(a), derivative(derivative(a))
    assert (value(a, 0.0), value(first, 0.0), value(second, 0.0)) == pytest.approx((0.3, -0.4, 2.0))
    assert (value(a, 1.7), value(first, 1.7), value(second, 1.7)) == pytest.approx((1.5, 0.0, 0.0), abs=1e-12)


@pytest.mark.parametrize(
    ("bounds", "lasting"),
    [
        (Bounds(0.5, FREE, FREE), 15.0 / 8.0 * 2.0 / 0.5),
        (Bounds(FREE, 3.0, FREE), (10.0 / 3.0**0.5 * 2.0 / 3.0) ** 0.5),
        (Bounds(FREE, FREE, 15.0), (60.0 * 2.0 / 15.0) ** (1.0 / 3.0)),
    ],
)
def test_the_limit_that_binds_is_just_reached(bounds: Bounds, lasting: float) -> None:
    time = from_rest([(2.0, bounds), (-0.1, bounds)], 0.0)
    assert time == pytest.approx(lasting, rel=1e-6)
    row, parts = quintic(0.0, (2.0, 0.0, 0.0), time), list[float]()
    for most in bounds:
        row = derivative(row)
        parts.append(max(map(abs, extremes(row, time))) / most)
    assert max(parts) == pytest.approx(1.0, rel=1e-5)


def test_the_second_half_is_the_same_polynomial_and_slows_down() -> None:
    limits = JointLimits((1.0,), (4.0,), (40.0,), (1.0,), (-9.0,), (9.0,))
    first, second = joint_motion(JointState((0.0,), (0.0,)), (2.0,), limits, 0.0, MOTION)
    assert isinstance(first.path, JointPath)
    assert isinstance(second.path, JointPath)
    assert (first.phase, second.phase, first.duration) == (Phase.ACCELERATE, Phase.DECELERATE, second.duration)
    for k in range(9):
        s = second.duration * k / 8
        assert second.path.joints(s) == pytest.approx(first.path.joints(first.duration + s), abs=1e-12)


def test_an_acceleration_that_leads_beyond_every_limit_leaves_no_time() -> None:
    limits = JointLimits((1.0,), (4.0,), (40.0,), (1.0,), (-9.0,), (9.0,))
    with pytest.raises(NoTimes):
        joint_motion(JointState((0.0,), (0.999,), (4.0,)), (2.0,), limits, 0.0, MOTION)
