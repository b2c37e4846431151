"""Joints at constant jerk, piece by piece: changes of velocity as polynomials, and stops."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from math import copysign, sqrt

from vrs_cli.kinematics.joints import LIMIT_TOLERANCE
from vrs_cli.kinematics.profile import Profile
from vrs_cli.trajectory.instant import TICK, TICKS_PER_SECOND
from vrs_cli.trajectory.laws import lspb_stops
from vrs_cli.trajectory.laws.law import Pieces, Row
from vrs_cli.trajectory.limits import JointLimits
from vrs_cli.trajectory.polynomial import turns
from vrs_cli.trajectory.segment import JointPath, Path, Phase, Segment, segments_of
from vrs_cli.trajectory.state import NEGLIGIBLE, JointState
from vrs_cli.values.motion import Motion

SHORTEST = 1e-10  # [s] of a piece: a shorter one changes nothing

# --- one joint alone ---


def stop(v: float, a: float, acceleration: float, jerk: float) -> Pieces:
    """The quickest way to velocity and acceleration zero: (duration, jerk) piece by piece."""
    left = v + 0.5 * a * abs(a) / jerk  # the velocity once the acceleration is gone
    if abs(left) <= NEGLIGIBLE:
        return ((abs(a) / jerk, copysign(jerk, -a)),) if a else ()
    sign = copysign(1.0, left)
    v, a = v * sign, a * sign
    level = min(sqrt(jerk * v + 0.5 * a * a), acceleration)
    rise, fall = (a + level) / jerk, level / jerk
    hold = (v + 0.5 * (a - level) * abs(rise)) / level - 0.5 * fall
    pieces = (abs(rise), copysign(jerk, -sign * rise)), (hold, 0.0), (fall, sign * jerk)
    return tuple([piece for piece in pieces if piece[0] > SHORTEST])


def turning_back(v: float, a: float, acceleration: float, jerk: float) -> Pieces:
    """The pieces that bring the velocity to zero soonest, whatever the acceleration is then: nothing goes less far."""
    sign = copysign(1.0, v)
    v, a = v * sign, a * sign
    ramp = max((a + acceleration) / jerk, 0.0)
    if v + a * ramp - 0.5 * jerk * ramp * ramp < 0.0:  # at rest before full acceleration is reached
        return (((a + sqrt(a * a + 2.0 * jerk * v)) / jerk, -sign * jerk),)
    v += a * ramp - 0.5 * jerk * ramp * ramp
    pieces = (ramp, -sign * jerk), (v / acceleration, 0.0)
    return tuple([piece for piece in pieces if piece[0] > SHORTEST])


def farthest(q: float, v: float, a: float, pieces: Pieces) -> tuple[float, float]:
    """The least and the greatest position on a way of pieces of constant jerk."""
    places = [q]
    for duration, jerk in pieces:
        places += [q + s * (v + s * (0.5 * a + s * jerk / 6.0)) for s in turns(v, a, jerk) if 0.0 < s < duration]
        q, v, a = state_after(q, v, a, duration, jerk)
        places.append(q)
    return min(places), max(places)


def state_after(q: float, v: float, a: float, s: float, jerk: float) -> tuple[float, float, float]:
    """The state s seconds later."""
    return q + s * (v + s * (0.5 * a + s * jerk / 6.0)), v + s * (a + 0.5 * s * jerk), a + s * jerk


# --- all joints ---


def joint_stops(state: JointState, limits: JointLimits, start: float, motion: Motion) -> Iterator[tuple[Segment, ...]]:
    """The ways to rest: at limited jerk; at constant acceleration, which needs less room, where it jumps anyway."""
    yield joint_stop(state, limits, start, motion)
    if not state.acceleration:
        yield from lspb_stops.joint_stops(state, limits, start, motion._replace(profile=Profile.LSPB))


def joint_stop(state: JointState, limits: JointLimits, start: float, motion: Motion) -> tuple[Segment, ...]:
    """Every joint to rest as fast as it can, each in its own time.

    One that would leave its range so is turned back: the motion that is interrupted would have done so too, or it would
    not have been planned.
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
    """Joints that each go through pieces of their own to rest, as `common_stretches`."""
    rows = zip(state.joints, state.velocity, state.present_acceleration, pieces, strict=True)
    return common_stretches([list(rows_through(*row)) for row in rows], slows)


def rows_through(q: float, v: float, a: float, pieces: Pieces) -> Iterator[Row]:
    """The cubics of a joint that goes through pieces to rest."""
    t = 0.0
    for duration, jerk in pieces:
        yield round(t * TICKS_PER_SECOND), t, q, v, 0.5 * a, jerk / 6.0
        q, v, a = state_after(q, v, a, duration, jerk)
        t += duration
    yield round(t * TICKS_PER_SECOND), t, q, 0.0, 0.0, 0.0  # at rest, whatever rounding has left


def common_stretches(ways: Sequence[Sequence[Row]], slows: float) -> Iterator[tuple[float, Phase, JointPath]]:
    """Joints that each have rows of their own: a stretch from each of their instants to the next. What begins before
    `slows` [s] is no slowing down yet.
    """
    instants = sorted({row[0] for way in ways for row in way})
    paths, slowing = zip(*[_column(way, instants) for way in ways], strict=True), round(slows * TICKS_PER_SECOND)
    for (begin, end), path in zip(pairwise(instants), paths, strict=True):
        yield (end - begin) * TICK, Phase.BLEND if begin < slowing else Phase.DECELERATE, JointPath(path)


def _column(way: Sequence[Row], instants: Sequence[int]) -> list[tuple[float, float, float, float]]:
    """The cubics of one joint from each instant to the next."""
    column, rest = [], iter(way)
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
