"""Jerk-limited motion in which each part has times of its own, and all end together.

A part changes its velocity to v1, cruises, and slows down to rest, both as fast as it can. The greater v1, the farther
it goes in a given whole time, so the v1 with the right way is found by halving. That is the quickest but where a part
need not lose its acceleration in between. (All cases, in closed form: Berscheid and Kroeger, Jerk-limited Real-time
Trajectory Generation with Arbitrary Target States, 2021.)
"""

from __future__ import annotations

from collections.abc import Sequence
from math import sqrt
from typing import NamedTuple

from vrs_cli.trajectory.instant import up_to_grid
from vrs_cli.trajectory.laws.law import Pieces
from vrs_cli.trajectory.laws.lspb_times import ROOM
from vrs_cli.trajectory.laws.scurve_times import CAREFUL, MOMENT, NONE, Change, Course, Part
from vrs_cli.trajectory.state import NEGLIGIBLE

HALVINGS = 26
LATER = 1.03  # a whole time in which a part cannot arrive is made so much longer
CLOSE = 2e-3  # a cruise that is so short a part of the rest is nearly none
SHORTEST = 1e-2  # [s] a ramp of next to no change
SPARE = 1e-6  # [s] of the whole time, for rounding


class Fastest(NamedTuple):
    """How a part alone arrives soonest: its change to a velocity, 0 where it only stops, and how long all takes [s]."""

    change: Change
    velocity: float
    lasting: float


def fastest(part: Part) -> Fastest:
    change, _ = _changes_through(part, 0.0)
    ahead = part.displacement - _way_of_change(part.velocity, part.acceleration, 0.0, change)
    if abs(ahead) <= NEGLIGIBLE:
        return Fastest(change, 0.0, change.lasts)
    slow, fast = 0.0, part.max_velocity if ahead > 0.0 else -part.max_velocity
    v1 = fast
    for _ in range(HALVINGS):
        change, slowing = _changes_through(part, v1)
        cruise = (part.displacement - _way(part, change, v1, slowing)) / v1
        if cruise >= 0.0:
            if v1 == fast or cruise < CLOSE * change.lasts:
                break
            slow = v1
        else:
            fast = v1
        v1 = 0.5 * (slow + fast)
    return Fastest(change, v1, change.lasts + max(cruise, 0.0) + slowing.lasts)


def together(parts: Sequence[Part], least: float) -> list[Course]:
    """The times of each part, so that all arrive at once, `least` [s] from now or as soon after that as they can."""
    alone = [fastest(part) for part in parts]
    whole = up_to_grid(max(least, *(one.lasting for one in alone)) + SPARE)
    while True:
        courses = [_course_of_time(part, one.velocity, whole) for part, one in zip(parts, alone, strict=True)]
        if None not in courses:
            return [course for course in courses if course is not None]
        whole = up_to_grid(LATER * whole)


def _course_of_time(part: Part, fast: float, whole: float) -> Course | None:
    """The times of a part that arrives at that time; None where it would have to come to rest earlier."""
    if not fast:
        return Course(_changes_through(part, 0.0)[0], 0.0, NONE)
    slow = 0.0
    for _ in range(HALVINGS):
        v1 = 0.5 * (slow + fast)
        change, slowing = _changes_through(part, v1)
        cruise = whole - change.lasts - slowing.lasts
        if (part.displacement - _way(part, change, v1, slowing) - v1 * cruise) * fast > 0.0:
            slow = v1
        else:
            fast = v1
    return Course(change, cruise, slowing) if cruise >= 0.0 else None


def course_pieces(part: Part, course: Course) -> Pieces:
    """The way of a part at the times of its course; it ends where the part ends, whatever rounding has cost."""
    v, a, change = part.velocity, part.acceleration, course.change
    if course.stops_at_once:
        return change.pieces(v, a, 0.0) if change.lasts else ()
    k0, _ = change.ways
    lag = change.lag if change.lasts else 0.0
    v1 = (part.displacement - v * change.lasts - a * k0 + lag * (v + 0.5 * change.rise * a)) / course.reach
    begin = change.pieces(v, a, v1) if change.lasts else ()
    end = course.slow.pieces(v1, 0.0, 0.0) if course.slow.lasts else ()
    return (*begin, *(((course.cruise, 0.0),) if course.cruise else ()), *end)


def _changes_through(part: Part, v1: float) -> tuple[Change, Change]:
    """The quickest changes to velocity v1, and from there to rest."""
    acceleration, jerk = part.max_acceleration, part.max_jerk
    change = _change_to_rest(part.velocity - v1, part.acceleration, acceleration, jerk)
    return change, _change_to_rest(v1, 0.0, acceleration, jerk) if abs(v1) > NEGLIGIBLE else NONE


def _way(part: Part, change: Change, v1: float, slow: Change) -> float:
    """How far the part goes in both changes."""
    return _way_of_change(part.velocity, part.acceleration, v1, change) + _way_of_change(v1, 0.0, 0.0, slow)


def _way_of_change(v0: float, a0: float, v1: float, change: Change) -> float:
    if not change.lasts:
        return 0.0
    k0, k1 = change.ways
    return v0 * change.lasts + a0 * k0 + change.level(v0, a0, v1) * k1


def _change_to_rest(v: float, a: float, acceleration: float, jerk: float) -> Change:
    """The times of the quickest change to velocity and acceleration zero."""
    acceleration, jerk = acceleration / CAREFUL, jerk / CAREFUL
    left = v + 0.5 * a * abs(a) / jerk  # the velocity once the acceleration is gone
    if abs(left) <= NEGLIGIBLE:
        return Change(0.0, 0.0, up_to_grid(abs(a) / jerk))
    if left < 0.0:
        v, a = -v, -a
    level = min(sqrt(jerk * v + 0.5 * a * a), acceleration)
    fall, least = level / jerk, MOMENT
    if fall < 2.0 * MOMENT:  # so little to do that the time grid would show in the jerk
        fall = least = SHORTEST
        level = 0.5 * jerk * (sqrt(fall * fall + (8.0 * v + 4.0 * a * a / jerk) / jerk) - fall)
    rise = max(abs(a + level) / jerk, least)  # down to the level where ACCEL is lower now
    hold = (v + 0.5 * (a - level) * rise) / level - 0.5 * fall
    if hold < 0.0 and least == MOMENT:  # the level is nearly that which there is: the rise does a part of the fall
        fall = 0.5 * (sqrt(rise * rise + 4.0 * (2.0 * v + a * rise) / jerk) - rise)
    return Change(up_to_grid(rise) + ROOM, up_to_grid(max(hold, 0.0)), up_to_grid(fall) + ROOM)
