"""The algebra of transformations, and the angles of VAL-II and V+ (hypothesis, so singular pitch is met)."""

from __future__ import annotations

import math
from math import pi, radians

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrs_cli.errors import IllegalValue
from vrs_cli.kinematics.transform import (
    IDENTITY,
    Transform,
    angle_between,
    at_position,
    axis_angle,
    compose,
    distance,
    from_oat,
    inverse,
    orthonormal_frame,
    position,
    rotate,
    rotation_about,
    rotation_x,
    rotation_y,
    rotation_z,
    to_oat,
    translation,
)

ANY = st.floats(-2 * pi, 2 * pi)
QUARTERS = st.integers(-4, 4).map(lambda n: n * pi / 2)
ANGLE = st.one_of(ANY, QUARTERS, QUARTERS.flatmap(lambda q: st.floats(-1e-6, 1e-6).map(lambda d: q + d)))
LENGTH = st.floats(-2.0, 2.0)
POSES = st.builds(from_oat, LENGTH, LENGTH, LENGTH, ANGLE, ANGLE, ANGLE)


def apart(a: Transform, b: Transform) -> float:
    return max(abs(x - y) for x, y in zip(a, b, strict=True))


@given(POSES, POSES, POSES)
def test_transformations_are_a_group(a: Transform, b: Transform, c: Transform) -> None:
    assert apart(compose(compose(a, b), c), compose(a, compose(b, c))) < 1e-14
    assert apart(compose(a, inverse(a)), IDENTITY) < 1e-14
    assert apart(compose(inverse(a), a), IDENTITY) < 1e-14
    assert compose(a, IDENTITY) == a == compose(IDENTITY, a)
    assert apart(orthonormal_frame(compose(a, b)), compose(a, b)) < 1e-14, "it is rigid"


@given(POSES)
def test_oat_round_trip(T: Transform) -> None:
    o, a, t = to_oat(T)
    assert -pi < o <= pi
    assert -pi / 2 <= a <= pi / 2
    assert -pi < t <= pi
    assert apart(from_oat(*position(T), o, a, t), T) < 2e-10
    assert all(math.copysign(1.0, angle) == 1.0 for angle in (o, a, t) if angle == 0.0)


@given(ANGLE, ANGLE, ANGLE)
def test_yaw_pitch_roll_is_the_product_of_three_rotations(yaw: float, pitch: float, roll: float) -> None:
    product = compose(compose(rotation_z(yaw), rotation_y(pitch)), rotation_z(roll))
    assert apart(from_oat(0, 0, 0, yaw + pi / 2, pitch - pi / 2, roll), product) < 5e-15


def test_oat_matrix_of_the_manual() -> None:
    o, a, t = 0.3, -0.7, 1.9
    T = from_oat(1, 2, 3, o, a, t)
    cO, sO, cA, sA, cT, sT = (f(angle) for angle in (o, a, t) for f in (math.cos, math.sin))
    n = (cO * sT - sO * sA * cT, sO * sT + cO * sA * cT, -cA * cT)
    s = (cO * cT + sO * sA * sT, sO * cT - cO * sA * sT, cA * sT)
    approach = (sO * cA, -cO * cA, -sA)
    expected = Transform(n[0], s[0], approach[0], 1, n[1], s[1], approach[1], 2, n[2], s[2], approach[2], 3)
    assert apart(T, expected) < 1e-15


def test_identity_has_a_vertical_tool() -> None:
    assert to_oat(IDENTITY) == (pi / 2, -pi / 2, 0.0)
    assert from_oat(0, 0, 0, radians(90), radians(-90), 0.0) == IDENTITY


@pytest.mark.parametrize("roll", [0.0, 0.4, -2.5, pi])
def test_a_vertical_tool_has_no_yaw(roll: float) -> None:
    down = compose(rotation_y(pi), rotation_z(roll))
    assert to_oat(down) == pytest.approx((pi / 2, pi / 2, roll), abs=1e-15)
    up = compose(rotation_z(0.25), rotation_z(roll - 0.25))
    assert to_oat(up) == pytest.approx((pi / 2, -pi / 2, roll), abs=1e-15)


# Both ends of the range, where formulas by arccos of the trace lose half their digits.
TURNS = st.one_of(st.floats(0, pi), st.floats(0, 1e-5), st.floats(0, 1e-7).map(lambda d: pi - d))
DIRECTIONS = st.tuples(LENGTH, LENGTH, LENGTH).filter(lambda v: math.hypot(*v) > 0.1)


@given(DIRECTIONS, TURNS)
def test_axis_and_angle_round_trip(direction: tuple[float, float, float], angle: float) -> None:
    T = rotation_about(direction, angle)
    axis, found = axis_angle(T)
    assert found == pytest.approx(angle, abs=1e-14)
    assert math.hypot(*axis) == pytest.approx(1.0, abs=1e-14)
    assert apart(rotation_about(axis, found), T) < 1e-14


def test_axis_angle_of_half_turns_and_of_none() -> None:
    assert axis_angle(IDENTITY) == ((0.0, 0.0, 1.0), 0.0)
    for rotation, axis in ((rotation_x, (1, 0, 0)), (rotation_y, (0, 1, 0)), (rotation_z, (0, 0, 1))):
        found, angle = axis_angle(rotation(pi))
        assert found == pytest.approx(axis, abs=1e-15)
        assert angle == pytest.approx(pi, abs=1e-15)
        assert axis_angle(rotation(1e-9))[1] == pytest.approx(1e-9, rel=1e-12)


@given(POSES, POSES)
def test_axis_and_angle_turn_one_into_the_other(a: Transform, b: Transform) -> None:
    axis, angle = axis_angle(compose(b, inverse(a)))
    assert angle == pytest.approx(angle_between(a, b), abs=1e-7)  # near half a turn the two may differ in the noise
    if angle > 1e-12:
        turned = compose(rotation_about(axis, angle), a)
        assert apart(at_position(turned, *position(b)), b) < 1e-13


def test_distance_position_and_rotation() -> None:
    assert distance(translation(1, 2, 3), translation(1, 5, 7)) == 5.0
    assert position(translation(1, 2, 3)) == (1, 2, 3)
    assert rotate(rotation_z(pi / 2), (1, 0, 0)) == pytest.approx((0, 1, 0), abs=1e-15)


def test_normalised_mends_a_worn_matrix() -> None:
    T = from_oat(0.1, 0.2, 0.3, 0.5, 0.6, 0.7)
    worn = Transform(*(x + 1e-4 * math.sin(i) for i, x in enumerate(T)))
    assert apart(compose(worn, inverse(worn)), IDENTITY) > 1e-5
    mended = orthonormal_frame(worn)
    assert apart(compose(mended, inverse(mended)), IDENTITY) < 1e-15
    assert apart(mended, T) < 3e-4
    assert apart(orthonormal_frame(T), T) < 1e-15


def test_what_is_no_rotation_is_refused() -> None:
    flat = Transform(0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0)
    with pytest.raises(IllegalValue, match="parallel"):
        orthonormal_frame(flat)
    with pytest.raises(IllegalValue, match="no direction"):
        rotation_about((0, 0, 0), 1.0)
