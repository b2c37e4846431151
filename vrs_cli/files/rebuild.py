"""From the deltas of a file to their timeline, quickly and checked."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from itertools import pairwise

from vrs_cli.engine.history import History, Step
from vrs_cli.trajectory.delta import Cause, TimelineDelta
from vrs_cli.trajectory.segment import Segment
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.wire.records import RecordError


class Rebuilding:
    """tau[k] while deltas are added.

    Deltas that only append are put on together at the end of their run: what a single append makes anew along the
    edge of the rope is made once for all of them.
    """

    def __init__(self, initial: Iterable[Segment]) -> None:
        self._timeline = Timeline(initial)
        self._run: list[TimelineDelta] = []
        self._take_stock()

    def _take_stock(self) -> None:
        self._version = self._timeline.version
        self._count = len(self._timeline)
        self._last = self._timeline[-1]

    def add(self, delta: TimelineDelta) -> None:
        """Apply one delta. Raises RecordError when it cannot be the next."""
        if delta.version != self._version:
            raise RecordError(f"a delta of timeline version {delta.version}; version {self._version} is due here")
        if self.only_appends(delta):
            self._append(delta)
        else:
            self._edit(delta)

    def only_appends(self, delta: TimelineDelta) -> bool:
        return delta.keep == self._count and not delta.drop and delta.cut >= self._last.finish

    def timeline(self) -> Timeline:
        """tau after all deltas so far."""
        if self._run:
            self._put_on_run()
        return self._timeline

    @property
    def end(self) -> float:
        """When the last segment finishes [s]."""
        return self._last.finish

    def _append(self, delta: TimelineDelta) -> None:
        _check_order([self._last.finish, *_edges(delta.segments)])
        self._run.append(delta)
        self._version += 1
        if delta.segments:
            self._count += len(delta.segments)
            self._last = delta.segments[-1]

    def _put_on_run(self) -> None:
        segments = tuple(segment for delta in self._run for segment in delta.segments)
        first = self._run[0]
        whole = replace(first, cut=max(first.cut, self._timeline.end), shift=0.0, segments=segments)
        self._timeline = self._timeline.apply(whole)
        self._timeline.version = self._version  # not shared yet; it stands for a whole run of versions
        self._run = []

    def _edit(self, delta: TimelineDelta) -> None:
        timeline = self.timeline()
        after = delta.keep + delta.drop
        if after > self._count:
            raise RecordError(f"keeps {delta.keep} and drops {delta.drop} of {self._count} segments")
        if after == self._count and not delta.keep and not delta.segments:
            raise RecordError("leaves a timeline without segments")
        edges = _edges(delta.segments)
        if delta.keep:
            last = timeline[delta.keep - 1]
            edges = [last.start, min(last.finish, delta.cut), *edges]
        if after < self._count:
            edges.append(timeline[after].start + delta.shift)
        _check_order(edges)
        self._timeline = timeline.apply(delta)
        self._take_stock()


# --- what can be undone ------------------------------------------------------------------------------------------


def history_of(initial: Iterable[Segment], deltas: Iterable[TimelineDelta]) -> History:
    """The commands that hold after a row of deltas, and those that were undone last, as if they had just been given.

    The targets of a stream, which are of one motion, are one command. A file does not tell the clock: UNDO goes back to
    the issue time of a command, REDO to the end of the timeline.
    """
    history, rebuilding, streaming = History(), Rebuilding(initial), False
    for delta in deltas:
        goes_on = _goes_on(history, delta)
        if streaming and not goes_on:
            history.lengthen_last(rebuilding.timeline())
        streaming = goes_on
        if delta.cause is Cause.UNDO:
            history.take_back(rebuilding.end)
        elif delta.cause is Cause.REDO:
            history.do_again()
        elif not goes_on:
            history.add(_step(rebuilding, delta))
        rebuilding.add(delta)
    if streaming:
        history.lengthen_last(rebuilding.timeline())
    return history


def _goes_on(history: History, delta: TimelineDelta) -> bool:
    """Whether a delta has one more target of the stream that is the last command."""
    if delta.cause is not Cause.COMMAND or not history.done:
        return False
    return delta.motion.number == history.done[-1].delta.motion.number


def _step(rebuilding: Rebuilding, delta: TimelineDelta) -> Step:
    """The timeline before is put together only for a delta that does more than append."""
    if not rebuilding.only_appends(delta):
        before = rebuilding.timeline()
        return Step.of(before, delta, delta.issued, insert=not _overrides(before, delta))
    back = replace(
        delta, cause=Cause.UNDO, cut=rebuilding.end, drop=len(delta.segments), shift=0.0 - delta.shift, segments=()
    )
    return Step(delta, back, delta.issued)


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
