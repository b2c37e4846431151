"""Test numbers, their text, and the conversion between mm, degrees and SI."""

from __future__ import annotations

from math import inf, nan, pi

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrs_cli.errors import ArithmeticOverflow, IllegalValue, StringOverflow
from vrs_cli.kinematics.transform import from_oat
from vrs_cli.language.words.values import (
    default_form,
    integer,
    leading_number,
    numbers_of,
    plain,
    quadrant,
    read_number,
    storable,
    transformation,
    whole,
    within_range,
    wrap,
)
from vrs_cli.values.numbers import LIMIT


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, " 0"),
        (-0.0, " 0"),
        (5.0, " 5"),
        (-193.0, "-193"),
        (2.5, " 2.5"),
        (1 / 3, " 0.3333333"),
        (16777215.0, " 16777215"),
        (-16777216.0, "-16777216"),
        (123456.789, " 123456.8"),
        (1e20, " 1E+20"),
        (1e-9, " 1E-09"),
    ],
)
def test_default_form_has_a_place_for_the_sign_and_no_trailing_zeros(value: float, text: str) -> None:
    assert default_form(value) == text


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("12.5", 12.5),
        (" -3 ", -3.0),
        ("1E-3", 0.001),
        (".5", 0.5),
        ("5.", 5.0),
        ("^HFF", 255.0),
        ("^b101", 5.0),
        ("^17", 15.0),
        ("", None),
        ("abc", None),
        ("1 2", None),
        ("^HXY", None),
        ("^B12", None),
        ("1E99", None),
        ("nan", None),
        ("inf", None),
        ("1_000", None),
    ],
)
def test_numbers_read(text: str, value: float | None) -> None:
    assert read_number(text) == value


def test_leading_number_stops_where_the_number_does() -> None:
    assert leading_number("12mm") == (12.0, 2)
    assert leading_number("mm12") is None


@pytest.mark.parametrize(("value", "rounded"), [(0.5, 1), (1.5, 2), (2.5, 3), (-0.5, -1), (-2.4, -2), (7.0, 7)])
def test_reals_are_rounded_halves_away_from_zero(value: float, rounded: int) -> None:
    assert whole(value) == rounded


def test_integers_hold_24_bits_and_a_sign() -> None:
    assert integer(16777215.4) == 16777215
    assert integer(-16777216.0) == -16777216
    for value in (16777216.0, -16777217.0, 1e30):
        with pytest.raises(IllegalValue, match=plain(value).replace("+", r"\+")):
            integer(value)


def test_bits_beyond_24_are_cut() -> None:
    assert wrap(1 << 24) == -16777216.0
    assert wrap(-1) == -1.0


@pytest.mark.parametrize("value", [inf, -inf, nan, 1e39])
def test_what_a_real_cannot_hold_is_an_overflow(value: float) -> None:
    with pytest.raises(ArithmeticOverflow):
        within_range(value)


def test_the_largest_real_is_no_overflow() -> None:
    assert within_range(LIMIT) == LIMIT


def test_strings_of_128_characters_can_be_stored() -> None:
    assert storable("x" * 128) == "x" * 128
    with pytest.raises(StringOverflow, match="129"):
        storable("x" * 129)


@given(st.floats(-1e6, 1e6))
def test_a_typed_number_reads_back_to_seven_digits(value: float) -> None:
    read = read_number(default_form(value))
    assert read is not None
    assert read == pytest.approx(value, rel=1e-6, abs=1e-300)


@given(st.lists(st.integers(-2000, 2000), min_size=3, max_size=3), st.integers(-179, 180), st.integers(-89, 89))
def test_millimetres_and_degrees_survive_the_edge(xyz: list[int], o: int, a: int) -> None:
    numbers = (*map(float, xyz), float(o), float(a), 30.0)
    assert numbers_of(transformation(numbers)) == numbers


def test_transformations_are_metres_inside() -> None:
    assert transformation((1000.0, 0.0, 0.0, 90.0, -90.0, 0.0)).px == 1.0
    assert numbers_of(from_oat(0.0, 0.0, 0.0, pi / 2, -pi / 2, 0.0)) == (0.0, 0.0, 0.0, 90.0, -90.0, 0.0)


@given(st.floats(-1e6, 1e6))
def test_quadrants_leave_at_most_half_a_right_angle(angle: float) -> None:
    right_angles, rest = quadrant(angle)
    assert right_angles in range(4)
    assert abs(rest) <= pi / 4
