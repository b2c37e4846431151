"""Joints at constant jerk, piece by piece: changes of velocity as polynomials, and stops."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import accumulate, pairwise
from math import sqrt

from vrs_cli.kinematics.joints import LIMIT_TOLERANCE
from vrs_cli.kinematics.profile import Profile
from vrs_cli.trajectory.instant import up_to_grid
from vrs_cli.trajectory.laws import lspb_stops
from vrs_cli.trajectory.laws.law import Pieces
from vrs_cli.trajectory.laws.lspb_times import ROOM
from vrs_cli.trajectory.laws.scurve_times import CAREFUL, MOMENT, Change
from vrs_cli.trajectory.limits import JointLimits
from vrs_cli.trajectory.polynomial import turns
from vrs_cli.trajectory.segment import JointPath, Path, Phase, Segment, segments_of
from vrs_cli.trajectory.state import NEGLIGIBLE, JointState
from vrs_cli.values.motion import Motion

# --- one joint alone ---


def stop(v: float, a: float, acceleration: float, jerk: float) -> Pieces:
    """The quickest way to velocity and acceleration zero: (duration, jerk) piece by piece."""
    acceleration, jerk = acceleration / CAREFUL, jerk / CAREFUL
    left = v + 0.5 * a * abs(a) / jerk  # the velocity once the acceleration is gone
    if abs(left) <= NEGLIGIBLE:
        duration = up_to_grid(abs(a) / jerk)
        return ((duration, -a / duration),) if duration else ()
    sign = 1.0 if left > 0.0 else -1.0
    v, a = v * sign, a * sign
    level = min(sqrt(jerk * v + 0.5 * a * a), acceleration)
    rise, fall = (a + level) / jerk, level / jerk
    if fall < MOMENT:  # so little to do that the time grid would show in the jerk
        rise, fall = max(rise, 10.0 * MOMENT), 10.0 * MOMENT
    elif rise < MOMENT:  # the level is that which there is
        return tuple((duration, -sign * rate) for duration, rate in _pieces_at_level(v, a, jerk))
    hold = (v + 0.5 * (a - level) * rise) / level - 0.5 * fall
    change = Change(up_to_grid(rise) + ROOM, up_to_grid(max(hold, 0.0)), up_to_grid(fall) + ROOM)
    return tuple((duration, sign * rate) for duration, rate in change.pieces(v, a, 0.0))


def _pieces_at_level(v: float, a: float, jerk: float) -> Iterator[tuple[float, float]]:
    """The deceleration a < 0 is kept, and then goes; the sign of the jerk is turned round."""
    fall = up_to_grid(-a / jerk)
    hold = up_to_grid(max(-v / a - 0.5 * fall, 0.0))
    fall = up_to_grid(2.0 * (-v / a - hold))
    if hold:
        yield hold, 0.0
    yield fall, a / fall


def turning_back(v: float, a: float, acceleration: float, jerk: float) -> Pieces:
    """The pieces that bring the velocity to zero soonest, whatever the acceleration is then: nothing goes less far."""
    acceleration, jerk = acceleration / CAREFUL, jerk / CAREFUL
    sign = 1.0 if v > 0.0 else -1.0
    v, a = v * sign, a * sign
    ramp = max((a + acceleration) / jerk, 0.0)
    if v + a * ramp - 0.5 * jerk * ramp * ramp < 0.0:  # at rest before full acceleration is reached
        ramp = (a + sqrt(a * a + 2.0 * jerk * v)) / jerk
        return ((up_to_grid(ramp), -sign * jerk),)
    v += a * ramp - 0.5 * jerk * ramp * ramp
    pieces = ((up_to_grid(ramp), -sign * jerk), (up_to_grid(v / acceleration), 0.0))
    return tuple(piece for piece in pieces if piece[0])


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
    """Joints that each go through pieces of their own to rest, as common stretches: one from each instant to the next.

    What begins before `slows` [s] is no slowing down yet.
    """
    begins = [list(accumulate((duration for duration, _ in row), initial=0.0)) for row in pieces]
    instants = sorted({instant for row in begins for instant in row})
    states = list(zip(state.joints, state.velocity, state.present_acceleration, strict=True))
    for begin, end in pairwise(instants):
        path, after = [], []
        for (q, v, a), row, times in zip(states, pieces, begins, strict=True):
            at = sum(1 for time in times[1:] if time <= begin)
            jerk = row[at][1] if at < len(row) else 0.0
            path.append((q, v, 0.5 * a, jerk / 6.0))
            there = state_after(q, v, a, end - begin, jerk)
            after.append((there[0], 0.0, 0.0) if end >= times[-1] else there)  # at rest, whatever rounding has left
        states = after
        yield end - begin, Phase.BLEND if begin < slows else Phase.DECELERATE, JointPath(tuple(path))
