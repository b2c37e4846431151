"""Tests of the times of jerk-limited motions: the textbook's closed form, the limits at every instant, and single
stops.
"""

from __future__ import annotations

from math import inf, sqrt

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from msgspec import structs

from tests.examples import examples
from vrs_cli.kinematics.joints import Profile
from vrs_cli.trajectory.instant import TICK
from vrs_cli.trajectory.laws.law import NONE, Change, Course, NoTimes
from vrs_cli.trajectory.laws.lspb import Component
from vrs_cli.trajectory.laws.scurve import _possible, _root, from_rest, joint_motion, keeps, ramps, turn_bounds
from vrs_cli.trajectory.laws.scurve_steering import farthest, joint_stop, state_after, stop, turning_back
from vrs_cli.trajectory.polynomial import derivative, turns, value
from vrs_cli.trajectory.segment import JointPath, Segment
from vrs_cli.trajectory.state import JointLimits, JointState, ToolLimits
from vrs_cli.values.commands import Motion, MotionKind, Start

ROUNDING = 1.0 + 1e-5
MOTION = Motion(1, MotionKind.JOINT, Start.AT, profile=Profile.SCURVE)
LIMITS = JointLimits((1.4, 0.9, 2.1), (4.8, 3.1, 7.1), (48.0, 31.0, 71.0), (1.4, 0.9, 2.1), (-10.0,) * 3, (10.0,) * 3)

parts = st.floats(-1.0, 1.0)
thirds = st.tuples(parts, parts, parts)


def test_seven_stretches_from_rest() -> None:
    # 2 rad at 1 rad/s, 2 rad/s2, 10 rad/s3 (Biagiotti and Melchiorri 3.4): T = D/v + v/a + a/j
    course = from_rest([Component(2.0, 0.0, 1.0, 2.0, 10.0)])
    assert course.change == pytest.approx((0.2, 0.3, 0.2), abs=1e-6)
    assert course.cruise == pytest.approx(1.3, abs=1e-6)
    assert course.total == pytest.approx(2.7, abs=1e-6)


def test_full_acceleration_is_not_reached() -> None:
    # velocity 1 in two ramps of sqrt(v / j): T = D/v + 2 sqrt(v / j)
    course = from_rest([Component(2.0, 0.0, 1.0, 100.0, 4.0)])
    assert course.change.hold == 0.0
    assert course.total == pytest.approx(2.0 + 2.0 * sqrt(1.0 / 4.0), abs=1e-5)


def test_a_short_way_is_four_ramps() -> None:
    # D = 2 j t^3 in four ramps of t
    course = from_rest([Component(0.002, 0.0, 10.0, 100.0, 8.0)])
    assert course.total == pytest.approx(4.0 * (0.002 / (2.0 * 8.0)) ** (1.0 / 3.0), abs=1e-5)
    assert course.cruise == 0.0


def test_least_time_is_kept_and_not_much_more() -> None:
    course = from_rest([Component(0.5, 0.0, 10.0, 2.0, 20.0)], 3.0)
    assert 3.0 <= course.total <= 3.0001


def test_nothing_to_do_takes_no_time() -> None:
    assert from_rest([Component(0.0, 0.0, 1.0, 1.0, 1.0)]).total == 0.0


def check(segments: tuple[Segment, ...], state: JointState, start: float) -> None:
    """Check that a motion is continuous in position, velocity and acceleration until rest, and keeps every limit at
    every instant.
    """
    now, at = state, start
    for segment in segments:
        path = segment.path
        assert isinstance(path, JointPath)
        assert segment.start == at
        assert segment.start % TICK == segment.finish % TICK == 0.0
        assert path.joints(0.0) == pytest.approx(now.joints, abs=1e-9)
        assert path.velocity(0.0) == pytest.approx(now.velocity, abs=1e-7)
        assert path.acceleration(0.0) == pytest.approx(now.acceleration, abs=1e-6)
        for k in range(9):
            check_limits(path, segment.duration * k / 8)
        end = segment.duration
        now, at = JointState(path.joints(end), path.velocity(end), path.acceleration(end)), segment.finish
    assert now.velocity == pytest.approx((0.0,) * 3, abs=1e-7)
    assert now.acceleration == pytest.approx((0.0,) * 3, abs=1e-6)


