"""Turns of a joint."""

from __future__ import annotations

from math import pi, radians

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrs_cli.kinematics.joints import (
    LIMIT_TOLERANCE,
    JointKind,
    JointUnits,
    joints_outside,
    largest_change,
    nearest_turn,
    turn_within,
)

ANGLE = st.floats(-12.0, 12.0)


@given(ANGLE, ANGLE)
def test_the_nearest_turn_is_within_half_a_turn(angle: float, reference: float) -> None:
    turn = nearest_turn(angle, reference)
    assert abs(turn - reference) <= pi + 1e-12
    assert (turn - angle) / (2 * pi) == pytest.approx(round((turn - angle) / (2 * pi)), abs=1e-12)


@given(ANGLE, ANGLE, st.floats(-6.0, 0.0), st.floats(0.1, 6.0))
def test_the_turn_within_is_the_nearest_of_all_inside(
    angle: float, reference: float, lower: float, upper: float
) -> None:
    inside = [t for k in range(-6, 7) if lower <= (t := angle + 2 * pi * k) <= upper]
    turn = turn_within(angle, reference, lower, upper)
    if not inside:
        assert turn is None or min(turn - lower, upper - turn) < LIMIT_TOLERANCE
    else:
        assert turn is not None
        assert lower <= turn <= upper
        nearest = min(inside, key=lambda t: abs(t - reference))
        assert abs(turn - reference) == pytest.approx(abs(nearest - reference), abs=2 * LIMIT_TOLERANCE)


def test_joint_6_of_a_puma_has_two_turns_to_choose_from() -> None:
    low, high = radians(-266), radians(266)
    assert turn_within(radians(100), radians(-200), low, high) == pytest.approx(radians(-260))
    assert turn_within(radians(100), radians(50), low, high) == pytest.approx(radians(100))
    assert turn_within(radians(90), radians(-266), low, high) == pytest.approx(radians(90))  # -270 is outside


def test_rounding_at_a_limit_is_forgiven_and_set_right() -> None:
    assert turn_within(1.0 + 1e-12, 0.0, -1.0, 1.0) == 1.0
    assert turn_within(-1.0 - 1e-12, 0.0, -1.0, 1.0) == -1.0
    assert turn_within(1.0 + 1e-6, 0.0, -1.0, 1.0) is None


def test_joints_outside_counts_from_one() -> None:
    assert joints_outside((0.0, 2.0, -2.0), (-1.0,) * 3, (1.0,) * 3) == (2, 3)
    assert joints_outside((1.0 + 1e-12, 0.0, 0.0), (-1.0,) * 3, (1.0,) * 3) == ()


def test_largest_change() -> None:
    assert largest_change((0.0, 1.0), (0.5, -1.0)) == 2.0


def test_turns_are_shown_in_degrees_and_slides_in_millimetres_and_read_back() -> None:
    units = JointUnits((JointKind.REVOLUTE, JointKind.PRISMATIC))
    q, shown = (0.5 * pi, 0.25, -pi), (90.0, 250.0, -180.0)
    assert units.to_display(q[:2]) == shown[:2]
    assert units.read(shown[:2]) == q[:2]
    for joint, (x, number, unit) in enumerate(zip(q, shown, ("deg", "mm", "deg"), strict=True), 1):
        assert units.one_shown(joint, x) == number
        assert units.one_read(joint, number) == x
        assert units.unit(joint) == unit
        assert units.slides(joint) == (unit == "mm")
    assert not units.slides(0)
    assert units.json_units(2) == {"joint_units": ["deg", "mm"]}
    assert units.json_units(1) == {}
