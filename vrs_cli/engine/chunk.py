"""Chunks of time-stamped joints: where the joints are to be at given times, and f for them."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Sequence
from math import isfinite
from typing import TYPE_CHECKING

from vrs_cli.engine.dated import edit_of
from vrs_cli.engine.one_motion import joint_limits
from vrs_cli.engine.planner import place_at, plan_steering
from vrs_cli.engine.problem import NoRoomToStop
from vrs_cli.errors import IllegalValue, TooLate
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.trajectory.instant import LATEST, on_grid
from vrs_cli.trajectory.laws.law import LAWS, NoTimes
from vrs_cli.trajectory.segment import Segment, stay_inside
from vrs_cli.trajectory.state import JointLimits, JointState, Target
from vrs_cli.trajectory.timeline import Cause, Timeline, TimelineDelta
from vrs_cli.values.commands import Motion

if TYPE_CHECKING:
    from vrs_cli.kinematics.arrays import Floats

TICK = on_grid(0.02)  # [s] between the targets that are taken from a chunk
PART = 40  # ticks that are planned at once: about 8 ms
COMPARED = 300  # samples that are compared at once with what was planned: about 8 ms
MAX_SAMPLES = 2000
MAX_SECONDS = 120.0  # from the first sample to the last


class Chunk:
    """Samples at increasing `times` (N,) [s]: `joints` (N, n) [rad, m], put inside the ranges of a robot; `held`: how
    many of the samples were outside. Between samples the joints go on cubics through them (Catmull-Rom).

    Raises IllegalValue for what is no chunk for this robot.
    """

    def __init__(self, model: RobotModel, times: Sequence[float], joints: Sequence[Joints]) -> None:
        import numpy as np

        count = len(times)
        if not 1 <= count <= MAX_SAMPLES:
            raise IllegalValue(f"a chunk of {count} samples", f"1 to {MAX_SAMPLES} samples", value=count)
        if len(joints) != count:
            raise IllegalValue(f"{count} times, and {len(joints)} sets of joints", "one time for each set")
        for k, row in enumerate(joints):
            if len(row) != model.joint_count:
                raise IllegalValue(f"sample {k} of {len(row)} joints", f"the robot has {model.joint_count}")
            if not all(map(isfinite, (times[k], *row))):
                raise IllegalValue(f"sample {k}: a number that is not finite", "finite numbers")
            if k and times[k] <= times[k - 1]:
                raise IllegalValue(f"sample {k} at {times[k]:g} s, not after {times[k - 1]:g} s", "increasing times")
        if times[-1] > LATEST or times[-1] - times[0] > MAX_SECONDS:
            what = f"a chunk from {times[0]:g} to {times[-1]:g} s"
            raise IllegalValue(what, f"it lasts at most {MAX_SECONDS:g} s, and times are up to {LATEST:g} s")
        asked = np.array(joints, dtype=np.float64)
        self.times: Floats = np.array(times, dtype=np.float64)
        self.joints: Floats = np.clip(asked, model.lower, model.upper)
        self.held = int((self.joints != asked).any(axis=1).sum())
        self._slopes: Floats = np.zeros_like(self.joints)
        if count > 1:
            self._slopes = np.gradient(self.joints, self.times, axis=0)

    def since(self, now: float) -> tuple[float, int]:
        """Return when the chunk begins that is followed from `now` on, and how many samples are too late for that.
        Raises TooLate if all are.
        """
        late = bisect_left(self.times.tolist(), now)
        if late == len(self.times):
            said = f"all {late} samples have passed: the last one was for {self.times[-1]:.3f} s"
            raise TooLate(said, f"the robot's clock shows {now:.3f} s: send samples for later times")
        return max(float(self.times[0]), now), late

    def at(self, times: Sequence[float] | Floats) -> Floats:
        """Return the joints at times (M,) [s], those of the ends before the first and after the last sample: (M, n)."""
        import numpy as np

        t = np.clip(times, self.times[0], self.times[-1])
        if len(self.times) == 1:
            return np.repeat(self.joints, len(t), axis=0)
        k = np.clip(np.searchsorted(self.times, t, side="right") - 1, 0, len(self.times) - 2)
        span = (self.times[k + 1] - self.times[k])[:, None]
        s = (t - self.times[k])[:, None] / span
        a, b, u, v = self.joints[k], self.joints[k + 1], span * self._slopes[k], span * self._slopes[k + 1]
        found: Floats = a + s * (u + s * (3.0 * (b - a) - 2.0 * u - v + s * (2.0 * (a - b) + u + v)))
        return found


def tick_count(chunk: Chunk, begin: float) -> int:
    """Return how many targets are taken from a chunk that is followed from `begin` [s] on."""
    return max(round((float(chunk.times[-1]) - begin) / TICK), 1)


def plan_chunk(
    arm: RobotArm, timeline: Timeline, motion: Motion, issued: float, begin: float, chunk: Chunk, ticks: range
) -> TimelineDelta:
    """f for a part of a chunk that is followed from `begin` [s] on: the joints chase its samples tick by tick, and come
    to rest, after the last tick at the last sample; all that was scheduled after the part begins is dropped. Raises
    NoRoomToStop where what is under way has to go on.
    """
    ends = ticks.stop == tick_count(chunk, begin)
    times = [begin + k * TICK for k in range(ticks.start, ticks.stop + 1)]
    places = [tuple(row) for row in chunk.at(times).tolist()]
    place, after = None, timeline
    for t, here, there in zip(times, places, places[1:], strict=False):
        target = Target(here, tuple([(b - a) / TICK for a, b in zip(here, there, strict=True)]))
        try:
            delta = plan_steering(arm, after, motion, t, target, TICK)
        except NoRoomToStop:
            continue
        place = place or place_at(arm, timeline, t)
        after = after.apply(delta)
    if place is None:
        raise NoRoomToStop
    final, stop = len(after), tuple[Segment, ...]()
    if ends:
        last, goal = place_at(arm, after, times[-1]), tuple(chunk.joints[-1].tolist())  # ticks may end before it
        stop = _to_rest(last.here.joints, goal, joint_limits(arm, motion), times[-1], motion)
        final = last.keep if stop else final
    segments, keep, count = tuple([after[k] for k in range(place.keep, final)]) + stop, place.keep, len(timeline)
    events = edit_of(timeline, keep, count, segments, 0.0, inserts=False, own=None) if timeline.event_count else None
    cut, drop = segments[0].start, count - keep
    return TimelineDelta(timeline.version, Cause.COMMAND, motion, issued, cut, cut, keep, drop, 0.0, segments, events)


def _to_rest(state: JointState, goal: Joints, limits: JointLimits, begin: float, motion: Motion) -> tuple[Segment, ...]:
    """Plan from a state to rest at the goal; return nothing where no way keeps the limits, or where it rests there."""
    try:
        segments = LAWS[motion.profile].joint_motion(state, goal, limits, begin, motion, 0.0)
    except NoTimes:
        return ()
    return segments if stay_inside(segments, limits.lower, limits.upper) else ()
