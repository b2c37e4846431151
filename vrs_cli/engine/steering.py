"""Plan the motion for streamed targets: a target for each tick of time, or a chunk of time-stamped joints."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterator, Sequence
from contextlib import suppress
from functools import partial
from math import isfinite
from typing import TYPE_CHECKING

from msgspec import structs

from vrs_cli.engine.planner import cut_at, drop_rest
from vrs_cli.engine.problem import NoRoomToStop, Problem
from vrs_cli.engine.single_motion import hardest_limits, joint_limits, plan_stop
from vrs_cli.errors import IllegalValue, TooLate
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.trajectory.instant import LATEST, TICKS_PER_SECOND, on_grid
from vrs_cli.trajectory.laws.law import LAWS, NoTimes, Row
from vrs_cli.trajectory.polynomial import Polynomial, taylor_shift
from vrs_cli.trajectory.segment import JointPath, Segment, stay_inside
from vrs_cli.trajectory.state import JointState, Target
from vrs_cli.trajectory.timeline import Timeline, TimelineDelta
from vrs_cli.values.commands import Motion

if TYPE_CHECKING:
    from vrs_cli.kinematics.arrays import Floats

CUBIC = 3  # degree of a path of constant jerk
TICK = on_grid(0.02)  # [s] time between the targets that are taken from a chunk
TICKS_AT_ONCE = 40  # number of ticks planned at once: about 8 ms of CPU
SAMPLES_AT_ONCE = 300  # number of samples compared with the plan at once: about 8 ms of CPU
MAX_SAMPLES = 2000
MAX_SECONDS = 120.0  # maximum duration from the first sample to the last [s]


def plan_steering(
    arm: RobotArm, timeline: Timeline, motion: Motion, executed: float, target: Target, tick: float
) -> TimelineDelta:
    """Plan the motion for a moving target: starting at `executed`, the joints move towards it for a tick [s], then
    stop. Later motions are dropped. Raises NoRoomToStop if the motion in progress must continue.
    """
    cut = cut_at(arm, timeline, executed)
    steer, coming = LAWS[motion.profile].steer, partial(_coming_rows, timeline, cut.keep, executed)
    limits = joint_limits(arm, motion)
    limits = structs.replace(limits, lower=target.lower or limits.lower, upper=target.upper or limits.upper)
    segments = steer(cut.here.joints, target, limits, hardest_limits(arm), tick, executed, motion, coming)
    segments = segments or plan_stop(Problem(arm, cut.here, motion, executed))
    return drop_rest(timeline, cut.keep, segments, motion, executed, executed)


def _coming_rows(timeline: Timeline, keep: int, t: float) -> list[list[Row]] | None:
    """Return the cubics that are already planned for each joint from t [s] until the robot is at rest.

    None if the robot is at rest already, or if the motion is not jerk-limited or not in joint space.
    """
    cubics: list[list[Row]] = []
    for segment in _segments_under_way(timeline, keep, t):
        begin, path = max(segment.start, t), segment.path
        if not (LAWS[segment.motion.profile].smooth and isinstance(path, JointPath) and path.degree <= CUBIC):
            return None
        ends = [_row(segment.finish - t, (q, 0.0, 0.0, 0.0)) for q in path.joints(segment.duration)]
        cubics = [rows[:-1] for rows in cubics] or [[] for _ in ends]
        for rows, row, end in zip(cubics, path.coefficients, ends, strict=True):
            cubic = taylor_shift((*row, 0.0, 0.0, 0.0)[: CUBIC + 1], begin - segment.start)
            rows.extend((_row(begin - t, cubic), end))
    return cubics or None


def _row(t: float, cubic: Polynomial) -> Row:
    """Make the row of a cubic that a joint follows from t [s] on."""
    q, v, half, sixth = cubic
    return round(t * TICKS_PER_SECOND), t, q, v, half, sixth


def _segments_under_way(timeline: Timeline, keep: int, t: float) -> Iterator[Segment]:
    """Yield the consecutive segments from t [s] on, until the robot is at rest or a gap follows."""
    end = t
    for index in range(keep - 1, len(timeline)):
        segment = timeline[index]
        if segment.start > end:
            return
        if segment.finish > t:
            yield segment
            end, path = segment.finish, segment.path
            if isinstance(path, JointPath):
                s = segment.duration
                if JointState(path.joints(s), path.velocity(s), path.acceleration(s)).at_rest:
                    return


class Chunk:
    """Samples at increasing `times` (N,) [s]: `joints` (N, n) [rad, m], limited to the ranges of a robot; `held`: the
    number of samples that were outside these ranges. Between samples the joints follow cubics (Catmull-Rom splines).

    Raises IllegalValue for samples that do not fit this robot.
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
        """Return the start time of the chunk [s] if the robot begins to follow it at time `now` [s], and the number of
        samples that are then too late. Raises TooLate if all samples are too late.
        """
        late = bisect_left(self.times.tolist(), now)
        if late == len(self.times):
            said = f"all {late} samples have passed: the last one was for {self.times[-1]:.3f} s"
            raise TooLate(said, f"the robot's clock shows {now:.3f} s: send samples for later times")
        return max(float(self.times[0]), now), late

    def at(self, times: Sequence[float] | Floats) -> Floats:
        """Return the joints at times (M,) [s], as an array (M, n). Before the first sample they are those of the first
        sample, after the last sample those of the last.
        """
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
    """Return the number of ticks, each with one target, in a chunk that is followed from `begin` [s] on."""
    return max(round((float(chunk.times[-1]) - begin) / TICK), 1)


def plan_chunk(
    arm: RobotArm, timeline: Timeline, motion: Motion, issued: float, begin: float, chunk: Chunk, ticks: range
) -> TimelineDelta:
    """Plan the motion for the given ticks of a chunk that is followed from `begin` [s] on: the joints follow its
    samples tick by tick, and after the last tick come to rest at the last sample. Motions scheduled after the start of
    this part are dropped. Raises NoRoomToStop if the motion in progress must continue.
    """
    ends = ticks.stop == tick_count(chunk, begin)
    times = [begin + k * TICK for k in range(ticks.start, ticks.stop + 1)]
    places = [tuple(row) for row in chunk.at(times).tolist()]
    cut, after = None, timeline
    for t, here, there in zip(times, places, places[1:], strict=False):
        target = Target(here, tuple([(b - a) / TICK for a, b in zip(here, there, strict=True)]))
        try:
            delta = plan_steering(arm, after, motion, t, target, TICK)
        except NoRoomToStop:
            continue
        cut = cut or cut_at(arm, timeline, t)
        after = after.apply(delta)
    if cut is None:
        raise NoRoomToStop
    final, stop = len(after), tuple[Segment, ...]()
    if ends:
        # stop at the last sample even if the ticks end earlier
        last, goal = (cut_at(arm, after, times[-1]), tuple(chunk.joints[-1].tolist()))
        limits = joint_limits(arm, motion)
        with suppress(NoTimes):
            found = LAWS[motion.profile].joint_motion(last.here.joints, goal, limits, times[-1], motion, 0.0)
            stop = found if stay_inside(found, limits.lower, limits.upper) else ()
        final = last.keep if stop else final
    segments = tuple([after[k] for k in range(cut.keep, final)]) + stop
    return drop_rest(timeline, cut.keep, segments, motion, issued, segments[0].start)
