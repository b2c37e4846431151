"""Judge the path of the tool's tip: places, lines and arcs, stops, boxes, speeds, and the path of the model."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from math import acos, ceil, degrees, dist, hypot, radians, sqrt

from vrs_cli.engine.approximation import distance_from_line, thin_out
from vrs_cli.kinematics.transform import (
    TURN,
    Vector,
    added,
    cross,
    dot,
    inverse,
    length,
    moved_point,
    scaled,
    subtracted,
    unit,
)
from vrs_cli.teach.checks import (
    AccelerationCheck,
    KeepOutCheck,
    LikeModelCheck,
    NoStopCheck,
    PathCheck,
    PlacesCheck,
    SpeedCheck,
    StretchCheck,
)
from vrs_cli.teach.exercise_text import Place
from vrs_cli.teach.judging.basis import (
    HALF,
    MORE,
    NEAR,
    PRECISION,
    Evidence,
    JudgedRun,
    Verdict,
    exceeds,
    figure,
    largest,
)
from vrs_cli.teach.tip import (
    Extreme,
    Measure,
    Piece,
    TurningPiece,
    below,
    clip,
    farthest,
    greatest,
    least,
    most_turned,
    nearest,
    stops,
    tip_pieces,
    turning_pieces,
    within,
)
from vrs_cli.values.numbers import count
from vrs_cli.values.world import SpanKind

Window = tuple[float, float]  # start and end [s]
PASSED_MM = 1.0  # distance at which the tip passes a place, if a check gives none
FLAT = 1e-6  # [m] three places this close to one line define no arc


def _reach(mm: float, run: JudgedRun) -> float:
    """Return the distance at which the tip passes a place [m]."""
    return 1e-3 * largest(mm, run.mm)


# --- places ----------------------------------------------------------------------------------------------------------


def judge_places(check: PlacesCheck, run: JudgedRun) -> Verdict:
    """Judge which places the tip passed, in order."""
    t, reach, total = run.evidence.started, _reach(check.mm, run), len(check.places)
    for found, place in enumerate(check.places):
        target = run.basis.point(place)
        after = clip(run.tip, t, run.evidence.end)
        if not after:
            return Verdict(found / total, f"the tool did not move on to {run.place_text(target)}", t)
        passed = within(after, target, reach, run.precision)
        if not passed:
            near = nearest(after, target, run.precision)
            since = f" after {figure(t, run.s)} s" if found else ""
            return Verdict(
                found / total,
                f"the tool came no nearer to {run.place_text(target)}{since} than "
                f"{figure(1e3 * near.value, run.mm)} mm, {figure(check.mm, run.mm)} mm allowed; "
                f"{found} of {count(total, 'place')} passed",
                near.t,
            )
        t = passed[0][0]
    return Verdict(1.0, f"the tool passed {count(total, 'place')}{' in order' if total > 1 else ''}")


def windows(run: JudgedRun, a: Vector, b: Vector, mm: float) -> list[Window]:
    """Return the intervals in which the tip moves from one place to another: from its last time at the first place to
    its arrival at the second.
    """
    reach = _reach(mm, run)
    left, came = (within(run.tip, place, reach, run.precision) for place in (a, b))
    found = list[Window]()
    for number, (_, leaves) in enumerate(left):
        again = left[number + 1][0] if number + 1 < len(left) else run.evidence.end
        arrival = next((begin for begin, end in came if end >= leaves), None)
        if arrival is not None and arrival <= again:
            found.append((leaves, max(arrival, leaves)))
    return found


def did_not_go(run: JudgedRun, a: Vector, b: Vector, mm: float) -> Verdict:
    """Return the verdict of a tip that never went from one place to another."""
    for what, place in (("beginning", a), ("end", b)):
        near = nearest(run.tip, place, run.precision)
        if near.value > _reach(mm, run):
            far = f"{figure(1000.0 * near.value, run.mm)} mm, {figure(mm, run.mm)} mm allowed"
            return Verdict(0.0, f"the tool came no nearer to the {what} {run.place_text(place)} than {far}", near.t)
    return Verdict(0.0, f"the tool did not go from {run.place_text(a)} to {run.place_text(b)}")


# --- lines, arcs, stops ----------------------------------------------------------------------------------------------


def judge_path(check: PathCheck, run: JudgedRun) -> Verdict:
    """Judge how far the tip was from a line or an arc, in its best pass."""
    a, b = run.basis.point(check.begin), run.basis.point(check.end)
    found = windows(run, a, b, check.mm)
    if not found:
        return did_not_go(run, a, b, check.mm)
    if check.via is None:
        measure, search, way = (lambda p: distance_from_line(p, a, b)), greatest, "line"
    else:
        measure, search, way = arc_measure(a, run.basis.point(check.via), b), farthest, "arc"
    best = min((_worst(run, window, search, measure) for window in found), key=lambda one: one.value)
    far = 1000.0 * best.value
    if exceeds(far, check.mm, run.mm):
        share = HALF if not exceeds(far, NEAR * check.mm, run.mm) else 0.0
        allowed = f"{figure(far, run.mm)} mm from the {way}, {figure(check.mm, run.mm)} mm allowed"
        return Verdict(
            share, f"the tool was {allowed}, at {figure(best.t, run.s)} s at {run.place_text(best.place)}", best.t
        )
    text = f"the tool stayed within {figure(check.mm, run.mm)} mm of the {way}"
    return Verdict(1.0, text) if check.deg is None else _orientation(check.deg, text, check.begin, found, run)


def _orientation(most: float, text: str, place: Place, found: list[Window], run: JudgedRun) -> Verdict:
    """Judge how far the tool turned from the orientation of a place, in its best pass."""
    wanted, step, it = run.basis.place(place), run.basis.rounding.deg, run.evidence
    off, t = min(
        most_turned(
            turning_pieces(it.arm, it.timeline, *window),
            [TurningPiece(*window, lambda _: wanted, 0.0)],
            radians(PRECISION * step),
            enough=radians(largest(most, step)),
        )
        for window in found
    )
    if not exceeds(degrees(off), most, step):
        return Verdict(1.0, f"{text}, and was turned by no more than {figure(most, step)} deg")
    share = HALF if not exceeds(degrees(off), NEAR * most, step) else 0.0
    turned = f"it was turned by {figure(degrees(off), step)} deg, {figure(most, step)} deg allowed"
    return Verdict(share, f"{text}; at {figure(t, run.s)} s {turned}", t)


def _worst(run: JudgedRun, window: Window, search: Callable[..., Extreme], measure: Measure) -> Extreme:
    found: Extreme = search(clip(run.tip, *window) or run.tip[:1], measure, run.precision)
    return found


def arc_measure(a: Vector, via: Vector, b: Vector) -> Measure:
    """Return a function for the distance from the arc from a through another place to b. Raises ValueError for places
    on one line.
    """
    u, v = subtracted(via, a), subtracted(b, a)
    normal = cross(u, v)
    square = dot(normal, normal)
    if square < (FLAT * length(v)) ** 2:
        raise ValueError("the three places of the arc are on one line")
    toward = added(scaled(cross(v, normal), dot(u, u)), scaled(cross(normal, u), dot(v, v)))
    centre = added(a, scaled(toward, 0.5 / square))
    n, x = unit(normal), unit(subtracted(a, centre))
    y, radius = cross(n, x), dist(a, centre)
    turn = _angle(subtracted(b, centre), x, y)  # the turn from a to b through the third place, positive about n

    def measure(p: Vector) -> float:
        r = subtracted(p, centre)
        if _angle(r, x, y) <= turn:
            height = dot(r, n)
            return hypot(hypot(dot(r, x), dot(r, y)) - radius, height)
        return min(dist(p, a), dist(p, b))

    return measure


def _angle(r: Vector, x: Vector, y: Vector) -> float:
    """Return the angle of a direction from x towards y, from 0 to 2 pi [rad]."""
    across, up = dot(r, x), dot(r, y)
    size = hypot(across, up)
    if size == 0.0:
        return 0.0
    angle = acos(max(-1.0, min(1.0, across / size)))
    return angle if up >= 0.0 else TURN - angle


def judge_no_stop(check: NoStopCheck, run: JudgedRun) -> Verdict:
    """Judge whether the arm stopped between two places, in its best pass."""
    a, b = run.basis.point(check.begin), run.basis.point(check.end)
    found = windows(run, a, b, check.mm)
    if not found:
        return did_not_go(run, a, b, check.mm)
    timeline = run.evidence.timeline
    halts = [[one for one in stops(timeline, *w) if one[0] < w[1] and one[1] > w[0]] for w in found]
    fewest = min(halts, key=len)
    if not fewest:
        return Verdict(1.0, "the arm did not stop on the way")
    t = fewest[0][0]
    place = nearest(clip(run.tip, t, run.evidence.end) or run.tip[-1:], a, 1.0).place
    more = f", and {count(len(fewest) - 1, 'time')} more" if len(fewest) > 1 else ""
    return Verdict(0.0, f"the arm stopped on the way, at {figure(t, run.s)} s at {run.place_text(place)}{more}", t)


# --- boxes -----------------------------------------------------------------------------------------------------------


def judge_keep_out(check: KeepOutCheck, run: JudgedRun) -> Verdict:
    """Judge whether the tip entered a box by more than the rounding."""
    T_box_world = inverse(run.basis.place(check.at))
    half = tuple(0.5 * size for size in check.size)

    def outside(p: Vector) -> float:
        """Return the distance from the box along its axes; negative inside."""
        return max(abs(x) - h for x, h in zip(moved_point(T_box_world, p), half, strict=True))

    limit = 1e-3 * largest(0.0, run.mm)
    deepest = least(run.tip, outside, run.precision, enough=-limit)
    if not exceeds(-1000.0 * deepest.value, 0.0, run.mm):
        return Verdict(1.0, "the tool kept out of the box")
    entered = next(t for t, _ in below(run.tip, outside, -limit, run.precision))
    deep = f"{figure(-1000.0 * deepest.value, run.mm)} mm deep at {run.place_text(deepest.place)}"
    return Verdict(0.0, f"the tool entered the box at {figure(entered, run.s)} s, {deep}", entered)


# --- speeds ----------------------------------------------------------------------------------------------------------


def judge_speed(check: SpeedCheck, run: JudgedRun) -> Verdict:
    """Judge the speed of the tip."""
    return _judge_rate(check, run, run.velocity, "speed", check.mm_s, "mm/s")


def judge_acceleration(check: AccelerationCheck, run: JudgedRun) -> Verdict:
    """Judge the acceleration of the tip."""
    return _judge_rate(check, run, run.acceleration, "acceleration", check.mm_s2, "mm/s2")


def _judge_rate(
    check: StretchCheck, run: JudgedRun, rates: Sequence[Piece], what: str, most: float, unit_: str
) -> Verdict:
    spans: list[Window] | None = None
    where = ""
    if check.begin is not None and check.end is not None:
        a, b = run.basis.point(check.begin), run.basis.point(check.end)
        spans = windows(run, a, b, PASSED_MM)
        where = f" between {run.place_text(a)} and {run.place_text(b)}"
        if not spans:
            return did_not_go(run, a, b, PASSED_MM)
    if check.around is not None:
        place = run.basis.point(check.around)
        near = within(run.tip, place, 1e-3 * check.radius, run.precision)
        spans = near if spans is None else _common(spans, near)
        where += f" within {figure(check.radius, run.mm)} mm of {run.place_text(place)}"
        if not spans:
            return Verdict(0.0, f"the tool was never{where}")
    if check.holding:
        held = _held_spans(run, check.holding)
        where += f" with the {check.holding} in the hand"
        if not held:
            return Verdict(0.0, f"the hand never held the {check.holding}")
        spans = held if spans is None else _common(spans, held)
    pieces = [piece for span in spans for piece in clip(rates, *span)] if spans is not None else list(rates)
    if not pieces:
        return Verdict(0.0, f"the tool was never{where}")
    found = greatest(pieces, length, run.precision, enough=1e-3 * largest(most, run.mm))
    value = 1000.0 * found.value
    if not exceeds(value, most, run.mm):
        return Verdict(1.0, f"the {what} of the tool stayed within {figure(most, run.mm)} {unit_}{where}")
    share = HALF if not exceeds(value, MORE * most, run.mm) else 0.0
    text = f"the {what} of the tool was {figure(value, run.mm)} {unit_}{where} at {figure(found.t, run.s)} s"
    return Verdict(share, f"{text}, {figure(most, run.mm)} {unit_} allowed", found.t)


def _held_spans(run: JudgedRun, part: str) -> list[Window]:
    """Return the intervals in which the hand held a part."""
    course, end = run.evidence.course, run.evidence.end
    if course is None:
        return []
    spans = (span for span in course.spans(part, end) if span.kind is SpanKind.HELD)
    return [(span.begin, min(span.end, end)) for span in spans if span.begin < end]


def _common(a: Sequence[Window], b: Sequence[Window]) -> list[Window]:
    """Return the common times of two lists of intervals."""
    both = ((max(one[0], other[0]), min(one[1], other[1])) for one in a for other in b)
    return [span for span in both if span[1] > span[0]]


COARSE = 0.25  # of the allowed distance: first error of the lines that approximate a path
FINE = 0.5  # of the rounding: error of these lines if the first one does not decide


def judge_like_model(check: LikeModelCheck, run: JudgedRun) -> Verdict:
    """Judge the path of the tip by that of the model."""
    model = run.basis.model
    if model is None:
        raise ValueError("the model's run is not known")
    return _at_same_times(check, run, model) if check.times else _on_same_path(check, run, model)


def _at_same_times(check: LikeModelCheck, run: JudgedRun, model: Evidence) -> Verdict:
    """Compare position and orientation at each time since the beginning of both runs."""
    evidence = run.evidence
    lasting = max(evidence.end - evidence.started, model.end - model.started)
    ours, theirs = (tip_pieces(it.arm, it.timeline, it.started, it.started + lasting) for it in (evidence, model))
    apart = _differences(ours, [_later(piece, evidence.started - model.started) for piece in theirs])
    found = greatest(apart, length, run.precision, enough=1e-3 * largest(check.mm, run.mm))
    far, share = 1000.0 * found.value, 1.0
    text = f"the tool was within {figure(check.mm, run.mm)} mm of the model's at all times"
    at: float | None = None
    if exceeds(far, check.mm, run.mm):
        share, at = (HALF if not exceeds(far, NEAR * check.mm, run.mm) else 0.0), found.t
        what = f"{figure(far, run.mm)} mm from where the model's is, {figure(check.mm, run.mm)} mm allowed"
        text = f"at {figure(found.t, run.s)} s the tool was {what}"
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
    turned = f"it was turned by {figure(off, step)} deg from the model's, {figure(check.deg, step)} deg allowed"
    part = HALF if not exceeds(off, NEAR * check.deg, step) else 0.0
    return Verdict(min(share, part), f"{text}; at {figure(when, run.s)} s {turned}", when if at is None else at)


def _later(piece: Piece, seconds: float) -> Piece:
    return piece._replace(start=piece.start + seconds, finish=piece.finish + seconds)


def _differences(a: Sequence[Piece], b: Sequence[Piece]) -> list[Piece]:
    """Return the difference of two curves as a curve."""
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
    """Compare both paths regardless of time: each must be close to the other. Coarse lines along the paths decide most
    runs.
    """
    theirs = tip_pieces(model.arm, model.timeline, model.started, model.end)
    limit, share = 1e-3 * largest(check.mm, run.mm), 1.0
    for error in (COARSE * limit, 1e-3 * FINE * run.mm):
        left, missed = _away(run.tip, theirs, run, error, limit), _away(theirs, run.tip, run, error, limit)
        if max(left.value, missed.value) + error + run.precision <= limit:
            break
    allowed, worst = f"{figure(check.mm, run.mm)} mm allowed", 1000.0 * max(left.value, missed.value)
    if not exceeds(worst, check.mm, run.mm):
        return Verdict(share, f"the tool kept to the model's path within {figure(check.mm, run.mm)} mm")
    share = HALF if not exceeds(worst, NEAR * check.mm, run.mm) else 0.0
    if exceeds(1000.0 * left.value, check.mm, run.mm):
        far = f"{figure(1000.0 * left.value, run.mm)} mm from the model's path, {allowed}"
        when = f"at {figure(left.t, run.s)} s at {run.place_text(left.place)}"
        return Verdict(share, f"the tool was {far}, {when}", left.t)
    far = f"{figure(1000.0 * missed.value, run.mm)} mm, {allowed}"
    place = run.place_text(missed.place)
    return Verdict(share, f"the model's path goes by {place}, the tool came no nearer than {far}")


def _away(pieces: Sequence[Piece], path: Sequence[Piece], run: JudgedRun, error: float, limit: float) -> Extreme:
    """Return the maximum distance of a curve from lines that approximate another path within `error` [m]. It need not
    be exact below `limit` minus `error`.
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
        """Return a bound for the line from p to q: the distance from a line is convex, so its maximum is at an end."""
        return min(max(distance_from_line(end, *known[near][:2]) for end in (p, q)) for near in (p, q))

    return farthest(pieces, measure, run.precision, enough=limit - error - run.precision, between=between)


def path_points(pieces: Sequence[Piece], error: float) -> list[Vector]:
    """Return the ends of straight lines that approximate a path within `error` [m]."""
    places = [(pieces[0].start, pieces[0].at(0.0))]
    for piece in pieces:
        lasting = piece.finish - piece.start
        count = ceil(lasting * sqrt(piece.bend / (4.0 * error))) or 1  # each bends by at most half the error
        places += [(piece.start + s, piece.at(s)) for s in (lasting * k / count for k in range(1, count + 1))]
    return [p for _, p in thin_out(places, 0.5 * error)]
