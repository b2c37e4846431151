"""Compare two histories of one robot, or a timeline with the measured joints of the real arm."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from itertools import takewhile, zip_longest
from math import inf
from typing import TYPE_CHECKING, Any

from msgspec import structs

from vrs_cli.engine.book import Book
from vrs_cli.engine.history import HistoryStep
from vrs_cli.engine.position import PlaceArrays, places_at
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.trajectory.rope import RowPart
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.reports import Apart, Comparison, Extent, Pair

if TYPE_CHECKING:
    from vrs_cli.kinematics.arrays import Floats
from itertools import pairwise
from math import nan, sqrt
from typing import TYPE_CHECKING

from vrs_cli.engine.position import poses_along, position_at, world_pose
from vrs_cli.trajectory.measured import GAP, MeasuredTimeline
from vrs_cli.values.measured import Deviation, MeasuredComparison, MeasuredPosition
from vrs_cli.values.numbers import seconds
from vrs_cli.values.results import Position

if TYPE_CHECKING:
    from vrs_cli.kinematics.arrays import Floats


MAX_TIMELINE_SAMPLES = 200_000  # maximum number of samples of one timeline in a comparison
DENSEST, SPARSEST = 32, 2  # maximum and minimum number of samples in each segment
CLOSER_SAMPLES = 64  # number of samples around the greatest distance, to locate it more exactly
CLOSER_ROUNDS = 3
DISTANCE_ROUNDING = 1e-12  # [m, rad] distances that differ by less, by rounding, count as equal

# returns the k compared vectors of dimension d at each of N times: (N, k, d)
Compared = Callable[[PlaceArrays], "Floats"]


def compare(arm: RobotArm, a: Book, b: Book) -> Comparison:
    """Compare two histories of one robot: return the greatest distance between their tools and between their joints,
    and the commands of both. Commands are in the order of `a`, followed by the commands that only `b` has.
    """
    import numpy as np

    since = first_difference(a.timeline, b.timeline)
    tool = joints = Apart(0.0, a.timeline.start)
    if since is not None:
        times = np.unique(np.concatenate((*(_sample_times(book.timeline, since) for book in (a, b)), [since])))
        here = places_at(arm, a.timeline, times), places_at(arm, b.timeline, times)
        tool = _greatest(arm, a.timeline, b.timeline, here, lambda at: at.T_world_tool[:, None, :, 3])
        tool = structs.replace(tool, joint=0)
        joints = _greatest(arm, a.timeline, b.timeline, here, lambda at: at.joints[:, :, None])
    others = dict(zip(map(_identity, b.history.known_commands), b.records(), strict=True))
    rows = zip(a.history.known_commands, a.records(), strict=True)
    pairs = [Pair(record, others.pop(_identity(step), None)) for step, record in rows]
    pairs += [Pair(None, record) for record in others.values()]
    return Comparison(_extent(arm, a), _extent(arm, b), tuple(pairs), since, tool, joints)


def first_difference(a: Timeline, b: Timeline) -> float | None:
    """Return the first time [s] at which two timelines may differ in motions, the hand or signals; None if they never
    differ.
    """
    times = [t for t in (_first_other_segment(a, b), _first_other_event(a, b)) if t is not None]
    return min(times, default=None)


def _first_other_event(a: Timeline, b: Timeline) -> float | None:
    if a.same_events(b):
        return None
    changes = ([event for event in one.events if not event.observed] for one in (a, b))
    for one, other in zip_longest(*changes):
        if one is None or other is None:
            return float((one or other).time)
        if (one.time, one.channel, one.value, one.duration) != (other.time, other.channel, other.value, other.duration):
            return float(min(one.time, other.time))
    return None


def _first_other_segment(a: Timeline, b: Timeline) -> float | None:
    ours, theirs = list(a.blocks(-inf, inf)), list(b.blocks(-inf, inf))
    pairs = zip(ours, theirs, strict=False)
    same = (a.row is b.row and (a.offset, a.first, a.last) == (b.offset, b.first, b.last) for a, b in pairs)
    # number of blocks at the start that both timelines share: the same part of a row at the same time
    shared = sum(1 for _ in takewhile(bool, same))
    for one, other in zip_longest(_courses(ours[shared:]), _courses(theirs[shared:])):
        if one is None or other is None:
            return float((one or other)[0])
        if one != other:
            return float(min(one[-1], other[-1]) if one[:-1] == other[:-1] else min(one[0], other[0]))
    return None


def _courses(blocks: Iterable[RowPart]) -> Iterator[Any]:
    """Yield what the robot does in each segment, without the command that caused it: start [s], path, frames, and
    finish [s].
    """
    for block in blocks:
        (starts, finishes), part = block.times(), slice(block.first, block.last)
        paths, motions = block.row.paths[part], block.row.motions[part]
        for start, path, motion, finish in zip(starts, paths, motions, finishes, strict=True):
            yield start, path, motion.frames, finish


# --- one timeline ---------------------------------------------------------------------------------------------------


def _extent(arm: RobotArm, book: Book) -> Extent:
    """Measure one history: its duration, commands, segments, and the path lengths of tool and joints."""
    import numpy as np

    timeline = book.timeline
    here = places_at(arm, timeline, _sample_times(timeline))
    slides = np.array([arm.model.units.slides(joint) for joint in range(1, arm.model.joint_count + 1)])
    travel = np.abs(np.diff(here.joints, axis=0)).sum(axis=0)
    return Extent(
        duration=timeline.end - timeline.start,
        commands=book.history.commands,
        segments=len(timeline) - 1,
        tool_path=float(np.linalg.norm(np.diff(here.T_world_tool[:, :, 3], axis=0), axis=1).sum()),
        joint_travel=float(travel[~slides].sum()),
        joint_slide=float(travel[slides].sum()),
    )


def _sample_times(timeline: Timeline, since: float = 0.0) -> Floats:
    """Return the boundaries of the moving segments and equidistant times between them [s], in order, each once."""
    import numpy as np

    tables = [(block.offset, *block.table()) for block in timeline.blocks(since, inf)]
    ends = [np.stack((table.starts[part], table.finishes[part]), axis=1) + offset for offset, table, part in tables]
    edges = np.concatenate(ends)
    moving = edges[(edges[:, 1] >= since) & ~np.concatenate([table.resting[part] for _, table, part in tables])]
    if not len(moving):
        return np.array([timeline.start, timeline.end])
    count = int(min(max(MAX_TIMELINE_SAMPLES // len(moving), SPARSEST), DENSEST))
    shares = np.linspace(0.0, 1.0, count)
    times = np.concatenate(([timeline.start], (moving[:, :1] + np.diff(moving) * shares).ravel(), [timeline.end]))
    return times[np.diff(times, prepend=-inf) > 0.0]  # drop duplicates: a segment begins when the previous one ends


# --- distances ------------------------------------------------------------------------------------------------------


def _greatest(
    arm: RobotArm, a: Timeline, b: Timeline, here: tuple[PlaceArrays, PlaceArrays], compared: Compared
) -> Apart:
    """Return the greatest distance. Search among the sampled times first, then take more and more samples around the
    time found.
    """
    for _ in range(CLOSER_ROUNDS - 1):
        _, times = _farthest(*here, compared)
        here = places_at(arm, a, times), places_at(arm, b, times)
    return _farthest(*here, compared)[0]


def _farthest(a: PlaceArrays, b: PlaceArrays, compared: Compared) -> tuple[Apart, Floats]:
    """Return the greatest distance at the common times, and closely spaced times around the time of that distance."""
    import numpy as np

    times, found = a.times, np.linalg.norm(compared(a) - compared(b), axis=2)
    farthest = found.max(axis=1)
    # the first time at which the distance is greatest, apart from rounding
    place = int(np.argmax(farthest >= farthest.max() - DISTANCE_ROUNDING))
    best = Apart(float(found[place].max()), float(times[place]), int(np.argmax(found[place])) + 1)
    near = times[max(place - 1, 0) : place + 2]
    return best, np.unique(np.concatenate((np.linspace(near[0], near[-1], CLOSER_SAMPLES), [times[place]])))


def _identity(step: HistoryStep) -> tuple[object, ...]:
    """Return the fields that identify a command, so that it is found both on main and on a branch."""
    motion = step.delta.motion
    return motion.number, motion.text, motion.kind, motion.goal, motion.pose


REPORTS_AT_ONCE = 20_000  # maximum number of reports whose poses are in memory at once


def measured_position(
    arm: RobotArm, timeline: Timeline, measured: MeasuredTimeline, t: float
) -> MeasuredPosition | None:
    """Return the measured position of the robot at t [s], with BASE and TOOL of the timeline; None where the measured
    joints are unknown.
    """
    joints, mode = measured.joints_at(t), measured.mode_at(t)
    if joints is None or mode is None:
        return None
    expected = position_at(arm, timeline, t)
    still = (0.0,) * len(joints)
    velocity = measured.velocity_at(t) or still
    pose = world_pose(arm, timeline.locate(t)[0].motion.frames, joints)
    at = Position(t, joints, velocity, still, pose, expected.hand, expected.moving, expected.text)
    return MeasuredPosition(at, expected, mode)


def why_unknown(measured: MeasuredTimeline, t: float) -> str:
    """Return why the measured position at t [s] is unknown, although there are reports."""
    assert measured.start is not None, "there are reports"
    assert measured.end is not None, "there are reports"
    if t > measured.end:
        why = f"the last report is of {seconds(measured.end)}"
    elif t < measured.start:
        why = f"the first report is of {seconds(measured.start)}"
    else:
        why = f"there is no report for more than {seconds(GAP)} about then"
    return f"The measured robot is unknown at {seconds(t)}: {why}"


def compare_measured(arm: RobotArm, timeline: Timeline, measured: MeasuredTimeline) -> MeasuredComparison | None:
    """Compare each report with the planned position at the same time; None if there is no report."""
    if measured.start is None or measured.end is None:
        return None
    unknown, before = 0.0, measured.start
    joints = [_Sum() for _ in range(arm.model.joint_count)]
    tool, turned = _Sum(), _Sum()
    for columns, begin, end in measured.parts():
        for first in range(begin, end, REPORTS_AT_ONCE):
            at = columns.arrays(first, min(first + REPORTS_AT_ONCE, end))
            _add(arm, timeline, at.times, at.joints, (*joints, tool, turned))
            times = [before, *at.times.tolist()]
            unknown += sum(b - a for a, b in pairwise(times) if b - a > GAP)
            before = times[-1]
    return MeasuredComparison(
        begin=measured.start,
        end=measured.end,
        reports=len(measured),
        unknown=unknown,
        tool=tool.deviation(),
        turned=turned.deviation(),
        joints=tuple(one.deviation(number) for number, one in enumerate(joints, 1)),
    )


def _add(arm: RobotArm, timeline: Timeline, times: Floats, joints: Floats, sums: tuple[_Sum, ...]) -> None:
    """Add the differences between reports (N,), with joints (N, n), and the planned motion to `sums`: of each joint, of
    the tool's position, and of its orientation.
    """
    import numpy as np

    expected, here = places_at(arm, timeline, times), poses_along(arm, timeline, times, joints)
    apart = expected.T_world_tool - here.T_world_tool
    distance = np.linalg.norm(apart[:, :, 3], axis=1)
    # the sine of half the angle between the two orientations
    chord = np.linalg.norm(apart[:, :, :3], axis=(1, 2)) / sqrt(8.0)
    angle = 2.0 * np.arcsin(np.minimum(chord, 1.0))
    for one, values in zip(sums, (*np.abs(expected.joints - joints).T, distance, angle), strict=True):
        one.add(times, values)


class _Sum:
    """The greatest of many distances, its time, and the sum of the squares of all distances, for their root mean
    square.
    """

    def __init__(self) -> None:
        self._greatest, self._time, self._squares, self._count = -1.0, nan, 0.0, 0

    def add(self, times: Floats, values: Floats) -> None:
        place = int(values.argmax())
        if values[place] > self._greatest:
            self._greatest, self._time = float(values[place]), float(times[place])
        self._squares += float(values @ values)
        self._count += len(values)

    def deviation(self, joint: int = 0) -> Deviation:
        return Deviation(sqrt(self._squares / self._count), Apart(self._greatest, self._time, joint))
