"""From the deltas of a file to their timeline, quickly and checked."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from itertools import pairwise

from vrs_cli.files.records import RecordError
from vrs_cli.trajectory.delta import TimelineDelta
from vrs_cli.trajectory.segment import Segment
from vrs_cli.trajectory.timeline import Timeline


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
        if delta.keep == self._count and not delta.drop and delta.cut >= self._last.finish:
            self._append(delta)
        else:
            self._edit(delta)

    def timeline(self) -> Timeline:
        """tau after all deltas so far."""
        if self._run:
            self._put_on_run()
        return self._timeline

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


def _edges(segments: Iterable[Segment]) -> list[float]:
    return [edge for segment in segments for edge in (segment.start, segment.finish)]


def _check_order(edges: Iterable[float]) -> None:
    if not all(earlier <= later for earlier, later in pairwise(edges)):
        raise RecordError("the segments overlap in time")
