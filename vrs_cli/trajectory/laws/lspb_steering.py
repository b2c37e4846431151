"""Joints that come to rest at constant acceleration, and one tick of steering: the joints chase a target that moves.

Every joint wants the velocity `w + g(e)`: that of its target, and one that takes away the error e within a short time,
but no more than it can brake from on the way: g(e) = e / (2 D), at most sqrt(a |e|). It changes its velocity towards
that within D / 2. Where limits do not matter this is the critically damped law  q'' = e / D^2 + 2 (w - q') / D  for a
target that keeps its velocity w, so it follows such a target without a lag. It is held for one tick, as a parabola.

When no other target comes, the joints coast for a while and then brake. A joint always leaves itself room for both
before the end of its range; so it stays inside whatever comes, if it did at the beginning.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import copysign, sqrt

from vrs_cli.kinematics.joints import Joints
from vrs_cli.trajectory.instant import TICK, up_to_grid
from vrs_cli.trajectory.laws.law import Coming
from vrs_cli.trajectory.polynomial import parabola, value
from vrs_cli.trajectory.segment import JointPath, Path, Phase, Segment, segments_of, stay_inside
from vrs_cli.trajectory.state import JointLimits, JointState, Target
from vrs_cli.values.motion import Motion

RESPONSE = 2.5  # D in ticks: quick, and steady for targets that are known once a tick
COASTING = 1.0  # ticks: how late the next target may come without a jolt
SPARE = 1.0 - 1e-9  # of limits, for rounding


def joint_stops(state: JointState, limits: JointLimits, start: float, motion: Motion) -> Iterator[tuple[Segment, ...]]:
    """The ways to rest: all joints together, or each as fast as it can."""
    yield joint_stop(state, limits, start, motion)
    yield joint_stop_each(state, limits, start, motion)


def joint_stop(state: JointState, limits: JointLimits, start: float, motion: Motion) -> tuple[Segment, ...]:
    """Every joint to rest together, along the present direction."""
    blend = max(map(_stopping_time, state.velocity, limits.acceleration))
    pairs = zip(state.joints, state.velocity, strict=True)
    path = JointPath(tuple(parabola(q, v, 0.0, blend) if blend else (q,) for q, v in pairs))
    return segments_of(start, motion, iter([(blend, Phase.DECELERATE, path)]))


def _stopping_time(velocity: float, acceleration: float) -> float:
    return up_to_grid(abs(velocity) / acceleration)


def joint_stop_each(state: JointState, limits: JointLimits, start: float, motion: Motion) -> tuple[Segment, ...]:
    """Every joint to rest as fast as it can, each in its own time.

    No joint goes farther than it would have to go anyway, so this stays inside joint limits wherever the motion that is
    interrupted would have.
    """
    stops = list(map(_stopping_time, state.velocity, limits.acceleration))
    q, v = list(state.joints), list(state.velocity)
    rates = [0.0 if not stop else -speed / stop for speed, stop in zip(v, stops, strict=True)]
    stretches: list[tuple[float, Phase, Path]] = []
    before = 0.0
    for moment in sorted(set(stops) - {0.0}):
        lasting = moment - before
        path = tuple(
            (p, w, 0.5 * rate) if stop >= moment else (p, 0.0, 0.0)
            for p, w, rate, stop in zip(q, v, rates, stops, strict=True)
        )
        stretches.append((lasting, Phase.DECELERATE, JointPath(path)))
        q = [value(a, lasting) for a in path]
        v = [w + rate * lasting if stop > moment else 0.0 for w, rate, stop in zip(v, rates, stops, strict=True)]
        before = moment
    return segments_of(start, motion, iter(stretches))


def steer(
    state: JointState,
    target: Target,
    limits: JointLimits,
    hardest: JointLimits,
    tick: float,
    start: float,
    motion: Motion,
    _coming: Coming,
) -> tuple[Segment, ...]:
    """A tick [s] towards the target, on the time grid, then coasting and braking to rest; braking at once, at the
    `hardest`, where the motion before has left no room for a whole tick.
    """
    segments = steered(state, _next_velocities(state, target, limits, tick), limits, tick, start, motion)
    return (
        segments
        if stay_inside(segments, limits.lower, limits.upper)
        else joint_stop_each(state, hardest, start, motion)
    )


def steered(
    state: JointState, v1: Joints, limits: JointLimits, tick: float, start: float, motion: Motion
) -> tuple[Segment, ...]:
    """A tick in which the joints come to the velocities v1, then coasting and braking to rest."""
    chase = segments_of(start, motion, _chase(state, v1, tick))
    last = chase[-1]
    assert isinstance(last.path, JointPath)
    after = JointState(last.path.joints(last.duration), v1)
    return (*chase, *_stop(after, limits, last.finish, motion))


def steering_of(segments: Sequence[Segment]) -> Joints | None:
    """The velocities with which `steered` made the segments, if it did."""
    path = segments[0].path
    if segments[0].phase is not Phase.BLEND or not isinstance(path, JointPath):
        return None
    if len(segments) == 1:
        return (0.0,) * len(path.coefficients)
    coast = segments[1].path
    return tuple(row[1] for row in coast.coefficients) if isinstance(coast, JointPath) and coast.degree == 1 else None


def _next_velocities(state: JointState, target: Target, limits: JointLimits, tick: float) -> Joints:
    return tuple(
        _next_velocity(q, v, p, w, v_max * SPARE, a_max * SPARE, low, high, tick)
        for q, v, p, w, v_max, a_max, low, high in zip(
            state.joints,
            state.velocity,
            target.joints,
            target.velocity,
            limits.velocity,
            limits.acceleration,
            limits.lower,
            limits.upper,
            strict=True,
        )
    )


def _chase(state: JointState, v1: Joints, tick: float) -> Iterator[tuple[float, Phase, Path]]:
    path = tuple(map(parabola, state.joints, state.velocity, v1, (tick,) * len(v1)))
    yield tick, Phase.BLEND, JointPath(path)
    if any(v1):
        q = JointPath(path).joints(tick)
        yield COASTING * tick, Phase.CRUISE, JointPath(tuple(zip(q, v1, strict=True)))


def _stop(state: JointState, limits: JointLimits, start: float, motion: Motion) -> tuple[Segment, ...]:
    """All joints together where there is room for that, each in its own time where not."""
    together = joint_stop(state, limits, start, motion)
    if not together:
        return ()
    path = together[-1].path
    assert isinstance(path, JointPath)
    ends = path.joints(together[-1].duration)
    if all(low <= q <= high for q, low, high in zip(ends, limits.lower, limits.upper, strict=True)):
        return together
    return joint_stop_each(state, limits, start, motion)


def _next_velocity(
    q: float, v: float, p: float, w: float, v_max: float, a_max: float, low: float, high: float, tick: float
) -> float:
    """The velocity of a joint at the end of the tick."""
    response = RESPONSE * tick
    error = p - q
    closing = copysign(min(abs(error) / (2.0 * response), sqrt(a_max * abs(error))), error)
    wanted = v + (min(max(w + closing, -v_max), v_max) - v) * min(2.0 * tick / response, 1.0)
    change = a_max * tick
    v1 = min(max(wanted, v - change), v + change)
    fastest = _fastest(high - q, v, a_max, tick)
    if v1 > fastest:
        return max(fastest, v - change)
    slowest = -_fastest(q - low, -v, a_max, tick)
    return min(slowest, v + change) if v1 < slowest else v1


def _fastest(room: float, v: float, a_max: float, tick: float) -> float:
    """The greatest velocity at the end of the tick from which the way to the end of the range is enough:

    (v + v1) tick / 2 + v1 coasting + v1^2 / (2 a) <= room, for v1 >= 0; 0 where there is no such velocity. Braking may
    take an instant of the time grid longer, which is added to the coasting.
    """
    left = room - 0.5 * v * tick
    if left <= 0.0:
        return 0.0
    b = a_max * (tick * (0.5 + COASTING) + TICK)
    return sqrt(b * b + 2.0 * a_max * left) - b
