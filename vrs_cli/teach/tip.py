"""Compute the path of the tool's tip over time, and find its extremes, with bounds that also hold between samples.

On each segment of the timeline the tip, its velocity and its acceleration are curves c(t). Their second derivatives
have a bound M, so that a curve between two samples at t and t + h is within M h^2 / 8 of the straight line between
them. On a straight-line segment the curves are polynomials, and M is exact. On a joint-interpolated segment M follows
from the extremes of the joints' derivatives and the lengths of the links. If rotations turn a vector of length l, and
the first, second, ... derivatives of their angles sum to at most x1, x2, ..., then the vector's n-th derivative is at
most l B_n(x1, ..., xn), with the complete Bell polynomials B_n (Comtet, "Advanced Combinatorics", 1974, section 3.3).

A measure is a convex function of a vector with Lipschitz constant 1: it changes by no more than the vector moves. A
search halves the pieces with the best bounds first (branch and bound).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from heapq import heapify, heappop, heappush
from itertools import pairwise
from math import comb, dist, hypot, inf
from typing import NamedTuple, TypeVar

from vrs_cli.engine.approximation import distance_from_line, tip_of
from vrs_cli.engine.position import world_pose
from vrs_cli.engine.problem import segment_joints
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.joints import JointKind
from vrs_cli.kinematics.model import ArmTask, RobotModel, link_pose
from vrs_cli.kinematics.transform import Transform, Vector, angle_between, compose, inverse, length, position
from vrs_cli.trajectory.polynomial import Polynomial, derivative, most, value
from vrs_cli.trajectory.segment import JointPath, Phase, Segment
from vrs_cli.trajectory.timeline import Timeline


class Piece(NamedTuple):
    """A piece of a curve, from `start` to `finish` [s]. `at`: the function from seconds after `start` to the point of
    the curve. `bend`: an upper bound of the length of its second derivative."""

    start: float
    finish: float
    at: Callable[[float], Vector]
    bend: float


class TurningPiece(NamedTuple):
    """The tool's orientation from `start` to `finish` [s]. `at`: the function from seconds after `start` to
    T_world_tool. `rate`: an upper bound of its angular speed [rad/s]."""

    start: float
    finish: float
    at: Callable[[float], Transform]
    rate: float


AnyPiece = TypeVar("AnyPiece", Piece, TurningPiece)


def turning_pieces(arm: RobotArm, timeline: Timeline, begin: float, end: float) -> list[TurningPiece]:
    """Return the orientation of the tool between two times [s]."""
    found = []
    for segment, since, until in stretches(timeline, begin, end):
        path, stands = segment.path, segment.phase is Phase.REST or since >= segment.finish
        rate = 0.0
        if not stands and isinstance(path, JointPath):
            rates = zip(path.extremes(segment.duration, 1), arm.turning, strict=True)
            rate = sum(max(-low, high) for (low, high), turns in rates if turns)
        elif not stands and not isinstance(path, JointPath):
            rate = sum(most(derivative(turn.angle), segment.duration) for turn in path.turns)
            if arm.model.task is not ArmTask.POSE:  # the joints limit the angular speed of the tool
                rate = sum(arm.model.max_velocity)
        found.append(TurningPiece(since, until, _pose_of(arm, segment, since - segment.start), rate))
    return found


def _pose_of(arm: RobotArm, segment: Segment, first: float) -> Callable[[float], Transform]:
    """Return a function from s to T_world_tool at `first` + s seconds after the start of a segment. After the segment
    the tool is at rest."""
    path, frames, lasting = segment.path, segment.motion.frames, segment.duration
    if not isinstance(path, JointPath) and arm.model.task is ArmTask.POSE:
        T_world_robot = inverse(frames.base)
        return lambda s: compose(T_world_robot, path.pose(min(first + s, lasting)))
    return lambda s: world_pose(arm, frames, segment_joints(arm, segment, min(first + s, lasting)))


def tip_pieces(arm: RobotArm, timeline: Timeline, begin: float, end: float, order: int = 0) -> list[Piece]:
    """Return the position of the tool's tip in the world [m] between two times [s]; with `order` 1 or 2 its velocity
    [m/s] or acceleration [m/s2], along the axes of the robot's frame.
    """
    return [_piece(arm, segment, since, until, order) for segment, since, until in stretches(timeline, begin, end)]


def stretches(timeline: Timeline, begin: float, end: float) -> Iterator[tuple[Segment, float, float]]:
    """Yield the segments between two times, each with the time span in which it gives the position [s]. In a gap
    between segments the robot rests at the end of the previous segment."""
    index, since = timeline.index_at(begin), begin
    while True:
        segment = timeline[index]
        after = timeline[index + 1].start if index + 1 < len(timeline) else end
        for until in (min(segment.finish, end), min(max(after, segment.finish), end)):
            if until > since or until == end == since:
                yield segment, since, until
                since = until
        index += 1
        if index >= len(timeline) or after >= end:
            return


def _piece(arm: RobotArm, segment: Segment, since: float, until: float, order: int) -> Piece:
    """Return the curve of a segment between two times [s]."""
    first, stands = since - segment.start, segment.phase is Phase.REST or since >= segment.finish
    if stands:
        place = tip_of(arm, segment)(min(first, segment.duration)) if order == 0 else (0.0, 0.0, 0.0)
        return Piece(since, until, lambda _: place, 0.0)
    curve, bend = _curve(arm, segment, order)
    return Piece(since, until, lambda s: curve(first + s), bend)


def _curve(arm: RobotArm, segment: Segment, order: int) -> tuple[Callable[[float], Vector], float]:
    """Return the curve of a segment in which the arm moves, and an upper bound of its second derivative."""
    path, tool = segment.path, segment.motion.frames.tool
    if not isinstance(path, JointPath):
        rows = [_derive(a, order) for a in path.position]
        bend = hypot(*(most(_derive(a, 2), segment.duration) for a in rows))
        if order == 0:
            return tip_of(arm, segment), bend
        x, y, z = rows
        return (lambda s: (value(x, s), value(y, s), value(z, s))), bend
    bounds = [
        [max(-low, high) for low, high in path.extremes(segment.duration, which)] for which in range(1, order + 3)
    ]
    bend = tip_bound(arm.model, tool, bounds)
    if order == 0:
        return tip_of(arm, segment), bend
    if order == 1:
        return (lambda s: _linear(arm.twist(path.joints(s), path.velocity(s), tool))), bend

    def acceleration(s: float) -> Vector:
        q, qd = path.joints(s), path.velocity(s)
        rates, bias = arm.twist(q, path.acceleration(s), tool), arm.acceleration_bias(q, qd, tool)
        return rates[0] + bias[0], rates[1] + bias[1], rates[2] + bias[2]

    return acceleration, bend


def _linear(twist: Sequence[float]) -> Vector:
    return twist[0], twist[1], twist[2]


def _derive(a: Polynomial, order: int) -> Polynomial:
    for _ in range(order):
        a = derivative(a)
    return a


def tip_bound(model: RobotModel, T_flange_tool: Transform, bounds: Sequence[Sequence[float]]) -> float:
    """Return an upper bound of the n-th derivative of the tip's position. `bounds`: for each order from 1 to n, the
    bounds of all joints' derivatives of this order [rad, m]."""
    order, sums, total = len(bounds), [0.0] * len(bounds), 0.0
    for i, link in enumerate(model.links, 1):
        T = link_pose(model, i, 0.0)
        reach = length(position(compose(T, T_flange_tool) if i == model.joint_count else T))
        if link.kind is JointKind.REVOLUTE:
            sums = [x + row[i - 1] for x, row in zip(sums, bounds, strict=True)]
            total += reach * _bell(sums)
        else:
            slides = [reach + max(abs(model.lower[i - 1]), abs(model.upper[i - 1])), *(row[i - 1] for row in bounds)]
            total += sum(comb(order, k) * slides[k] * _bell(sums[: order - k]) for k in range(order + 1))
    return total


