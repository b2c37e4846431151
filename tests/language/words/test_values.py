"""Numbers, their text, and the edge between mm and degrees and SI."""

from __future__ import annotations

from math import inf, nan, pi

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrs_cli.errors import ArithmeticOverflow, IllegalValue, StringOverflow
from vrs_cli.kinematics.transform import from_oat
from vrs_cli.language.text.ast import Format, Span
from vrs_cli.language.words.values import (
    LIMIT,
    TypeItem,
    default_form,
    encode,
    integer,
    leading_number,
    numbers_of,
    plain,
    precision_point,
    quadrant,
    read_number,
    storable,
    transformation,
    whole,
    within_range,
    wrapped,
)

NOWHERE = Span(1, 1, 1)


def form(code: str, width: int | None = None, decimals: int | None = None) -> Format:
    return Format(code, width, decimals, NOWHERE)


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
    ("item", "value", "text"),
    [
        (form("F", 8, 2), 3.14159, "    3.14"),
        (form("F", 8, 0), 3.7, "       4"),
        (form("F", 0, 3), -3.14159, "-3.142"),
        (form("F", 6, 2), -0.001, "  0.00"),
        (form("F", 4, 2), 12345.0, "****"),
        (form("E", 12, 3), 12345.678, "   1.235E+04"),
        (form("E", 5, 3), 1.0, "*****"),
        (form("G", 8, 2), 12.5, "   12.50"),
        (form("G", 10, 2), 1e12, "  1.00E+12"),
        (form("G", 10, 2), 1e-6, "  1.00E-06"),
        (form("G", 8, 3), 0.0001, "1.00E-04"),
        (form("G", 8, 3), -0.0001, "-1.0E-04"),
        (form("G", 8, 3), 123456789.0, "1.23E+08"),
        (form("G", 5, 3), 0.0001, "1E-04"),
        (form("G", 4, 3), 0.0001, "****"),
        (form("I", 5), 41.5, "   42"),
        (form("I"), -7.0, "-7"),
        (form("I", 2), 1000.0, "**"),
        (form("H", 6), 255.0, "    FF"),
        (form("H"), -1.0, "FFFFFF"),
        (form("O"), 8.0, "10"),
        (form("D"), 1.5, " 1.5"),
    ],
)
def test_number_formats(item: Format, value: float, text: str) -> None:
    assert encode([item, value]) == (text, True)


def test_a_format_holds_until_the_next() -> None:
    assert encode([form("F", 6, 1), 1.0, 2.0, form("D"), 3.0]) == ("   1.0   2.0 3", True)


@pytest.mark.parametrize(
    ("items", "text", "newline"),
    [
        (["a", "b"], "ab", True),
        ([form("X", 3), "a"], "   a", True),
        (["a", form("C", 2), "b"], "a\n\nb", True),
        (["a", form("C"), "b"], "a\nb", True),
        (["a", form("S")], "a", False),
        ([form("B")], "\a", True),
        ([form("U", 2)], "\x1b[2A", True),
        ([], "", True),
    ],
)
def test_controls(items: list[TypeItem], text: str, newline: bool) -> None:
    assert encode(items) == (text, newline)


def test_locations_are_shown_by_their_numbers() -> None:
    place = transformation((500.0, -100.5, 20.0, 90.0, -90.0, 0.0))
    assert encode([place]) == (" 500 -100.5 20 90 -90 0", True)
    assert encode([form("F", 0, 1), precision_point((0.0, -90.0, 90.0))]) == (" 0.0 -90.0 90.0", True)


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
    assert wrapped(1 << 24) == -16777216.0
    assert wrapped(-1) == -1.0


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
