"""Tests of LSPB: the times of a motion, lines before their joints are known, stops and steering."""

from __future__ import annotations

from math import dist, hypot, inf
from random import Random

import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st
from msgspec import structs

from tests.examples import examples
from vrs_cli.kinematics.transform import IDENTITY
from vrs_cli.trajectory.instant import TICK
from vrs_cli.trajectory.laws.law import Blend, Course
from vrs_cli.trajectory.laws.lspb import (
    Component,
    from_motion,
    from_rest,
    scalar_demands,
    steer,
    straight_motion,
    straight_stop,
    vector_demands,
)
from vrs_cli.trajectory.polynomial import value
from vrs_cli.trajectory.segment import JointPath, Phase, Segment
from vrs_cli.trajectory.state import JointLimits, JointState, Target, ToolLimits, ToolState
from vrs_cli.values.commands import Motion, MotionKind, Start

LIMITS = ToolLimits(speed=1.0, acceleration=4.0, spin=1.0, spin_acceleration=4.0)
STEER_TICK = 1.0 / 64.0  # [s]
MOTION = Motion(1, MotionKind.STEERED, Start.AT)
JOINTS = JointLimits((1.4, 0.9), (4.8, 3.1), lower=(-1.0, -0.5), upper=(1.0, 0.5))
ROUNDING = 1e-9


def test_a_line_takes_no_longer_than_it_must_unless_told() -> None:
    """On 0.04 m at 4 m/s2 the velocity is a triangle, which lasts 2 sqrt(D / a)."""
    state, target = ToolState(IDENTITY, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)), IDENTITY._replace(px=0.04)
    assert sum(part.duration for part in straight_motion(state, target, LIMITS)) == pytest.approx(0.2, abs=1e-5)
    assert sum(part.duration for part in straight_motion(state, target, LIMITS, 0.7)) == pytest.approx(0.7, abs=1e-5)


@pytest.mark.parametrize(
    ("speed", "spin", "seconds"),
    [(0.5, 0.0, 0.125), (0.0, 0.6, 0.3), (0.5, 0.6, 0.3), (0.8, 0.1, 0.2)],
)
def test_a_tool_stops_as_soon_as_its_accelerations_allow(speed: float, spin: float, seconds: float) -> None:
    """At 4 m/s2 and 2 rad/s2 the slower of the two determines the time."""
    limits = structs.replace(LIMITS, spin_acceleration=2.0)
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
        STEER_TICK,
        0.0,
        MOTION,
        lambda: None,
    )
    assert [segment.phase for segment in segments[:3]] == [Phase.BLEND, Phase.CRUISE, Phase.DECELERATE]
    assert [segment.duration for segment in segments[:2]] == [STEER_TICK, STEER_TICK]
    assert path(segments[1]).velocity(STEER_TICK) == pytest.approx(after(segments[0]).velocity)
    assert after(segments[-1]).velocity == pytest.approx((0.0, 0.0), abs=ROUNDING)


def test_a_target_that_moves_is_followed_without_a_lag() -> None:
    state, w = JointState((0.0, 0.0), (0.0, 0.0)), (0.3, -0.2)
    for k in range(90):
        target = Target((0.05 + w[0] * k * STEER_TICK, w[1] * k * STEER_TICK), w)
        state = after(steer(state, target, JOINTS, JOINTS, STEER_TICK, k * STEER_TICK, MOTION, lambda: None)[0])
    assert state.joints == pytest.approx((0.05 + w[0] * 90 * STEER_TICK, w[1] * 90 * STEER_TICK), abs=1e-6)
    assert state.velocity == pytest.approx(w, abs=1e-5)


@pytest.mark.parametrize("seed", range(10))
def test_wherever_targets_jump_limits_and_ranges_are_kept(seed: int) -> None:
    random, state = Random(seed), JointState((0.0, 0.0), (0.0, 0.0))
    for k in range(80):
        if k % 10 == 0:
            p, w = (tuple(random.uniform(-most, most) for _ in range(2)) for most in (1.5, 2.0))
        segments = steer(state, Target(p, w), JOINTS, JOINTS, STEER_TICK, k * STEER_TICK, MOTION, lambda: None)
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
    """Braking ends on an instant of the time grid, so it may take that much longer than the velocity needs."""
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


TIME_ROUNDING = 1e-5

displacements = st.floats(-3.0, 3.0)
parts = st.builds(
    Component,
    displacement=displacements,
    velocity=st.floats(-1.0, 1.0),
    max_velocity=st.floats(1.0, 4.0),
    max_acceleration=st.floats(1.0, 12.0),
    max_jerk=st.just(inf),
)


def test_trapezium_from_rest() -> None:
    # 2 rad at 1 rad/s and 2 rad/s2: half a second of acceleration, 1.5 s of cruise (Craig 7.3)
    times = from_rest([Component(2.0, 0.0, 1.0, 2.0)])
    assert (times.change.lasts, times.cruise, times.slow.lasts) == pytest.approx((0.5, 1.5, 0.5), abs=1e-6)


def test_triangle_from_rest() -> None:
    # too short to reach full velocity: t = 2 sqrt(D / a)
    times = from_rest([Component(0.5, 0.0, 10.0, 2.0)])
    assert times.cruise == 0.0
    assert times.total == pytest.approx(1.0, abs=1e-5)