def _bell(x: Sequence[float]) -> float:
    """Return the complete Bell polynomial of x1, ..., xn; without arguments it is 1."""
    found = [1.0]
    for n in range(len(x)):
        found.append(sum(comb(n, k) * found[n - k] * x[k] for k in range(n + 1)))
    return found[-1]


# --- where the robot is at rest --------------------------------------------------------------------------------------

STILL = 1e-6  # [rad/s, m/s] a joint slower than this counts as at rest


def stops(timeline: Timeline, begin: float, end: float) -> list[tuple[float, float]]:
    """Return the intervals in which the arm is at rest between two times [s]. An interval of zero length is an instant
    at which the velocity is zero."""
    found = list[tuple[float, float]]()
    for segment, since, until in stretches(timeline, begin, end):
        if segment.phase is Phase.REST or since >= segment.finish:
            _add_interval(found, since, until)
            continue
        if since == segment.start and _stands(segment, 0.0):
            _add_interval(found, since, since)
        if until == segment.finish and _stands(segment, segment.duration):
            _add_interval(found, until, until)
    return found


def _add_interval(found: list[tuple[float, float]], since: float, until: float, gap: float = 0.0) -> None:
    """Add the interval from `since` to `until` [s] to a sorted list; merge it with the last interval if it begins at
    most `gap` [s] after that interval ends."""
    if found and since <= found[-1][1] + gap:
        found[-1] = found[-1][0], max(until, found[-1][1])
    else:
        found.append((since, until))