def check_limits(path: JointPath, s: float) -> None:
    for v, most in zip(path.velocity(s), LIMITS.peak, strict=True):
        assert abs(v) <= most * ROUNDING
    for a, most in zip(path.acceleration(s), LIMITS.acceleration, strict=True):
        assert abs(a) <= most * ROUNDING
    for row, most in zip(path.coefficients, LIMITS.jerk, strict=True):
        assert abs(value(derivative(derivative(derivative(row))), s)) <= most * ROUNDING


def possible(velocity: tuple[float, ...], acceleration: tuple[float, ...]) -> JointState:
    """Return whether a motion within the limits can be in a state: it can lose its acceleration before it is
    too fast.
    """
    v = tuple(part * most for part, most in zip(velocity, LIMITS.peak, strict=True))
    a = tuple(part * most for part, most in zip(acceleration, LIMITS.acceleration, strict=True))
    rows = zip(v, a, LIMITS.peak, LIMITS.jerk, strict=True)
    assume(all(abs(w + 0.5 * b * abs(b) / jerk) <= 0.9999 * most for w, b, most, jerk in rows))
    return JointState((0.1, 0.2, 0.3), v, a)


@given(thirds, thirds, thirds, st.sampled_from([0.0, 0.0, 1.0, 5.0]))
@examples(300)
def test_a_motion_from_any_state_keeps_every_limit(
    goal: tuple[float, ...], velocity: tuple[float, ...], acceleration: tuple[float, ...], least: float
) -> None:
    state = possible(velocity, acceleration)
    segments = joint_motion(state, tuple(3.0 * x for x in goal), LIMITS, 0.0, MOTION, least)
    check(segments, state, 0.0)
    last = segments[-1]
    assert isinstance(last.path, JointPath)
    assert last.path.joints(last.duration) == pytest.approx(tuple(3.0 * x for x in goal), abs=1e-9)


@given(thirds, thirds)
@examples(200)
def test_a_stop_from_any_state_keeps_every_limit(velocity: tuple[float, ...], acceleration: tuple[float, ...]) -> None:
    state = possible(velocity, acceleration)
    check(joint_stop(state, LIMITS, 0.0, MOTION), state, 0.0)


@given(st.floats(0.05, 0.9), parts)
@examples(200)
def test_nothing_turns_back_earlier_than_full_braking(v: float, part: float) -> None:
    """The farthest place of any way to rest is at least that of braking as hard as possible and swinging back."""
    a, jerk = 4.0 * part, 40.0
    braked = turning_back(v, a, 4.0, jerk)
    state = (0.0, v, a)
    for duration, rate in braked:
        state = state_after(*state, duration, rate)
    swung = braked + stop(state[1], state[2], 4.0, jerk)
    _, nearest = farthest(0.0, v, a, swung)
    _, direct = farthest(0.0, v, a, stop(v, a, 4.0, jerk))
    assert nearest <= direct + 1e-9


@given(st.floats(0.0, 1.4), st.floats(-0.99, 0.99))
def test_turning_back_ends_at_rest(v: float, part: float) -> None:
    state, a = (0.0, v, 4.0 * part), 4.0
    for duration, rate in turning_back(v, state[2], a, 40.0):
        assert abs(rate) <= 40.0 * ROUNDING
        state = state_after(*state, duration, rate)
        assert abs(state[2]) <= a + 40.0 * TICK
    assert state[1] == pytest.approx(0.0, abs=1e-7)


def test_a_stop_next_to_the_end_of_a_range_swings_back() -> None:
    v = (0.5, 0.0, 0.0)
    state = JointState((0.0, 0.0, 0.0), v, (-4.8, 0.0, 0.0))
    direct = joint_stop(state, LIMITS, 0.0, MOTION)
    farthest_direct = max(s.path.joints(s.duration)[0] for s in direct)  # type: ignore[union-attr]
    tight = structs.replace(LIMITS, upper=(farthest_direct - 1e-4, 10.0, 10.0))
    swung = joint_stop(state, tight, 0.0, MOTION)
    check(swung, state, 0.0)
    for segment in swung:
        for k in range(50):
            assert segment.path.joints(segment.duration * k / 49)[0] <= tight.upper[0] + 1e-9  # type: ignore[union-attr]


