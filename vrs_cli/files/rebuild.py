"""Rebuild the timeline and the command history of a trajectory file from its deltas, and find faults in them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import chain, pairwise
from typing import TYPE_CHECKING

from msgspec import Struct, structs

from vrs_cli.engine.history import History, HistoryStep
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.trajectory.segment import Segment
from vrs_cli.trajectory.timeline import Cause, Timeline, TimelineDelta
from vrs_cli.values.commands import HAND, Event, EventEdit
from vrs_cli.wire.records import Motions, RecordError

if TYPE_CHECKING:
    from vrs_cli.engine.breaches import Breach


class Fault(Struct, frozen=True):
    """A fault in a trajectory file: its line number, and what is wrong."""

    line: int
    what: str

    def __str__(self) -> str:
        return f"line {self.line}: {self.what}"


def apply(timeline: Timeline, delta: TimelineDelta) -> Timeline:
    """Apply a delta to a timeline, and return the new timeline. Raises RecordError if the delta does not fit this
    timeline.
    """
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
    """Check that a change of the events fits the current events of a timeline. Raises RecordError."""
    count, after = timeline.event_count, edit.keep + edit.drop
    if after > count:
        raise RecordError(f"keeps {edit.keep} and drops {edit.drop} of {count} events")
    before = [timeline.event(edit.keep - 1).time] if edit.keep else []
    behind = [timeline.event(after).time + edit.shift] if after < count else []
    times = (*before, *(event.time for event in edit.events), *behind)
    if not all(earlier <= later for earlier, later in pairwise(times)):
        raise RecordError("the events are not in order of time")


class LoadedTimeline:
    """A timeline to which the deltas of a file are being applied. Appended segments are collected in a list and added
    to the timeline together, which is faster. `_count`, `_end`, `_version`: the number of segments, the end [s] and the
    version after all deltas applied so far.
    """

    def __init__(self, timeline: Timeline) -> None:
        self._timeline, self._appended = timeline, list[Segment]()
        self._count, self._end, self._version = len(timeline), timeline.end, timeline.version

    def timeline(self) -> Timeline:
        """Return the timeline after all deltas applied so far."""
        if self._version != self._timeline.version:
            self._timeline = self._timeline.append(self._appended, self._version)
            self._appended = []
        return self._timeline

    def apply(self, delta: TimelineDelta) -> None:
        """Apply a delta to this timeline. Raises RecordError if the delta does not fit."""
        appends = delta.keep == self._count and not delta.drop and delta.events is None
        if not appends or self._end > delta.cut or delta.version != self._version:
            self._timeline = apply(self.timeline(), delta)
            self._count, self._end, self._version = len(self._timeline), self._timeline.end, self._timeline.version
            return
        edge, segments = self._end, delta.segments
        for segment in segments:
            if segment.start < edge:
                raise RecordError("the segments overlap in time")
            edge = segment.finish
        self._appended += segments
        self._count += len(segments)
        self._end, self._version = edge, self._version + 1


# --- the hand in older files ---------------------------------------------------------------------------------------


def initial_timeline(segments: Sequence[Segment]) -> Timeline:
    """Return the first timeline of a file, with hand events made from its motions."""
    return Timeline(segments, events=list(_openings(segments, 0.0)))


class OlderHand:
    """Makes hand events from the motions of an older file, in which each motion contains the opening of the hand. If
    deltas of a file have events, only the motions before the first such delta are treated as older ones. `found`:
    whether a motion has opened the hand; if such a file is continued, the next delta must have events. `motions`: the
    motions of the file that have been read so far.
    """

    def __init__(self, motions: Motions) -> None:
        self.found, self._ended, self._motions = False, False, motions

    def read(self, loaded: LoadedTimeline, delta: TimelineDelta) -> TimelineDelta:
        """Return a delta with hand events made from its motions. `loaded`: the timeline before the delta."""
        if self._ended or delta.events is not None:
            self.found, self._ended = False, True
            return delta
        if not self._motions.open_hand:
            return delta
        self.found = self.found or delta.motion.hand != 0.0
        timeline = loaded.timeline()
        if not timeline.event_count and not any(segment.motion.hand for segment in delta.segments):
            return delta
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
        return structs.replace(delta, events=EventEdit(keep, after - keep, delta.shift, tuple(events)))


def _openings(segments: Iterable[Segment], before: float) -> Iterator[Event]:
    """Yield a hand event for each segment whose hand opening differs from that of the previous segment. `before`: the
    hand opening before the first segment.
    """
    for segment in segments:
        motion = segment.motion
        if motion.hand != before:
            before = motion.hand
            yield Event(segment.start, HAND, before, motion.number, tied=True)


def _event_of(timeline: Timeline, index: int) -> int:
    """Return how many events belong to the segments before the segment with this index. Each event is at the start of
    its segment.
    """
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
    """Check that segments do not overlap in time, and are all between the times `before` and `behind`. Raises
    RecordError.
    """
    edges = (*before, *(edge for segment in segments for edge in (segment.start, segment.finish)), *behind)
    if not all(earlier <= later for earlier, later in pairwise(edges)):
        raise RecordError("the segments overlap in time")


# --- the command history -----------------------------------------------------------------------------------------


def history_of(initial: Timeline, deltas: Iterable[TimelineDelta]) -> History:
    """Return the command history after all deltas: the commands in effect, and the undone commands that REDO can
    repeat. All targets of a stream count as one command, because they share one motion. A file does not store the
    clock, so UNDO will set it to the time at which a command was given, and REDO to the end of the timeline.
    """
    history = History()
    loaded_forward(history, initial, deltas, 0)
    return history


def loaded_forward(history: History, timeline: Timeline, deltas: Iterable[TimelineDelta], number: int) -> Timeline:
    """Apply deltas to a timeline, add their commands to the history, and return the new timeline. `number`: the number
    of the last motion before these deltas.
    """
    streaming = False
    for delta in deltas:
        # true for a further target of the same stream
        goes_on = delta.cause is Cause.COMMAND and delta.motion.number == number
        if streaming and not goes_on:
            history.lengthen_last(timeline)
        streaming = goes_on
        if delta.cause is Cause.UNDO:
            history.take_back(timeline.end, delta.motion)
        elif delta.cause is Cause.REDO:
            history.do_again(delta.motion)
        elif not goes_on:
            number = delta.motion.number
            # if the command dropped motions that were scheduled after it, it was given with INSERT off
            dropped = {timeline[index].motion.number for index in range(delta.keep, delta.keep + delta.drop)}
            planned = {segment.motion.number for segment in delta.segments}
            interrupted = timeline[delta.keep - 1].motion.number if delta.keep else 0
            history.add(HistoryStep.of(timeline, delta, delta.issued, insert=not dropped - planned - {interrupted}))
        timeline = apply(timeline, delta)
    if streaming:
        history.lengthen_last(timeline)
    return timeline


# --- faults ----------------------------------------------------------------------------------------------------------


HEADER = 1  # line number of a file's header


def faults(arm: RobotArm, timeline: Timeline, deltas: Sequence[TimelineDelta], lines: Sequence[int]) -> Iterator[Fault]:
    """Yield the faults of a trajectory: goals outside the joint ranges, and times at which the final timeline jumps,
    leaves a joint range or exceeds a velocity or other limit. `lines`: the line number of each delta.
    """
    import numpy as np

    from vrs_cli.engine.breaches import PLACE_TOLERANCE, breaches

    goals = [goal for delta in deltas if (goal := delta.motion.goal) is not None]
    table = np.fromiter(chain.from_iterable(goals), float).reshape(len(goals), arm.model.joint_count)
    outside = (table < np.array(arm.model.lower) - PLACE_TOLERANCE) | (
        table > np.array(arm.model.upper) + PLACE_TOLERANCE
    )
    for row in np.flatnonzero(outside.any(axis=1)).tolist():
        joint = int(outside[row].argmax())
        line = [line for line, delta in zip(lines, deltas, strict=True) if delta.motion.goal is not None][row]
        yield Fault(
            line,
            f"the goal of joint {joint + 1}, {arm.model.joint_text(joint + 1, goals[row][joint])}, is beyond its range",
        )
    yield from in_lines(breaches(arm, timeline), timeline, deltas, lines)


def in_lines(
    found: Iterable[Breach], timeline: Timeline, deltas: Sequence[TimelineDelta], lines: Sequence[int]
) -> Iterator[Fault]:
    """Yield a fault for each breach (a time at which the timeline violates a limit). The fault has the number of the
    last line that made one of the two segments at the breach, or that shortened the first of them to its current end.
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
