"""Rebuild the timeline and the history of a file from its deltas, and check them."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import pairwise

from msgspec import Struct

from vrs_cli.engine.history import History, HistoryStep
from vrs_cli.trajectory.segment import Segment
from vrs_cli.trajectory.timeline import Cause, Timeline, TimelineDelta
from vrs_cli.wire.records import RecordError


class Fault(Struct, frozen=True):
    """A fault in a file, and the number of its line."""

    line: int
    what: str

    def __str__(self) -> str:
        return f"line {self.line}: {self.what}"


def apply(timeline: Timeline, delta: TimelineDelta) -> Timeline:
    """The timeline after a delta. Raises RecordError when it cannot be the next."""
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
    return timeline.apply(delta)


def check_order(segments: Iterable[Segment], before: Iterable[float] = (), behind: Iterable[float] = ()) -> None:
    """Raises RecordError where segments overlap in time, or the times `before` and `behind` them."""
    edges = (*before, *(edge for segment in segments for edge in (segment.start, segment.finish)), *behind)
    if not all(earlier <= later for earlier, later in pairwise(edges)):
        raise RecordError("the segments overlap in time")


# --- what can be undone ------------------------------------------------------------------------------------------


def history_of(initial: Iterable[Segment], deltas: Iterable[TimelineDelta]) -> History:
    """The commands that hold after a row of deltas, and those that were undone last, as if they had just been given.

    The targets of a stream, which are of one motion, are one command. A file does not tell the clock: UNDO goes back to
    the issue time of a command, REDO to the end of the timeline.
    """
    history = History()
    loaded_forward(history, Timeline(initial), deltas, 0)
    return history


def loaded_forward(history: History, timeline: Timeline, deltas: Iterable[TimelineDelta], number: int) -> Timeline:
    """The timeline after more deltas; the history of what was before learns of them. `number`: of the last motion."""
    streaming = False
    for delta in deltas:
        goes_on = delta.cause is Cause.COMMAND and delta.motion.number == number  # one more target of the stream
        if streaming and not goes_on:
            history.lengthen_last(timeline)
        streaming = goes_on
        if delta.cause is Cause.UNDO:
            history.take_back(timeline.end)
        elif delta.cause is Cause.REDO:
            history.do_again()
        elif not goes_on:
            number = delta.motion.number
            # it overrides where it drops motions that were scheduled after it
            dropped = {timeline[index].motion.number for index in range(delta.keep, delta.keep + delta.drop)}
            planned = {segment.motion.number for segment in delta.segments}
            interrupted = timeline[delta.keep - 1].motion.number if delta.keep else 0
            history.add(HistoryStep.of(timeline, delta, delta.issued, insert=not dropped - planned - {interrupted}))
        timeline = apply(timeline, delta)
    if streaming:
        history.lengthen_last(timeline)
    return timeline
