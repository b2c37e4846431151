"""Joints at constant jerk: changes of velocity piece by piece, stops, and one tick of jerk-limited steering.

Steering follows the rule of `lspb` without jumps of the acceleration: each joint has a constant jerk for a tick. Every
joint wants the velocity `w + g(e)`: the velocity of its target, plus a velocity that removes the error e in
RESPONSE_TICKS, but at most the velocity from which it can brake over the distance e. It wants the acceleration with
which it reaches this velocity, and at the same time acceleration 0, as soon as its jerk limit allows. With n ticks to
reduce the acceleration to 0, D = w + g - q' - q'' tick / 2,

q''(next) = 2 D / (tick (1 + n)), n >= 1, n (n + 1) >= 2 |D| / (jerk tick^2).

A stop follows the tick, and a joint chooses only jerks that leave room for a stop. If no constant jerk leaves such
room, the joint continues its previous plan, if necessary until the plan brings it to rest. So it stays inside its
limits whatever the next targets are.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from math import copysign, inf, nextafter, sqrt
from typing import NamedTuple

from msgspec import structs

from vrs_cli.kinematics.joints import LIMIT_TOLERANCE, Joints, Profile
from vrs_cli.trajectory.instant import TICK, TICKS_PER_SECOND, up_to_grid
from vrs_cli.trajectory.laws.law import Change, Coming, Pieces, Row, ramps
from vrs_cli.trajectory.laws.lspb import COASTING_TICKS, LIMIT_MARGIN
from vrs_cli.trajectory.laws.lspb import joint_stops as stops_at_constant_acceleration
from vrs_cli.trajectory.polynomial import Polynomial, bisect_interval, turns
from vrs_cli.trajectory.segment import JointPath, Path, Phase, Segment, segments_of
from vrs_cli.trajectory.state import NEGLIGIBLE, JointLimits, JointState, Target
from vrs_cli.values.commands import Motion

RESPONSE_TICKS = 4.0  # number of ticks in which an error is removed: the smallest number without an overshoot
APPROACH_PART = 0.25  # fraction of acceleration and jerk used to approach a target
# fraction of acceleration and jerk used to stop; the rest is a margin, because jerks change only at ticks
STOPPING_PART = 0.8
HALVINGS = 24
CUBIC = 3  # degree of a path of constant jerk
MIN_PIECE_S = 1e-10  # minimum duration of a piece [s]; shorter pieces are left out

# --- stops: one joint alone -----------------------------------------------------------------------------------------


def stop(v: float, a: float, acceleration: float, jerk: float) -> Pieces:
    """Return the quickest change to velocity and acceleration zero, as (duration, jerk) pieces."""
    left = v + 0.5 * a * abs(a) / jerk  # the velocity that is left when the acceleration is 0
    if abs(left) <= NEGLIGIBLE:
        return ((abs(a) / jerk, copysign(jerk, -a)),) if a else ()
    sign = copysign(1.0, left)
    v, a = v * sign, a * sign
    level = min(sqrt(jerk * v + 0.5 * a * a), acceleration)
    rise, fall = (a + level) / jerk, level / jerk
    hold = (v + 0.5 * (a - level) * abs(rise)) / level - 0.5 * fall
    pieces = (abs(rise), copysign(jerk, -sign * rise)), (hold, 0.0), (fall, sign * jerk)
    return tuple([piece for piece in pieces if piece[0] > MIN_PIECE_S])


def turning_back(v: float, a: float, acceleration: float, jerk: float) -> Pieces:
    """Return the pieces of the shortest motion to velocity zero, with any final acceleration."""
    sign = copysign(1.0, v)
    v, a = v * sign, a * sign
    ramp = max((a + acceleration) / jerk, 0.0)
    if v + a * ramp - 0.5 * jerk * ramp * ramp < 0.0:  # the joint is at rest before it reaches full acceleration
        return (((a + sqrt(a * a + 2.0 * jerk * v)) / jerk, -sign * jerk),)
    v += a * ramp - 0.5 * jerk * ramp * ramp
    pieces = (ramp, -sign * jerk), (v / acceleration, 0.0)
    return tuple([piece for piece in pieces if piece[0] > MIN_PIECE_S])


def farthest(q: float, v: float, a: float, pieces: Pieces) -> tuple[float, float]:
    """Return the minimum and the maximum position during pieces of constant jerk."""
    places = [q]
    for duration, jerk in pieces:
        places += [q + s * (v + s * (0.5 * a + s * jerk / 6.0)) for s in turns(v, a, jerk) if 0.0 < s < duration]
        q, v, a = state_after(q, v, a, duration, jerk)
        places.append(q)
    return min(places), max(places)


def state_after(q: float, v: float, a: float, s: float, jerk: float) -> tuple[float, float, float]:
    """Return position, velocity and acceleration after s seconds at constant jerk."""
    return q + s * (v + s * (0.5 * a + s * jerk / 6.0)), v + s * (a + 0.5 * s * jerk), a + s * jerk


# --- all joints ---


def joint_stops(state: JointState, limits: JointLimits, start: float, motion: Motion) -> Iterator[tuple[Segment, ...]]:
    """Yield the possible stops: at limited jerk; if the acceleration may jump, also at constant acceleration, which
    needs less room.
    """
    yield joint_stop(state, limits, start, motion)
    if not state.acceleration:
        yield from stops_at_constant_acceleration(state, limits, start, structs.replace(motion, profile=Profile.LSPB))


def joint_stop(state: JointState, limits: JointLimits, start: float, motion: Motion) -> tuple[Segment, ...]:
    """Bring every joint to rest as fast as possible, each in its own time. A joint that would leave its range turns
    back: the interrupted motion would have turned back too, or it would not have been planned.
    """
    rows = zip(
        state.joints,
        state.velocity,
        state.present_acceleration,
        limits.acceleration,
        limits.jerk,
        limits.lower,
        limits.upper,
        strict=True,
    )
    pieces = [_pieces_to_rest(*row) for row in rows]
    return segments_of(start, motion, joint_pieces(state, pieces))


def _pieces_to_rest(
    q: float, v: float, a: float, acceleration: float, jerk: float, lower: float, upper: float
) -> Pieces:
    direct = stop(v, a, acceleration, jerk)
    low, high = farthest(q, v, a, direct)
    if lower - LIMIT_TOLERANCE <= low and high <= upper + LIMIT_TOLERANCE:
        return direct
    pieces = turning_back(v, a, acceleration, jerk)
    for duration, rate in pieces:
        q, v, a = state_after(q, v, a, duration, rate)
    return pieces + stop(v, a, acceleration, jerk)


def joint_pieces(
    state: JointState, pieces: Sequence[Pieces], slows: float = 0.0
) -> Iterator[tuple[float, Phase, Path]]:
    """Yield the stretches of joints that each follow their own pieces until rest. `slows`: as for
    `common_stretches`.
    """
    rows = zip(state.joints, state.velocity, state.present_acceleration, pieces, strict=True)
    return common_stretches([list(rows_through(*row)) for row in rows], slows)


def rows_through(q: float, v: float, a: float, pieces: Pieces) -> Iterator[Row]:
    """Yield the cubics of a joint that follows the given pieces and ends at rest."""
    t = 0.0
    for duration, jerk in pieces:
        yield round(t * TICKS_PER_SECOND), t, q, v, 0.5 * a, jerk / 6.0
        q, v, a = state_after(q, v, a, duration, jerk)
        t += duration
    yield round(t * TICKS_PER_SECOND), t, q, 0.0, 0.0, 0.0  # exactly at rest, without rounding


def common_stretches(cubics: Sequence[Sequence[Row]], slows: float) -> Iterator[tuple[float, Phase, JointPath]]:
    """Yield a stretch from each instant at which some joint begins a new cubic to the next such instant. Only stretches
    that begin at `slows` [s] or later are marked as slowing down.
    """
    instants = sorted({row[0] for rows in cubics for row in rows})
    paths, slowing = zip(*[_column(rows, instants) for rows in cubics], strict=True), round(slows * TICKS_PER_SECOND)
    for (begin, end), path in zip(pairwise(instants), paths, strict=True):
        yield (end - begin) * TICK, Phase.BLEND if begin < slowing else Phase.DECELERATE, JointPath(path)


def _column(rows: Sequence[Row], instants: Sequence[int]) -> list[tuple[float, float, float, float]]:
    """Return the cubics of one joint from each instant to the next."""
    column, rest = [], iter(rows)
    (_, t, q, v, h, c), after = next(rest), next(rest, None)
    for instant in instants[:-1]:
        while after is not None and after[0] <= instant:
            (_, t, q, v, h, c), after = after, next(rest, None)
        s = instant * TICK - t
        if s:
            x = s * c
            y = h + 3.0 * x
            column.append((q + s * (v + s * (h + x)), v + s * (h + y), y, c))
        else:
            column.append((q, v, h, c))
    return column


class Joint(NamedTuple):
    """One joint: position q, velocity v and acceleration a; position p and velocity w of its target; its limits and
    range [rad, rad/s, rad/s2, rad/s3]. `peak`: the velocity that is never exceeded.
    """

    q: float
    v: float
    a: float
    p: float
    w: float
    v_max: float
    a_max: float
    j_max: float
    peak: float
    low: float
    high: float


def steer(
    state: JointState,
    target: Target,
    limits: JointLimits,
    _hardest: JointLimits,
    tick: float,
    start: float,
    motion: Motion,
    coming: Coming,
) -> tuple[Segment, ...]:
    """Plan a tick [s] towards the target, on the time grid, then a stop.

    `coming`: returns the part of each joint's previous plan that is still ahead, if it consists of cubics. Return no
    segments if the previous plan is needed but unknown.
    """
    joints = _joints(state, target, limits)
    jerks = [_jerk(one, tick) for one in joints]
    steady = [(one, jerk) for one, jerk in zip(joints, jerks, strict=True) if jerk is not None]
    if len(steady) == len(joints):
        return segments_of(start, motion, _tick_and_stop(state, steady, tick))
    before = coming()
    if before is None:
        return ()
    cubics = [
        planned if jerk is None else list(rows_through(one.q, one.v, one.a, _pieces(one, jerk, tick)))
        for one, jerk, planned in zip(joints, jerks, before, strict=True)
    ]
    return segments_of(start, motion, common_stretches(cubics, tick))


def replay_steering(
    state: JointState, jerks: Joints, limits: JointLimits, tick: float, start: float, motion: Motion
) -> tuple[Segment, ...]:
    """Plan a tick with the given jerks, then a stop."""
    joints = _joints(state, Target(state.joints, state.velocity), limits)
    return segments_of(start, motion, _tick_and_stop(state, list(zip(joints, jerks, strict=True)), tick))


def steering_of(segments: Sequence[Segment]) -> Joints | None:
    """Return the jerks from which `replay_steering` makes these segments; None if it cannot have made them."""
    chase, *after = (segment.path.coefficients for segment in segments if isinstance(segment.path, JointPath))
    if segments[0].phase is not Phase.BLEND or len(chase[0]) != CUBIC + 1:
        return None
    tick, coast = segments[0].duration, after[0] if after else ((),) * len(chase)
    jerks = [_jerk_of(row, then, tick) for row, then in zip(chase, coast, strict=True)]
    return None if None in jerks else tuple(jerks)  # type: ignore[arg-type]


def _jerk_of(row: Polynomial, then: Polynomial, tick: float) -> float | None:
    """Return the jerk of a joint in a tick, to the bit. `then`: the cubic after the tick. Several jerks have the same
    stored value jerk / 6, so the state in which `then` begins decides between them.
    """
    q, v, half, sixth = row
    near = 6.0 * sixth
    for jerk in (near, nextafter(near, inf), nextafter(near, -inf)):
        q1, v1, a1 = state_after(q, v, 2.0 * half, tick, jerk)
        if jerk / 6.0 == sixth and then[:CUBIC] in ((), (q1, v1, 0.5 * a1)):
            return jerk
    return None


def _joints(state: JointState, target: Target, limits: JointLimits) -> list[Joint]:
    rows = zip(
        state.joints,
        state.velocity,
        state.present_acceleration,
        target.joints,
        target.velocity,
        limits.velocity,
        limits.acceleration,
        limits.jerk,
        limits.peak,
        limits.lower,
        limits.upper,
        strict=True,
    )
    return [
        Joint(
            q,
            v,
            a,
            p,
            w,
            v_max * LIMIT_MARGIN,
            a_max * LIMIT_MARGIN,
            j_max * LIMIT_MARGIN,
            peak,
            min(low, q),
            max(high, q),
        )
        for q, v, a, p, w, v_max, a_max, j_max, peak, low, high in rows
    ]


# --- the tick ------------------------------------------------------------------------------------------------------


def _jerk(one: Joint, tick: float) -> float | None:
    """Return the jerk for a tick: of all jerks that keep the joint inside its limits, the one nearest to the wanted
    jerk; None if there is none.
    """
    least = min(max(-one.j_max, (-one.a_max - one.a) / tick), one.j_max)
    most = max(min(one.j_max, (one.a_max - one.a) / tick), -one.j_max)
    # the wanted velocity determines the acceleration at the end of the tick, and so the jerk
    error = one.p - one.q
    closing = min(
        abs(error) / (RESPONSE_TICKS * tick),
        _brakable(abs(error), APPROACH_PART * one.a_max, APPROACH_PART * one.j_max),
    )
    wanted = min(max(one.w + copysign(closing, error), -one.v_max), one.v_max)
    change = wanted - one.v - 0.5 * one.a * tick
    ticks = max(0.5 * (sqrt(1.0 + 8.0 * abs(change) / (STOPPING_PART * one.j_max * tick * tick)) - 1.0), 1.0)
    jerk = min(max(((2.0 * change / (tick * (1.0 + ticks))) - one.a) / tick, least), most)
    beyond = _beyond(one, jerk, tick)
    if not beyond:
        return jerk
    near, far = (least, jerk) if beyond > 0 else (most, jerk)
    if _beyond(one, near, tick) == beyond:
        return None
    near, _ = bisect_interval(lambda slower: _beyond(one, slower, tick) != beyond, near, far, HALVINGS)
    return None if _beyond(one, near, tick) else near


def _brakable(way: float, acceleration: float, jerk: float) -> float:
    """Return the velocity from which a joint can come to rest within a distance.

    The distance is v / 2 (v / A + A / J), or sqrt(v^3 / J) if full acceleration is not reached.
    """
    ramp = acceleration / jerk
    if way < acceleration * ramp * ramp:
        return float((way * way * jerk) ** (1.0 / 3.0))
    return sqrt(0.25 * acceleration * acceleration * ramp * ramp + 2.0 * acceleration * way) - 0.5 * acceleration * ramp


def _beyond(one: Joint, jerk: float, tick: float) -> int:
    """Return 1 if a tick with this jerk makes a joint exceed its velocity limit in the positive direction, or leaves
    too little room to stop before its upper limit; -1 if the same happens in the negative direction; otherwise 0.
    """
    q, v, a = one.q, one.v, one.a
    _, v1, a1 = state_after(q, v, a, tick, jerk)
    turning = v - 0.5 * a * a / jerk if a * a1 < 0.0 else v  # the velocity where the acceleration changes its sign
    settled = v1 + 0.5 * a1 * abs(a1) / (STOPPING_PART * one.j_max)
    if max(turning, v1, settled) > _velocity_bound(one, v, a):
        return 1
    if min(turning, v1, settled) < -_velocity_bound(one, -v, -a):
        return -1
    hard, quick = STOPPING_PART * one.a_max, STOPPING_PART * one.j_max
    fastest = max(abs(turning), abs(v1), abs(v)) + 0.5 * a1 * a1 / quick
    enough = fastest * (tick + abs(a1) / quick + 0.5 * (fastest / hard + hard / quick))
    if one.low + enough <= q <= one.high - enough:
        return 0
    low, high = farthest(q, v, a, ((tick, jerk), *stop(v1, a1, hard, quick)))
    return 1 if high > one.high else -1 if low < one.low else 0


def _velocity_bound(one: Joint, v: float, a: float) -> float:
    """Return the maximum velocity: the requested limit, or a higher velocity that the current acceleration leads to
    anyway.
    """
    coming = v + 0.5 * a * a / (STOPPING_PART * one.j_max) if a > 0.0 else v
    return max(min(max(one.v_max, coming), one.peak), v)


# --- the stop ------------------------------------------------------------------------------------------------------


def _tick_and_stop(
    state: JointState, steady: Sequence[tuple[Joint, float]], tick: float
) -> Iterator[tuple[float, Phase, Path]]:
    """Plan a tick with the jerk of each joint, then a stop: all joints together if there is enough room, else each
    joint on its own.
    """
    together = _together(steady, tick)
    return iter(together) if together else joint_pieces(state, [_pieces(*one, tick) for one in steady], tick)


def _pieces(one: Joint, jerk: float, tick: float) -> Pieces:
    """Return the pieces of a joint that stops on its own: the tick, then the stop."""
    _, v1, a1 = state_after(one.q, one.v, one.a, tick, jerk)
    return (tick, jerk), *stop(v1, a1, STOPPING_PART * one.a_max, STOPPING_PART * one.j_max)


def _together(steady: Sequence[tuple[Joint, float]], tick: float) -> list[tuple[float, Phase, Path]]:
    """Plan the tick, then a common stop: all joints reduce their accelerations to zero, coast, and come to rest
    together. Return no stretches if there is not enough room.
    """
    joints = [one for one, _ in steady]
    after = [state_after(one.q, one.v, one.a, tick, jerk) for one, jerk in steady]
    chase = JointPath(tuple([(one.q, one.v, 0.5 * one.a, jerk / 6.0) for one, jerk in steady]))
    stretches: list[tuple[float, Phase, Path]] = [(tick, Phase.BLEND, chase)]
    if not any(v or a for _, v, a in after):
        return stretches
    settling = [abs(a) / one.j_max for one, (_, _, a) in zip(joints, after, strict=True)]
    coasting = up_to_grid(max(COASTING_TICKS * tick, *settling))
    coasted = [state_after(q, v, a, coasting, -a / coasting)[:2] for q, v, a in after]
    change = _stopping_change(joints, [v for _, v in coasted])
    for one, here, (_, v) in zip(joints, after, coasted, strict=True):
        if not _has_room(one, here, v, coasting, change):
            return []
    path = tuple([(q, v, 0.5 * a, (0.0 - a) / (6.0 * coasting)) for q, v, a in after])
    stretches.append((coasting, Phase.CRUISE, JointPath(path)))
    lasting = change.durations
    changes = [change.polynomials(q, v, 0.0, 0.0) if lasting else [] for q, v in coasted]
    for duration, rows in zip(lasting, zip(*changes, strict=True), strict=True):
        stretches.append((duration, Phase.DECELERATE, JointPath(rows)))
    return stretches


def _stopping_change(joints: Sequence[Joint], velocities: Sequence[float]) -> Change:
    """Return the times of the change in which joints with these velocities come to rest together."""
    by_acceleration = max(abs(v) / one.a_max for one, v in zip(joints, velocities, strict=True))
    by_jerk = max(abs(v) / one.j_max for one, v in zip(joints, velocities, strict=True))
    return ramps(by_acceleration / STOPPING_PART, by_jerk / STOPPING_PART)


def _has_room(one: Joint, here: tuple[float, float, float], v1: float, coasting: float, change: Change) -> bool:
    """Return whether a joint with velocity v1 after the tick has room to coast and then stop."""
    q, v, a = here
    if not -_velocity_bound(one, -one.v, -one.a) <= v1 <= _velocity_bound(one, one.v, one.a):
        return False
    enough = max(abs(v), abs(v1)) * (coasting + change.lasts)
    if one.low + enough <= q <= one.high - enough:
        return True
    low, high = farthest(q, v, a, ((coasting, -a / coasting), *(change.pieces(v1, 0.0, 0.0) if v1 else ())))
    return one.low <= low and high <= one.high