def _stands(segment: Segment, s: float) -> bool:
    """Return whether the arm is at rest `s` seconds after the start of a segment."""
    path = segment.path
    return all(abs(rate) <= STILL for rate in (path.velocity(s) if isinstance(path, JointPath) else path.twist(s)))


NOISE = 1e-9  # smaller differences of a measure are ignored, so that all machines give the same result
NOISE_DIGITS = 9
MIN_PIECE_S = 1e-5  # [s] pieces shorter than this are not halved
INSTANT = 1e-4  # [s] precision of the time at which a measure crosses a value

Measure = Callable[[Vector], float]


class Extreme(NamedTuple):
    """An extreme value of a measure, its time [s], and the point of the curve."""

    value: float
    t: float
    place: Vector


class _End(NamedTuple):
    """A sample at one end of an interval of a curve: seconds after the start of its piece, the point, and the value of
    the measure there."""

    s: float
    c: Vector
    m: float


def _sample(piece: Piece, s: float, measure: Measure) -> _End:
    c = piece.at(s)
    return _End(s, c, measure(c))


def greatest(pieces: Sequence[Piece], measure: Measure, precision: float, *, enough: float = -inf) -> Extreme:
    """Return the maximum of a convex measure, within `precision`. If no value exceeds `enough`, the result may be any
    value up to `enough`. Raises ValueError without pieces."""
    return _best(pieces, measure, lambda a, b: max(a.m, b.m), precision, enough)


def nearest(pieces: Sequence[Piece], target: Vector, precision: float, *, enough: float = inf) -> Extreme:
    """Return the minimum distance from a target, within `precision`. If no distance is below `enough`, the result may
    be any value of at least `enough`. Raises ValueError without pieces."""
    found = _best(
        pieces,
        lambda c: -dist(c, target),
        lambda a, b: -distance_from_line(target, a.c, b.c),
        precision,
        -enough,
    )
    return found._replace(value=-found.value)


def least(pieces: Sequence[Piece], measure: Measure, precision: float, *, enough: float = inf) -> Extreme:
    """Return the minimum of a measure, within `precision`. If no value is below `enough`, the result may be any value
    of at least `enough`."""
    found = _best(pieces, lambda c: -measure(c), lambda a, b: 0.5 * (a.m + b.m + dist(a.c, b.c)), precision, -enough)
    return found._replace(value=-found.value)


def farthest(
    pieces: Sequence[Piece],
    measure: Measure,
    precision: float,
    *,
    enough: float = -inf,
    between: Callable[[Vector, Vector], float] = lambda _a, _b: inf,
) -> Extreme:
    """Return the maximum of a measure that may be non-convex, within `precision`. If no value exceeds `enough`, the
    result may be any value up to `enough`. `between`: another upper bound of the measure on the straight line between
    two points."""
    return _best(
        pieces,
        measure,
        lambda a, b: min(0.5 * (a.m + b.m + dist(a.c, b.c)), between(a.c, b.c)),
        precision,
        enough,
    )


def _best(
    pieces: Sequence[Piece],
    measure: Measure,
    on_line: Callable[[_End, _End], float],
    precision: float,
    enough: float,
) -> Extreme:
    """Return the maximum of a measure. `on_line`: an upper bound of the measure on the straight line between two
    samples."""
    best: Extreme | None = None
    waiting = list[tuple[float, int, _End, _End]]()

    def look(piece: Piece, s: float) -> _End:
        nonlocal best
        end = _sample(piece, s, measure)
        if best is None or end.m > best.value + NOISE:
            best = Extreme(end.m, piece.start + s, end.c)
        return end

    for number, piece in enumerate(pieces):
        a, b = look(piece, 0.0), look(piece, piece.finish - piece.start)
        waiting.append((-_most(piece, a, b, on_line), number, a, b))
    if best is None:
        raise ValueError("there is no motion to look at")
    heapify(waiting)
    while waiting and -waiting[0][0] > max(best.value + precision, enough):
        _, number, a, b = heappop(waiting)
        piece = pieces[number]
        if b.s - a.s <= MIN_PIECE_S:
            continue
        middle = look(piece, 0.5 * (a.s + b.s))
        for left, right in ((a, middle), (middle, b)):
            most = _most(piece, left, right, on_line)
            if most > max(best.value + precision, enough):
                heappush(waiting, (-most, number, left, right))
    return best


