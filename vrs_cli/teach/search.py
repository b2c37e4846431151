"""Searches along curves for greatest and least values, which miss nothing between two looks.

A measure is a convex function of a vector that changes by no more than the vector moves. A search halves the pieces
of a curve in which the bounds of `tip` allow what is looked for, those that allow the most first (branch and bound).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from heapq import heapify, heappop, heappush
from itertools import pairwise
from math import dist, inf
from typing import NamedTuple

from vrs_cli.engine.approximation import distance_from_line
from vrs_cli.kinematics.transform import Vector, angle_between
from vrs_cli.teach.tip import Piece, TurningPiece

NOISE = 1e-9  # of a measure: machines may differ by less, and all of them are to find the same
NOISE_DIGITS = 9
SHORTEST = 1e-5  # [s] a piece is not halved any more
INSTANT = 1e-4  # [s] to which times are found at which a measure crosses a value

Measure = Callable[[Vector], float]


class Extreme(NamedTuple):
    """A value of a measure, when it was found [s], and where the curve is then."""

    value: float
    t: float
    place: Vector


class _End(NamedTuple):
    """A look at a curve: how long after the start of its piece [s], where it is, the measure there."""

    s: float
    c: Vector
    m: float


def greatest(pieces: Sequence[Piece], measure: Measure, precision: float, *, enough: float = -inf) -> Extreme:
    """Return the greatest value of a convex measure, to a precision; one that is no more than `enough` where none is.
    Raises ValueError for no piece.
    """
    return _best(pieces, measure, lambda a, b: max(a.m, b.m), precision, enough)


def nearest(pieces: Sequence[Piece], target: Vector, precision: float, *, enough: float = inf) -> Extreme:
    """Return the nearest approach to a target, to a precision; one that is no less than `enough` where none is nearer.
    Raises ValueError for no piece.
    """
    found = _best(
        pieces,
        lambda c: -dist(c, target),
        lambda a, b: -distance_from_line(target, a.c, b.c),
        precision,
        -enough,
    )
    return found._replace(value=-found.value)


def least(pieces: Sequence[Piece], measure: Measure, precision: float, *, enough: float = inf) -> Extreme:
    """Return the least value of a measure, as `nearest` does."""
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
    """Return the greatest value of a measure that need not be convex, as `greatest` does. `between`: another bound of
    the measure on the straight line between two places.
    """
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
    """Return the greatest value. `on_line`: the most that it can be on the straight line between two looks."""
    best: Extreme | None = None
    waiting = list[tuple[float, int, _End, _End]]()

    def look(piece: Piece, s: float) -> _End:
        nonlocal best
        c = piece.at(s)
        end = _End(s, c, measure(c))
        if best is None or end.m > best.value + NOISE:
            best = Extreme(end.m, piece.start + s, c)
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
        if b.s - a.s <= SHORTEST:
            continue
        middle = look(piece, 0.5 * (a.s + b.s))
        for left, right in ((a, middle), (middle, b)):
            most = _most(piece, left, right, on_line)
            if most > max(best.value + precision, enough):
                heappush(waiting, (-most, number, left, right))
    return best


def _most(piece: Piece, a: _End, b: _End, on_line: Callable[[_End, _End], float]) -> float:
    """Return the most that the measure can be between two looks."""
    return round(on_line(a, b) + 0.125 * piece.bend * (b.s - a.s) ** 2, NOISE_DIGITS)


def most_turned(
    pieces: Sequence[TurningPiece], others: Sequence[TurningPiece], precision: float, *, enough: float
) -> tuple[float, float]:
    """Return by which angle two orientations differ at most [rad], to a precision, and when [s]; an angle that is no
    more than `enough` where none is. Both go from and to the same times.
    """
    cuts = sorted({t for piece in (*pieces, *others) for t in (piece.start, piece.finish)})
    best, when = -inf, cuts[0]
    waiting = list[tuple[float, float, float, float]]()
    places = [0, 0]

    def angle(t: float, pair: tuple[TurningPiece, TurningPiece]) -> float:
        nonlocal best, when
        found = angle_between(*(piece.at(t - piece.start) for piece in pair))
        if found > best + NOISE:
            best, when = found, t
        return found

    for since, until in pairwise(cuts):
        for k, row in enumerate((pieces, others)):
            while row[places[k]].finish <= since:
                places[k] += 1
        pair = pieces[places[0]], others[places[1]]
        rate = pair[0].rate + pair[1].rate
        waiting = [(since, angle(since, pair), until, angle(until, pair))]
        while waiting:
            t0, a0, t1, a1 = waiting.pop()
            if 0.5 * (a0 + a1 + rate * (t1 - t0)) > max(best + precision, enough) and t1 - t0 > SHORTEST:
                t = 0.5 * (t0 + t1)
                a = angle(t, pair)
                waiting += [(t, a, t1, a1), (t0, a0, t, a)]
    return best, when


def within(pieces: Sequence[Piece], target: Vector, radius: float, precision: float) -> list[tuple[float, float]]:
    """Return the times from which to which a curve is no farther than `radius` from a target [s], in order."""
    return _spans(
        pieces, lambda c: dist(c, target), lambda a, b: distance_from_line(target, a.c, b.c), radius, precision
    )


def below(pieces: Sequence[Piece], measure: Measure, most: float, precision: float) -> list[tuple[float, float]]:
    """Return the times from which to which a convex measure is no more than a value [s], in order."""
    return _spans(pieces, measure, lambda a, b: 0.5 * (a.m + b.m - dist(a.c, b.c)), most, precision)


def _spans(
    pieces: Sequence[Piece], measure: Measure, on_line: Callable[[_End, _End], float], most: float, precision: float
) -> list[tuple[float, float]]:
    """Return when a measure is no more than a value. `on_line`: the least that it can be between two looks."""
    found = list[tuple[float, float]]()

    def add(since: float, until: float) -> None:
        if found and since <= found[-1][1] + INSTANT:
            found[-1] = found[-1][0], until
        else:
            found.append((since, until))

    def look(piece: Piece, s: float) -> _End:
        c = piece.at(s)
        return _End(s, c, measure(c))

    for piece in pieces:
        waiting = [(look(piece, 0.0), look(piece, piece.finish - piece.start))]
        while waiting:
            a, b = waiting.pop()
            slack = 0.125 * piece.bend * (b.s - a.s) ** 2
            if max(a.m, b.m) + slack <= most:
                add(piece.start + a.s, piece.start + b.s)
            elif on_line(a, b) - slack <= most:
                middle = look(piece, 0.5 * (a.s + b.s))
                even = slack < precision and max(abs(one.m - most) for one in (a, middle, b)) < precision
                if b.s - a.s > INSTANT and not even:
                    waiting += [(middle, b), (a, middle)]
                elif min(a.m, middle.m, b.m) <= most:
                    add(piece.start + a.s, piece.start + b.s)
    return found


def clipped(pieces: Sequence[Piece], begin: float, end: float) -> list[Piece]:
    """Return the part of a curve from one time to another [s]."""
    found = list[Piece]()
    for piece in pieces:
        since, until = max(piece.start, begin), min(piece.finish, end)
        if until > since or (until == since and not found and until == end):
            found.append(piece if (since, until) == (piece.start, piece.finish) else _part(piece, since, until))
    return found


def _part(piece: Piece, since: float, until: float) -> Piece:
    first, at = since - piece.start, piece.at
    return Piece(since, until, lambda s: at(first + s), piece.bend)
