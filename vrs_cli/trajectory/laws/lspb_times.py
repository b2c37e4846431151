"""Linear with parabolic blends: how long to change velocity, to cruise and to slow down.

One motion of several components (joints; or the tool tip's position and rotation), all together: blend from the
present velocity v0 to the cruise velocity v1 in `blend` seconds, cruise, then slow down to rest in `slow` seconds, all
at constant acceleration. With D the displacement still to go,

    D = blend (v0 + v1) / 2 + v1 cruise + v1 slow / 2,   v1 = (D - v0 blend / 2) / S,   S = blend/2 + cruise + slow/2.

The time is minimal over u = 1/S for a given blend time; the blend time is searched. (Craig, Introduction to
Robotics, 7.3 "Linear function with parabolic blends", extended to a moving start.)
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import inf, sqrt
from typing import NamedTuple

from vrs_cli.kinematics.transform import Vector
from vrs_cli.trajectory.instant import TICK, up_to_grid
from vrs_cli.trajectory.laws.course import Blend, Course
from vrs_cli.trajectory.state import NEGLIGIBLE, ToolLimits

MARGIN = 1.0 + 1e-7  # keeps limits true after times are rounded to the grid
ROOM = 8 * TICK  # [s] by which a blend is longer than it must be: rounding the other times moves the limits a little
SLIVER = 1e-6  # [s] a cruise that is none
SAME = 1e-9  # two quotients that are one
LONGER = 1.2
FIRST_STEPS = 2
LONGEST_BLEND = 1e6  # [s]


def _course(blend: float, cruise: float, slow: float) -> Course:
    return Course(Blend(blend), cruise, Blend(slow))


class Component(NamedTuple):
    """A scalar part of a motion: displacement to go, velocity now, the limits of velocity, acceleration and jerk."""

    displacement: float
    velocity: float
    max_velocity: float
    max_acceleration: float
    max_jerk: float = inf


class Demand(NamedTuple):
    """The bounds of a blend time: u lies in [low, high]; `slowing` is max |v1| / (u a), so that slow = slowing u."""

    low: float
    high: float
    slowing: float


Demands = Callable[[float], Demand]


def from_rest(components: Sequence[Component], least: float = 0.0) -> Course:
    """Return the times of a motion from rest; `least`: the least total time [s]."""
    by_velocity = by_acceleration = 0.0
    for part in components:
        distance = abs(part.displacement)
        by_velocity = max(by_velocity, distance / part.max_velocity)
        by_acceleration = max(by_acceleration, distance / part.max_acceleration)
    if by_velocity <= NEGLIGIBLE:
        return _course(0.0, 0.0, 0.0)
    square = least * least - 4.0 * by_acceleration  # the whole time is S + by_acceleration / S
    by_time = 0.5 * (least + sqrt(square)) if square > 0.0 else 0.0
    reach = MARGIN * max(by_velocity, sqrt(by_acceleration), by_time)
    blend = up_to_grid(by_acceleration / reach)  # as long as slowing down
    return _without_sliver(blend, up_to_grid(max(reach - blend, 0.0)), blend)


def _without_sliver(blend: float, cruise: float, slow: float) -> Course:
    """Leave out a cruise of next to no time: slowing down takes twice that time longer, S stays the same."""
    return _course(blend, cruise, slow) if cruise > SLIVER else _course(blend, 0.0, slow + 2.0 * cruise)


def from_motion(components: Sequence[Component], least: float = 0.0) -> Course:
    """Return the times of a motion of scalar components that starts at their velocities."""
    shortest = max(max(abs(part.velocity) - part.max_velocity, 0.0) / part.max_acceleration for part in components)
    guess = max(abs(part.velocity) / part.max_acceleration for part in components)
    return search(scalar_demands(components), shortest, guess, least)


def scalar_demands(components: Sequence[Component]) -> Demands:
    """Return a function from the blend time to the bounds on u of components that each have their own limits."""
    parts = tuple((c.displacement, 0.5 * c.velocity, c.max_velocity, c.max_acceleration) for c in components)

    def demands(blend: float) -> Demand:
        low, high, slowing = 0.0, inf, 0.0
        for displacement, half, fastest, acceleration in parts:
            ahead = displacement - half * blend
            change = acceleration * blend
            if ahead < 0.0:
                ahead = -ahead
                along = -2.0 * half
            else:
                along = 2.0 * half
            if ahead <= NEGLIGIBLE:
                if abs(along) > change:
                    return Demand(1.0, 0.0, 0.0)
                continue
            bound = (along + change if along + change < fastest else fastest) / ahead
            if bound < high:
                high = bound
            bound = (along - change) / ahead
            if bound > low:
                low = bound
            bound = ahead / acceleration
            if bound > slowing:
                slowing = bound
        return Demand(low, high, slowing)

    return demands


def vector_demands(displacement: Vector, velocity: Vector, limits: ToolLimits, blend: float) -> Demand:
    """The bounds on u so that |c u| <= v_max and |c u - v0| <= a_blend blend, with c = D - v0 blend / 2: of the tip."""
    vx, vy, vz = velocity
    half = 0.5 * blend
    cx, cy, cz = (d - half * v for d, v in zip(displacement, velocity, strict=True))
    ahead = sqrt(cx * cx + cy * cy + cz * cz)
    change = limits.blend_acceleration * blend
    speed = sqrt(vx * vx + vy * vy + vz * vz)
    if ahead <= NEGLIGIBLE:
        return Demand(0.0, inf, 0.0) if speed <= change else Demand(1.0, 0.0, 0.0)
    along = (cx * vx + cy * vy + cz * vz) / ahead
    across = speed * speed - along * along
    room = change * change - max(across, 0.0)
    if room < 0.0:
        return Demand(1.0, 0.0, 0.0)
    root = sqrt(room)
    return Demand(
        max((along - root) / ahead, 0.0),
        min(limits.speed / ahead, (along + root) / ahead),
        ahead / limits.acceleration,
    )


def search(
    demands: Demands, shortest: float, guess: float, least: float = 0.0, first_steps: int = FIRST_STEPS
) -> Course:
    """The times of the shortest motion that the demands allow, by search over the blend time.

    `shortest`: a blend time [s] below which none is possible; `guess`: about how long it may be; `least`: the least
    total time; `first_steps`: how closely the shortest possible blend is looked for. Raises ValueError when there is
    none.
    """

    def tried(blend: float) -> Try:
        demand = demands(blend)
        u = _most(demand, blend)
        room = u - demand.low
        if room < 0.0 or u <= 0.0:
            return Try(blend, inf, min(room, -NEGLIGIBLE))
        return Try(blend, 1.0 / u + 0.5 * (blend + demand.slowing * u) if u < inf else blend, room)

    low, best = Try(shortest, inf, -inf), tried(max(shortest, guess, 1e-6))
    while best.total == inf:
        if best.blend > LONGEST_BLEND:
            raise ValueError("no blend time brings the motion to its target within the limits")
        low, best = best, tried(2.0 * best.blend)
    return _times_on_grid(demands, _shortest(tried, low, best, first_steps), least)


class Try(NamedTuple):
    """A blend time [s], the total time with it (inf: impossible), and by how much the bounds on u leave room."""

    blend: float
    total: float
    room: float


def _shortest(tried: Callable[[float], Try], low: Try, best: Try, first_steps: int) -> float:
    """A blend time of (nearly) the least total time: the first possible one, then downhill from there."""
    for _ in range(first_steps):  # where the room would begin if it grew evenly; the middle where that cannot be told
        known = -inf < low.room < 0.0 and best.room < inf
        part = min(max(low.room / (low.room - best.room), 0.1), 0.9) if known else 0.5
        middle = tried(low.blend + part * (best.blend - low.blend))
        if middle.total < best.total:
            best = middle
        else:
            low = middle
    step = max(best.blend, 1e-3) * 0.25
    while step > 0.1 * best.blend:
        ahead = tried(best.blend + step)
        if ahead.total < best.total:
            best, step = ahead, 1.6 * step
        else:
            step *= 0.25
    return best.blend


def _most(demand: Demand, blend: float) -> float:
    """The largest u within the demand that leaves a cruise of no negative length; inf where nothing is left to go."""
    _, high, slowing = demand
    if slowing <= 0.0:
        return high
    # cruise >= 0:  1/u - blend/2 - slowing u / 2 >= 0
    return min(high, (sqrt(blend * blend + 8.0 * slowing) - blend) / (2.0 * slowing))


def _times_on_grid(demands: Demands, blend: float, least: float) -> Course:
    """The times on the grid for the chosen blend time; slower when the motion is to last at least `least`."""
    blend = up_to_grid(blend * MARGIN) + ROOM
    while True:
        times = _on_grid(demands(blend), blend, least)
        if times is None:
            blend = up_to_grid(blend * 1.001) + ROOM  # rounding has cost the last bit of room
        elif times.total < least - SLIVER:
            blend = up_to_grid(blend * LONGER)  # so fast that it cannot take its time without turning back
        else:
            return times


def _on_grid(demand: Demand, blend: float, least: float) -> Course | None:
    """The times for a blend time; None where none on the grid is inside the demand. Times are rounded up, so u down."""
    u = _most(demand, blend)
    if u < demand.low or u <= 0.0:
        return None
    if u == inf:  # the blend itself ends at rest on the target
        return _course(blend, 0.0, 0.0)
    u = max(u / MARGIN, 0.5 * (demand.low + u))  # where rounding finds room on both sides
    rest = least - 0.5 * blend
    square = rest * rest - 2.0 * demand.slowing
    # with this u, or any, the whole, 1/u + (blend + slowing u) / 2, takes at least so long
    slow_enough = 2.0 / (rest + sqrt(square)) if rest > 0.0 and square > 0.0 else inf
    u = max(min(u, slow_enough), min(u, demand.low * (1.0 + ROOM * u)))
    slow = up_to_grid(demand.slowing * u)
    times = _without_sliver(blend, up_to_grid(max(1.0 / u - 0.5 * (blend + slow), 0.0)), slow)
    return times if demand.low * times.reach <= 1.0 + SAME else None