@given(parts, parts, parts)
@examples(100)
def test_turns_are_where_the_velocity_is_zero(v: float, a: float, jerk: float) -> None:
    assume(abs(jerk) > 1e-3)
    assume(all(x == 0.0 or abs(x) > 1e-100 for x in (v, a)))  # a square of less is lost
    for s in turns(v, a, jerk):
        assert v + a * s + 0.5 * jerk * s * s == pytest.approx(0.0, abs=1e-6 * (1.0 + s * s))


def test_a_velocity_that_only_touches_zero_turns_there() -> None:
    assert set(turns(0.5, 1.0, 1.0)) == {-1.0}


def test_lag_of_a_step_is_half_of_it() -> None:
    assert Change(0.0, 2.0, 0.0).lag == 1.0
    assert Change(1.0, 0.0, 1.0).lag == 1.0, "symmetrical changes have the middle velocity on the average"


@given(st.floats(0.0, 1e6), st.floats(1e-12, 1e6))
def test_the_root_of_a_cubic(c2: float, c3: float) -> None:
    x = _root(c2, c3)
    assert x > 0.0
    assert (c2 + c3 * x) * x * x == pytest.approx(1.0, abs=1e-9)


def test_a_motion_out_of_another_takes_the_time_that_it_is_given() -> None:
    state = JointState((0.0, 0.0, 0.0), (0.3, 0.1, 0.0), (0.0, 0.0, 0.0))
    quick, slow = (joint_motion(state, (2.0, 1.0, 0.5), LIMITS, 0.0, MOTION, least) for least in (0.0, 4.0))
    assert quick[-1].finish < 3.0
    assert 4.0 <= slow[-1].finish <= 4.001
    check(slow, state, 0.0)


@given(st.floats(0.0, 2.0), st.floats(1e-9, 4.0))
def test_ramps_are_on_the_grid_of_times(by_acceleration: float, by_jerk: float) -> None:
    change = ramps(by_acceleration, by_jerk)
    assert all(duration % TICK == 0.0 for duration in change)
    assert change.rise * (change.rise + change.hold) >= by_jerk * (1.0 - 1e-9)
    assert change.rise + change.hold >= by_acceleration


def test_a_change_alone_stops_on_the_target() -> None:
    change = Change(0.1, 0.0, 0.1)
    assert Course(change, 0.0, NONE).stops_at_once is True
    assert Course(change, 0.5, NONE).stops_at_once is False
    assert Course(change, 0.0, change).stops_at_once is False


def test_a_spin_that_dies_and_a_turn_share_the_limits() -> None:
    """In a change of two ramps of t each, the level is w / t; the rest of acceleration and jerk is for the turn."""
    t, angle, limits = 0.5, 0.8, ToolLimits(1.0, 1.0, 9.0, 2.0, 1.0, 20.0)  # twice these when it blends
    for spin in (0.0, 0.6, 1.9):
        bounds = turn_bounds(angle, Change(t, 0.0, t), (0.0, 0.0, spin), (0.0, 0.0, 0.0), limits)
        assert bounds.high == pytest.approx((4.0 - spin / t) * t / angle)
        assert (bounds.low, bounds.by_acceleration, bounds.by_jerk) == pytest.approx((0.0, angle / 2.0, angle / 20.0))
    beyond = turn_bounds(angle, Change(t, 0.0, t), (0.0, 0.0, 2.1), (0.0, 0.0, 0.0), limits)
    assert beyond.low > beyond.high


def test_a_change_of_hours_is_not_looked_for() -> None:
    tried = list[float]()
    with pytest.raises(NoTimes):
        _possible(lambda change: tried.append(change.hold) or inf, Change(0.1, 1.0, 0.1), 0.0)
    assert 5_000.0 < max(tried) <= 10_000.0


@pytest.mark.parametrize(
    ("velocity", "present", "kept"),
    [(0.9, 0.0, True), (1.1, 0.0, False), (0.9, -2.0, True), (-0.9, 2.0, True), (0.2, 3.0, False), (0.9, -9.0, False)],
)
def test_a_change_to_rest_keeps_acceleration_and_jerk_or_not(velocity: float, present: float, *, kept: bool) -> None:
    """With two ramps of 0.5 s, at 2 m/s2 and 6 m/s3, the level is twice the velocity that is left after half the first
    ramp.
    """
    change = Change(0.5, 0.0, 0.5)
    assert keeps(change, (velocity, 0.0, 0.0), (present, 0.0, 0.0), 2.0, 6.0) == kept
