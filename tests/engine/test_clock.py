"""Tests of clocks: virtual ones, and those that follow a wall clock."""

from __future__ import annotations

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.engine.wall import ManualWall
from tests.examples import examples
from vrs_cli.engine.clock import SLICE_S, ClockFace, VirtualClock
from vrs_cli.errors import ClockPaused
from vrs_cli.trajectory.instant import on_grid


def test_virtual_time_jumps_and_never_goes_back_by_itself() -> None:
    clock = VirtualClock()
    clock.advance(5.0)
    clock.advance(3.0)
    assert clock.now == clock.reached == 5.0
    clock.set(1.0)
    assert clock.now == 1.0


def test_a_wall_clock_sleeps_what_is_left() -> None:
    wall = ManualWall()
    clock = wall.clock(rate=2.0)
    clock.advance(4.0)
    wall.seconds += 1.0  # the program takes a second of real time: two of the robot
    clock.advance(5.0)
    clock.advance(8.0)
    assert sum(wall.slept) == pytest.approx(3.0)
    assert clock.now == 8.0


def test_now_is_exact_and_lasts_until_it_is_told_to_move() -> None:
    wall = ManualWall()
    clock = wall.clock()
    clock.advance(0.1)
    wall.seconds += 3.0
    assert clock.now == 0.1
    assert clock.reached == pytest.approx(3.1)
    clock.advance(clock.reached)
    assert clock.now == on_grid(clock.now) == pytest.approx(3.1)


def test_what_is_read_belongs_together_however_long_reading_takes() -> None:
    clock = ManualWall(each_look=lambda: 1.0).clock(rate=2.0)
    for _ in range(3):
        reading = clock.read()
        assert reading == ClockFace(2.0 * (reading.wall - 1001.0), 2.0, False, reading.wall)


def test_a_wait_is_cut_into_slices() -> None:
    wall = ManualWall()
    clock = wall.clock()
    clock.wait(10.0)
    assert clock.now == pytest.approx(SLICE_S)
    clock.advance(10.0)
    assert max(wall.slept) == SLICE_S


def test_an_hour_passes_at_once() -> None:
    wall = ManualWall()
    clock = wall.clock(rate=0.5)
    clock.advance(3600.0)
    assert wall.seconds == pytest.approx(1000.0 + 7200.0)


def test_a_pause_takes_no_time_and_nothing_waits_in_it() -> None:
    wall = ManualWall()
    clock = wall.clock()
    wall.seconds += 2.0
    clock.change(paused=True)
    wall.seconds += 100.0
    assert clock.reached == 2.0
    clock.advance(clock.reached)
    with pytest.raises(ClockPaused, match="CLOCK GO"):
        clock.wait(2.5)
    clock.change(paused=False)
    wall.seconds += 1.0
    assert clock.reached == 3.0


steps = st.lists(
    st.one_of(
        st.tuples(st.just("pass"), st.floats(0.0, 100.0)),
        st.tuples(st.just("rate"), st.floats(1e-3, 1e3)),
        st.tuples(st.just("pause"), st.booleans()),
        st.tuples(st.just("follow"), st.none()),
    ),
    max_size=30,
)


@examples(200)
@given(steps)
def test_time_is_continuous_and_never_goes_back(sequence: list[tuple[str, object]]) -> None:
    wall = ManualWall(0.0)
    clock = wall.clock()
    seen, expected, rate, paused = [clock.reached], 0.0, 1.0, False
    for what, value in sequence:
        before = clock.reached
        if what == "pass":
            assert isinstance(value, float)
            wall.seconds += value
            expected += 0.0 if paused else rate * value
        elif what == "rate":
            assert isinstance(value, float)
            clock.change(rate=value)
            rate = value
        elif what == "pause":
            paused = bool(value)
            clock.change(paused=paused)
        else:
            clock.advance(clock.reached)
        if what != "pass":
            assert clock.reached == before
        seen.append(clock.reached)
    assert all(earlier <= later for earlier, later in pairwise(seen))
    assert clock.reached == pytest.approx(expected, rel=1e-9, abs=1e-7)
