"""Steering, whatever the targets: position and velocity are continuous, and no limit is exceeded."""

from __future__ import annotations

from math import radians

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.laws.motion_laws import check_continuous, check_limits
from tests.laws.test_motion_laws import MODEL
from vrs_cli.engine.commands import JointTarget, Move
from vrs_cli.engine.engine import Engine
from vrs_cli.trajectory.steered import Target

TICK = 0.02

parts = st.tuples(*[st.sampled_from([0.0, 1.0]) | st.floats(0.0, 1.0)] * 6)
velocities = st.tuples(*[st.floats(-3.0, 3.0)] * 6)
lateness = st.sampled_from([0.2, 0.99, 1.0, 1.0, 1.0, 1.0, 1.3, 2.5, 20.0])  # of a tick
stretches = st.tuples(parts, velocities, st.integers(1, 25), lateness, st.sampled_from([1.0, 1.0, 0.3]))


def joints(part: tuple[float, ...]) -> tuple[float, ...]:
    return tuple(low + (high - low) * f for f, low, high in zip(part, MODEL.lower, MODEL.upper, strict=True))


@settings(max_examples=80, deadline=None, suppress_health_check=list(HealthCheck), derandomize=True)
@given(parts, st.floats(0.0, 1.5), st.lists(stretches, min_size=1, max_size=6))
def test_every_stream_keeps_the_laws(
    start: tuple[float, ...],
    begin: float,
    stream: list[tuple[tuple[float, ...], tuple[float, ...], int, float, float]],
) -> None:
    engine = Engine(MODEL)
    engine.perform(Move(JointTarget(joints(start)), straight=False), program=True)
    engine.clock.advance(begin)
    for part, velocity, count, late, speed in stream:
        for _ in range(count):
            engine.steer(Target(joints(part), velocity), TICK, speed=speed)
            engine.clock.advance(engine.now + late * TICK)
    check_continuous(engine, engine.timeline)
    check_limits(engine, engine.timeline)


@settings(max_examples=60, deadline=None, suppress_health_check=list(HealthCheck), derandomize=True)
@given(parts, parts)
def test_a_target_that_stands_is_reached(start: tuple[float, ...], part: tuple[float, ...]) -> None:
    engine = Engine(MODEL, start=joints(start))
    goal = joints(part)
    for _ in range(600):
        engine.steer(Target(goal, (0.0,) * 6), TICK)
        engine.clock.advance(engine.now + TICK)
    reached = engine.position(engine.end).joints
    assert max(abs(a - b) for a, b in zip(reached, goal, strict=True)) < radians(1e-3)
