"""Tests of one tick of jerk-limited steering, and of its parts."""

from __future__ import annotations

from random import Random

import pytest

from vrs_cli.kinematics.joints import Profile
from vrs_cli.trajectory.laws.law import ramps
from vrs_cli.trajectory.laws.scurve_steering import (
    STOPPING_PART,
    Joint,
    _beyond,
    _brakable,
    _jerk,
    _stopping_change,
    joint_pieces,
    state_after,
    steer,
)
from vrs_cli.trajectory.segment import JointPath, Phase
from vrs_cli.trajectory.state import JointLimits, JointState, Target
from vrs_cli.values.commands import Motion, MotionKind, Start

TICK = 1.0 / 64.0  # [s]
MOTION = Motion(1, MotionKind.STEERED, Start.AT, profile=Profile.SCURVE)
LIMITS = JointLimits((1.4, 0.9), (4.8, 3.1), (48.0, 31.0), (1.4, 0.9), (-1.0, -0.5), (1.0, 0.5))
AT_REST = Joint(q=0.0, v=0.0, a=0.0, p=0.0, w=0.0, v_max=1.4, a_max=4.8, j_max=48.0, peak=1.4, low=-1.0, high=1.0)


def some(random: Random) -> Joint:
    """Return a joint in any state inside its limits, sometimes next to an end of its range."""
    q, v, a, p, w = (random.uniform(-most, most) for most in (1.0, 1.4, 4.8, 1.5, 1.4))
    return AT_REST._replace(q=q, v=v, a=a, p=p, w=w)


def mirrored(one: Joint) -> Joint:
    q, v, a, p, w = (0.0 - x for x in one[:5])
    return one._replace(q=q, v=v, a=a, p=p, w=w, low=-one.high, high=-one.low)


def test_down_is_up_in_a_mirror() -> None:
    random, met = Random(3), set[int]()
    for _ in range(2000):
        one, jerk = some(random), random.uniform(-48.0, 48.0)
        beyond = _beyond(one, jerk, TICK)
        assert _beyond(mirrored(one), -jerk, TICK) == -beyond
        chosen = _jerk(one, TICK)
        assert _jerk(mirrored(one), TICK) == (None if chosen is None else pytest.approx(-chosen, abs=1e-9))
        met.add(beyond)
    assert met == {-1, 0, 1}


@pytest.mark.parametrize(("v", "a", "beyond"), [(1.0, 4.0, 0), (1.3, 4.0, 1), (1.39, -4.0, 0), (-1.3, -4.0, -1)])
def test_too_fast_is_what_is_too_fast_once_the_acceleration_has_gone(v: float, a: float, beyond: int) -> None:
    """The velocity grows or falls by a^2 / (2 STOPPING_PART j) = 0.21 rad/s; the state before has the same
    acceleration.
    """
    one = AT_REST._replace(v=v - a * TICK, a=a, low=-9.0, high=9.0)
    assert 0.5 * a * a / (STOPPING_PART * 48.0) == pytest.approx(0.21, abs=0.01)
    assert _beyond(one, 0.0, TICK) == beyond


@pytest.mark.parametrize("v", [0.7, -0.2, 1e-6, 0.0])
def test_the_pieces_of_a_change_end_at_rest(v: float) -> None:
    state = (0.0, v, 0.0)
    for duration, jerk in ramps(0.3, 0.04).pieces(v, 0.0, 0.0):
        state = state_after(*state, duration, jerk)
    assert state[1:] == pytest.approx((0.0, 0.0), abs=1e-12)


def test_what_begins_in_the_tick_is_no_stop_yet() -> None:
    state = JointState((0.0,), (0.1,), (0.0,))
    pieces = [((0.5 * TICK, 1.0), (TICK, -0.5), (1.0, 0.0))]
    assert [phase for _, phase, _ in joint_pieces(state, pieces, TICK)] == [
        Phase.BLEND,
        Phase.BLEND,
        Phase.DECELERATE,
    ]


def test_a_target_that_moves_is_followed_without_a_lag() -> None:
    state, w = JointState((0.0, 0.0), (0.0, 0.0)), (0.3, -0.15)
    for k in range(120):
        target = Target((0.05 + w[0] * k * TICK, w[1] * k * TICK), w)
        tick, coasting, *stop = steer(state, target, LIMITS, LIMITS, TICK, k * TICK, MOTION, lambda: None)
        assert (tick.phase, tick.duration) == (Phase.BLEND, TICK)
        assert coasting.phase is Phase.CRUISE
        assert coasting.duration >= TICK
        end = stop[-1]
        assert isinstance(end.path, JointPath)
        assert end.path.velocity(end.duration) == pytest.approx((0.0, 0.0), abs=1e-9)
        path = tick.path
        assert isinstance(path, JointPath)
        state = JointState(path.joints(TICK), path.velocity(TICK), path.acceleration(TICK))
    assert state.joints == pytest.approx((0.05 + w[0] * 120 * TICK, w[1] * 120 * TICK), abs=1e-4)
    assert state.velocity == pytest.approx(w, abs=1e-3)


def test_joints_that_stop_together_keep_the_limits_of_each() -> None:
    random = Random(5)
    for _ in range(200):
        joints = [AT_REST._replace(a_max=random.uniform(1.0, 9.0), j_max=random.uniform(5.0, 90.0)) for _ in range(3)]
        velocities = [random.uniform(-1.4, 1.4) for _ in joints]
        change = _stopping_change(joints, velocities)
        for one, v in zip(joints, velocities, strict=True):
            level = abs(change.level(v, 0.0, 0.0))
            assert level <= STOPPING_PART * one.a_max * (1.0 + 1e-6)
            assert level <= STOPPING_PART * one.j_max * min(change.rise, change.fall) * (1.0 + 1e-6)


@pytest.mark.parametrize("way", [1e-4, 0.01, 0.04, 0.05, 0.3, 2.0])
def test_a_joint_stops_on_the_way_that_it_has(way: float) -> None:
    v = _brakable(way, 4.8, 48.0)
    ramps_alone = v < 4.8 * 4.8 / 48.0  # full acceleration is not reached
    taken = v * (v / 48.0) ** 0.5 if ramps_alone else 0.5 * v * (v / 4.8 + 4.8 / 48.0)
    assert taken == pytest.approx(way)
