"""The trajectory generation function f: a motion command edits the timeline.

f(theta; p, t, v; tau[k]) -> TimelineDelta. The motion in progress at the execution time is truncated there (the cut).
The new motion takes its place, and starts from the position and velocity at that time. Motions that are scheduled later
stay: the next motion is planned again from the new position to its own target, and so on while motions blend into each
other. From the first boundary on at which position and velocity are unchanged, segments (the tail) are only shifted in
time.

Events up to the cut stay. A tied event keeps its distance in time to the start of its motion, or to the end of the
interrupted motion. An event with its own time keeps this time, but comes at the latest when the tail begins. The tail
is shifted as a whole, with its events. Inputs from outside are never shifted. If nothing is inserted (INSERT OFF,
BRAKE, JOG, steering), all events after the cut are dropped.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from functools import cached_property
from math import inf

from msgspec import Struct, structs

from vrs_cli.engine.position import finish_after, joints_at
from vrs_cli.engine.problem import SLOWEST, Here, NoRoomToStop, Problem, rest_after, state_at
from vrs_cli.engine.single_motion import plan_corner, plan_motion, rounding_begins, slowing_segments
from vrs_cli.engine.targets import retarget
from vrs_cli.errors import MotionError
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.joints import Joints, largest_change, put_inside
from vrs_cli.trajectory.instant import up_to_grid
from vrs_cli.trajectory.segment import Phase, Segment, rest
from vrs_cli.trajectory.timeline import Cause, Timeline, TimelineDelta
from vrs_cli.values.commands import FIRST_INPUT, Event, EventEdit, Motion, MotionKind, Start
from vrs_cli.values.results import ResyncReport

RESYNC = "RESYNC"
SAME_PLACE = 1e-9  # [rad, m] positions closer than this are equal
Anchors = list[tuple[float, float]]  # pairs of corresponding instants [s] of the old and the new timeline, in order


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
    """Function f: return the change of the timeline that makes `motion` start at `executed` [s].

    Cut the timeline there, plan the motion, plan the following motions again as far as needed, and shift the remaining
    segments. `insert` false: drop all later motions. `event`: an event at the start of the motion. Raises MotionError
    if the motion is impossible, or a later motion that must be planned again; the message then names the later motion.
    """
    cut = cut_at(arm, timeline, executed)
    cut, segments = _plan_from_cut(timeline, cut, Problem(arm, cut.here, motion, executed, slowest))
    edit = _Edit.of(arm, slowest, timeline, cut, segments, insert, event)
    while edit.changes_next:
        edit = edit.plan_next_again()
    return edit.delta(motion, issued, segments[0].start if motion.start is Start.BLEND else executed)


def plan_resync(
    arm: RobotArm,
    timeline: Timeline,
    measured: Joints,
    resting: Motion,
    times: tuple[float, float],
    leaves: float,
    *,
    stops: bool,
    slowest: float = SLOWEST,
) -> tuple[TimelineDelta, ResyncReport]:
    """Function f for RESYNC: move to the measured joints [rad, m], limited to their ranges, and from there to the end
    of the motion in progress. With `stops`, stay at the measured joints and drop all scheduled motions.

    The real arm holds its position during this move, so only the virtual robot moves to the measured joints, as fast as
    its limits allow. Then both have the same joints, and the real arm follows again. RESYNC is one command with one
    delta. `times`: issued and executed [s]. `leaves`: the earliest time [s] at which the robot leaves the measured
    joints, so that the real arm receives the motion in time. `resting`: the motion to use if none is in progress; its
    goal is replaced. Raises MotionError.
    """
    issued, begin = times
    under_way, index = timeline.locate(begin)[0].motion, timeline.index_at(begin)
    goal = joints_at(arm, timeline, finish_after(timeline, begin))
    there = put_inside(measured, arm.model.lower, arm.model.upper)
    distances = tuple([q - p for p, q in zip(joints_at(arm, timeline, begin), there, strict=True)])
    numbered = structs.replace(resting, kind=MotionKind.JOINT, start=Start.AT, frames=under_way.frames, text=RESYNC)
    to_measured = structs.replace(numbered, goal=there, speed=1.0, acceleration=1.0, duration=0.0)
    if stops:
        delta = plan(arm, timeline, to_measured, issued, begin, insert=False, slowest=slowest)
        return delta, ResyncReport(begin, delta.segments[-1].finish, distances)
    on = structs.replace(numbered, goal=goal)
    if begin < timeline[index].finish and under_way.kind in (MotionKind.JOINT, MotionKind.STRAIGHT):
        on = structs.replace(under_way, number=numbered.number, start=Start.AT, goal=goal, relative=None, rounding=None)
        on = structs.replace(on, duration=0.0, text=RESYNC)
    to_measured = structs.replace(to_measured, profile=on.profile)
    by_joints = structs.replace(on, kind=MotionKind.JOINT, pose=None, tip_speed=None, rotation=None, swivel=None)
    text = under_way.text if under_way.text and under_way.text != RESYNC else "where the timeline stood"

    def plan_through_measured(motion: Motion) -> tuple[TimelineDelta, ResyncReport]:
        cut = cut_at(arm, timeline, begin)
        cut, first = _plan_from_cut(timeline, cut, Problem(arm, cut.here, to_measured, begin, slowest))
        arrival, here = first[-1].finish, rest_after(arm, first[-1])
        segments = tuple([structs.replace(segment, motion=motion) for segment in first])
        if leaves > arrival:
            segments += (rest(here.joints.joints, up_to_grid(leaves) - arrival, arrival, motion),)
        segments += plan_motion(Problem(arm, here, motion, segments[-1].finish, slowest))
        edit = _Edit.of(arm, slowest, timeline, cut, segments)
        while edit.changes_next:
            edit = edit.plan_next_again()
        return edit.delta(motion, *times), ResyncReport(begin, arrival, distances, text)

    if on.kind is MotionKind.STRAIGHT:
        with suppress(MotionError):  # a line may leave the reach; if it does, the motion is joint-interpolated
            return plan_through_measured(structs.replace(on, goal=None))
    return plan_through_measured(by_joints)


def drop_rest(
    timeline: Timeline, keep: int, segments: tuple[Segment, ...], motion: Motion, issued: float, executed: float
) -> TimelineDelta:
    """Return the delta that puts `segments` after the first `keep` segments and drops all later ones."""
    count, events = len(timeline), None
    if timeline.event_count:
        events = edit_events(timeline, keep, count, segments, 0.0, inserts=False)
    cut, drop = segments[0].start, count - keep
    return TimelineDelta(
        timeline.version, Cause.COMMAND, motion, issued, executed, cut, keep, drop, 0.0, segments, events
    )


class CutPlace(Struct, frozen=True):
    """The point at which a time cuts the timeline: after `keep` segments, with the state of the robot at that time and
    the interrupted motion.

    The interrupted motion is the motion of the first segment that ends after that time, even if that segment begins
    exactly then: the newer command has priority. It is None in a gap and after the end.
    """

    keep: int
    here: Here
    interrupted: Motion | None


def cut_at(arm: RobotArm, timeline: Timeline, t: float) -> CutPlace:
    """Return the point at which time t [s] cuts the timeline."""
    keep = timeline.index_at(t) + 1
    segment = timeline[keep - 1]
    while keep > 1 and segment.start >= t and segment.duration > 0.0:
        keep -= 1  # segments without duration at t are in the past
        segment = timeline[keep - 1]
    here = state_at(arm, segment, min(t - segment.start, segment.duration))
    if segment.finish > t:
        return CutPlace(keep, here, segment.motion)
    if keep == len(timeline) or (after := timeline[keep]).start > t:
        return CutPlace(keep, here.at_rest(), None)
    moving = not state_at(arm, after, 0.0).joints.at_rest
    return CutPlace(keep, here if moving else here.at_rest(), after.motion)


def _plan_from_cut(timeline: Timeline, cut: CutPlace, problem: Problem) -> tuple[CutPlace, tuple[Segment, ...]]:
    """Plan a motion that branches off from the motion in progress or, if that motion cannot be interrupted, starts once
    the arm is at rest.

    Return the point at which the planned segments cut the timeline, and the segments.
    """
    rounds = problem.motion.start is Start.BLEND and cut.interrupted is not None
    if not rounds:
        with suppress(NoRoomToStop):
            return cut, plan_motion(problem)
    keep = cut.keep  # find the first segment boundary after the cut at which the robot is at rest
    while True:
        segment = timeline[keep - 1]
        if keep == len(timeline) or (after := timeline[keep]).start > segment.finish:
            break
        if state_at(problem.arm, after, 0.0).joints.at_rest:
            break
        keep += 1
    corner = CutPlace(keep, rest_after(problem.arm, segment), None)
    stopped = structs.replace(problem, here=corner.here, begin=segment.finish)
    if not rounds:
        return corner, plan_motion(stopped)
    new = plan_corner(problem, stopped)
    return cut if new[0].start == problem.begin else corner, new


class _Tail(Struct, frozen=True):
    """The segments of the timeline `old` from `index` on: `next` is the first of them, `before` the segment before
    `next`.
    """

    old: Timeline
    index: int
    before: Segment
    next: Segment | None

    @classmethod
    def of(cls, old: Timeline, index: int) -> _Tail:
        """Make the tail of a timeline that begins with segment number `index`."""
        return cls(old, index, old[index - 1], old[index] if index < len(old) else None)

    def after(self, motion: Motion | None) -> _Tail:
        """Return the tail without the segments at its start that are part of the given motion."""
        index, before, following = self.index, self.before, self.next
        while motion is not None and following is not None and following.motion.number == motion.number:
            index, before = index + 1, following
            following = self.old[index] if index < len(self.old) else None
        return _Tail(self.old, index, before, following)


class _Edit(Struct, frozen=True, dict=True):
    """A change of a timeline that is being planned: `segments` replace the old segments between the cut and the
    `tail`.
    """

    arm: RobotArm
    slowest: float
    cut: CutPlace
    segments: tuple[Segment, ...]
    tail: _Tail
    inserts: bool
    event: Event | None

    @classmethod
    def of(
        cls,
        arm: RobotArm,
        slowest: float,
        timeline: Timeline,
        cut: CutPlace,
        segments: tuple[Segment, ...],
        inserts: bool = True,
        event: Event | None = None,
    ) -> _Edit:
        """Replace the motion that a cut interrupts by segments; drop all later motions unless the change `inserts`."""
        tail = _Tail.of(timeline, cut.keep).after(cut.interrupted) if inserts else _Tail.of(timeline, len(timeline))
        return cls(arm, slowest, cut, segments, tail, inserts, event)

    @cached_property
    def place(self) -> Here:
        """The state of the robot at the end of the planned segments, at rest."""
        return rest_after(self.arm, self.segments[-1])

    @property
    def changes_next(self) -> bool:
        """Return whether the next motion must be planned again: it now starts at other joints, or it was moving at its
        start before the change.
        """
        if self.tail.next is None:
            return False
        before = state_at(self.arm, self.tail.next, 0.0).joints
        return not (before.at_rest and largest_change(self.place.joints.joints, before.joints) <= SAME_PLACE)

    def _begin(self, first: Segment) -> float:
        """Return when the next motion begins [s] if it starts from rest. `first`: its old first segment."""
        end = self.segments[-1].finish
        if first.motion.start is Start.AT or not (self.cut.interrupted or self.tail.index > self.cut.keep):
            return max(first.start, end)
        return end + first.start - self.tail.before.finish

    def delta(self, motion: Motion, issued: float, executed: float) -> TimelineDelta:
        """Return the change as the delta of a motion; the tail is shifted to the end of the planned segments."""
        old, following, events = self.tail.old, self.tail.next, None
        shift = 0.0 if following is None else self._begin(following) - following.start
        keep, segments = self.cut.keep, self.segments
        if old.event_count or self.event is not None:
            index, own = self.tail.index, self.event
            events = edit_events(old, keep, index, segments, shift, inserts=self.inserts, own=own)
        cut, drop = segments[0].start, self.tail.index - keep
        return TimelineDelta(
            old.version, Cause.COMMAND, motion, issued, executed, cut, keep, drop, shift, segments, events
        )

    def plan_next_again(self) -> _Edit:
        """Plan the next motion again, from its new start to its own target. Raises MotionError."""
        first = self.tail.next
        assert first is not None
        tail = self.tail.after(first.motion)
        motion = tail.before.motion  # not that of `first`, which may be a stop with another profile
        try:
            new = self._plan_next(first, retarget(self.arm, motion, self.place.joints.joints))
        except MotionError as error:
            when_again = f"when {motion.text or 'the next motion'}, scheduled later, is planned again"
            raise error.reworded(f"{when_again}: {error.detail}") from None
        begin = new[0].start
        kept = [segment for segment in self.segments if not segment.start >= begin < segment.finish]
        if kept and kept[-1].finish > begin:
            kept[-1] = kept[-1].truncate(begin)
        return structs.replace(self, segments=(*kept, *new), tail=tail)

    def _plan_next(self, first: Segment, motion: Motion) -> tuple[Segment, ...]:
        """Plan the next motion again. `first`: its old first segment.

        If the motion blends into the previous one, or its execution time lies in the previous one, it starts in motion;
        otherwise it starts from rest.
        """
        resting = Problem(self.arm, self.place, motion, self._begin(first), self.slowest)
        if motion.start is Start.BLEND and self.segments[-1].phase is Phase.DECELERATE:
            begin = rounding_begins(self.arm, slowing_segments(self.segments), motion.rounding)
            return plan_corner(self._problem_in_motion(resting, begin), resting)
        if first.motion.start is Start.AT and not state_at(self.arm, first, 0.0).joints.at_rest:
            number = self.tail.before.motion.number
            begins = next((segment.start for segment in self.segments if segment.motion.number == number), None)
            if begins is not None and begins < first.start < self.segments[-1].finish:
                with suppress(NoRoomToStop):
                    return plan_motion(self._problem_in_motion(resting, first.start))
        return plan_motion(resting)

    def _problem_in_motion(self, resting: Problem, begin: float) -> Problem:
        """Return the planning problem of the same motion when it starts at the time `begin` [s] out of the planned
        segments.
        """
        segments = self.segments
        segment = next((segment for segment in reversed(segments) if segment.start < begin), segments[0])
        here = state_at(self.arm, segment, min(begin - segment.start, segment.duration))
        return structs.replace(resting, here=here, begin=begin)


# --- events ----------------------------------------------------------------------------------------------------------


def edit_events(
    old: Timeline,
    keep: int,
    tail: int,
    new: Sequence[Segment],
    shift: float,
    *,
    inserts: bool,
    own: Event | None = None,
) -> EventEdit | None:
    """Return the change of the events that goes with a delta; None if no event changes. The delta keeps `keep`
    segments, puts `new` after them, and shifts those from index `tail` on by `shift` [s]. `own`: an event at the start
    of the new motion.
    """
    cut, count = new[0].start, old.event_count
    kept, coming = old.events_by(cut), () if own is None else (own._replace(time=cut),)
    if kept == count:
        return EventEdit(kept, events=coming) if coming else None
    if not inserts:
        return EventEdit(kept, count - kept, 0.0, coming)
    begins, after = inf, count
    if tail < len(old):
        begins = old[tail].start
        after = max(old.events_by(begins, before=True), kept)
    anchors = _anchors(old, keep, tail, new, shift)
    gone = [*old.event_slice(kept, after)]
    moved = [_move_event(event, anchors, begins + shift) for event in gone]
    latest = max((event.time for event in moved), default=-inf)
    last_input = after  # 1 + the index of the last input from outside in the tail, which must not be shifted
    if shift and any(channel >= FIRST_INPUT for channel in old.channels):
        places = range(count - 1, after - 1, -1)
        last_input = next((index + 1 for index in places if _is_input(old.event(index))), after)
    for event in old.event_slice(after, last_input):
        gone.append(event)
        moved.append(event if _is_input(event) else event.shift_by(shift))
        latest = max(latest, moved[-1].time)
    after = kept + len(gone)
    for event in old.event_slice(after, old.events_by(latest - shift, before=True)):
        gone.append(event)  # an input that keeps its time now comes after this event
        moved.append(event.shift_by(shift))
    after = kept + len(gone)
    moved.sort(key=lambda event: event.time)  # the sort is stable: events of one instant keep their order
    if after == count:
        shift = 0.0
    if not coming and not shift and moved == gone:
        return None
    return EventEdit(kept, len(gone), shift, (*coming, *moved))


def _is_input(event: Event) -> bool:
    """Return whether an event is an input from outside: its time does not depend on what the robot does."""
    return event.channel >= FIRST_INPUT and not event.tied


def _anchors(old: Timeline, keep: int, tail: int, new: Sequence[Segment], shift: float) -> Anchors:
    """Return pairs of old and new instants, by which tied events move: the starts of the motions that are planned
    again, the end of the last interrupted motion, and the start of the tail.
    """
    starts: dict[int, float] = {}
    for segment in new:
        starts.setdefault(segment.motion.number, segment.start)
    anchors: Anchors = []
    number = old[keep - 1].motion.number
    for index in range(keep, tail):
        segment = old[index]
        if segment.motion.number != number:
            number = segment.motion.number
            anchors.append((segment.start, starts.get(number, segment.start)))
    end = old[max(tail, keep) - 1].finish
    begins = old[tail].start if tail < len(old) else inf
    if end > new[0].start and end < begins:  # a motion is interrupted, or planned again
        anchors.append((end, new[-1].finish))
    anchors.append((begins, begins + shift))
    return anchors


def _move_event(event: Event, anchors: Anchors, latest: float) -> Event:
    """Return an event with its new time. `latest`: the new start of the tail [s]."""
    if _is_input(event):
        return event
    if not event.tied:
        return event._replace(time=min(event.time, latest))
    shift, until = 0.0, inf
    for before, after in anchors:
        if before > event.time:
            until = after
            break
        shift = after - before
    return event._replace(time=min(event.time + shift, until))
