"""Jerk-limited joint motions that start in motion: each joint has its own phases, and all joints arrive together.

A joint changes its velocity to v1, cruises, and slows down to rest, at constant jerks. The distance that it covers in a
time T,

    x(v1) = distance of both changes + v1 (T - time of both changes),    dx/dv1 = cruise + (fall + ramp) / 2 > 0,

grows with v1, so Newton's method finds the v1 with the right distance. `fall` is the end of the first change, in which
the acceleration goes to zero, and `ramp` is the start of the second. So a joint never exceeds its velocity limit,
unless its state at the start forces it to. If a joint slows down already, and its goal is a little farther than its
quickest stop, a cruise without acceleration takes too long; the joint then brakes less, in a single change. (All cases,
in closed form: Berscheid and Kroeger, Jerk-limited Real-time Trajectory Generation with Arbitrary Target States, 2021.)

The instants between phases are real numbers; the instants between segments lie on the time grid. Each segment continues
the cubic of its phase from the nearest instant of the grid. So jerks stay unchanged, position and velocity are
continuous except for rounding, and the acceleration jumps by at most the jerk times 0.5 ns.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from math import inf, sqrt
from typing import NamedTuple

from vrs_cli.kinematics.joints import Joints
from vrs_cli.trajectory.instant import TICK, TICKS_PER_SECOND, up_to_grid
from vrs_cli.trajectory.laws.law import NoTimes, Row
from vrs_cli.trajectory.laws.scurve_steering import MIN_PIECE_S, common_stretches
from vrs_cli.trajectory.segment import Path, Phase
from vrs_cli.trajectory.state import NEGLIGIBLE, JointLimits, JointState

SAME_WAY = 1e-12  # [rad, m] a smaller error of the distance counts as 0
# [s] tolerance of the total time of all phases: less than half a step of the time grid
TIME_TOLERANCE = 0.4 * TICK
NEWTON_STEPS = 15  # maximum number of Newton steps; five are usual
SEARCH_STEPS = 60  # maximum number of steps of other searches
MIN_BRAKING = 1e-3  # weakest braking that is tried, as a fraction of the acceleration limit
MAX_RAISES = 20  # maximum number of attempts to find the time in which all joints arrive

_new = tuple.__new__


class Joint(NamedTuple):
    """One joint: its remaining distance, its current velocity and acceleration, and its limits."""

    way: float
    velocity: float
    acceleration: float
    max_velocity: float
    max_acceleration: float
    max_jerk: float


class Phases(NamedTuple):
    """Phases of a joint's motion: the acceleration goes to `level` in `rise` seconds, stays there for `hold`, and goes
    to 0 in `fall`. Then the joint has the velocity `cruising`, until its deceleration grows for `ramp`, stays for
    `keep`, and goes to 0 in another `ramp`. `lasts`, `way`: duration and distance of all phases without the cruise.
    """

    rise: float
    hold: float
    fall: float
    level: float
    cruising: float
    ramp: float
    keep: float
    lasts: float
    way: float


def together(joints: Sequence[Joint], least: float = 0.0) -> tuple[float, list[Phases]]:
    """Return the time [s] until all joints arrive, which is at least `least`, and the phases of each joint.

    If possible, a joint changes its phases at the same instants as the slowest joint, which gives fewer segments.
    Raises NoTimes.
    """
    slowest = max(joints, key=_likely_time)
    alone, quick = _soonest_in_two(slowest)
    weak = _weakest(slowest, alone, quick)
    whole = up_to_grid(max(least, phases(slowest, 0.0, weak).lasts if weak else alone))
    for _ in range(MAX_RAISES):
        pace = _phases_in(slowest, whole)
        if not isinstance(pace, float):
            found = [pace if one is slowest else _at_pace(one, pace, whole) or _phases_in(one, whole) for one in joints]
            late = {time: one for one, time in zip(joints, found, strict=True) if isinstance(time, float)}
            if not late:
                return whole, [one for one in found if not isinstance(one, float)]
            pace = max(late)
            slowest = late[pace]
        whole = up_to_grid(max(pace, whole + TICK))
    raise NoTimes("joints that can arrive at different times only")


def _likely_time(joint: Joint) -> float:
    """Estimate how long a joint takes [s] if it first stops and then moves to its target."""
    way, v, _, v_max, a_max, jerk = joint
    stop = abs(v) / a_max
    left = abs(way - 0.5 * v * stop)
    going = 2.0 * sqrt(left / a_max) if left * a_max < v_max * v_max else left / v_max + v_max / a_max
    return stop + a_max / jerk + going


# --- one joint -----------------------------------------------------------------------------------------------------


def phases(joint: Joint, v1: float, a_max: float) -> Phases:
    """Return the quickest changes to velocity v1 and from there to rest, with accelerations up to a_max."""
    _, v0, a0, _, _, jerk = joint
    dv, a, sign = v0 - v1, a0, -1.0
    if dv + 0.5 * a * abs(a) / jerk < 0.0:  # the joint must become faster than its current acceleration would make it
        dv, a, sign = -dv, -a, 1.0
    square = jerk * dv + 0.5 * a * a
    size, hold = sqrt(square) if square > 0.0 else 0.0, 0.0
    if size > a_max:
        size, rise = a_max, abs(a + a_max) / jerk  # reduce a larger acceleration to a_max, if ACCEL is lower now
        hold = (dv + 0.5 * (a - size) * rise) / size - 0.5 * size / jerk
        hold = hold if hold > 0.0 else 0.0
    else:
        rise = abs(a + size) / jerk
    fall, level = size / jerk, sign * size
    later = hold + fall
    lasts, half = rise + later, 0.5 * later
    by_level = rise * (rise / 6.0 + half) + hold * (0.5 * hold + fall) + fall * fall / 3.0
    way = v0 * lasts + a0 * rise * (rise / 3.0 + half) + level * by_level
    speed = abs(v1)
    if speed < NEGLIGIBLE:
        return _new(Phases, (rise, hold, fall, level, 0.0, 0.0, 0.0, lasts, way))
    slow = sqrt(jerk * speed)
    if slow > a_max:
        slow = a_max
    ramp, reach = slow / jerk, speed / slow
    slowing = reach + ramp
    return _new(Phases, (rise, hold, fall, level, v1, ramp, reach - ramp, lasts + slowing, way + 0.5 * v1 * slowing))


def _phases_in(joint: Joint, whole: float) -> Phases | float:
    """Return the phases with which a joint arrives in a given time [s]; if that is impossible, the next possible time
    [s].
    """
    found = _in_two(joint, whole, joint.max_velocity)
    if _arrives(joint, found, whole):
        return found
    alone, quick = _soonest_in_two(joint)
    if alone <= whole:
        found = _in_two(joint, whole, abs(quick.cruising))
        if _arrives(joint, found, whole):
            return found
        # next, find the motion without a cruise phase whose velocity is lower than that of `found`
        sign = 1.0 if found.cruising > 0.0 else -1.0
        speed = _root(lambda speed: sign * _past(joint, sign * speed), 0.0, abs(found.cruising))
        quick = phases(joint, sign * speed, joint.max_acceleration)
        alone = quick.lasts
    return _in_one(joint, whole, alone, quick)


def _arrives(joint: Joint, found: Phases, whole: float) -> bool:
    cruise = whole - found.lasts
    return cruise >= -TIME_TOLERANCE and abs(found.way + found.cruising * cruise - joint.way) <= SAME_WAY


# --- in two changes, with a cruise between them --------------------------------------------------------------------


def _in_two(joint: Joint, whole: float, fastest: float) -> Phases:
    """Return phases, with a velocity up to `fastest`, that cover (nearly) the right distance in a given time [s]."""
    way, _, _, _, a_max, _ = joint
    found = phases(joint, 0.0, a_max)
    sign = 1.0 if way > found.way else -1.0
    low, high, speed = 0.0, fastest, 0.0
    if found.lasts > whole:  # all other solutions last longer still
        return found
    for _ in range(NEWTON_STEPS):
        cruise = whole - found.lasts
        error = sign * (found.way + found.cruising * cruise - way)
        if abs(error) <= SAME_WAY:
            break
        if error < 0.0:
            low = speed
        else:
            high = speed
        slope = cruise + 0.5 * (found.fall + found.ramp)
        if slope <= 0.0:
            break
        better = speed - error / slope
        if better >= fastest > speed:
            better = fastest
        elif not low < better < high:
            better = 0.5 * (low + high)
        if better == speed:
            break
        speed = better
        found = phases(joint, sign * speed, a_max)
    return found


def _soonest_in_two(joint: Joint) -> tuple[float, Phases]:
    """Return the shortest time [s] in which a joint arrives with two changes, and the phases."""
    way, v, a, v_max, a_max, jerk = joint
    stop = phases(joint, 0.0, a_max)
    left = way - stop.way
    if abs(left) <= SAME_WAY:
        return stop.lasts, stop
    sign = 1.0 if left > 0.0 else -1.0
    top = phases(joint, sign * v_max, a_max)
    if sign * (way - top.way) >= 0.0:
        return top.lasts + (way - top.way) / top.cruising, top
    low, high, free = 0.0, v_max, sign * (v + 0.5 * a * abs(a) / jerk)
    if 0.0 < free < v_max:  # here the distance jumps: `free` is the velocity when the acceleration has become 0
        low, high = (free, high) if sign * _past(joint, sign * free) <= 0.0 else (low, free)
    found = phases(joint, sign * _root(lambda speed: sign * _past(joint, sign * speed), low, high), a_max)
    return found.lasts, found


def _root(f: Callable[[float], float], low: float, high: float) -> float:
    """Return the zero of f, which is at most 0 at `low` and at least 0 at `high` (regula falsi, Illinois variant)."""
    below, above, side = f(low), f(high), 0
    x = low
    for _ in range(SEARCH_STEPS):
        if above <= below or high == low:
            break
        x, before = high - above * (high - low) / (above - below), x
        y = f(x)
        if y > 0.0:
            high, above, below, side = x, y, 0.5 * below if side > 0 else below, 1
        elif y < 0.0:
            low, below, above, side = x, y, 0.5 * above if side < 0 else above, -1
        if y == 0.0 or abs(x - before) <= MIN_PIECE_S * abs(x):
            break
    return x


def _past(joint: Joint, v1: float) -> float:
    """Return the distance by which a joint passes its target if it changes to velocity v1 and then slows down without a
    cruise.
    """
    return phases(joint, v1, joint.max_acceleration).way - joint.way


# --- in one change, which brakes less than the joint could ----------------------------------------------------------


def _in_one(joint: Joint, whole: float, otherwise: float, quick: Phases) -> Phases | float:
    """Return the phases of a single change that lasts `whole` [s]; if that is impossible, the minimum time of such a
    change, or `otherwise`.

    `otherwise`: the time that the joint takes with the phases `quick` [s].
    """
    weak = _weakest(joint, otherwise, quick)
    if not weak:
        return otherwise
    quickest = phases(joint, 0.0, weak)
    if quickest.lasts >= whole:
        return quickest if quickest.lasts <= whole + TIME_TOLERANCE else quickest.lasts
    sign, strong = 1.0 if quick.cruising > 0.0 else -1.0, joint.max_acceleration
    for _ in range(SEARCH_STEPS):  # bisection: a joint that brakes harder at first arrives later
        level = 0.5 * (weak + strong)
        found = _change(joint, -sign * level)
        if abs(found.lasts - whole) <= MIN_PIECE_S:
            return found
        weak, strong = (level, strong) if found.lasts < whole else (weak, level)
    return otherwise


def _weakest(joint: Joint, otherwise: float, quick: Phases) -> float:
    """Return the deceleration with which the quickest stop ends on the target; 0 if this stop takes at least
    `otherwise` [s].
    """
    way, v, a, _, a_max, jerk = joint
    sign = 1.0 if quick.cruising > 0.0 else -1.0
    # the joint reaches the cruise velocity without braking
    if sign * (v + 0.5 * a * abs(a) / jerk) <= abs(quick.cruising):
        return 0.0
    weak = strong = a_max
    while sign * (phases(joint, 0.0, weak).way - way) < 0.0:
        weak, strong = 0.5 * weak, weak
        if weak < MIN_BRAKING * a_max or phases(joint, 0.0, strong).lasts >= otherwise:
            return 0.0
    weak = _root(lambda level: sign * (way - phases(joint, 0.0, level).way), weak, strong)
    return weak if phases(joint, 0.0, weak).lasts < otherwise else 0.0


def _change(joint: Joint, level: float) -> Phases:
    """Return the phases of a single change that holds the acceleration `level` and comes to rest on the target. Their
    duration is infinite if there is no such change.

    With w the velocity and D the distance that remain after the rise, W = w / level: hold = W - s, fall = 2 s, s^2 = 6
    D / level - 3 W^2.
    """
    way, v, a, _, _, jerk = joint
    rise = abs(level - a) / jerk
    after = -(v + 0.5 * (a + level) * rise) / level
    ahead = -(way - rise * (v + rise * (2.0 * a + level) / 6.0)) / level
    square = 6.0 * ahead - 3.0 * after * after
    half = sqrt(square) if square > 0.0 else 0.0
    lasts = rise + after + half if 0.0 < half < after else inf
    return Phases(rise, after - half, 2.0 * half, level, 0.0, 0.0, 0.0, lasts, way)


# --- joints beside each other --------------------------------------------------------------------------------------


def _at_pace(joint: Joint, pace: Phases, whole: float) -> Phases | None:
    """Return the phases of a joint that change at the same instants as the phases `pace` of another joint; None if they
    exceed the joint's limits.
    """
    way, v0, a0, v_max, a_max, jerk = joint
    rise, hold, fall, _, _, ramp, keep, lasts, _ = pace
    reach, held, slowing = 0.5 * rise + hold + 0.5 * fall, ramp + keep, 2.0 * ramp + keep
    if reach < MIN_PIECE_S or held < MIN_PIECE_S:
        return None
    later = hold + fall
    by_start = rise * (rise / 3.0 + 0.5 * later)
    by_level = rise * (rise / 6.0 + 0.5 * later) + hold * (0.5 * hold + fall) + fall * fall / 3.0
    carried, lag = v0 + 0.5 * rise * a0, by_level / reach
    ahead = way - v0 * (rise + later) - a0 * by_start + lag * carried
    v1 = ahead / (lag + max(whole - lasts, 0.0) + 0.5 * slowing)
    level, slow = (v1 - carried) / reach, v1 / held
    turned = v0 + 0.5 * a0 * a0 * rise / (a0 - level) if a0 * level < 0.0 else v0  # velocity at zero acceleration
    if (
        max(abs(v1), abs(turned)) > v_max
        or max(abs(level), abs(slow)) > a_max
        or abs(level - a0) > jerk * rise
        or abs(level) > jerk * fall
        or abs(slow) > jerk * ramp
    ):
        return None
    return _new(Phases, (rise, hold, fall, level, v1, ramp, keep, lasts, way))


def stretches(
    state: JointState, goal: Joints, limits: JointLimits, least: float = 0.0
) -> Iterator[tuple[float, Phase, Path]]:
    """Yield the stretches of a motion to rest at `goal`, which lasts at least `least` [s]. Raises NoTimes."""
    joints = [
        Joint(to - q, v, a, v_max, a_max, jerk)
        for q, v, a, to, v_max, a_max, jerk in zip(
            state.joints,
            state.velocity,
            state.present_acceleration,
            goal,
            limits.velocity,
            limits.acceleration,
            limits.jerk,
            strict=True,
        )
    ]
    whole, found = together(joints, least)
    cubics = [
        list(_rows(q, to, joint, one, whole))
        for q, to, joint, one in zip(state.joints, goal, joints, found, strict=True)
    ]
    for duration, phase, path in common_stretches(cubics, whole - max([2.0 * one.ramp + one.keep for one in found])):
        steady = phase is Phase.BLEND and not any(half or sixth for _, _, half, sixth in path.coefficients)
        yield duration, Phase.CRUISE if steady else phase, path


def _rows(q: float, goal: float, joint: Joint, found: Phases, whole: float) -> Iterator[Row]:
    """Yield the cubics of a joint; the second change ends exactly on the goal."""
    rise, hold, fall, level, v1, ramp, keep, _, _ = found
    _, v, a, _, _, _ = joint
    t = 0.0
    for duration, after in ((rise, level), (hold, level), (fall, 0.0)):
        if duration > MIN_PIECE_S:
            jerk = (after - a) / duration
            yield round(t * TICKS_PER_SECOND), t, q, v, 0.5 * a, jerk / 6.0
            q += duration * (v + duration * (0.5 * a + duration * jerk / 6.0))
            v += 0.5 * duration * (a + after)
            t += duration
        a = after
    if v1:
        slowing, level = 2.0 * ramp + keep, -v1 / (ramp + keep)
        begin = whole - slowing
        if begin > t:
            yield round(t * TICKS_PER_SECOND), t, q, v1, 0.0, 0.0
        t, q, v, sixth = begin, goal - 0.5 * v1 * slowing, v1, level / (6.0 * ramp)
        yield round(t * TICKS_PER_SECOND), t, q, v, 0.0, sixth
        t, q, v = t + ramp, q + ramp * (v + ramp * ramp * sixth), v + 0.5 * ramp * level
        if keep > MIN_PIECE_S:
            yield round(t * TICKS_PER_SECOND), t, q, v, 0.5 * level, 0.0
            t, q, v = t + keep, q + keep * (v + 0.5 * keep * level), v + keep * level
        yield round(t * TICKS_PER_SECOND), t, q, v, 0.5 * level, -sixth
    elif t < whole:
        yield round(t * TICKS_PER_SECOND), t, goal, 0.0, 0.0, 0.0
    yield round(whole * TICKS_PER_SECOND), whole, goal, 0.0, 0.0, 0.0
