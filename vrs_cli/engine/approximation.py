"""Approximate paths for viewers: the path of the tool tip by lines, and straight lines by cubics of the joints.

Lines have few points. The points are placed by curvature and not by time, close enough that the lines stay near the tip
positions that the position function g returns. The cubics serve viewers that have no inverse kinematics. Each cubic has
the joints and joint velocities of g at both of its ends (Hermite), so neighbouring cubics join without a jump of
position or velocity. A piece that differs from g by more than a tolerance is halved.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise
from math import ceil, dist
from typing import NamedTuple

from vrs_cli.engine.problem import joint_velocity, segment_joints
from vrs_cli.errors import IllegalValue, PathWithoutJoints, StraightLineSingular
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.transform import Vector, dot, inverse, moved_point, position, vector_difference
from vrs_cli.trajectory.polynomial import Polynomial, value
from vrs_cli.trajectory.rope import RowPart
from vrs_cli.trajectory.row import Row
from vrs_cli.trajectory.segment import JointPath, Phase, Segment
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.commands import Motion, MotionKind

# [rad, m] a path is first cut into pieces of equal duration, one for every such amount of joint motion (summed over all
# joints); in so short a piece the tip reverses its direction at most once
MAX_TURN = 0.5
PROBES = (0.25, 0.5, 0.75)  # fractions of a line at which its distance from the path is measured
# fraction of the allowed error at the probes, since between them the path may be farther from its line
LINE_MARGIN = 0.8
MAX_HALVINGS = 12  # maximum number of halvings: pieces of a line of 1 s are not shorter than 0.25 ms
SIGHT_STEP_S = 10.0  # [s] the part with lines begins and ends at multiples of this time, so that it rarely changes

Tip = Callable[[float], Vector]  # the position of the tool tip in the world [m], s seconds into a segment
Place = tuple[float, Vector]  # a time [s], and the position of the tool tip at that time [m]


class ToolLine(NamedTuple):
    """A polyline of the tool tip's path in one segment, or in several steered segments: points in the world [m]. The
    tip is at each point `offset` [s] later than the time in `times`.
    """

    motion: Motion
    phase: Phase
    offset: float
    times: tuple[float, ...]
    points: tuple[Vector, ...]

    @property
    def begin(self) -> float:
        return self.offset + self.times[0]

    @property
    def end(self) -> float:
        return self.offset + self.times[-1]

    def count_passed(self, t: float) -> int:
        """Return how many points of the line the tip has passed at a time [s]."""
        return sum(self.offset + time < t for time in self.times)

    def split_at(self, t: float, tip: Vector) -> tuple[tuple[Vector, ...], tuple[Vector, ...]]:
        """Split the line at a time [s]: return the points up to `tip`, the position of the tip at that time, and the
        points that start with `tip`.
        """
        count = self.count_passed(t)
        return (*self.points[:count], tip), (tip, *self.points[count:])


class ToolPath:
    """Computes straight lines that approximate the path of an arm's tip; no point of the path is farther than `error`
    [m] from these lines.

    The lines of a part of a timeline are cached while the part is visible, because versions of a timeline share their
    unchanged parts.
    """

    def __init__(self, arm: RobotArm, error: float) -> None:
        self._arm, self._error = arm, error
        # lines by (id of the row, first, last); the row is stored too, so that no other object gets its id
        self._seen: dict[tuple[int, int, int], tuple[Row, tuple[ToolLine, ...]]] = {}

    def lines(self, timeline: Timeline, begin: float, end: float) -> list[ToolLine]:
        """Return, in order, all lines of the tip that overlap the time from `begin` to `end` [s]."""
        before, self._seen = self._seen, {}
        found = list[ToolLine]()
        for block in timeline.blocks(begin // SIGHT_STEP_S * SIGHT_STEP_S, -(-end // SIGHT_STEP_S) * SIGHT_STEP_S):
            key = (id(block.row), block.first, block.last)
            seen = before.get(key) or (block.row, tuple(_block_lines(self._arm, block, self._error)))
            self._seen[key] = seen
            found += [line._replace(offset=block.offset) for line in seen[1]]
        return [line for line in found if line.begin < end and line.end > begin]


def _block_lines(arm: RobotArm, block: RowPart, error: float) -> Iterator[ToolLine]:
    """Yield a line for each segment that moves; a single line for consecutive steered segments."""
    steered = list[ToolLine]()
    for segment in block.row.between(block.first, block.last):
        if segment.phase is Phase.REST or segment.duration <= 0.0:
            continue
        steers = segment.motion.kind is MotionKind.STEERED
        if steered and not (steers and steered[-1].times[-1] == segment.start):
            yield _join_lines(steered, error)
            steered = []
        if steers:
            steered.append(_line(arm, segment, 0.5 * error))
        else:
            yield _line(arm, segment, error)
    if steered:
        yield _join_lines(steered, error)


def _line(arm: RobotArm, segment: Segment, error: float) -> ToolLine:
    tip, pieces = tip_of(arm, segment), 1  # number of pieces of equal duration into which the path is cut
    if isinstance(segment.path, JointPath):
        way = sum(high - low for low, high in segment.path.extremes(segment.duration))
        pieces = max(ceil(way / MAX_TURN), 1)
    ends = [(s, tip(s)) for s in (segment.duration * k / pieces for k in range(pieces + 1))]
    places = [ends[0], *(p for a, b in pairwise(ends) for p in _refine(tip, a, b, LINE_MARGIN * error, MAX_HALVINGS))]
    times, points = zip(*((segment.start + s, p) for s, p in places), strict=True)
    return ToolLine(segment.motion, segment.phase, 0.0, times, points)


def _join_lines(lines: Sequence[ToolLine], error: float) -> ToolLine:
    """Join consecutive lines, and leave out the points that the allowed error makes unnecessary."""
    places = [place for line in lines for place in zip(line.times[:-1], line.points[:-1], strict=True)]
    places.append((lines[-1].times[-1], lines[-1].points[-1]))
    times, points = zip(*thin_out(places, 0.5 * error), strict=True)
    return ToolLine(lines[0].motion, lines[0].phase, 0.0, times, points)


def thin_out(places: Sequence[Place], error: float) -> Iterator[Place]:
    """Yield only the points that are needed: no omitted point is farther than `error` [m] from the straight line
    between the two yielded points around it.
    """

    def near(some: Sequence[Place]) -> bool:
        return all(distance_from_line(p, some[0][1], some[-1][1]) <= error for _, p in some[1:-1])

    first, last = 0, len(places) - 1
    yield places[0]
    while first < last:
        step = 1
        while first + 2 * step <= last and near(places[first : first + 2 * step + 1]):
            step *= 2
        first = min(first + step, last)
        yield places[first]


def tip_of(arm: RobotArm, segment: Segment) -> Tip:
    """Return a function that maps the time since the start of a segment [s] to the position of the tool tip."""
    path, frames = segment.path, segment.motion.frames
    T_world_robot, p_flange_tip = inverse(frames.base), position(frames.tool)
    if isinstance(path, JointPath):
        return lambda s: moved_point(T_world_robot, moved_point(arm.forward(path.joints(s)), p_flange_tip))
    x, y, z = path.position
    return lambda s: moved_point(T_world_robot, (value(x, s), value(y, s), value(z, s)))


def _refine(tip: Tip, a: Place, b: Place, error: float, depth: int) -> Iterator[Place]:
    """Yield the points that a polyline needs after `a`, up to `b`."""
    (t0, p0), (t1, p1) = a, b
    probes = [tip(t0 + part * (t1 - t0)) for part in PROBES]
    if depth == 0 or max(distance_from_line(p, p0, p1) for p in probes) <= error:
        yield b
        return
    middle = (0.5 * (t0 + t1), probes[1])
    yield from _refine(tip, a, middle, error, depth - 1)
    yield from _refine(tip, middle, b, error, depth - 1)


def distance_from_line(p: Vector, a: Vector, b: Vector) -> float:
    """Return the distance of a point from the straight line between a and b."""
    along, there = vector_difference(b, a), vector_difference(p, a)
    square = dot(along, along)
    part = min(max(dot(there, along) / square, 0.0), 1.0) if square > 0.0 else 0.0
    return dist(there, (part * along[0], part * along[1], part * along[2]))


# number of equal parts of a piece, which is compared with g where two parts meet; even, so that its halves reuse these
# times
PIECE_LOOKS = 8
# fraction of the tolerance allowed at the sample times; the error of a piece may be larger between samples
PIECE_MARGIN = 0.9
MIN_PIECE_S = 2.0**-20  # [s] (about 1 us) shorter pieces are not halved
TOLERANCES = (0.1, 1e-2, 1e-3, 1e-4, 1e-5)  # [rad, m] the tolerances with which viewers can get pieces


class JointPiece(NamedTuple):
    """A piece of a path: for each joint a cubic [rad, m] in the time since its start. A piece lasts `duration` [s]."""

    duration: float
    joints: tuple[Polynomial, ...]


class _State(NamedTuple):
    """Joints and their velocities."""

    q: Joints
    qd: Joints


def known_tolerance(wanted: float) -> float:
    """Return the largest of TOLERANCES that is not above the wanted tolerance [rad, m].

    There are only a few TOLERANCES, so that many viewers share the same pieces. Raises IllegalValue for a tolerance
    outside the range of TOLERANCES.
    """
    most, least = TOLERANCES[0], TOLERANCES[-1]
    if not least <= wanted <= most:
        hint = f"a tolerance from {least:g} to {most:g} rad (of prismatic joints: m)"
        raise IllegalValue(f"joints within {wanted:g} rad", hint, value=wanted, lower=least, upper=most)
    return next(one for one in TOLERANCES if one <= wanted)


def joint_pieces(arm: RobotArm, segment: Segment, tolerance: float) -> tuple[JointPiece, ...]:
    """Return consecutive cubic pieces from the start of a straight-line segment to its end.

    No joint is farther than `tolerance` [rad, m] from g. Return no pieces for a segment in joint space, a segment
    without duration, and a segment with an unreachable pose (a damaged file).
    """
    path = segment.path
    if isinstance(path, JointPath) or not segment.duration > 0.0:
        return ()
    states: dict[float, _State] = {}
    places: dict[float, Joints] = {}

    def joints(s: float) -> Joints:
        if s not in places:
            places[s] = segment_joints(arm, segment, s)
        return places[s]

    def velocity(s: float) -> Joints:
        twist, still = path.twist(s), (0.0,) * arm.model.joint_count
        try:
            return joint_velocity(arm, path, s, joints(s), twist, segment.motion.frames.tool) if any(twist) else still
        except StraightLineSingular:  # at a singular pose: zero velocity joins pieces without a jump, but with a kink
            return still

    def state(s: float) -> _State:
        if s not in states:
            states[s] = _State(joints(s), velocity(s))
        return states[s]

    def close(piece: JointPiece, begin: float) -> bool:
        looks = (
            max(PIECE_LOOKS, ceil(0.5 * piece.duration / path.seed_interval) * 2)
            if path.seed_interval > 0.0
            else PIECE_LOOKS
        )
        for k in range(1, looks):
            s = piece.duration * k / looks
            for a, q in zip(piece.joints, joints(begin + s), strict=True):
                if abs(value(a, s) - q) > PIECE_MARGIN * tolerance:
                    return False
        return True

    def between(begin: float, end: float) -> list[JointPiece]:
        piece = _hermite(end - begin, state(begin), state(end))
        if end - begin < MIN_PIECE_S or close(piece, begin):
            return [piece]
        middle = 0.5 * (begin + end)
        return between(begin, middle) + between(middle, end)

    try:
        return tuple(between(0.0, segment.duration))
    except PathWithoutJoints:
        return ()


def _hermite(h: float, begin: _State, end: _State) -> JointPiece:
    """Return the cubics with the given positions and velocities at times 0 and `h` [s]."""
    rows = []
    for p, v, q, w in zip(begin.q, begin.qd, end.q, end.qd, strict=True):
        slope = (q - p) / h
        rows.append((p, v, (3.0 * slope - 2.0 * v - w) / h, (v + w - 2.0 * slope) / (h * h)))
    return JointPiece(h, tuple(rows))
