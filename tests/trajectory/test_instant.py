"""Tests of the time grid: sums and shifts are exact."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from vrs_cli.trajectory.instant import LATEST, TICK, on_grid, round_to_ns, up_to_grid

times = st.floats(0.0, LATEST / 2)


@given(times, times)
def test_shifts_are_undone_to_the_bit(t: float, shift: float) -> None:
    t, shift = on_grid(t), on_grid(shift)
    assert (t + shift) - shift == t


@given(times)
def test_rounding_is_small_and_up_is_up(t: float) -> None:
    assert abs(on_grid(t) - t) <= TICK
    assert 0.0 <= up_to_grid(t) - t <= TICK


def test_a_million_shifts_do_not_drift() -> None:
    shift, t = on_grid(0.1), 0.0
    for _ in range(1_000_000):
        t += shift
    assert t == shift * 1_000_000


def test_times_are_shown_as_typed() -> None:
    for text in ("2.5", "3.1", "0.1", "86399.999"):
        assert str(round_to_ns(on_grid(float(text)))) == text
