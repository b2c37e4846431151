"""From the deltas of a file to their timeline, checked, and to what can be undone."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import pairwise

from vrs_cli.engine.history import History, Step
from vrs_cli.trajectory.delta import Cause, TimelineDelta
from vrs_cli.trajectory.segment import Segment
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.wire.records import RecordError


def apply(timeline: Timeline, delta: TimelineDelta) -> Timeline:
    """The timeline after a delta. Raises RecordError when it cannot be the next."""
    if delta.version != timeline.version:
        raise RecordError(f"a delta of timeline version {delta.version}; version {timeline.version} is due here")
    count, after = len(timeline), delta.keep + delta.drop
    if after > count:
        raise RecordError(f"keeps {delta.keep} and drops {delta.drop} of {count} segments")
    if after == count and not delta.keep and not delta.segments:
        raise RecordError("leaves a timeline without segments")
    edges = _edges(delta.segments)
    if delta.keep:
        last = timeline[delta.keep - 1]
        edges = [last.start, min(last.finish, delta.cut), *edges]
    if after < count:
        edges.append(timeline[after].start + delta.shift)
    _check_order(edges)
    return timeline.apply(delta)


# --- what can be undone ------------------------------------------------------------------------------------------


def history_of(initial: Iterable[Segment], deltas: Iterable[TimelineDelta]) -> History:
    """The commands that hold after a row of deltas, and those that were undone last, as if they had just been given.

    The targets of a stream, which are of one motion, are one command. A file does not tell the clock: UNDO goes back to
    the issue time of a command, REDO to the end of the timeline.
    """
    history, timeline, streaming = History(), Timeline(initial), False
    for delta in deltas:
        goes_on = _goes_on(history, delta)
        if streaming and not goes_on:
            history.lengthen_last(timeline)
        streaming = goes_on
        if delta.cause is Cause.UNDO:
            history.take_back(timeline.end)
        elif delta.cause is Cause.REDO:
            history.do_again()
        elif not goes_on:
            insert = not _overrides(timeline, delta)
            history.add(Step.of(timeline, delta, delta.issued, insert=insert))
        timeline = apply(timeline, delta)
    if streaming:
        history.lengthen_last(timeline)
    return history


def _goes_on(history: History, delta: TimelineDelta) -> bool:
    """Whether a delta has one more target of the stream that is the last command."""
    if delta.cause is not Cause.COMMAND or not history.done:
        return False
    return delta.motion.number == history.done[-1].delta.motion.number


def _overrides(before: Timeline, delta: TimelineDelta) -> bool:
    """Whether a command dropped motions that were scheduled after it."""
    dropped = {before[index].motion.number for index in range(delta.keep, delta.keep + delta.drop)}
    planned = {segment.motion.number for segment in delta.segments}
    interrupted = before[delta.keep - 1].motion.number if delta.keep else 0
    return bool(dropped - planned - {interrupted})


def _edges(segments: Iterable[Segment]) -> list[float]:
    return [edge for segment in segments for edge in (segment.start, segment.finish)]


def check_order(segments: Iterable[Segment]) -> None:
    """Raises RecordError where segments overlap in time."""
    _check_order(_edges(segments))


def _check_order(edges: Iterable[float]) -> None:
    if not all(earlier <= later for earlier, later in pairwise(edges)):
        raise RecordError("the segments overlap in time")
