"""Judge the path of the tool's tip: places, lines and arcs, stops, boxes, speeds, and comparison with the model
solution."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from math import acos, ceil, degrees, dist, hypot, radians, sqrt

from vrs_cli.engine.approximation import distance_from_line, thin_out
from vrs_cli.kinematics import transform
from vrs_cli.teach import checks, tip
from vrs_cli.teach.exercise_text import Place
from vrs_cli.teach.judging import basis
from vrs_cli.values.numbers import count
from vrs_cli.values.world import SpanKind

Window = tuple[float, float]  # start and end of an interval [s]
PASSED_MM = 1.0  # [mm] distance within which the tip passes a place, if a check gives none
FLAT = 1e-6  # [m] three places define no arc if the second is closer than this to the line through the others


def _reach(mm: float, run: basis.JudgedRun) -> float:
    """Return the distance [m] within which the tip passes a place."""
    return 1e-3 * basis.largest(mm, run.mm)


# --- places ----------------------------------------------------------------------------------------------------------


def judge_places(check: checks.PlacesCheck, run: basis.JudgedRun) -> basis.Verdict:
    """Judge which places the tip passed, and in which order."""
    t, reach, total = run.evidence.started, _reach(check.mm, run), len(check.places)
    for found, place in enumerate(check.places):
        target = run.basis.point(place)
        after = tip.clip(run.tip, t, run.evidence.end)
        if not after:
            return basis.Verdict(found / total, f"the tool did not move on to {run.place_text(target)}", t)
        passed = tip.within(after, target, reach, run.precision)
        if not passed:
            near = tip.nearest(after, target, run.precision)
            since = f" after {basis.figure(t, run.s)} s" if found else ""
            return basis.Verdict(
                found / total,
                f"the tool came no nearer to {run.place_text(target)}{since} than "
                f"{basis.figure(1e3 * near.value, run.mm)} mm, {basis.figure(check.mm, run.mm)} mm allowed; "
                f"{found} of {count(total, 'place')} passed",
                near.t,
            )
        t = passed[0][0]
    return basis.Verdict(1.0, f"the tool passed {count(total, 'place')}{' in order' if total > 1 else ''}")


def windows(run: basis.JudgedRun, a: transform.Vector, b: transform.Vector, mm: float) -> list[Window]:
    """Return the intervals in which the tip moves from one place to another: from its departure from the first place to
    its arrival at the second.
    """
    left, came = (tip.within(run.tip, place, _reach(mm, run), run.precision) for place in (a, b))
    found = list[Window]()
    for number, (_, leaves) in enumerate(left):
        again = left[number + 1][0] if number + 1 < len(left) else run.evidence.end
        arrival = next((begin for begin, end in came if end >= leaves), None)
        if arrival is not None and arrival <= again:
            found.append((leaves, max(arrival, leaves)))
    return found


def did_not_go(run: basis.JudgedRun, a: transform.Vector, b: transform.Vector, mm: float) -> basis.Verdict:
    """Return the verdict for a tip that never moved from one place to the other."""
    for what, place in (("beginning", a), ("end", b)):
        near = tip.nearest(run.tip, place, run.precision)
        if near.value > _reach(mm, run):
            far = f"{basis.figure(1000.0 * near.value, run.mm)} mm, {basis.figure(mm, run.mm)} mm allowed"
            return basis.Verdict(
                0.0, f"the tool came no nearer to the {what} {run.place_text(place)} than {far}", near.t
            )
    return basis.Verdict(0.0, f"the tool did not go from {run.place_text(a)} to {run.place_text(b)}")


# --- lines, arcs, stops ----------------------------------------------------------------------------------------------


def judge_path(check: checks.PathCheck, run: basis.JudgedRun) -> basis.Verdict:
    """Judge how far the tip was from a line or an arc. The best of several passes counts."""
    a, b = run.basis.point(check.begin), run.basis.point(check.end)
    found = windows(run, a, b, check.mm)
    if not found:
        return did_not_go(run, a, b, check.mm)
    if check.via is None:
        measure, search, way = (lambda p: distance_from_line(p, a, b)), tip.greatest, "line"
    else:
        measure, search, way = arc_measure(a, run.basis.point(check.via), b), tip.farthest, "arc"
    worst = (search(tip.clip(run.tip, *window) or run.tip[:1], measure, run.precision) for window in found)
    best = min(worst, key=lambda one: one.value)
    far = 1000.0 * best.value
    share = basis.share_within(far, check.mm, run.mm)
    if share < 1.0:
        allowed = f"{basis.figure(far, run.mm)} mm from the {way}, {basis.figure(check.mm, run.mm)} mm allowed"
        return basis.Verdict(
            share, f"the tool was {allowed}, at {basis.figure(best.t, run.s)} s at {run.place_text(best.place)}", best.t
        )
    text = f"the tool stayed within {basis.figure(check.mm, run.mm)} mm of the {way}"
    return basis.Verdict(1.0, text) if check.deg is None else _orientation(check.deg, text, check.begin, found, run)


def _orientation(most: float, text: str, place: Place, found: list[Window], run: basis.JudgedRun) -> basis.Verdict:
    """Judge how far the tool turned away from the orientation of a place. The best of several passes counts."""
    wanted, step, it = run.basis.place(place), run.basis.rounding.deg, run.evidence
    off, t = min(
        tip.most_turned(
            tip.turning_pieces(it.arm, it.timeline, *window),
            [tip.TurningPiece(*window, lambda _: wanted, 0.0)],
            radians(basis.PRECISION * step),
            enough=radians(basis.largest(most, step)),
        )
        for window in found
    )
    share = basis.share_within(degrees(off), most, step)
    if share == 1.0:
        return basis.Verdict(share, f"{text}, and was turned by no more than {basis.figure(most, step)} deg")
    turned = f"it was turned by {basis.figure(degrees(off), step)} deg, {basis.figure(most, step)} deg allowed"
    return basis.Verdict(share, f"{text}; at {basis.figure(t, run.s)} s {turned}", t)


def arc_measure(a: transform.Vector, via: transform.Vector, b: transform.Vector) -> tip.Measure:
    """Return a function that measures the distance from the arc from a to b through `via`. Raises ValueError if the
    three places are on one line."""
    u, v = transform.vector_difference(via, a), transform.vector_difference(b, a)
    normal = transform.cross(u, v)
    square = transform.dot(normal, normal)
    if square < (FLAT * transform.length(v)) ** 2:
        raise ValueError("the three places of the arc are on one line")
    toward = transform.vector_sum(
        transform.scaled_vector(transform.cross(v, normal), transform.dot(u, u)),
        transform.scaled_vector(transform.cross(normal, u), transform.dot(v, v)),
    )
    centre = transform.vector_sum(a, transform.scaled_vector(toward, 0.5 / square))
    n, x = transform.unit(normal), transform.unit(transform.vector_difference(a, centre))
    y, radius = transform.cross(n, x), dist(a, centre)
    turn = _angle(
        transform.vector_difference(b, centre), x, y
    )  # [rad] angle from a to b on the arc through `via`, positive about n

    def measure(p: transform.Vector) -> float:
        r = transform.vector_difference(p, centre)
        if _angle(r, x, y) <= turn:
            return hypot(hypot(transform.dot(r, x), transform.dot(r, y)) - radius, transform.dot(r, n))
        return min(dist(p, a), dist(p, b))

    return measure


def _angle(r: transform.Vector, x: transform.Vector, y: transform.Vector) -> float:
    """Return the angle of a direction, measured from x towards y, from 0 to 2 pi [rad]."""
    across, up = transform.dot(r, x), transform.dot(r, y)
    size = hypot(across, up)
    if size == 0.0:
        return 0.0
    angle = acos(max(-1.0, min(1.0, across / size)))
    return angle if up >= 0.0 else transform.TURN - angle


def judge_no_stop(check: checks.NoStopCheck, run: basis.JudgedRun) -> basis.Verdict:
    """Judge whether the arm stopped between two places. The best of several passes counts."""
    a, b = run.basis.point(check.begin), run.basis.point(check.end)
    found = windows(run, a, b, check.mm)
    if not found:
        return did_not_go(run, a, b, check.mm)
    halts = ([one for one in tip.stops(run.evidence.timeline, *w) if one[0] < w[1] and one[1] > w[0]] for w in found)
    fewest = min(halts, key=len)
    if not fewest:
        return basis.Verdict(1.0, "the arm did not stop on the way")
    t = fewest[0][0]
    place = tip.nearest(tip.clip(run.tip, t, run.evidence.end) or run.tip[-1:], a, 1.0).place
    more = f", and {count(len(fewest) - 1, 'time')} more" if len(fewest) > 1 else ""
    return basis.Verdict(
        0.0, f"the arm stopped on the way, at {basis.figure(t, run.s)} s at {run.place_text(place)}{more}", t
    )


# --- boxes -----------------------------------------------------------------------------------------------------------


def judge_keep_out(check: checks.KeepOutCheck, run: basis.JudgedRun) -> basis.Verdict:
    """Judge whether the tip entered a box by more than the rounding step."""
    T_box_world = transform.inverse(run.basis.place(check.at))
    half = tuple(0.5 * size for size in check.size)

    def outside(p: transform.Vector) -> float:
        """Return the distance from the box, measured along its axes; negative inside."""
        return max(abs(x) - h for x, h in zip(transform.moved_point(T_box_world, p), half, strict=True))

    limit = 1e-3 * basis.largest(0.0, run.mm)
    deepest = tip.least(run.tip, outside, run.precision, enough=-limit)
    if not basis.exceeds(-1000.0 * deepest.value, 0.0, run.mm):
        return basis.Verdict(1.0, "the tool kept out of the box")
    entered = next(t for t, _ in tip.below(run.tip, outside, -limit, run.precision))
    deep = f"{basis.figure(-1000.0 * deepest.value, run.mm)} mm deep at {run.place_text(deepest.place)}"
    return basis.Verdict(0.0, f"the tool entered the box at {basis.figure(entered, run.s)} s, {deep}", entered)


# --- speeds ----------------------------------------------------------------------------------------------------------


def judge_speed(check: checks.SpeedCheck, run: basis.JudgedRun) -> basis.Verdict:
    return _judge_rate(check, run, run.velocity, "speed", check.mm_s, "mm/s")


def judge_acceleration(check: checks.AccelerationCheck, run: basis.JudgedRun) -> basis.Verdict:
    return _judge_rate(check, run, run.acceleration, "acceleration", check.mm_s2, "mm/s2")


def _judge_rate(
    check: checks.StretchCheck, run: basis.JudgedRun, rates: Sequence[tip.Piece], what: str, most: float, unit_: str
) -> basis.Verdict:
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
        near = tip.within(run.tip, place, 1e-3 * check.radius, run.precision)
        spans = near if spans is None else _common(spans, near)
        where += f" within {basis.figure(check.radius, run.mm)} mm of {run.place_text(place)}"
        if not spans:
            return basis.Verdict(0.0, f"the tool was never{where}")
    if check.holding:
        held = _held_spans(run, check.holding)
        where += f" with the {check.holding} in the hand"
        if not held:
            return basis.Verdict(0.0, f"the hand never held the {check.holding}")
        spans = held if spans is None else _common(spans, held)
    pieces = [piece for span in spans for piece in tip.clip(rates, *span)] if spans is not None else list(rates)
    if not pieces:
        return basis.Verdict(0.0, f"the tool was never{where}")
    found = tip.greatest(pieces, transform.length, run.precision, enough=1e-3 * basis.largest(most, run.mm))
    value = 1000.0 * found.value
    share = basis.share_within(value, most, run.mm, basis.MORE)
    if share == 1.0:
        return basis.Verdict(share, f"the {what} of the tool stayed within {basis.figure(most, run.mm)} {unit_}{where}")
    text = (
        f"the {what} of the tool was {basis.figure(value, run.mm)} {unit_}{where} at {basis.figure(found.t, run.s)} s"
    )
    return basis.Verdict(share, f"{text}, {basis.figure(most, run.mm)} {unit_} allowed", found.t)


def _held_spans(run: basis.JudgedRun, part: str) -> list[Window]:
    """Return the intervals in which the hand held a part."""
    course, end = run.evidence.course, run.evidence.end
    if course is None:
        return []
    spans = (span for span in course.spans(part, end) if span.kind is SpanKind.HELD)
    return [(span.begin, min(span.end, end)) for span in spans if span.begin < end]


def _common(a: Sequence[Window], b: Sequence[Window]) -> list[Window]:
    """Return the intersections of two lists of intervals."""
    both = ((max(one[0], other[0]), min(one[1], other[1])) for one in a for other in b)
    return [span for span in both if span[1] > span[0]]


COARSE = 0.25  # maximum error of the first approximation of a path by lines, as a fraction of the allowed deviation
FINE = 0.5  # maximum error of the second approximation, if the first cannot decide, as a fraction of the rounding step


def judge_like_model(check: checks.LikeModelCheck, run: basis.JudgedRun) -> basis.Verdict:
    """Judge the path of the tip by comparison with the path of the model solution."""
    model = run.basis.model
    if model is None:
        raise ValueError("the model's run is not known")
    return _at_same_times(check, run, model) if check.times else _on_same_path(check, run, model)


def _at_same_times(check: checks.LikeModelCheck, run: basis.JudgedRun, model: basis.Evidence) -> basis.Verdict:
    """Compare position and orientation at equal times after the starts of both runs."""
    evidence, step, shift = run.evidence, run.basis.rounding.deg, run.evidence.started - model.started
    lasting = max(evidence.end - evidence.started, model.end - model.started)
    ours, theirs = (tip.tip_pieces(it.arm, it.timeline, it.started, it.started + lasting) for it in (evidence, model))
    theirs = [piece._replace(start=piece.start + shift, finish=piece.finish + shift) for piece in theirs]
    apart = [
        tip.Piece(since, until, _difference(one, other, since), one.bend + other.bend)
        for since, until, one, other in tip.together(ours, theirs)
    ]
    found = tip.greatest(apart, transform.length, run.precision, enough=1e-3 * basis.largest(check.mm, run.mm))
    far, times = 1000.0 * found.value, list[float]()
    share = basis.share_within(far, check.mm, run.mm)
    text = f"the tool was within {basis.figure(check.mm, run.mm)} mm of the model's at all times"
    if share < 1.0:
        what = f"{basis.figure(far, run.mm)} mm from where the model's is, {basis.figure(check.mm, run.mm)} mm allowed"
        text = f"at {basis.figure(found.t, run.s)} s the tool was {what}"
        times.append(found.t)
    if check.deg is not None:
        turning, of_model = (
            tip.turning_pieces(it.arm, it.timeline, it.started, it.started + lasting) for it in (evidence, model)
        )
        later = [piece._replace(start=piece.start + shift, finish=piece.finish + shift) for piece in of_model]
        enough = radians(basis.largest(check.deg, step))
        angle, when = tip.most_turned(turning, later, radians(basis.PRECISION * step), enough=enough)
        part = basis.share_within(degrees(angle), check.deg, step)
        if part < 1.0:
            off, allowed = basis.figure(degrees(angle), step), basis.figure(check.deg, step)
            turned = f"it was turned by {off} deg from the model's, {allowed} deg allowed"
            share, text = min(share, part), f"{text}; at {basis.figure(when, run.s)} s {turned}"
            times.append(when)
    return basis.Verdict(share, text, times[0] if times else None)


def _difference(a: tip.Piece, b: tip.Piece, since: float) -> Callable[[float], transform.Vector]:
    first, second = since - a.start, since - b.start
    return lambda s: transform.vector_difference(a.at(first + s), b.at(second + s))


def _on_same_path(check: checks.LikeModelCheck, run: basis.JudgedRun, model: basis.Evidence) -> basis.Verdict:
    """Compare both paths regardless of time: each must be close to the other. Coarse approximations of the paths decide
    most runs."""
    theirs = tip.tip_pieces(model.arm, model.timeline, model.started, model.end)
    limit = 1e-3 * basis.largest(check.mm, run.mm)
    for error in (COARSE * limit, 1e-3 * FINE * run.mm):
        left, missed = _away(run.tip, theirs, run, error, limit), _away(theirs, run.tip, run, error, limit)
        if max(left.value, missed.value) + error + run.precision <= limit:
            break
    allowed, worst = f"{basis.figure(check.mm, run.mm)} mm allowed", 1000.0 * max(left.value, missed.value)
    share = basis.share_within(worst, check.mm, run.mm)
    if share == 1.0:
        return basis.Verdict(share, f"the tool kept to the model's path within {basis.figure(check.mm, run.mm)} mm")
    if basis.exceeds(1000.0 * left.value, check.mm, run.mm):
        far = f"{basis.figure(1000.0 * left.value, run.mm)} mm from the model's path, {allowed}"
        when = f"at {basis.figure(left.t, run.s)} s at {run.place_text(left.place)}"
        return basis.Verdict(share, f"the tool was {far}, {when}", left.t)
    far = f"{basis.figure(1000.0 * missed.value, run.mm)} mm, {allowed}"
    place = run.place_text(missed.place)
    return basis.Verdict(share, f"the model's path goes by {place}, the tool came no nearer than {far}")


def _away(
    pieces: Sequence[tip.Piece], path: Sequence[tip.Piece], run: basis.JudgedRun, error: float, limit: float
) -> tip.Extreme:
    """Return the maximum distance between the curve `pieces` and `path`, which is approximated by straight lines within
    `error` [m]. A result below `limit` minus `error` may be inexact."""
    lines = [(a, b, dist(a, b)) for a, b in pairwise(path_points(path, error))]
    recent, known = lines[0], dict[transform.Vector, tuple[transform.Vector, transform.Vector, float]]()

    def measure(p: transform.Vector) -> float:
        nonlocal recent
        best = distance_from_line(p, *recent[:2])
        for line in lines:
            a, b, size = line
            if dist(p, a) - size < best and (far := distance_from_line(p, a, b)) < best:
                best, recent = far, line
        known[p] = recent
        return best

    def between(p: transform.Vector, q: transform.Vector) -> float:
        """Return an upper bound of the distance between the path and any point of the line from p to q. The distance
        from a straight line is convex, so its maximum is at p or q."""
        return min(max(distance_from_line(end, *known[near][:2]) for end in (p, q)) for near in (p, q))

    return tip.farthest(pieces, measure, run.precision, enough=limit - error - run.precision, between=between)


def path_points(pieces: Sequence[tip.Piece], error: float) -> list[transform.Vector]:
    """Return the end points of straight lines that approximate a path within `error` [m]."""
    places = [(pieces[0].start, pieces[0].at(0.0))]
    for piece in pieces:
        lasting = piece.finish - piece.start
        # enough lines that each deviates from the path by at most half the error
        count = ceil(lasting * sqrt(piece.bend / (4.0 * error))) or 1
        places += [(piece.start + s, piece.at(s)) for s in (lasting * k / count for k in range(1, count + 1))]
    return [p for _, p in thin_out(places, 0.5 * error)]
