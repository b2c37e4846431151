"""Two courses of events side by side: how long, how far, which commands, and how far apart the robot is at most."""

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
from vrs_cli.values.results import Apart, Comparison, Extent, Pair

if TYPE_CHECKING:
    from vrs_cli.kinematics.arrays import Floats


MOST_SAMPLES = 200_000  # of one timeline
DENSEST, SPARSEST = 32, 2  # samples a segment
CLOSER = 64  # samples between two others, to find the greatest distance exactly
CLOSER_ROUNDS = 3
NOISE = 1e-12  # [m, rad] what rounding makes of one distance

Compared = Callable[[PlaceArrays], "Floats"]  # of what is compared, at each time (N, k, d)


def compare(arm: RobotArm, a: Book, b: Book) -> Comparison:
    """Compare two courses of events of one robot: how far apart the tool and the joints are at most, and which commands
    both have once, in the order of a, then those of b alone.
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
    others = dict(zip(map(_identity, b.history.known), b.records(), strict=True))
    rows = zip(a.history.known, a.records(), strict=True)
    pairs = [Pair(record, others.pop(_identity(step), None)) for step, record in rows]
    pairs += [Pair(None, record) for record in others.values()]
    return Comparison(_extent(arm, a), _extent(arm, b), tuple(pairs), since, tool, joints)


def first_difference(a: Timeline, b: Timeline) -> float | None:
    """The first time at which two timelines may differ [s], the hand and signals too; None where they are the same
    throughout.
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
    shared = sum(1 for _ in takewhile(bool, same))  # parts of one row at the same time
    for one, other in zip_longest(_courses(ours[shared:]), _courses(theirs[shared:])):
        if one is None or other is None:
            return float((one or other)[0])
        if one != other:
            return float(min(one[-1], other[-1]) if one[:-1] == other[:-1] else min(one[0], other[0]))
    return None


def _courses(blocks: Iterable[RowPart]) -> Iterator[Any]:
    """Yield what the robot does in each segment, without the command that asked for it: the start first, the finish
    last.
    """
    for block in blocks:
        (starts, finishes), part = block.times(), slice(block.first, block.last)
        paths, motions = block.row.paths[part], block.row.motions[part]
        for start, path, motion, finish in zip(starts, paths, motions, finishes, strict=True):
            yield start, path, motion.frames, finish


# --- how far ---------------------------------------------------------------------------------------------------


def _extent(arm: RobotArm, book: Book) -> Extent:
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
    """Return the boundaries of moving segments and times between them [s], in order, each once."""
    import numpy as np

    tables = [(block.offset, *block.table()) for block in timeline.blocks(since, inf)]
    ends = [np.stack((table.starts[part], table.finishes[part]), axis=1) + offset for offset, table, part in tables]
    edges = np.concatenate(ends)
    moving = edges[(edges[:, 1] >= since) & ~np.concatenate([table.resting[part] for _, table, part in tables])]
    if not len(moving):
        return np.array([timeline.start, timeline.end])
    count = int(min(max(MOST_SAMPLES // len(moving), SPARSEST), DENSEST))
    shares = np.linspace(0.0, 1.0, count)
    times = np.concatenate(([timeline.start], (moving[:, :1] + np.diff(moving) * shares).ravel(), [timeline.end]))
    return times[np.diff(times, prepend=-inf) > 0.0]  # a segment begins where the one before ends


# --- how far apart ---------------------------------------------------------------------------------------------


def _greatest(
    arm: RobotArm, a: Timeline, b: Timeline, here: tuple[PlaceArrays, PlaceArrays], compared: Compared
) -> Apart:
    """Find the greatest distance at the sampled times, then around it at times that are closer and closer."""
    for _ in range(CLOSER_ROUNDS - 1):
        _, times = _farthest(*here, compared)
        here = places_at(arm, a, times), places_at(arm, b, times)
    return _farthest(*here, compared)[0]


def _farthest(a: PlaceArrays, b: PlaceArrays, compared: Compared) -> tuple[Apart, Floats]:
    """Return the greatest distance at the times of both, and closer times around it."""
    import numpy as np

    times, found = a.times, np.linalg.norm(compared(a) - compared(b), axis=2)
    farthest = found.max(axis=1)
    place = int(np.argmax(farthest >= farthest.max() - NOISE))  # the first time, where it stays so
    best = Apart(float(found[place].max()), float(times[place]), int(np.argmax(found[place])) + 1)
    near = times[max(place - 1, 0) : place + 2]
    return best, np.unique(np.concatenate((np.linspace(near[0], near[-1], CLOSER), [times[place]])))


def _identity(step: HistoryStep) -> tuple[object, ...]:
    """Return what identifies a command: a branch repeats the commands from before it began."""
    motion = step.delta.motion
    return motion.number, motion.text, motion.kind, motion.goal, motion.pose
