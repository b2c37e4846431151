"""Straight lines before their joints are known."""

from __future__ import annotations

from random import Random

import pytest

from vrs_cli.kinematics.transform import IDENTITY
from vrs_cli.trajectory.laws.lspb import steer, straight_motion, straight_stop
from vrs_cli.trajectory.polynomial import value
from vrs_cli.trajectory.segment import JointPath, Phase, Segment
from vrs_cli.trajectory.state import JointLimits, JointState, Target, ToolLimits, ToolState
from vrs_cli.values.commands import Motion, MotionKind, Start

LIMITS = ToolLimits(speed=1.0, acceleration=4.0, spin=1.0, spin_acceleration=4.0)
TICK = 1.0 / 64.0  # [s]
MOTION = Motion(1, MotionKind.STEERED, Start.AT)
JOINTS = JointLimits((1.4, 0.9), (4.8, 3.1), lower=(-1.0, -0.5), upper=(1.0, 0.5))
ROUNDING = 1e-9


def test_a_line_takes_no_longer_than_it_must_unless_told() -> None:
    """0.04 m at 4 m/s2 are a triangle of 2 sqrt(D / a)."""
    state, target = ToolState(IDENTITY, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)), IDENTITY._replace(px=0.04)
    assert sum(part.duration for part in straight_motion(state, target, LIMITS)) == pytest.approx(0.2, abs=1e-5)
    assert sum(part.duration for part in straight_motion(state, target, LIMITS, 0.7)) == pytest.approx(0.7, abs=1e-5)


@pytest.mark.parametrize(
    ("speed", "spin", "seconds"),
    [(0.5, 0.0, 0.125), (0.0, 0.6, 0.3), (0.5, 0.6, 0.3), (0.8, 0.1, 0.2)],
)
def test_a_tool_stops_as_soon_as_its_accelerations_allow(speed: float, spin: float, seconds: float) -> None:
    """At 4 m/s2 and 2 rad/s2: the slower of the two says how long it takes."""
    limits = LIMITS._replace(spin_acceleration=2.0)
    stop = straight_stop(ToolState(IDENTITY, (speed, 0.0, 0.0), (0.0, 0.0, spin)), limits)
    assert sum(part.duration for part in stop) == pytest.approx(seconds, abs=1e-5)
    moved = sum(value(part.position[0], part.duration) - part.position[0][0] for part in stop)
    assert moved == pytest.approx(0.5 * speed * seconds, abs=1e-5)


def path(segment: Segment) -> JointPath:
    assert isinstance(segment.path, JointPath)
    return segment.path


def after(segment: Segment) -> JointState:
    return JointState(path(segment).joints(segment.duration), path(segment).velocity(segment.duration))


def test_after_the_tick_it_coasts_for_one_and_brakes_to_rest() -> None:
    segments = steer(
        JointState((0.0, 0.0), (0.2, 0.0)),
        Target((0.5, 0.1), (0.0, 0.0)),
        JOINTS,
        JOINTS,
        TICK,
        0.0,
        MOTION,
        lambda: None,
    )
    assert [segment.phase for segment in segments[:3]] == [Phase.BLEND, Phase.CRUISE, Phase.DECELERATE]
    assert [segment.duration for segment in segments[:2]] == [TICK, TICK]
    assert path(segments[1]).velocity(TICK) == pytest.approx(after(segments[0]).velocity)
    assert after(segments[-1]).velocity == pytest.approx((0.0, 0.0), abs=ROUNDING)


def test_a_target_that_moves_is_followed_without_a_lag() -> None:
    state, w = JointState((0.0, 0.0), (0.0, 0.0)), (0.3, -0.2)
    for k in range(90):
        target = Target((0.05 + w[0] * k * TICK, w[1] * k * TICK), w)
        state = after(steer(state, target, JOINTS, JOINTS, TICK, k * TICK, MOTION, lambda: None)[0])
    assert state.joints == pytest.approx((0.05 + w[0] * 90 * TICK, w[1] * 90 * TICK), abs=1e-6)
    assert state.velocity == pytest.approx(w, abs=1e-5)


@pytest.mark.parametrize("seed", range(10))
def test_wherever_targets_jump_limits_and_ranges_are_kept(seed: int) -> None:
    random, state = Random(seed), JointState((0.0, 0.0), (0.0, 0.0))
    for k in range(80):
        if k % 10 == 0:
            p, w = (tuple(random.uniform(-most, most) for _ in range(2)) for most in (1.5, 2.0))
        segments = steer(state, Target(p, w), JOINTS, JOINTS, TICK, k * TICK, MOTION, lambda: None)
        for segment in segments:
            for s in (0.0, 0.5 * segment.duration, segment.duration):
                rows = zip(
                    path(segment).joints(s),
                    path(segment).velocity(s),
                    JOINTS.lower,
                    JOINTS.upper,
                    JOINTS.velocity,
                    strict=True,
                )
                for q, v, low, high, fastest in rows:
                    assert low - ROUNDING <= q <= high + ROUNDING
                    assert abs(v) <= fastest * (1.0 + ROUNDING)
            for a, most in zip(path(segment).acceleration(0.0), JOINTS.acceleration, strict=True):
                assert abs(a) <= most * (1.0 + 1e-6)
        state = after(segments[0])


def test_a_fast_arm_that_stands_goes_as_far_as_a_long_tick_lets_it() -> None:
    """Braking ends on an instant of the time grid, and may take that much longer than its velocity needs."""
    random, still = Random(6), (0.0,)
    for _ in range(300):
        room, acceleration = random.uniform(1.0, 8.0), random.uniform(10.0, 40.0)
        limits = JointLimits((random.uniform(4.0, 10.0),), (acceleration,), lower=(-room,), upper=(9.0,))
        target = Target((-room,), (random.uniform(-9.0, 0.0),))
        segments = steer(
            JointState((0.0,), still), target, limits, limits, random.uniform(0.2, 0.5), 0.0, MOTION, lambda: None
        )
        assert segments[0].phase is Phase.BLEND
        assert path(segments[0]).velocity(segments[0].duration) < still
        assert all(path(segment).stays_inside(limits.lower, limits.upper, segment.duration) for segment in segments)
