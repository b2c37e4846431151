"""The way of the tool tip as lines: few points, by curvature and not by time, near enough to where g leads it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import pairwise
from math import ceil, dist
from typing import NamedTuple

from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.transform import Vector, dot, inverse, moved_point, position, subtracted
from vrs_cli.trajectory.polynomial import value
from vrs_cli.trajectory.segment import JointPath, Phase, Segment
from vrs_cli.trajectory.timeline import Timeline

TURN = 0.5  # [rad, m] of all joints together: on so short a way the tip turns to and fro once at most
PROBES = (0.25, 0.5, 0.75)  # of a line: where its distance from the way is looked at
MARGIN = 0.8  # of the error: between the probes the way is a little farther from its line
DEEPEST = 12  # halvings: a line of 1 s is not made shorter than 0.25 ms

Tip = Callable[[float], Vector]  # where the tool tip is in the world [m], s seconds into a segment


class ToolLine(NamedTuple):
    """What the tool tip does in one segment, from `begin` to `end` [s]: points in the world [m]."""

    motion: int
    phase: Phase
    begin: float
    end: float
    points: tuple[Vector, ...]


def tool_lines(arm: RobotArm, timeline: Timeline, begin: float, end: float, error: float) -> Iterator[ToolLine]:
    """One line a segment that moves, of those between two times [s]. No point of the way is farther than `error` [m]
    from its line.
    """
    for segment in segments_between(timeline, begin, end):
        first, last = max(begin - segment.start, 0.0), min(end, segment.finish) - segment.start
        if segment.phase is not Phase.REST and last > first:
            points = tuple(line_points(arm, segment, first, last, error))
            yield ToolLine(segment.motion.number, segment.phase, segment.start + first, segment.start + last, points)


def segments_between(timeline: Timeline, begin: float, end: float) -> Iterator[Segment]:
    """Those in force from time `begin` to `end` [s]."""
    if begin <= end:
        yield from (timeline[index] for index in range(timeline.index_at(begin), timeline.index_at(end) + 1))


def line_points(arm: RobotArm, segment: Segment, first: float, last: float, error: float) -> Iterator[Vector]:
    """The points of a line, from `first` to `last` seconds into a segment."""
    tip, pieces = tip_of(arm, segment), _pieces(segment, last - first)
    times = [first + (last - first) * k / pieces for k in range(pieces + 1)]
    yield tip(first)
    for a, b in pairwise(times):
        yield from _refined(tip, (a, tip(a)), (b, tip(b)), MARGIN * error, DEEPEST)


def tip_of(arm: RobotArm, segment: Segment) -> Tip:
    """Where the tool tip is while a segment is in force."""
    path, frames = segment.path, segment.motion.frames
    T_world_robot, p_flange_tip = inverse(frames.base), position(frames.tool)
    if isinstance(path, JointPath):
        return lambda s: moved_point(T_world_robot, moved_point(arm.forward(path.joints(s)), p_flange_tip))
    x, y, z = path.position
    return lambda s: moved_point(T_world_robot, (value(x, s), value(y, s), value(z, s)))


def _pieces(segment: Segment, duration: float) -> int:
    """In how many parts of equal time the way is looked at."""
    if not isinstance(segment.path, JointPath):
        return 1
    way = sum(high - low for low, high in segment.path.extremes(segment.duration))
    return max(ceil(way / TURN * duration / segment.duration), 1)


def _refined(tip: Tip, a: tuple[float, Vector], b: tuple[float, Vector], error: float, depth: int) -> Iterator[Vector]:
    """The points behind `a` up to `b`, times [s] and points, that a line needs."""
    (t0, p0), (t1, p1) = a, b
    probes = [tip(t0 + part * (t1 - t0)) for part in PROBES]
    if depth == 0 or max(distance_from_line(p, p0, p1) for p in probes) <= error:
        yield p1
        return
    middle = (0.5 * (t0 + t1), probes[1])
    yield from _refined(tip, a, middle, error, depth - 1)
    yield from _refined(tip, middle, b, error, depth - 1)


def distance_from_line(p: Vector, a: Vector, b: Vector) -> float:
    """Of a point from the straight line that ends in a and b."""
    along, there = subtracted(b, a), subtracted(p, a)
    square = dot(along, along)
    part = min(max(dot(there, along) / square, 0.0), 1.0) if square > 0.0 else 0.0
    return dist(there, (part * along[0], part * along[1], part * along[2]))
