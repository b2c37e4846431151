"""Joints that come to rest at constant acceleration, whatever they do now."""

from __future__ import annotations

from collections.abc import Iterator

from vrs_cli.trajectory.instant import up_to_grid
from vrs_cli.trajectory.limits import JointLimits
from vrs_cli.trajectory.polynomial import parabola, value
from vrs_cli.trajectory.segment import JointPath, Path, Phase, Segment, segments_of
from vrs_cli.trajectory.state import JointState
from vrs_cli.values.motion import Motion


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