def test_nothing_to_do_takes_no_time() -> None:
    assert from_rest([Component(0.0, 0.0, 1.0, 1.0)]) == Course(Blend(0.0), 0.0, Blend(0.0))


def test_least_time_is_kept_and_not_much_more() -> None:
    times = from_rest([Component(0.5, 0.0, 10.0, 2.0)], 3.0)
    assert 3.0 <= times.total <= 3.0001


def test_slowest_joint_decides() -> None:
    alone = from_rest([Component(2.0, 0.0, 1.0, 2.0)])
    together = from_rest([Component(2.0, 0.0, 1.0, 2.0), Component(0.1, 0.0, 1.0, 2.0)])
    assert together == alone


@given(st.lists(parts, min_size=1, max_size=6), st.sampled_from([0.0, 0.0, 0.5, 5.0]))
@example([Component(-0.041252925571132054, -0.6656499636299109, 3.6056194429887514, 5.370405472935195)], 0.5)  # no room
@example([Component(3.320783095527391e-07, 0.00178, 0.16, 4.770566622117834)], 2.5)  # nearly there, told to take time
@examples(200)
def test_limits_and_target_from_motion(components: list[Component], least: float) -> None:
    times = from_motion(components, least)
    assert times.total >= least - 1e-6
    blend, slow = times.change.lasts, times.slow.lasts
    for time in (blend, times.cruise, slow):
        assert time >= 0.0
        assert time % TICK == 0.0
    for c in components:
        v1 = 0.0 if times.stops_at_once else (c.displacement - 0.5 * c.velocity * blend) / times.reach
        assert abs(v1) <= c.max_velocity * (1 + TIME_ROUNDING)
        assert abs(v1 - c.velocity) <= c.max_acceleration * blend * (1 + TIME_ROUNDING) + 1e-12
        assert abs(v1) <= c.max_acceleration * slow * (1 + TIME_ROUNDING) + 1e-12
        way = 0.5 * blend * (c.velocity + v1) + v1 * (times.cruise + 0.5 * slow)
        assert way == pytest.approx(c.displacement, abs=1e-9)


@given(st.lists(parts, min_size=2, max_size=3))
@example([Component(0.0, 0.0, 1.0, 1.0), Component(0.41015625, 0.9140625, 1.0, 1.0)])  # hardly too fast
@examples(60)
def test_near_the_shortest_time(components: list[Component]) -> None:
    """The time is within a fifth of the best of 2,000 blend times tried one by one (typically within 2 %)."""
    demands = scalar_demands(components)
    best = inf
    for k in range(1, 2000):
        blend = k * 0.004
        low, high, slowing = demands(blend)
        if slowing > 0.0:
            high = min(high, ((blend * blend + 8 * slowing) ** 0.5 - blend) / (2 * slowing))
            if high > 0.0 and high >= low:
                best = min(best, 1 / high + 0.5 * (blend + slowing * high))
    assert from_motion(components).total <= best * 1.2 + 1e-6


def test_a_blend_that_leads_to_the_target_too_fast_to_stop_there_is_none() -> None:
    low, high, _ = scalar_demands([Component(0.05, 1.0, 2.0, 2.0)])(0.1)  # 0.1 s at 1 m/s on average, 2 m/s2 to stop
    assert low > high


def test_a_blend_that_ends_on_the_target_too_fast_is_impossible() -> None:
    """No way is left, but the acceleration cannot remove the velocity in that time."""
    for acceleration, possible in ((0.5, False), (2.0, True)):
        demand = scalar_demands([Component(0.5, 1.0, 4.0, acceleration)])(1.0)
        assert (demand.low <= demand.high) == possible


def test_a_tool_that_is_there_when_its_velocity_has_gone() -> None:
    way, velocity = (0.1, 0.0, 0.0), (0.4, 0.0, 0.0)  # 0.4 m/s gone in 0.5 s leads 0.1 m on
    limits = ToolLimits(1.0, 2.0, 1.0, 1.0, blending=1.0)
    assert vector_demands(way, velocity, limits)(0.5) == (0.0, inf, 0.0)
    low, high, _ = vector_demands(way, velocity, structs.replace(limits, blending=0.25))(0.5)
    assert low > high


@given(
    st.tuples(displacements, displacements, displacements), st.tuples(*[st.floats(-1.0, 1.0)] * 3), st.floats(0.0, 3.0)
)
def test_the_bounds_of_a_vector_are_where_its_limits_are(
    way: tuple[float, float, float], velocity: tuple[float, float, float], u: float
) -> None:
    limits, blend = ToolLimits(2.0, 6.0, 1.0, 1.0, blending=4.0 / 6.0), 0.4
    low, high, slowing = vector_demands(way, velocity, limits)(blend)
    assume(all(abs(u - edge) > 1e-6 for edge in (low, high)))
    v1 = [u * (d - 0.5 * v * blend) for d, v in zip(way, velocity, strict=True)]
    kept = hypot(*v1) <= 2.0 and dist(v1, velocity) <= 4.0 * blend
    assert kept == (low < u < high)
    assert not kept or slowing * u == pytest.approx(hypot(*v1) / 6.0, abs=1e-9)
