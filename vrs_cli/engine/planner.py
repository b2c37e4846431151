"""The trajectory generation function f: a motion command edits the timeline.

f(theta; p, t, v; tau[k]) -> TimelineDelta. The motion in force at the execution time is truncated there and gives way
to the new one, which starts from the present position and velocity. Motions scheduled later stay: the next is planned
again from the new place to its own target, and so on as long as one blends into the next; from the first boundary
whose position and velocity are what they were, segments are only shifted in time.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from functools import cached_property, partial

from msgspec import Struct, structs

from vrs_cli.engine.dated import edit_of
from vrs_cli.engine.one_motion import (
    hardest_limits,
    joint_limits,
    plan_corner,
    plan_motion,
    plan_stop,
    rounding_begins,
    slowing_down,
)
from vrs_cli.engine.problem import SLOWEST, Here, NoRoomToStop, Problem, rest_after, state_at
from vrs_cli.engine.targets import retarget
from vrs_cli.errors import MotionError
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.joints import largest_change
from vrs_cli.trajectory.instant import TICKS_PER_SECOND, up_to_grid
from vrs_cli.trajectory.laws.law import LAWS, Row
from vrs_cli.trajectory.polynomial import Polynomial, shifted
from vrs_cli.trajectory.segment import JointPath, Phase, Segment, rest
from vrs_cli.trajectory.state import JointState, Target
from vrs_cli.trajectory.timeline import Cause, Timeline, TimelineDelta
from vrs_cli.values.commands import Event, Motion, Start

SAME_PLACE = 1e-9  # [rad, m] two places that are one
CUBIC = 3  # degree of a path of constant jerk


def plan(
    arm: RobotArm,
    timeline: Timeline,
    motion: Motion,
    issued: float,
    executed: float,
    *,
    insert: bool = True,
    slowest: float = SLOWEST,
    event: Event | None = None,
) -> TimelineDelta:
    """f: the change of the timeline that lets `motion` start at `executed` [s]: cut, plan, plan the next again, shift.

    `insert` false: what was scheduled after it is dropped. `event`: comes with the motion, when that begins. Raises
    MotionError when the motion, or a scheduled one that would have to be planned again, is not possible; the message
    names the latter.
    """
    place = place_at(arm, timeline, executed)
    cut, segments = _plan_new(timeline, place, Problem(arm, place.here, motion, executed, slowest))
    begun = segments[0].start if motion.start is Start.BLEND else executed
    return _delta(arm, timeline, cut, segments, motion, (issued, begun), insert=insert, slowest=slowest, event=event)


def plan_by_way_of(
    arm: RobotArm,
    timeline: Timeline,
    way: Motion,
    motion: Motion,
    issued: float,
    executed: float,
    leaves: float,
    *,
    slowest: float = SLOWEST,
) -> tuple[TimelineDelta, float]:
    """f for a motion by way of the end of another one, `way`, where the robot stands until `leaves` [s] at least.
    Return the change, which is of `motion` alone, and when the robot comes to that place [s]. Raises MotionError.
    """
    place = place_at(arm, timeline, executed)
    cut, first = _plan_new(timeline, place, Problem(arm, place.here, way, executed, slowest))
    comes, here = first[-1].finish, rest_after(arm, first[-1])
    segments = tuple([structs.replace(segment, motion=motion) for segment in first])
    if leaves > comes:
        segments += (rest(here.joints.joints, up_to_grid(leaves) - comes, comes, motion),)
    segments += plan_motion(Problem(arm, here, motion, segments[-1].finish, slowest))
    return _delta(arm, timeline, cut, segments, motion, (issued, executed), slowest=slowest), comes


def _delta(
    arm: RobotArm,
    timeline: Timeline,
    cut: CutPlace,
    segments: tuple[Segment, ...],
    motion: Motion,
    times: tuple[float, float],
    *,
    insert: bool = True,
    slowest: float,
    event: Event | None = None,
) -> TimelineDelta:
    """Return the change that puts segments in the place of the motion that a cut interrupts; motions after it are
    planned again and shifted. `times`: issued and executed [s].
    """
    tail = _Tail.of(timeline, cut.keep).after(cut.interrupted) if insert else _Tail.of(timeline, len(timeline))
    edit = _Edit(arm, slowest, cut, segments, tail, insert, event)
    while edit.changes_the_next:
        edit = edit.with_the_next_planned_again()
    return edit.delta(motion, *times)


def plan_steering(
    arm: RobotArm, timeline: Timeline, motion: Motion, executed: float, target: Target, tick: float
) -> TimelineDelta:
    """f for a target that moves: the joints chase it from `executed` on, for a tick [s]; all that was scheduled after
    that is dropped. Raises NoRoomToStop where what is under way has to go on.
    """
    place = place_at(arm, timeline, executed)
    steer, coming = LAWS[motion.profile].steer, partial(_coming, timeline, place.keep, executed)
    here, limits = place.here.joints, joint_limits(arm, motion)
    limits = limits._replace(lower=target.lower or limits.lower, upper=target.upper or limits.upper)
    segments = steer(here, target, limits, hardest_limits(arm), tick, executed, motion, coming)
    segments = segments or plan_stop(Problem(arm, place.here, motion, executed))
    edit = _Edit(arm, SLOWEST, place, segments, _Tail.of(timeline, len(timeline)), inserts=False)
    return edit.delta(motion, executed, executed)


def _coming(timeline: Timeline, keep: int, t: float) -> list[list[Row]] | None:
    """What each joint was to do from t [s] on until the robot rests; None where it stands already, or where that is not
    jerk-limited, or not in joint space.
    """
    ways: list[list[Row]] = []
    for segment in _under_way(timeline, keep, t):
        begin, path = max(segment.start, t), segment.path
        if not (LAWS[segment.motion.profile].smooth and isinstance(path, JointPath) and path.degree <= CUBIC):
            return None
        ends = [_row(segment.finish - t, (q, 0.0, 0.0, 0.0)) for q in path.joints(segment.duration)]
        ways = [way[:-1] for way in ways] or [[] for _ in ends]
        for way, row, end in zip(ways, path.coefficients, ends, strict=True):
            cubic = shifted((*row, 0.0, 0.0, 0.0)[: CUBIC + 1], begin - segment.start)
            way.extend((_row(begin - t, cubic), end))
    return ways or None


def _row(t: float, cubic: Polynomial) -> Row:
    q, v, half, sixth = cubic
    return round(t * TICKS_PER_SECOND), t, q, v, half, sixth


def _under_way(timeline: Timeline, keep: int, t: float) -> Iterator[Segment]:
    """The segments from t [s] on that follow each other without a gap, until the robot rests."""
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


class CutPlace(Struct, frozen=True):
    """Where a time cuts the timeline: after `keep` segments, the state then, and the motion that is interrupted.

    That is the motion of the first segment that ends later, also when it would begin just then: the later command
    counts. None in a gap and after the end.
    """

    keep: int
    here: Here
    interrupted: Motion | None


def place_at(arm: RobotArm, timeline: Timeline, t: float) -> CutPlace:
    """Cut the timeline at a time."""
    keep = timeline.index_at(t) + 1
    segment = timeline[keep - 1]
    while keep > 1 and segment.start >= t and segment.duration > 0.0:
        keep -= 1  # of segments of no length those at t have happened
        segment = timeline[keep - 1]
    here = state_at(arm, segment, min(t - segment.start, segment.duration))
    if segment.finish > t:
        return CutPlace(keep, here, segment.motion)
    if keep == len(timeline) or (after := timeline[keep]).start > t:
        return CutPlace(keep, here.standing(), None)
    moving = not state_at(arm, after, 0.0).joints.at_rest
    return CutPlace(keep, here if moving else here.standing(), after.motion)


def _plan_new(timeline: Timeline, place: CutPlace, problem: Problem) -> tuple[CutPlace, tuple[Segment, ...]]:
    """Plan a motion out of the motion under way, or after the arm has come to rest; return also where it cuts the
    timeline.
    """
    if problem.motion.start is Start.BLEND and place.interrupted is not None:
        corner, end = _next_rest(problem.arm, timeline, place.keep)
        new = plan_corner(problem, structs.replace(problem, here=corner.here, begin=end))
        return place if new[0].start == problem.begin else corner, new
    try:
        return place, plan_motion(problem)
    except NoRoomToStop:
        corner, end = _next_rest(problem.arm, timeline, place.keep)
        return corner, plan_motion(structs.replace(problem, here=corner.here, begin=end))


def _next_rest(arm: RobotArm, timeline: Timeline, keep: int) -> tuple[CutPlace, float]:
    """Return the first place and time at which the robot stands after the first `keep` segments have begun."""
    while True:
        segment = timeline[keep - 1]
        if keep == len(timeline) or (after := timeline[keep]).start > segment.finish:
            break
        if state_at(arm, after, 0.0).joints.at_rest:
            break
        keep += 1
    return CutPlace(keep, rest_after(arm, segment), None), segment.finish


class _Tail(Struct, frozen=True):
    """The segments of a timeline from `index` on: `next` is the first of them, `before` the one before it."""

    old: Timeline
    index: int
    before: Segment
    next: Segment | None

    @classmethod
    def of(cls, old: Timeline, index: int) -> _Tail:
        return cls(old, index, old[index - 1], old[index] if index < len(old) else None)

    def after(self, motion: Motion | None) -> _Tail:
        """Return the tail without the segments of a motion that it begins with."""
        index, before, following = self.index, self.before, self.next
        while motion is not None and following is not None and following.motion.number == motion.number:
            index, before = index + 1, following
            following = self.old[index] if index < len(self.old) else None
        return _Tail(self.old, index, before, following)


class _Edit(Struct, frozen=True, dict=True):
    """A change of a timeline while it is planned: `segments` replace the old ones between the cut and the `tail`."""

    arm: RobotArm
    slowest: float
    cut: CutPlace
    segments: tuple[Segment, ...]
    tail: _Tail
    inserts: bool
    event: Event | None = None

    @cached_property
    def place(self) -> Here:
        """The state in which the planned segments leave the robot, at rest."""
        return rest_after(self.arm, self.segments[-1])

    @property
    def changes_the_next(self) -> bool:
        """Whether the next motion begins otherwise than before: not at rest, or in another place."""
        if self.tail.next is None:
            return False
        before = state_at(self.arm, self.tail.next, 0.0).joints
        return not (before.at_rest and largest_change(self.place.joints.joints, before.joints) <= SAME_PLACE)

    def _begin(self, first: Segment) -> float:
        """Return when the next motion, whose first segment is given, begins if it starts from rest [s]."""
        end = self.segments[-1].finish
        if first.motion.start is Start.AT or not (self.cut.interrupted or self.tail.index > self.cut.keep):
            return max(first.start, end)
        return end + first.start - self.tail.before.finish

    def delta(self, motion: Motion, issued: float, executed: float) -> TimelineDelta:
        """Return the change as a delta that is caused by a motion."""
        old, following, events = self.tail.old, self.tail.next, None
        shift = 0.0 if following is None else self._begin(following) - following.start
        if old.event_count or self.event is not None:
            index, own = self.tail.index, self.event
            events = edit_of(old, self.cut.keep, index, self.segments, shift, inserts=self.inserts, own=own)
        return TimelineDelta(
            version=old.version,
            cause=Cause.COMMAND,
            motion=motion,
            issued=issued,
            executed=executed,
            cut=self.segments[0].start,
            keep=self.cut.keep,
            drop=self.tail.index - self.cut.keep,
            shift=shift,
            segments=self.segments,
            events=events,
        )

    def with_the_next_planned_again(self) -> _Edit:
        """Plan the next motion again, from its new place to its own target. Raises MotionError."""
        first = self.tail.next
        assert first is not None
        tail = self.tail.after(first.motion)
        motion = tail.before.motion  # not of its first segment, a stop of another profile where it braked first
        try:
            new = self._plan_next(first, retarget(self.arm, motion, self.place.joints.joints))
        except MotionError as error:
            when_again = f"when {motion.text or 'the next motion'}, scheduled later, is planned again"
            raise error.reworded(f"{when_again}: {error.detail}") from None
        begin = new[0].start
        kept = [segment for segment in self.segments if not segment.start >= begin < segment.finish]
        if kept and kept[-1].finish > begin:
            kept[-1] = kept[-1].truncated(begin)
        return structs.replace(self, segments=(*kept, *new), tail=tail)

    def _plan_next(self, first: Segment, motion: Motion) -> tuple[Segment, ...]:
        """The segments of a motion: out of the one before where it blends into that, or begins at its own time in the
        middle of it, while that is under way. `first`: of the old ones.
        """
        resting = Problem(self.arm, self.place, motion, self._begin(first), self.slowest)
        if motion.start is Start.BLEND and self.segments[-1].phase is Phase.DECELERATE:
            begin = rounding_begins(self.arm, slowing_down(self.segments), motion.rounding)
            return plan_corner(self._moving(resting, begin), resting)
        if first.motion.start is Start.AT and not state_at(self.arm, first, 0.0).joints.at_rest:
            number = self.tail.before.motion.number
            begins = next((segment.start for segment in self.segments if segment.motion.number == number), None)
            if begins is not None and begins < first.start < self.segments[-1].finish:
                with suppress(NoRoomToStop):
                    return plan_motion(self._moving(resting, first.start))
        return plan_motion(resting)

    def _moving(self, resting: Problem, begin: float) -> Problem:
        """Return the problem of the same motion at a time at which the planned segments are under way."""
        segments = self.segments
        segment = next((segment for segment in reversed(segments) if segment.start < begin), segments[0])
        here = state_at(self.arm, segment, min(begin - segment.start, segment.duration))
        return structs.replace(resting, here=here, begin=begin)
