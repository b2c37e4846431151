"""Rebuild the timeline and the command history of a file from its deltas, and find faults in them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import chain, pairwise
from typing import TYPE_CHECKING

from msgspec import Struct

from vrs_cli.engine.history import History, HistoryStep
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.trajectory.segment import Segment
from vrs_cli.trajectory.timeline import Cause, Timeline, TimelineDelta
from vrs_cli.values.commands import HAND, Event, EventEdit
from vrs_cli.wire.records import RecordError

if TYPE_CHECKING:
    from vrs_cli.engine.breaches import Breach


class Fault(Struct, frozen=True):
    """A fault in a file, with its line number."""

    line: int
    what: str

    def __str__(self) -> str:
        return f"line {self.line}: {self.what}"


def apply(timeline: Timeline, delta: TimelineDelta) -> Timeline:
    """Return the timeline after a delta. Raises RecordError if the delta does not fit."""
    if delta.version != timeline.version:
        raise RecordError(f"a delta of timeline version {delta.version}; version {timeline.version} is due here")
    count, after = len(timeline), delta.keep + delta.drop
    if after > count:
        raise RecordError(f"keeps {delta.keep} and drops {delta.drop} of {count} segments")
    if after == count and not delta.keep and not delta.segments:
        raise RecordError("leaves a timeline without segments")
    last = timeline[delta.keep - 1] if delta.keep else None
    before = () if last is None else (last.start, min(last.finish, delta.cut))
    check_order(delta.segments, before, (timeline[after].start + delta.shift,) if after < count else ())
    if delta.events is not None:
        _check_events(timeline, delta.events)
    return timeline.apply(delta)


def _check_events(timeline: Timeline, edit: EventEdit) -> None:
    """Raise RecordError if an edit does not fit the events of a timeline."""
    count, after = timeline.event_count, edit.keep + edit.drop
    if after > count:
        raise RecordError(f"keeps {edit.keep} and drops {edit.drop} of {count} events")
    before = [timeline.event(edit.keep - 1).time] if edit.keep else []
    behind = [timeline.event(after).time + edit.shift] if after < count else []
    times = (*before, *(event.time for event in edit.events), *behind)
    if not all(earlier <= later for earlier, later in pairwise(times)):
        raise RecordError("the events are not in order of time")


class LoadedTimeline:
    """A timeline while the deltas of its file are being applied. Appended segments are collected in a list, and added
    to the rope together. `_last` is the last segment of the list; if the list is empty, the last segment of the
    timeline.
    """

    def __init__(self, timeline: Timeline) -> None:
        self._timeline, self._last, self._version = timeline, timeline[len(timeline) - 1], timeline.version
        self._appended: list[Segment] = []
        self._count = len(timeline)

    def timeline(self) -> Timeline:
        """Return the timeline after all deltas applied so far."""
        if self._version != self._timeline.version:
            self._timeline = self._timeline.append(self._appended, self._version)
            self._appended = []
        return self._timeline

    @property
    def has_events(self) -> bool:
        """Return whether there are events."""
        return bool(self._timeline.event_count)

    def apply(self, delta: TimelineDelta) -> None:
        """Apply a delta. Raises RecordError if it does not fit."""
        appends = delta.keep == self._count and not delta.drop and delta.events is None
        if not appends or self._last.finish > delta.cut or delta.version != self._version:
            self._timeline = apply(self.timeline(), delta)
            self._count, self._version = len(self._timeline), self._timeline.version
            self._last = self._timeline[self._count - 1]
            return
        edge = self._last.finish
        for segment in delta.segments:
            if segment.start < edge:
                raise RecordError("the segments overlap in time")
            edge = segment.finish
        self._appended += delta.segments
        self._count += len(delta.segments)
        self._version += 1
        if delta.segments:
            self._last = delta.segments[-1]


# --- the hand in older files ---------------------------------------------------------------------------------------


class OlderHand:
    """Makes hand events from the motions of an older file, in which each motion contains the opening of the hand. If a
    file has events in its deltas, only the motions before the first of these are older. `found`: a motion has opened
    the hand, so a delta with events must follow if the file is continued."""

    def __init__(self) -> None:
        self.found, self._ended = False, False

    def initial(self, segments: Sequence[Segment]) -> Timeline:
        """Return the first timeline, with the events of its motions."""
        return Timeline(segments, events=list(_openings(segments, 0.0)))

    def read(self, loaded: LoadedTimeline, delta: TimelineDelta) -> TimelineDelta:
        """Return the delta with the events of its motions."""
        if self._ended or delta.events is not None:
            self.found, self._ended = False, True
            return delta
        self.found = self.found or delta.motion.hand != 0.0
        if not loaded.has_events and not any(segment.motion.hand for segment in delta.segments):
            return delta
        timeline = loaded.timeline()
        count = len(timeline)
        if not 0 < delta.keep <= delta.keep + delta.drop <= count:
            return delta
        keep, after = _event_of(timeline, delta.keep), _event_of(timeline, delta.keep + delta.drop)
        before = timeline[delta.keep - 1].motion.hand
        events = list(_openings(delta.segments, before))
        if delta.keep + delta.drop < count:
            tail = timeline[delta.keep + delta.drop]
            if after < timeline.event_count and timeline.event(after).number == tail.motion.number:
                after += timeline.event(after).time == tail.start
            events += _openings(
                [tail.shift_by(delta.shift)], delta.segments[-1].motion.hand if delta.segments else before
            )
        return delta._replace(events=EventEdit(keep, after - keep, delta.shift, tuple(events)))


def _openings(segments: Iterable[Segment], before: float) -> Iterator[Event]:
    """Yield an event for each segment whose hand opening differs from that of the previous segment. `before`: the
    opening before the first segment."""
    for segment in segments:
        motion = segment.motion
        if motion.hand != before:
            before = motion.hand
            yield Event(segment.start, HAND, before, motion.number, tied=True)


def _event_of(timeline: Timeline, index: int) -> int:
    """Return the number of events that belong to segments before the given segment number; each event is at the start
    of its segment."""
    start = timeline[index - 1].start
    count = timeline.events_by(start, before=True)
    known = set[int]()
    while index and timeline[index - 1].start == start:
        index -= 1
        known.add(timeline[index].motion.number)
    while count < timeline.event_count and timeline.event(count).time == start:
        if timeline.event(count).number not in known:
            break
        count += 1
    return count


def check_order(segments: Iterable[Segment], before: Iterable[float] = (), behind: Iterable[float] = ()) -> None:
    """Raise RecordError if segments overlap in time with each other, or extend beyond the times `before` and
    `behind`."""
    edges = (*before, *(edge for segment in segments for edge in (segment.start, segment.finish)), *behind)
    if not all(earlier <= later for earlier, later in pairwise(edges)):
        raise RecordError("the segments overlap in time")


# --- the command history -----------------------------------------------------------------------------------------


def history_of(initial: Timeline, deltas: Iterable[TimelineDelta]) -> History:
    """Return the history after a list of deltas: the commands in effect and the commands undone last, as if they had
    just been given. The targets of a stream share one motion and count as one command. A file does not store the clock:
    UNDO sets it to the issue time of a command, REDO to the end of the timeline."""
    history = History()
    loaded_forward(history, initial, deltas, 0)
    return history


def loaded_forward(history: History, timeline: Timeline, deltas: Iterable[TimelineDelta], number: int) -> Timeline:
    """Return the timeline after more deltas, and add their commands to the history. `number`: the number of the last
    motion."""
    streaming = False
    for delta in deltas:
        goes_on = delta.cause is Cause.COMMAND and delta.motion.number == number  # a further target of the same stream
        if streaming and not goes_on:
            history.lengthen_last(timeline)
        streaming = goes_on
        if delta.cause is Cause.UNDO:
            history.take_back(timeline.end, delta.motion)
        elif delta.cause is Cause.REDO:
            history.do_again(delta.motion)
        elif not goes_on:
            number = delta.motion.number
            # the command was given with INSERT off if it dropped motions that were scheduled after it
            dropped = {timeline[index].motion.number for index in range(delta.keep, delta.keep + delta.drop)}
            planned = {segment.motion.number for segment in delta.segments}
            interrupted = timeline[delta.keep - 1].motion.number if delta.keep else 0
            history.add(HistoryStep.of(timeline, delta, delta.issued, insert=not dropped - planned - {interrupted}))
        timeline = apply(timeline, delta)
    if streaming:
        history.lengthen_last(timeline)
    return timeline


# --- faults ----------------------------------------------------------------------------------------------------------


HEADER = 1  # line number of the header


def faults(arm: RobotArm, timeline: Timeline, deltas: Sequence[TimelineDelta], lines: Sequence[int]) -> Iterator[Fault]:
    """Yield the faults of a trajectory: goals out of range, and times at which the final timeline jumps, leaves a range
    or exceeds a limit. `lines`: the line numbers of the deltas."""
    import numpy as np

    from vrs_cli.engine.breaches import PLACE_TOLERANCE, breaches

    told = [(line, goal) for line, delta in zip(lines, deltas, strict=True) if (goal := delta.motion.goal) is not None]
    goals = np.fromiter(chain.from_iterable(goal for _, goal in told), float).reshape(len(told), arm.model.joint_count)
    outside = (goals < np.array(arm.model.lower) - PLACE_TOLERANCE) | (
        goals > np.array(arm.model.upper) + PLACE_TOLERANCE
    )
    for row in np.flatnonzero(outside.any(axis=1)).tolist():
        joint = int(outside[row].argmax()) + 1
        said = arm.model.joint_text(joint, float(goals[row, joint - 1]))
        yield Fault(told[row][0], f"the goal of joint {joint}, {said}, is beyond its range")
    yield from in_lines(breaches(arm, timeline), timeline, deltas, lines)


def in_lines(
    found: Iterable[Breach], timeline: Timeline, deltas: Sequence[TimelineDelta], lines: Sequence[int]
) -> Iterator[Fault]:
    """Yield a fault for each breach of a timeline. Its line is the last line that made a segment around the breach, or
    that cut off the first of these segments at its present end.
    """
    for breach in found:
        neighbours = [timeline[index] for index in (breach.index - 1, breach.index) if index >= 0]
        made = (
            line
            for line, delta in zip(reversed(lines), reversed(deltas), strict=True)
            if (delta.drop and delta.cut == neighbours[0].finish)
            or any(segment.path is one.path for segment in delta.segments for one in neighbours)
        )
        yield Fault(next(made, HEADER), breach.what)
