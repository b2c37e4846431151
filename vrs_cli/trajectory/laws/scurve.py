"""SCURVE: jerk-limited motions. Position, velocity and acceleration are continuous from the start of a motion to its
end at rest. A motion of several components, which share all times, has up to seven stretches of constant jerk. A
*change* takes the velocity from v0 to v1 in three of them: the acceleration goes from a0 to a level A in `rise`
seconds, stays there for `hold`, and goes to zero in `fall`. So a motion may begin in the middle of an acceleration.
With

    R = rise/2 + hold + fall/2          v1 = v0 + a0 rise/2 + A R
    distance of the change = v0 b + a0 K0 + A K1,   b = rise + hold + fall

everything is linear in v1 for given times, and the remaining displacement D requires

    v1 = E u,   E = D - v0 b - a0 K0 + lag (v0 + a0 rise/2),   1/u = lag + cruise + slow/2,   lag = K1 / R.

Slowing down is a change to zero with equal ramps. For given times of the change, the greatest u within all limits gives
the shortest motion; the times of the change are searched. (Biagiotti and Melchiorri, Trajectory Planning for Automatic
Machines and Robots, 3.4 "Double S trajectory", extended to several components that share their times and to any start
state.)
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import islice
from math import cbrt, inf, sqrt
from typing import NamedTuple

from msgspec import structs

from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.transform import (
    Transform,
    Vector,
    dot,
    length,
    rotated_back,
    scaled_vector,
    vector_difference,
    vector_sum,
)
from vrs_cli.trajectory.instant import up_to_grid
from vrs_cli.trajectory.laws.law import NONE, SLIVER, Change, Course, Law, NoTimes, ToolMotion, joint_stretches, ramps
from vrs_cli.trajectory.laws.lspb import BLEND_ROOM, MARGIN, SAME_QUOTIENT, Component
from vrs_cli.trajectory.laws.scurve_joints import stretches
from vrs_cli.trajectory.laws.scurve_steering import joint_stops, replay_steering, steer, steering_of
from vrs_cli.trajectory.segment import STILL, Phase, Segment, ToolStretch, segments_of
from vrs_cli.trajectory.state import NEGLIGIBLE, STEADY, JointLimits, JointState, ToolLimits, ToolState
from vrs_cli.values.commands import Motion

FIRST_STEP = 0.25
LAST_STEP = 0.05  # finest step of the search, as a fraction of the time of a change
MAX_TRIES = 240
MAX_CHANGE_S = 1e4  # maximum duration of a change [s]
DOUBLINGS = 40
HALVINGS = 50


class Bounds(NamedTuple):
    """The bounds on u (in v1 = E u) for given times of a change: u lies in [low, high]. `by_acceleration` and `by_jerk`
    are the maxima of |v1| / (u a) and |v1| / (u j), from which the time of slowing down follows.
    """

    low: float
    high: float
    by_acceleration: float
    by_jerk: float
    lag: float = 0.0  # lag of the change [s]


Demands = Callable[[Change], Bounds]

IMPOSSIBLE = Bounds(1.0, 0.0, 0.0, 0.0)


# --- from rest -------------------------------------------------------------------------------------------------


def from_rest(parts: Sequence[Component], least: float = 0.0) -> Course:
    """Return the times of a motion from rest; `least`: the least total time [s]."""
    by_velocity = by_acceleration = by_jerk = 0.0
    for part in parts:
        way = abs(part.displacement)
        by_velocity = max(by_velocity, way / part.max_velocity)
        by_acceleration = max(by_acceleration, way / part.max_acceleration)
        by_jerk = max(by_jerk, way / part.max_jerk)
    if by_velocity <= NEGLIGIBLE:
        return Course(NONE, 0.0, NONE)
    bounds = Bounds(0.0, 1.0 / by_velocity, by_acceleration, by_jerk)
    u = _most_that_cruises(bounds, None)
    if least > 0.0 and _rest_total(bounds, u) < least:
        u = _slower(lambda slow_u: _rest_total(bounds, slow_u), 0.0, u, least)
    reach = MARGIN / u
    change = ramps(by_acceleration / reach, by_jerk / reach)
    return _without_sliver(change, up_to_grid(max(reach - change.lasts, 0.0)), change)


def _rest_total(bounds: Bounds, u: float) -> float:
    return 1.0 / u + _slow_time(bounds, u)


def _slow_time(bounds: Bounds, u: float) -> float:
    """Return the least time [s] of a change by the velocities E u at constant jerks, with acceleration zero at both
    ends.
    """
    if bounds.by_jerk <= 0.0:
        return 0.0
    s = max(bounds.by_acceleration * u, sqrt(bounds.by_jerk * u))
    return s + bounds.by_jerk * u / s


def _without_sliver(change: Change, cruise: float, slow: Change) -> Course:
    """Return a course. A very short cruise is left out: each ramp of slowing down becomes longer by its duration
    instead.
    """
    if cruise > SLIVER:
        return Course(change, cruise, slow)
    return Course(change, 0.0, Change(slow.rise + cruise, slow.hold, slow.fall + cruise) if slow.lasts else slow)


def _most_that_cruises(bounds: Bounds, lag: float | None) -> float:
    """Return the maximum u up to `high` whose cruise time is not negative.

    `lag`: the lag of the change [s]; None if the change starts from rest, and so takes as long as slowing down.
    """
    fixed, halves = (0.0, 1.0) if lag is None else (lag, 0.5)
    high, m, n = bounds.high, bounds.by_acceleration, bounds.by_jerk
    if n <= 0.0:
        return min(high, 1.0 / fixed) if fixed else high
    # cruise = 1/u - fixed - halves (s + n u / s), s = max(m u, sqrt(n u))
    about = fixed + halves * n / m
    u = (sqrt(about * about + 4.0 * halves * m) - about) / (2.0 * halves * m)
    if m * m * u < n:  # full acceleration is not reached: 1 - fixed x^2 - 2 halves sqrt(n) x^3 = 0, x^2 = u
        u = _root(fixed, 2.0 * halves * sqrt(n)) ** 2
    return min(high, u)


def _root(c2: float, c3: float) -> float:
    """Return the x > 0 with 1 = c2 x^2 + c3 x^3, by Newton's method. The search starts at the largest x for which
    neither term is more than 1.
    """
    x = min(1.0 / cbrt(c3), 1.0 / sqrt(c2)) if c2 else 1.0 / cbrt(c3)
    for _ in range(8):
        excess = (c2 + c3 * x) * x * x - 1.0
        if excess <= 1e-12:
            break
        x -= excess / ((2.0 * c2 + 3.0 * c3 * x) * x)
    return x


def _slower(total: Callable[[float], float], low: float, high: float, least: float) -> float:
    """Return a u in (low, high] for which the total time is (just) at least `least` [s]; if there is no such u, the
    smallest u searched.
    """
    slow, quick = max(low, high * 1e-9), high
    for _ in range(HALVINGS):
        middle = sqrt(slow * quick)
        if total(middle) < least:
            quick = middle
        else:
            slow = middle
    return slow


# --- from motion -----------------------------------------------------------------------------------------------


def vector_bounds(
    displacement: Vector, velocity: Vector, acceleration: Vector, limits: ToolLimits, change: Change
) -> Bounds:
    """Return the bounds on u (in v1 = E u) that the motion of the tip sets, so that |E u| <= v_max, the level A keeps
    its limits, and |A - a0| <= jerk rise. The change keeps the limits of blending; slowing down keeps the ordinary
    limits.
    """
    reach = change.reach
    k0, k1 = change.ways
    carried = vector_sum(velocity, scaled_vector(acceleration, 0.5 * change.rise))
    way = vector_difference(displacement, scaled_vector(velocity, change.lasts))
    ahead = vector_sum(vector_difference(way, scaled_vector(acceleration, k0)), scaled_vector(carried, k1 / reach))
    level = min(limits.blend_acceleration, limits.blend_jerk * change.fall)
    spheres = (
        (carried, reach * level),
        (vector_sum(carried, scaled_vector(acceleration, reach)), reach * limits.blend_jerk * change.rise),
        ((0.0, 0.0, 0.0), limits.speed),
    )
    low, high = 0.0, inf
    for centre, radius in spheres:
        least, most = _inside(ahead, centre, radius)
        low, high = max(low, least), min(high, most)
    size = length(ahead)
    if size <= NEGLIGIBLE:
        return Bounds(low, high, 0.0, 0.0, k1 / reach)
    return Bounds(low, high, size / limits.acceleration, size / limits.jerk, k1 / reach)


def keeps(change: Change, velocity: Vector, at: Vector, acceleration: float, jerk: float) -> bool:
    """Return whether a change to rest keeps the limits; it begins with a velocity and with the acceleration `at`."""
    level = scaled_vector(vector_sum(velocity, scaled_vector(at, 0.5 * change.rise)), -1.0 / change.reach)
    most = min(acceleration, jerk * change.fall)
    return length(level) <= most and length(vector_difference(level, at)) <= jerk * change.rise


def _inside(ray: Vector, centre: Vector, radius: float) -> tuple[float, float]:
    """Return the interval of u in which u times `ray` is inside a sphere; an empty interval if there is no such u."""
    size = length(ray)
    if size <= NEGLIGIBLE:
        return (0.0, inf) if length(centre) <= radius else (1.0, 0.0)
    along = dot(ray, centre) / size
    room = radius * radius - max(dot(centre, centre) - along * along, 0.0)
    if room < 0.0:
        return 1.0, 0.0
    return (along - sqrt(room)) / size, (along + sqrt(room)) / size


def turn_bounds(angle: float, change: Change, spin: Vector, spin_rate: Vector, limits: ToolLimits) -> Bounds:
    """Return the bounds on u (in v1 = E u) that the rotation of the tool sets.

    The tool turns by `angle` [rad], and at the same time loses its present angular velocity `spin`, whose derivative is
    `spin_rate`. Both rotations together keep the limits.
    """
    blend_jerk = limits.blend_spin_jerk
    level = scaled_vector(vector_sum(spin, scaled_vector(spin_rate, 0.5 * change.rise)), -1.0 / change.reach)
    room = min(
        limits.blend_spin_acceleration - length(level),
        blend_jerk * change.fall - length(level),
        blend_jerk * change.rise - length(vector_difference(level, spin_rate)),
    )
    if room < 0.0:
        return IMPOSSIBLE
    if angle <= NEGLIGIBLE:
        return Bounds(0.0, inf, 0.0, 0.0)
    high = min(limits.spin, room * change.reach) / angle
    return Bounds(0.0, high, angle / limits.spin_acceleration, angle / limits.spin_jerk)


def both(a: Bounds, b: Bounds) -> Bounds:
    """Return the bounds that satisfy two parts of a motion, such as position and rotation."""
    return Bounds(
        max(a.low, b.low),
        min(a.high, b.high),
        max(a.by_acceleration, b.by_acceleration),
        max(a.by_jerk, b.by_jerk),
        a.lag or b.lag,
    )


# --- the search ------------------------------------------------------------------------------------------------


def search(demands: Demands, guess: Change, shortest: float, least: float = 0.0) -> Course:
    """Return the times of (nearly) the shortest motion that the demands allow. Raises NoTimes.

    `guess`: an estimate of the change; `shortest`: the least time of its rise [s]; `least`: the least total time [s].
    """

    def total(change: Change) -> float:
        bounds = demands(change)
        u = _quickest(bounds)
        return inf if u is None else _total(bounds, change, u)

    return _times_on_grid(demands, _downhill(total, _possible(total, guess, shortest), shortest), least)


def _total(bounds: Bounds, change: Change, u: float) -> float:
    if u == 0.0:
        return change.lasts
    return change.lasts + 1.0 / u - bounds.lag + 0.5 * _slow_time(bounds, u)


def _quickest(bounds: Bounds) -> float | None:
    """Return the maximum u whose cruise time is not negative; 0 if the change itself ends at rest on the target; None
    if no u is possible."""
    if bounds.low > bounds.high:
        return None
    if bounds.by_jerk <= 0.0:
        return 0.0
    u = _most_that_cruises(bounds, bounds.lag)
    return u if u > 0.0 and u >= bounds.low else None


def _possible(total: Callable[[Change], float], guess: Change, shortest: float) -> Change:
    """Return a change with which the motion is possible: the guess, or longer and longer changes, each also with the
    shortest rise and with a long rise. Raises NoTimes.
    """
    change = guess
    for _ in range(DOUBLINGS):
        for rise in (change.rise, max(1.02 * shortest, 1e-3), 2.0 * guess.fall):
            if total(tried := Change(rise, change.hold, change.fall)) < inf:
                return tried
        change = Change(change.rise, 2.0 * change.hold, change.fall)
        if change.hold > MAX_CHANGE_S:
            break
    raise NoTimes("no change of velocity within the limits leads to the target")


_DIRECTIONS = ((1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (-1, 1, -1), (1, -1, 1), (0, 1, -1), (1, -1, 0), (1, 0, -1))


def _downhill(total: Callable[[Change], float], start: Change, shortest: float) -> Change:
    """Reduce the total time, from a possible change to (nearly) the minimum, with ever smaller steps in each of the
    search directions.
    """
    best, best_total, tries = start, total(start), 0
    step = FIRST_STEP * max(start.lasts, 0.05)
    while step > LAST_STEP * max(best.lasts, 0.05) and tries < MAX_TRIES:
        before = best_total
        for longer, held, shorter in _DIRECTIONS:
            for way in (step, -step):
                rise, hold, fall = best
                tried = Change(
                    max(rise + way * longer, 0.0), max(hold + way * held, 0.0), max(fall + way * shorter, 0.0)
                )
                if tried == best or tried.rise < shortest or min(tried.rise, tried.fall) < SLIVER:
                    continue
                tries += 1
                if (time := total(tried)) < best_total:
                    best, best_total = tried, time
                    break
        if best_total > before * (1.0 - 1e-3):
            step *= 0.4
    return best


def _times_on_grid(demands: Demands, change: Change, least: float) -> Course:
    """Return the times on the grid for the chosen change; slower if the motion must last at least `least` [s]."""
    for _ in range(DOUBLINGS):
        change = Change(*(up_to_grid(x * MARGIN) + BLEND_ROOM if x > SLIVER else 0.0 for x in change))
        course = _on_grid(demands(change), change, least)
        if course is not None:
            return course
        change = Change(
            change.rise, change.hold * 1.001 + BLEND_ROOM + SLIVER, change.fall
        )  # try a longer change: rounding errors have used up the margin
    raise NoTimes("no change of velocity on the time grid leads to the target")


def _on_grid(bounds: Bounds, change: Change, least: float) -> Course | None:
    """Return the times for a change; None if no times on the grid are inside the bounds. Times are rounded up, so u is
    rounded down.
    """
    u = _quickest(bounds)
    if u is None:
        return None
    if u == 0.0:
        return Course(change, 0.0, NONE)
    u = max(u / MARGIN, 0.5 * (bounds.low + u))  # leave a margin for rounding on both sides of u
    if _total(bounds, change, u) < least:
        u = _slower(lambda slow_u: _total(bounds, change, slow_u), bounds.low * (1.0 + BLEND_ROOM * u), u, least)
    slow = ramps(bounds.by_acceleration * u, bounds.by_jerk * u)
    course = _without_sliver(change, up_to_grid(max(1.0 / u - bounds.lag - 0.5 * slow.lasts, 0.0)), slow)
    return course if bounds.low * course.reach <= 1.0 + SAME_QUOTIENT else None


STOP_FACTOR = 1.02  # stops are tried whose times are the estimated times multiplied by powers of this ratio
STOP_POWERS = (-150, 150)  # range of these powers, from short times to long ones
STOP_RISES = (0.01, 0.1, 0.3, 0.6, 1.0)  # durations tried for the first ramp of a stop, as fractions of its last ramp


def joint_motion(
    state: JointState, goal: Joints, limits: JointLimits, start: float, motion: Motion, least: float = 0.0
) -> tuple[Segment, ...]:
    """Plan the joint-interpolated motion to rest at `goal`; `least`: the least duration [s]."""
    if not state.at_rest:
        return segments_of(start, motion, stretches(state, goal, limits, least))
    rows = zip(state.joints, goal, limits.velocity, limits.acceleration, limits.jerk, strict=True)
    parts = [Component(to - at, 0.0, v_max, a_max, j_max) for at, to, v_max, a_max, j_max in rows]
    course = from_rest(parts, least)
    reach, still = course.reach, (0.0,) * len(parts)
    if reach <= 0.0:
        return ()
    cruising = [part.displacement / reach for part in parts]
    return segments_of(start, motion, joint_stretches(course, state.joints, still, cruising, Phase.ACCELERATE))


def straight_motion(state: ToolState, target: Transform, limits: ToolLimits, least: float = 0.0) -> list[ToolStretch]:
    """Plan the straight-line motion to rest at T_robot_tool `target`; empty if the tool is at the target already.

    Raises NoTimes if the state at the start allows no such motion.
    """
    line = _ToolMotion(state, target, limits)
    return list(line.stretches(line.course(least)))


def straight_stop(state: ToolState, limits: ToolLimits) -> list[ToolStretch]:
    """Plan the stretches that bring the tool to rest about as soon as possible, along its current line. Raises
    NoTimes.
    """
    line = _ToolMotion(state, state.pose, limits)
    stretches = line.stretches(Course(line.stop(), 0.0, NONE))
    return [structs.replace(stretch, phase=Phase.DECELERATE) for stretch in stretches]


class _ToolMotion(ToolMotion):
    """A line of the tool whose current spin decays as a turn about the axis of the spin and, if the spin's rate has
    another direction, as a second turn about a perpendicular axis.
    """

    def __init__(self, state: ToolState, target: Transform, limits: ToolLimits) -> None:
        self.spin, self.spin_rate, acceleration = rotated_back(state.pose, state.spin), STILL, STILL
        if state.accelerating:
            acceleration, self.spin_rate = state.acceleration, rotated_back(state.pose, state.spin_rate)
        super().__init__(state, target, limits, list(spin_turns(self.spin, self.spin_rate)), acceleration)

    def course(self, least: float) -> Course:
        limits = self.limits
        if self.at_rest:
            _, angle = self.turn(NONE)
            way = length(self.displacement)
            tip = Component(way, 0.0, limits.speed, limits.acceleration, limits.jerk)
            turning = Component(angle, 0.0, limits.spin, limits.spin_acceleration, limits.spin_jerk)
            most = limits.guide, limits.guide_acceleration, limits.guide_jerk
            guided = [Component(guide.end - guide.value, 0.0, *most) for guide in self.state.guides]
            return from_rest([tip, turning, *guided], least)
        slowest = max(
            length(self.state.velocity) / limits.acceleration, length(self.spin) / limits.spin_acceleration, 0.01
        )
        ramp = max(limits.acceleration / limits.jerk, limits.spin_acceleration / limits.spin_jerk)
        settling = max(
            length(self.acceleration) / limits.blend_jerk,
            length(self.spin_rate) / limits.blend_spin_jerk,
        )
        guess = Change(max(1.01 * settling, min(ramp, slowest)), slowest, ramp)
        return search(self._demands, guess, settling, least)

    def stop(self) -> Change:
        """Return the shortest change found that brings the tip and the rotation to rest. Raises NoTimes.

        Several fractions of the last ramp are tried as the first ramp, since a tool that already slows down needs a
        short first ramp.
        """
        limits, found = self.limits, list[Change]()
        ramp = max(limits.acceleration / limits.jerk, limits.spin_acceleration / limits.spin_jerk)
        lasting = max(length(self.state.velocity) / limits.acceleration, length(self.spin) / limits.spin_acceleration)
        tip = self.state.velocity, self.acceleration, limits.acceleration * MARGIN, limits.jerk * MARGIN
        spin = self.spin, self.spin_rate, limits.spin_acceleration * MARGIN, limits.spin_jerk * MARGIN
        for rise in STOP_RISES:
            times = (rise * ramp, max(lasting - 0.5 * (1.0 + rise) * ramp, 0.0), ramp)
            stretched = (
                Change(*(up_to_grid(duration * STOP_FACTOR**k) for duration in times)) for k in range(*STOP_POWERS)
            )
            found += islice((change for change in stretched if keeps(change, *tip) and keeps(change, *spin)), 1)
        if not found:
            raise NoTimes("no change of velocity within the limits ends at rest")
        return min(found, key=lambda change: change.lasts)

    def _demands(self, change: Change) -> Bounds:
        """Return the bounds that position and rotation set together; the decaying spin and the new turn share the
        angular limits.
        """
        _, angle = self.turn(change)
        return both(
            vector_bounds(self.displacement, self.state.velocity, self.acceleration, self.limits, change),
            turn_bounds(angle, change, self.spin, self.spin_rate, self.limits),
        )


def spin_turns(spin: Vector, spin_rate: Vector) -> Iterator[tuple[Vector, float, float]]:
    """Yield the turns by which a spin (angular velocity) decays: axis, speed and acceleration at the start."""
    size = length(spin)
    axis = scaled_vector(spin, 1.0 / size) if size > NEGLIGIBLE else (0.0, 0.0, 0.0)
    along = dot(spin_rate, axis)
    if size > NEGLIGIBLE:
        yield axis, size, along
    across = vector_difference(spin_rate, scaled_vector(axis, along))
    if length(across) > STEADY:
        yield scaled_vector(across, 1.0 / length(across)), 0.0, length(across)


LAW = Law(
    smooth=True,
    samples=4,  # fewer samples than in LSPB, because SCURVE has more stretches
    joint_motion=joint_motion,
    joint_stops=joint_stops,
    straight_motion=straight_motion,
    straight_stop=straight_stop,
    steer=steer,
    replay_steering=replay_steering,
    steering_of=steering_of,
)