def _most(piece: Piece, a: _End, b: _End, on_line: Callable[[_End, _End], float]) -> float:
    """Return an upper bound of the measure between two samples."""
    return round(on_line(a, b) + 0.125 * piece.bend * (b.s - a.s) ** 2, NOISE_DIGITS)


def together(a: Sequence[AnyPiece], b: Sequence[AnyPiece]) -> Iterator[tuple[float, float, AnyPiece, AnyPiece]]:
    """Yield each time span [s] in which both curves have a single piece, with these two pieces. The curves cover the
    same times."""
    cuts = sorted({t for piece in (*a, *b) for t in (piece.start, piece.finish)})
    if len(cuts) == 1:
        cuts *= 2
    places = [0, 0]
    for since, until in pairwise(cuts):
        for k, row in enumerate((a, b)):
            while row[places[k]].finish <= since and places[k] + 1 < len(row):
                places[k] += 1
        yield since, until, a[places[0]], b[places[1]]


def most_turned(
    pieces: Sequence[TurningPiece], others: Sequence[TurningPiece], precision: float, *, enough: float
) -> tuple[float, float]:
    """Return the maximum angle between two orientations [rad], within `precision`, and its time [s].

    If no angle exceeds `enough`, the result may be any angle up to `enough`. Both orientations must cover the same
    times.
    """
    best, when = -inf, pieces[0].start

    def angle(t: float, one: TurningPiece, other: TurningPiece) -> float:
        nonlocal best, when
        found = angle_between(one.at(t - one.start), other.at(t - other.start))
        if found > best + NOISE:
            best, when = found, t
        return found

    for since, until, one, other in together(pieces, others):
        rate = one.rate + other.rate
        waiting = [(since, angle(since, one, other), until, angle(until, one, other))]
        while waiting:
            t0, a0, t1, a1 = waiting.pop()
            if 0.5 * (a0 + a1 + rate * (t1 - t0)) > max(best + precision, enough) and t1 - t0 > MIN_PIECE_S:
                t = 0.5 * (t0 + t1)
                a = angle(t, one, other)
                waiting += [(t, a, t1, a1), (t0, a0, t, a)]
    return best, when


def within(pieces: Sequence[Piece], target: Vector, radius: float, precision: float) -> list[tuple[float, float]]:
    """Return the intervals in which a curve is within `radius` of a target [s], in order."""
    return _spans(
        pieces, lambda c: dist(c, target), lambda a, b: distance_from_line(target, a.c, b.c), radius, precision
    )


def below(pieces: Sequence[Piece], measure: Measure, most: float, precision: float) -> list[tuple[float, float]]:
    """Return the intervals in which a convex measure is at most `most` [s], in order."""
    return _spans(pieces, measure, lambda a, b: 0.5 * (a.m + b.m - dist(a.c, b.c)), most, precision)


def _spans(
    pieces: Sequence[Piece], measure: Measure, on_line: Callable[[_End, _End], float], most: float, precision: float
) -> list[tuple[float, float]]:
    """Return the intervals in which a measure is at most `most` [s]. `on_line`: a lower bound of the measure on the
    straight line between two samples."""
    found = list[tuple[float, float]]()

    for piece in pieces:
        waiting = [(_sample(piece, 0.0, measure), _sample(piece, piece.finish - piece.start, measure))]
        while waiting:
            a, b = waiting.pop()
            slack = 0.125 * piece.bend * (b.s - a.s) ** 2
            if max(a.m, b.m) + slack <= most:
                _add_interval(found, piece.start + a.s, piece.start + b.s, INSTANT)
            elif on_line(a, b) - slack <= most:
                middle = _sample(piece, 0.5 * (a.s + b.s), measure)
                even = slack < precision and max(abs(one.m - most) for one in (a, middle, b)) < precision
                if b.s - a.s > INSTANT and not even:
                    waiting += [(middle, b), (a, middle)]
                elif min(a.m, middle.m, b.m) <= most:
                    _add_interval(found, piece.start + a.s, piece.start + b.s, INSTANT)
    return found


def clip(pieces: Sequence[Piece], begin: float, end: float) -> list[Piece]:
    """Return the part of a curve between two times [s]."""
    found = list[Piece]()
    for piece in pieces:
        since, until = max(piece.start, begin), min(piece.finish, end)
        if until > since or (until == since and not found and until == end):
            found.append(piece if (since, until) == (piece.start, piece.finish) else _part(piece, since, until))
    return found


def _part(piece: Piece, since: float, until: float) -> Piece:
    first, at = since - piece.start, piece.at
    return Piece(since, until, lambda s: at(first + s), piece.bend)
