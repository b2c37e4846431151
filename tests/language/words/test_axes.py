"""Test transformations written as the axes of their frame, with rounded numbers."""

from __future__ import annotations

from math import pi

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrs_cli.errors import IllegalValue
from vrs_cli.kinematics.transform import from_oat
from vrs_cli.language.words.values import MAX_ROUNDING, rounding, transformation

ANGLE = st.floats(-pi, pi)
NUMBER = st.integers(0, 8)  # of those of the axes


def axes(o: float, a: float, t: float) -> list[float]:
    nx, sx, ax, px, ny, sy, ay, py, nz, sz, az, pz = from_oat(0.1, -0.2, 0.3, o, a, t)
    return [nx, ny, nz, sx, sy, sz, ax, ay, az, 1000.0 * px, 1000.0 * py, 1000.0 * pz]


@given(ANGLE, ANGLE, ANGLE)
def test_exact_axes_are_rounded_by_nothing_and_three_decimals_by_less_than_one(o: float, a: float, t: float) -> None:
    assert rounding(axes(o, a, t)) < 1e-9
    written = [round(number, 3) for number in axes(o, a, t)]
    assert rounding(written) < 1e-3
    assert transformation(written) == pytest.approx(from_oat(0.1, -0.2, 0.3, o, a, t), abs=2e-3)


@given(ANGLE, ANGLE, ANGLE, NUMBER, st.sampled_from([-0.1, 0.1]))
def test_a_wrong_number_is_no_rounding(o: float, a: float, t: float, which: int, by: float) -> None:
    numbers = axes(o, a, t)
    numbers[which] += by
    assert MAX_ROUNDING < rounding(numbers) < 2.0 * abs(by)
    with pytest.raises(IllegalValue):
        transformation(numbers)
