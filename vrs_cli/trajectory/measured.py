"""The measured timeline: the joint positions that the real or simulated arm has reported, in time order, with
interpolation between two reports.

The timeline is a record: reports are added to it, but never changed or removed. Between two reports joints are
interpolated: by the cubic with their positions and velocities if both have a velocity (cubic Hermite interpolation),
else by a straight line. The joints are unknown (None) before the first report, after the last one, and between two
reports that are more than GAP seconds apart.

Reports are kept in chunks of columns: for each joint 8 bytes of position and 4 of velocity (if there is one), and 9
bytes for the time and the mode. A `MeasuredTimeline` is a view that never changes, so readers can go on using it while
reports are added.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import accumulate, pairwise
from math import inf, isfinite, nan
from operator import attrgetter
from typing import TYPE_CHECKING, overload

from msgspec import Struct, structs

from vrs_cli.errors import IllegalValue
from vrs_cli.kinematics.joints import Joints
from vrs_cli.trajectory.instant import LATEST, on_grid
from vrs_cli.trajectory.polynomial import Polynomial
from vrs_cli.trajectory.reports import MAX_NUMBER, MODE, MODES, ReportArrays, ReportColumns
from vrs_cli.trajectory.segment import JointPath, Phase, Segment, rest
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.commands import Motion, MotionKind, Start
from vrs_cli.values.measured import MAX_LATENESS_S, BodyMode, Report, ReportCounts

if TYPE_CHECKING:
    from vrs_cli.kinematics.arrays import Floats

GAP = 0.5  # [s] joints are interpolated between two reports only if these are at most this far apart
MEASURED = Motion(0, MotionKind.JOINT, Start.AT, text="measured")

_begin, _end = attrgetter("begin"), attrgetter("end")


class _Between(Struct, frozen=True):
    """A time `s` seconds after the report at index `place` of `chunk`; the next report, `after`, is `h` seconds later.
    `after` is None if no report follows within GAP seconds; then `s` is 0.
    """

    chunk: ReportColumns
    place: int
    after: tuple[ReportColumns, int] | None
    s: float
    h: float


class MeasuredTimeline(Sequence[Report]):
    """An immutable view of all reports up to some moment, in time order. The module's docstring explains when the
    joints are known.
    """

    __slots__ = ("_chunks", "_firsts", "_last", "joint_count")

    def __init__(self, joint_count: int, chunks: tuple[ReportColumns, ...] = ()) -> None:
        self.joint_count = joint_count
        # number of reports of the last chunk in this view; the chunk may grow
        self._last = chunks[-1].count if chunks else 0
        self._chunks = chunks
        self._firsts: list[int] | None = None  # index of the first report of each chunk, and the number of all reports

    # --- reports ---

    def __len__(self) -> int:
        return self._indices()[-1]

    def _indices(self) -> list[int]:
        """Return the index of the first report of each chunk, and the number of all reports."""
        if self._firsts is None:
            counts = [*[chunk.count for chunk in self._chunks[:-1]], self._last][: len(self._chunks)]
            self._firsts = list(accumulate(counts, initial=0))
        return self._firsts

    @overload
    def __getitem__(self, index: int) -> Report: ...
    @overload
    def __getitem__(self, index: slice) -> list[Report]: ...
    def __getitem__(self, index: int | slice) -> Report | list[Report]:
        if isinstance(index, slice):
            return [self[i] for i in range(*index.indices(len(self)))]
        at = index + len(self) if index < 0 else index
        if not 0 <= at < len(self):
            raise IndexError(index)
        chunk = bisect_right(self._indices(), at) - 1
        return self._chunks[chunk].report(at - self._indices()[chunk])

    def __iter__(self) -> Iterator[Report]:
        for chunk, first, last in self.parts():
            yield from map(chunk.report, range(first, last))

    def __eq__(self, other: object) -> bool:
        return (
            isinstance(other, MeasuredTimeline)
            and len(self) == len(other)
            and all(a == b for a, b in zip(self, other, strict=True))
        )

    def __hash__(self) -> int:
        return hash((len(self), self.start, self.end))

    def __repr__(self) -> str:
        if self.start is None or self.end is None:
            return "<MeasuredTimeline: no report>"
        return f"<MeasuredTimeline: {len(self)} reports, {self.start:.3f} to {self.end:.3f} s>"

    @property
    def start(self) -> float | None:
        """The time of the first report [s]; None if there is none."""
        return self._chunks[0].begin if self._chunks else None

    @property
    def end(self) -> float | None:
        """The time of the last report [s], after which nothing is known; None if there is none."""
        return self._chunks[-1].times[self._last - 1] if self._chunks else None

    unknown_since = end

    @property
    def last(self) -> Report | None:
        return self._chunks[-1].report(self._last - 1) if self._chunks else None

    def parts(self, begin: float | None = None, end: float | None = None) -> Iterator[tuple[ReportColumns, int, int]]:
        """Yield (columns, first, last) for each chunk that has reports from time `begin` to time `end` [s], both
        included: `first` is the index of its first report in this interval, `last` the index after its last one.
        """
        for index, chunk in enumerate(self._chunks):
            count = self._last if index == len(self._chunks) - 1 else chunk.count
            first = 0 if begin is None else bisect_left(chunk.times, begin, 0, count)
            last = count if end is None else bisect_right(chunk.times, end, 0, count)
            if first < last:
                yield chunk, first, last

    def between(self, begin: float, end: float) -> Iterator[Report]:
        """Yield the reports from time `begin` to time `end` [s], both included."""
        for chunk, first, last in self.parts(begin, end):
            yield from map(chunk.report, range(first, last))

    def arrays(self, begin: float | None = None, end: float | None = None) -> ReportArrays:
        """Return the reports from time `begin` to time `end` [s] as arrays."""
        import numpy as np

        parts = [chunk.arrays(first, last) for chunk, first, last in self.parts(begin, end)]
        parts = parts or [ReportColumns(self.joint_count).arrays(0, 0)]
        return ReportArrays(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))

    # --- the measured joints at any time ---

    def joints_at(self, t: float) -> Joints | None:
        """Return the joints at time t [rad, m], interpolated between reports; None where the joints are unknown."""
        found = self._around(t)
        if found is None:
            return None
        chunk, place, after, s, h = found.chunk, found.place, found.after, found.s, found.h
        if after is None or not s:
            return chunk.joints(place)
        q0, q1 = chunk.joints(place), after[0].joints(after[1])
        v0, v1 = chunk.velocity(place), after[0].velocity(after[1])
        u = s / h
        if v0 is None or v1 is None:
            return tuple([a + u * (b - a) for a, b in zip(q0, q1, strict=True)])
        w = u * u * (3.0 - 2.0 * u)
        c0, c1 = s * (1.0 - u) * (1.0 - u), s * u * (u - 1.0)
        return tuple([a + w * (b - a) + (c0 * va + c1 * vb) for a, b, va, vb in zip(q0, q1, v0, v1, strict=True)])

    def velocity_at(self, t: float) -> Joints | None:
        """Return the velocity of the joints at time t [rad/s, m/s]: at a report its velocity, else the derivative of
        the interpolation of `joints_at`. None where the joints are unknown, and at a report without a velocity if no
        report follows within GAP.
        """
        found = self._around(t)
        if found is None:
            return None
        chunk, place, after, s, h = found.chunk, found.place, found.after, found.s, found.h
        v0 = chunk.velocity(place)
        if after is None or (v0 is not None and not s):
            return v0
        q0, q1, v1 = chunk.joints(place), after[0].joints(after[1]), after[0].velocity(after[1])
        if v0 is None or v1 is None:
            return tuple([(b - a) / h for a, b in zip(q0, q1, strict=True)])
        u = s / h
        rise, c0, c1 = 6.0 * u * (1.0 - u) / h, (1.0 - u) * (1.0 - 3.0 * u), u * (3.0 * u - 2.0)
        return tuple([rise * (b - a) + c0 * va + c1 * vb for a, b, va, vb in zip(q0, q1, v0, v1, strict=True)])

    def mode_at(self, t: float) -> BodyMode | None:
        """Return the mode in the last report up to time t [s]; None where the joints are unknown."""
        found = self._around(t)
        return None if found is None else MODES[found.chunk.flags[found.place] & MODE]

    def _around(self, t: float) -> _Between | None:
        """Find the reports before and after a time [s]. None where the joints are unknown."""
        index = bisect_right(self._chunks, t, key=_begin) - 1
        if index < 0 or t != t:
            return None
        chunk, is_last = self._chunks[index], index == len(self._chunks) - 1
        count = self._last if is_last else chunk.count
        place = bisect_right(chunk.times, t, 0, count) - 1
        begin = chunk.times[place]
        after = (chunk, place + 1) if place + 1 < count else None if is_last else (self._chunks[index + 1], 0)
        h = after[0].times[after[1]] - begin if after is not None else inf
        if h <= GAP:
            return _Between(chunk, place, after, t - begin, h)
        return _Between(chunk, place, None, 0.0, h) if t == begin else None

    def joints_over(self, times: Floats) -> Floats:
        """Return `joints_at` for times (N,) [s] in any order: (N, n), with rows of NaN if the joints are unknown."""
        import numpy as np

        times = np.asarray(times, dtype=float)
        found = np.full((len(times), self.joint_count), nan)
        if not len(times) or not self._chunks:
            return found
        at, q, v, _, _ = self.arrays(float(times.min()) - GAP, float(times.max()) + GAP)
        if not len(at):
            return found
        places = np.searchsorted(at, times, side="right") - 1
        after = np.minimum(places + 1, len(at) - 1)
        before = np.maximum(places, 0)
        exact = (places >= 0) & (at[before] == times)
        h = at[after] - at[before]
        inside = ~exact & (places >= 0) & (places + 1 < len(at)) & (h <= GAP)
        found[exact] = q[before[exact]]
        a, b, h = before[inside], after[inside], h[inside][:, None]
        s = times[inside][:, None] - at[a][:, None]
        u = s / h
        smooth = ~np.isnan(v[a, :1] + v[b, :1])
        w = np.where(smooth, u * u * (3.0 - 2.0 * u), u)
        bends = np.where(smooth, s * (1.0 - u) * (1.0 - u) * v[a] + s * u * (u - 1.0) * v[b], 0.0)
        found[inside] = q[a] + w * (q[b] - q[a]) + bends
        return found

    # --- as a timeline of segments ---

    def as_timeline(self, begin: float, end: float, like: Timeline | None = None) -> Timeline | None:
        """Return the reports from time `begin` to time `end` [s] as a timeline of segments, so that code for timelines
        also reads measured ones. The segments interpolate between reports in the same way as `joints_at`, but the robot
        is at rest while the joints are unknown. BASE, TOOL and events are copied from the timeline `like`. Times are
        rounded to the grid of timelines (0.93 ns). Return None if there is no report.
        """
        reports = list(self.between(begin, end))
        if not reports:
            return None
        first, last, motion = reports[0], reports[-1], MEASURED
        segments: list[Segment] = []
        for a, b in pairwise(reports):
            if like is not None and (frames := like.locate(a.t)[0].motion.frames) is not motion.frames:
                motion = structs.replace(MEASURED, frames=frames)
            segments += _stretch(a, b, motion) if b.t - a.t <= GAP else [rest(a.joints, 0.0, on_grid(a.t), motion)]
        frames = MEASURED.frames if like is None else like.locate(last.t)[0].motion.frames
        segments.append(rest(last.joints, 0.0, on_grid(last.t), structs.replace(MEASURED, frames=frames)))
        before = rest(first.joints, 0.0, on_grid(first.t), segments[0].motion)
        return Timeline([before, *segments], events=() if like is None else like.event_slice(0, like.events_by(last.t)))


class MeasuredRecord:
    """The growing record of the reports of one robot. One thread adds reports; any thread may read `view`. `listeners`
    are called with the added reports in the order of arrival.
    """

    def __init__(self, joint_count: int) -> None:
        self.joint_count = joint_count
        self.listeners: list[Callable[[Sequence[Report]], None]] = []
        self._chunks: list[ReportColumns] = []
        self._version = 0  # number that changes whenever the reports change
        self._view = 0, MeasuredTimeline(joint_count)

    def __len__(self) -> int:
        return sum(chunk.count for chunk in self._chunks)

    @property
    def view(self) -> MeasuredTimeline:
        """All reports so far, as a view that later reports do not change."""
        version, view = self._view
        if version != self._version:
            version = self._version  # read first: if reports are added during this call, the next call makes a new view
            view = MeasuredTimeline(self.joint_count, tuple(self._chunks))
            self._view = version, view
        return view

    def add(self, reports: Iterable[Report]) -> ReportCounts:
        """Insert reports in order of time, and return how many were late, duplicate or reordered. If several reports
        have the same time, the first stays; a report more than MAX_LATENESS_S older than the newest is dropped. Raises
        IllegalValue for a malformed report, and then adds nothing.
        """
        rows = [self._check_report(report) for report in reports]
        late = duplicate = reordered = 0
        taken = []
        for report in rows:
            newest = self._chunks[-1].end if self._chunks else None
            if newest is None or report.t > newest:
                self._append(report)
            elif report.t < newest - MAX_LATENESS_S:
                late += 1
                continue
            elif self._insert(report):
                reordered += 1
            else:
                duplicate += 1
                continue
            taken.append(report)
        self._version += 1
        for listener in self.listeners if taken else ():
            listener(taken)
        return ReportCounts(len(rows), 0, late, duplicate, reordered)

    def _check_report(self, report: Report) -> Report:
        if not abs(report.t) <= LATEST:
            raise IllegalValue(f"time {report.t:g} s of a report", f"at most {LATEST:g} s", value=report.t)
        for name, row in (("joints", report.joints), ("velocity", report.velocity), ("effort", report.effort)):
            if row is None:
                continue
            if len(row) != self.joint_count:
                raise IllegalValue(
                    f"{len(row)} values of {name} in a report", f"the robot has {self.joint_count} joints"
                )
            for joint, value in enumerate(row, 1):
                if not (isfinite(value) and abs(value) <= MAX_NUMBER):
                    detail = f"{name} of joint {joint} in a report is {value:g}"
                    raise IllegalValue(detail, f"at most {MAX_NUMBER:g}", value=value, joint=joint)
        return report

    def _append(self, report: Report) -> None:
        if not self._chunks or self._chunks[-1].full:
            made = ReportColumns(self.joint_count)
            made.put(report)  # first: readers must not see columns without a report
            self._chunks.append(made)
        else:
            self._chunks[-1].put(report)

    def _insert(self, report: Report) -> bool:
        """Insert a report before later ones; return False if there is a report at its time. The chunk is replaced by a
        copy, so readers of the old chunk are not disturbed.
        """
        index = max(bisect_right(self._chunks, report.t, key=_begin) - 1, 0)
        chunk = self._chunks[index]
        place = bisect_left(chunk.times, report.t, 0, chunk.count)
        if place < chunk.count and chunk.times[place] == report.t:
            return False
        self._chunks[index] = chunk.with_report(report)
        return True

    def add_columns(self, columns: ReportColumns) -> None:
        """Insert reports that are in time order and already checked, such as those from a file; none counts as late. If
        several reports have the same time, the first stays.
        """
        later = not self._chunks or columns.begin > self._chunks[-1].end
        for report in () if later else map(columns.report, range(columns.count)):
            if report.t > self._chunks[-1].end:
                self._append(report)
            else:
                self._insert(report)
        first = 0 if later else columns.count
        while first < columns.count:
            fresh = not self._chunks or self._chunks[-1].full
            chunk = ReportColumns(self.joint_count) if fresh else self._chunks[-1]
            last = min(first + len(chunk.flags) - chunk.count, columns.count)
            chunk.extend(columns, first, last)
            if fresh:
                self._chunks.append(chunk)
            first = last
        self._version += 1

    def take(self, other: MeasuredTimeline) -> None:
        """Insert all reports of a measured timeline; the rules of `add_columns` hold."""
        for columns, first, last in other.parts():
            part = ReportColumns(self.joint_count, last - first)
            part.extend(columns, first, last)
            self.add_columns(part)

    def forget_before(self, t: float) -> None:
        """Drop the chunks whose reports are all earlier than t [s], except the last chunk."""
        gone = min(bisect_left(self._chunks, t, key=_end), len(self._chunks) - 1)
        if gone > 0:
            del self._chunks[:gone]
            self._version += 1


def _stretch(a: Report, b: Report, motion: Motion) -> list[Segment]:
    """Return the segment from report a to report b in a list; return an empty list if no time passes between them."""
    start, finish = on_grid(a.t), on_grid(b.t)
    h = finish - start
    if h <= 0.0:
        return []
    rows: list[Polynomial] = [(p, (q - p) / h) for p, q in zip(a.joints, b.joints, strict=True)]
    if a.velocity is not None and b.velocity is not None:
        bends = zip(rows, a.velocity, b.velocity, strict=True)
        rows = [(p, v, (3.0 * m - 2.0 * v - w) / h, (v + w - 2.0 * m) / (h * h)) for (p, m), v, w in bends]
    return [Segment(start, finish, JointPath(tuple(rows)), Phase.CRUISE, motion)]
