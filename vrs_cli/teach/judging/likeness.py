"""Judges whether the tip goes where it goes in the run of the model solution."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from math import ceil, degrees, dist, radians, sqrt

from vrs_cli.engine.approximation import distance_from_line, thinned
from vrs_cli.kinematics.transform import Vector, length, subtracted
from vrs_cli.teach.checks import LikeModelCheck
from vrs_cli.teach.evidence import Evidence
from vrs_cli.teach.judging.basis import HALF, NEAR, PRECISION, JudgedRun
from vrs_cli.teach.search import Extreme, farthest, greatest, most_turned
from vrs_cli.teach.tip import Piece, tip_pieces, turning_pieces
from vrs_cli.teach.verdict import Verdict, exceeds, largest, written

COARSE = 0.25  # of the distance that is allowed: straight lines along a path are so near to it at first
FINE = 0.5  # of the rounding: the same, where that does not decide


def judge_like_model(check: LikeModelCheck, run: JudgedRun) -> Verdict:
    """Judge the way of the tip by that of the model."""
    model = run.basis.model
    if model is None:
        raise ValueError("the model's run is not known")
    return _at_same_times(check, run, model) if check.times else _on_same_path(check, run, model)


def _at_same_times(check: LikeModelCheck, run: JudgedRun, model: Evidence) -> Verdict:
    """Compare place and orientation at each time since the beginning of both runs."""
    evidence = run.evidence
    lasting = max(evidence.end - evidence.started, model.end - model.started)
    ours, theirs = (tip_pieces(it.arm, it.timeline, it.started, it.started + lasting) for it in (evidence, model))
    apart = _differences(ours, [_later(piece, evidence.started - model.started) for piece in theirs])
    found = greatest(apart, length, run.precision, enough=1e-3 * largest(check.mm, run.mm))
    far, share = 1000.0 * found.value, 1.0
    text = f"the tool was within {written(check.mm, run.mm)} mm of the model's at all times"
    at: float | None = None
    if exceeds(far, check.mm, run.mm):
        share, at = (HALF if not exceeds(far, NEAR * check.mm, run.mm) else 0.0), found.t
        what = f"{written(far, run.mm)} mm from where the model's is, {written(check.mm, run.mm)} mm allowed"
        text = f"at {written(found.t, run.s)} s the tool was {what}"
    if check.deg is None:
        return Verdict(share, text, at)
    step = run.basis.rounding.deg
    turning = [turning_pieces(it.arm, it.timeline, it.started, it.started + lasting) for it in (evidence, model)]
    shift = evidence.started - model.started
    later = [piece._replace(start=piece.start + shift, finish=piece.finish + shift) for piece in turning[1]]
    enough = radians(largest(check.deg, step))
    angle, when = most_turned(turning[0], later, radians(PRECISION * step), enough=enough)
    off = degrees(angle)
    if not exceeds(off, check.deg, step):
        return Verdict(share, text, at)
    turned = f"it was turned by {written(off, step)} deg from the model's, {written(check.deg, step)} deg allowed"
    part = HALF if not exceeds(off, NEAR * check.deg, step) else 0.0
    return Verdict(min(share, part), f"{text}; at {written(when, run.s)} s {turned}", when if at is None else at)


def _later(piece: Piece, seconds: float) -> Piece:
    return piece._replace(start=piece.start + seconds, finish=piece.finish + seconds)


def _differences(a: Sequence[Piece], b: Sequence[Piece]) -> list[Piece]:
    """Return how far two curves are apart, as a curve."""
    cuts = sorted({t for piece in (*a, *b) for t in (piece.start, piece.finish)})
    if len(cuts) == 1:
        cuts *= 2
    found, places = list[Piece](), [0, 0]
    for since, until in pairwise(cuts):
        for k, row in enumerate((a, b)):
            while row[places[k]].finish <= since and places[k] + 1 < len(row):
                places[k] += 1
        one, other = a[places[0]], b[places[1]]
        found.append(Piece(since, until, _difference(one, other, since), one.bend + other.bend))
    return found


def _difference(a: Piece, b: Piece, since: float) -> Callable[[float], Vector]:
    first, second = since - a.start, since - b.start
    return lambda s: subtracted(a.at(first + s), b.at(second + s))


def _on_same_path(check: LikeModelCheck, run: JudgedRun, model: Evidence) -> Verdict:
    """Compare both paths, whatever the times: each is to be near the other. Most runs are near enough already to coarse
    lines along the paths.
    """
    theirs = tip_pieces(model.arm, model.timeline, model.started, model.end)
    limit, share = 1e-3 * largest(check.mm, run.mm), 1.0
    for error in (COARSE * limit, 1e-3 * FINE * run.mm):
        left, missed = _away(run.tip, theirs, run, error, limit), _away(theirs, run.tip, run, error, limit)
        if max(left.value, missed.value) + error + run.precision <= limit:
            break
    allowed, worst = f"{written(check.mm, run.mm)} mm allowed", 1000.0 * max(left.value, missed.value)
    if not exceeds(worst, check.mm, run.mm):
        return Verdict(share, f"the tool kept to the model's path within {written(check.mm, run.mm)} mm")
    share = HALF if not exceeds(worst, NEAR * check.mm, run.mm) else 0.0
    if exceeds(1000.0 * left.value, check.mm, run.mm):
        far = f"{written(1000.0 * left.value, run.mm)} mm from the model's path, {allowed}"
        when = f"at {written(left.t, run.s)} s at {run.said(left.place)}"
        return Verdict(share, f"the tool was {far}, {when}", left.t)
    far = f"{written(1000.0 * missed.value, run.mm)} mm, {allowed}"
    return Verdict(share, f"the model's path goes by {run.said(missed.place)}, the tool came no nearer than {far}")


def _away(pieces: Sequence[Piece], path: Sequence[Piece], run: JudgedRun, error: float, limit: float) -> Extreme:
    """Return how far a curve goes at most from lines along the path of another, which are as near to it as `error`
    [m]; what is below `limit` less that error need not be exact.
    """
    lines = [(a, b, dist(a, b)) for a, b in pairwise(path_points(path, error))]
    recent, known = lines[0], dict[Vector, tuple[Vector, Vector, float]]()

    def measure(p: Vector) -> float:
        nonlocal recent
        best = distance_from_line(p, *recent[:2])
        for line in lines:
            a, b, size = line
            if dist(p, a) - size < best and (far := distance_from_line(p, a, b)) < best:
                best, recent = far, line
        known[p] = recent
        return best

    def between(p: Vector, q: Vector) -> float:
        """The distance from one line is convex: on the way from p to q it is greatest at an end."""
        return min(max(distance_from_line(end, *known[near][:2]) for end in (p, q)) for near in (p, q))

    return farthest(pieces, measure, run.precision, enough=limit - error - run.precision, between=between)


def path_points(pieces: Sequence[Piece], error: float) -> list[Vector]:
    """Return a path as the ends of straight lines, none of which is farther than `error` [m] from it."""
    places = [(pieces[0].start, pieces[0].at(0.0))]
    for piece in pieces:
        lasting = piece.finish - piece.start
        count = ceil(lasting * sqrt(piece.bend / (4.0 * error))) or 1  # each bends by half the error at most
        places += [(piece.start + s, piece.at(s)) for s in (lasting * k / count for k in range(1, count + 1))]
    return [p for _, p in thinned(places, 0.5 * error)]
