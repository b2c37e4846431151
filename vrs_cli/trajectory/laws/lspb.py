"""LSPB: linear motions with parabolic blends. A motion blends from its start state, cruises, and slows down to rest.

From rest the blend is the acceleration. One motion has several components, which start and stop together: all joints
or, in Cartesian space, position and rotation of the tool tip. They blend from the current velocity v0 to the cruise
velocity v1 in `blend` seconds, cruise, and slow down to rest in `slow` seconds, all at constant acceleration. With D
the remaining displacement,

    D = blend (v0 + v1) / 2 + v1 cruise + v1 slow / 2,   v1 = (D - v0 blend / 2) / S,   S = blend/2 + cruise + slow/2.

The time is minimal for the greatest u = 1/S that a given blend time allows; the blend time is searched. (Craig,
Introduction to Robotics, 7.3 "Linear function with parabolic blends", extended to a moving start.)

Steering, a tick at a time: the joints follow a moving target, each as well as its limits allow. Every joint wants the
velocity `w + g(e)`: the velocity of its target, plus a velocity that removes the error e within the response time T.
This is g(e) = e / (2 T), but at most sqrt(a |e|), from which the joint can brake within the distance e. The joint
changes its velocity to the wanted one within T / 2. If limits do not matter, this is the critically damped law

    q'' = e / T^2 + 2 (w - q') / T

for a target that keeps its velocity w, so the joint follows such a target without a lag. The acceleration is held for
one tick, as a parabola. If no other target comes, the joints coast for a while and then brake. A joint always keeps
enough room to coast and brake before the end of its range. So a joint that begins inside its range stays inside,
whatever targets come.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from math import copysign, inf, sqrt
from typing import NamedTuple

from msgspec import structs

from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.transform import Transform, Vector, length, rotated_back, scaled_vector
from vrs_cli.trajectory.instant import TICK, up_to_grid
from vrs_cli.trajectory.laws.law import SLIVER, Blend, Coming, Course, Law, ToolMotion, VelocityChange, joint_stretches
from vrs_cli.trajectory.polynomial import parabola, value
from vrs_cli.trajectory.segment import JointPath, Path, Phase, Segment, ToolStretch, segments_of, stay_inside
from vrs_cli.trajectory.state import NEGLIGIBLE, FrozenValue, JointLimits, JointState, Target, ToolLimits, ToolState
from vrs_cli.values.commands import Motion

MARGIN = 1.0 + 1e-7  # factor that keeps velocities inside limits after times are rounded to the grid
BLEND_ROOM = 8 * TICK  # [s] added to a blend, because rounding of the other times moves the limits a little
SAME_QUOTIENT = 1e-9  # relative tolerance: a bound that u misses by less, by rounding, counts as kept
LONGER_BLEND = 1.2
FIRST_STEPS = 2
MAX_BLEND_S = 1e6  # [s] maximum time of a blend

_new = tuple.__new__


def _course(blend: float, cruise: float, slow: float) -> Course:
    return Course(Blend(blend), cruise, Blend(slow))


class Component(FrozenValue, frozen=True):
    """A scalar part of a motion: the remaining displacement, the current velocity, and the limits of velocity,
    acceleration and jerk.
    """

    displacement: float
    velocity: float
    max_velocity: float
    max_acceleration: float
    max_jerk: float = inf


class Demand(NamedTuple):
    """The bounds that one blend time sets: u = 1/S of the module's formula lies in [low, high]; `slowing` is max |v1| /
    (u a), so that slow = slowing u.
    """

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
    # the whole time is S + by_acceleration / S, where S (see the module docstring) is the displacement D divided by the
    # cruise velocity v1
    square = least * least - 4.0 * by_acceleration
    by_time = 0.5 * (least + sqrt(square)) if square > 0.0 else 0.0
    reach = MARGIN * max(by_velocity, sqrt(by_acceleration), by_time)
    blend = up_to_grid(by_acceleration / reach)  # the blend lasts as long as the last stretch, which slows down
    return _without_sliver(blend, up_to_grid(max(reach - blend, 0.0)), blend)


def _without_sliver(blend: float, cruise: float, slow: float) -> Course:
    """Return the times of a motion (a `Course`) without a very short cruise: slowing down then takes longer by twice
    the time of the cruise, so S (see the module docstring) stays the same.
    """
    return _course(blend, cruise, slow) if cruise > SLIVER else _course(blend, 0.0, slow + 2.0 * cruise)


def from_motion(components: Sequence[Component], least: float = 0.0) -> Course:
    """Return the times of a motion whose scalar components already move at its start."""
    shortest = max(max(abs(part.velocity) - part.max_velocity, 0.0) / part.max_acceleration for part in components)
    guess = max(abs(part.velocity) / part.max_acceleration for part in components)
    return search(scalar_demands(components), shortest, guess, least)


def scalar_demands(components: Sequence[Component]) -> Demands:
    """Return a function from the blend time to the bounds on u = 1/S, for components that each have their own
    limits."""
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


def vector_demands(displacement: Vector, velocity: Vector, limits: ToolLimits) -> Demands:
    """Return a function from the blend time to the bounds on u = 1/S that the motion of the tip sets, so that |c u| <=
    v_max and |c u - v0| <= a_blend blend, with c = D - v0 blend / 2.
    """
    (dx, dy, dz), (vx, vy, vz), fastest, acceleration = displacement, velocity, limits.speed, limits.acceleration
    blending, speed = limits.blend_acceleration, sqrt(vx * vx + vy * vy + vz * vz)

    def demands(blend: float) -> Demand:
        half, change = 0.5 * blend, blending * blend
        cx, cy, cz = dx - half * vx, dy - half * vy, dz - half * vz
        ahead = sqrt(cx * cx + cy * cy + cz * cz)
        if ahead <= NEGLIGIBLE:
            return Demand(0.0, inf, 0.0) if speed <= change else Demand(1.0, 0.0, 0.0)
        along = (cx * vx + cy * vy + cz * vz) / ahead
        room = change * change - max(speed * speed - along * along, 0.0)
        if room < 0.0:
            return Demand(1.0, 0.0, 0.0)
        root = sqrt(room)
        low, high, most = (along - root) / ahead, (along + root) / ahead, fastest / ahead
        return _new(Demand, (low if low > 0.0 else 0.0, high if high < most else most, ahead / acceleration))

    return demands


def search(
    demands: Demands, shortest: float, guess: float, least: float = 0.0, first_steps: int = FIRST_STEPS
) -> Course:
    """Return the times of the shortest motion that the demands allow, by a search over the blend time.

    `shortest`: a blend time [s] below which no motion is possible; `guess`: an estimate of the blend time; `least`: the
    least total time [s]; `first_steps`: the number of search steps towards the shortest possible blend. Raises
    ValueError if no motion is possible.
    """

    def try_blend(blend: float) -> Try:
        demand = demands(blend)
        u = _most(demand, blend)
        room = u - demand.low
        if room < 0.0 or u <= 0.0:
            return Try(blend, inf, min(room, -NEGLIGIBLE))
        return Try(blend, 1.0 / u + 0.5 * (blend + demand.slowing * u) if u < inf else blend, room)

    low, best = Try(shortest, inf, -inf), try_blend(max(shortest, guess, 1e-6))
    while best.total == inf:
        if best.blend > MAX_BLEND_S:
            raise ValueError("no blend time brings the motion to its target within the limits")
        low, best = best, try_blend(2.0 * best.blend)
    return _times_on_grid(demands, _shortest(try_blend, low, best, first_steps), least)


class Try(FrozenValue, frozen=True):
    """A blend time [s], the total time with this blend (inf: impossible), and the room between the bounds on u."""

    blend: float
    total: float
    room: float


def _shortest(try_blend: Callable[[float], Try], low: Try, best: Try, first_steps: int) -> float:
    """Return a blend time with (nearly) the least total time: first find the shortest possible blend, then lengthen it
    as long as the total time decreases.
    """
    for _ in range(first_steps):  # try the blend where `room` is 0 if it grows linearly; else the middle
        known = -inf < low.room < 0.0 and best.room < inf
        part = min(max(low.room / (low.room - best.room), 0.1), 0.9) if known else 0.5
        middle = try_blend(low.blend + part * (best.blend - low.blend))
        if middle.total < best.total:
            best = middle
        else:
            low = middle
    step = max(best.blend, 1e-3) * 0.25
    while step > 0.1 * best.blend:
        ahead = try_blend(best.blend + step)
        if ahead.total < best.total:
            best, step = ahead, 1.6 * step
        else:
            step *= 0.25
    return best.blend


def _most(demand: Demand, blend: float) -> float:
    """Return the maximum u within the demand whose cruise time is not negative; inf if no distance remains."""
    _, high, slowing = demand
    if slowing <= 0.0:
        return high
    # cruise >= 0:  1/u - blend/2 - slowing u / 2 >= 0
    return min(high, (sqrt(blend * blend + 8.0 * slowing) - blend) / (2.0 * slowing))


def _times_on_grid(demands: Demands, blend: float, least: float) -> Course:
    """Return the times on the grid for the chosen blend time; slower if the motion must last at least `least` [s]."""
    blend = up_to_grid(blend * MARGIN) + BLEND_ROOM
    while True:
        times = _on_grid(demands(blend), blend, least)
        if times is None:
            # rounding has left no u between the bounds: try a longer blend
            blend = up_to_grid(blend * 1.001) + BLEND_ROOM
        elif times.total < least - SLIVER:
            # a longer blend: the motion starts so fast that it would otherwise have to turn back to last `least`
            blend = up_to_grid(blend * LONGER_BLEND)
        else:
            return times


def _on_grid(demand: Demand, blend: float, least: float) -> Course | None:
    """Return the times for a blend time; None if no times on the grid meet the demand. Times are rounded up, so u is
    rounded down.
    """
    u = _most(demand, blend)
    if u < demand.low or u <= 0.0:
        return None
    if u == inf:  # the blend itself ends at rest on the target
        return _course(blend, 0.0, 0.0)
    u = max(u / MARGIN, 0.5 * (demand.low + u))  # leave a margin for rounding on both sides of u
    rest = least - 0.5 * blend
    square = rest * rest - 2.0 * demand.slowing
    # the u for which the total time 1/u + (blend + slowing u) / 2 is `least`; inf if it is longer for every u
    slow_enough = 2.0 / (rest + sqrt(square)) if rest > 0.0 and square > 0.0 else inf
    u = max(min(u, slow_enough), min(u, demand.low * (1.0 + BLEND_ROOM * u)))
    slow = up_to_grid(demand.slowing * u)
    times = _without_sliver(blend, up_to_grid(max(1.0 / u - 0.5 * (blend + slow), 0.0)), slow)
    return times if demand.low * times.reach <= 1.0 + SAME_QUOTIENT else None


LINE_FIRST_STEPS = 4  # number of search steps towards the shortest blend of two lines, which is usually the best
RESPONSE_TICKS = 2.5  # [ticks] T of the steering rule: responds fast, and is steady with one target a tick
COASTING_TICKS = 1.0  # [ticks] joints coast this long for a late target before they brake
LIMIT_MARGIN = 1.0 - 1e-9  # factor on limits, to allow for rounding


def joint_motion(
    state: JointState, goal: Joints, limits: JointLimits, start: float, motion: Motion, least: float = 0.0
) -> tuple[Segment, ...]:
    """Plan the shortest joint-interpolated motion to rest at `goal`; `least`: the least duration [s]."""
    rows = zip(state.joints, state.velocity, goal, limits.velocity, limits.acceleration, strict=True)
    components = [Component(to - at, v, v_max, a_max) for at, v, to, v_max, a_max in rows]
    resting = state.at_rest
    course = from_rest(components, least) if resting else from_motion(components, least)
    reach, first = course.reach, Phase.ACCELERATE if resting else Phase.BLEND
    if reach <= 0.0:
        return ()
    blend, still = course.change.lasts, (0.0,) * len(components)
    ways = [it.displacement - 0.5 * it.velocity * blend for it in components]
    cruising = still if course.stops_at_once else [way / reach for way in ways]
    return segments_of(start, motion, joint_stretches(course, state.joints, state.velocity, cruising, first))


def straight_motion(state: ToolState, target: Transform, limits: ToolLimits, least: float = 0.0) -> list[ToolStretch]:
    """Plan the shortest straight-line motion to rest at T_robot_tool `target`; empty if the tool is at the target
    already.
    """
    line = _ToolMotion(state, target, limits)
    return list(line.stretches(line.course(least)))


def straight_stop(state: ToolState, limits: ToolLimits) -> list[ToolStretch]:
    """Return the stretches that bring the tool to rest as soon as possible, along its current line."""
    line = _ToolMotion(state, state.pose, limits)
    blend = up_to_grid(max(length(state.velocity) / limits.acceleration, line.spin / limits.spin_acceleration))
    stop = Course(Blend(blend), 0.0, Blend(0.0))
    return [structs.replace(stretch, phase=Phase.DECELERATE) for stretch in line.stretches(stop)]


class _ToolMotion(ToolMotion):
    def __init__(self, state: ToolState, target: Transform, limits: ToolLimits) -> None:
        self.spin = length(state.spin)
        dying = self.spin > NEGLIGIBLE
        axes = [scaled_vector(rotated_back(state.pose, state.spin), 1.0 / self.spin)] if dying else []
        super().__init__(state, target, limits, [(axis, self.spin, 0.0) for axis in axes])

    def turn_after_change(self, change: VelocityChange, spin: float) -> float:
        return 0.5 * spin * change.lasts

    def course(self, least: float) -> Course:
        """Return the shortest course (the times of the change of velocity, the cruise and slowing down) that keeps the
        tool's limits of velocity and acceleration and lasts at least `least` [s]."""
        limits, state = self.limits, self.state
        if self.at_rest:
            _, angle = self.turn(Blend(0.0))
            tip = Component(length(self.displacement), 0.0, limits.speed, limits.acceleration)
            turning = Component(angle, 0.0, limits.spin, limits.spin_acceleration)
            ways = [guide.end - guide.value for guide in state.guides]
            others = [Component(way, 0.0, limits.guide, limits.guide_acceleration) for way in ways]
            return from_rest([tip, turning, *others], least)
        blending = limits.blend_acceleration
        speed = length(state.velocity)
        shortest = max(max(speed - limits.speed, 0.0) / blending, self.spin / limits.blend_spin_acceleration)
        guess = max(speed / limits.acceleration, shortest)
        return search(self._demands(), shortest, guess, least, LINE_FIRST_STEPS)

    def _demands(self) -> Demands:
        """Return a function from the blend time to the bounds that position and rotation set together. The decaying
        spin and the new turn share the limit of angular acceleration.
        """
        limits, of_tip = self.limits, vector_demands(self.displacement, self.state.velocity, self.limits)
        fastest, blending, acceleration = limits.spin, limits.blend_spin_acceleration, limits.spin_acceleration
        dying = bool(self.dying)
        angle = 0.0 if dying else self.state.turn_to(self.target)[1]

        def demands(blend: float) -> Demand:
            demand, left = of_tip(blend), self.turn(Blend(blend))[1] if dying else angle
            if left <= NEGLIGIBLE:
                return demand
            low, high, slowing = demand
            high = min(high, fastest / left, (blending * blend - self.spin) / left)
            return _new(Demand, (low, high, max(slowing, left / acceleration)))

        return demands


# --- stops -----------------------------------------------------------------------------------------------------------


def joint_stops(state: JointState, limits: JointLimits, start: float, motion: Motion) -> Iterator[tuple[Segment, ...]]:
    """Yield the possible stops: all joints together, then each joint on its own as fast as possible."""
    yield joint_stop(state, limits, start, motion)
    yield joint_stop_each(state, limits, start, motion)


def joint_stop(state: JointState, limits: JointLimits, start: float, motion: Motion) -> tuple[Segment, ...]:
    """Bring all joints to rest together, along the current direction in joint space."""
    blend = max(_stopping_times(state, limits))
    pairs = zip(state.joints, state.velocity, strict=True)
    path = JointPath(tuple(parabola(q, v, 0.0, blend) if blend else (q,) for q, v in pairs))
    return segments_of(start, motion, iter([(blend, Phase.DECELERATE, path)]))


def _stopping_times(state: JointState, limits: JointLimits) -> list[float]:
    return [up_to_grid(abs(v) / a) for v, a in zip(state.velocity, limits.acceleration, strict=True)]


def joint_stop_each(state: JointState, limits: JointLimits, start: float, motion: Motion) -> tuple[Segment, ...]:
    """Bring every joint to rest as fast as possible, each in its own time. No joint goes farther than necessary, so the
    joints stay in range if the interrupted motion would have stayed in range.
    """
    stops = _stopping_times(state, limits)
    q, v = list(state.joints), list(state.velocity)
    rates = [0.0 if not stop else -speed / stop for speed, stop in zip(v, stops, strict=True)]
    stretches: list[tuple[float, Phase, Path]] = []
    before = 0.0
    for moment in sorted(set(stops) - {0.0}):
        lasting = moment - before
        path = tuple(
            (p, w, 0.5 * rate) if stop >= moment else (p, 0.0, 0.0)
            for p, w, rate, stop in zip(q, v, rates, stops, strict=True)
        )
        stretches.append((lasting, Phase.DECELERATE, JointPath(path)))
        q = [value(a, lasting) for a in path]
        v = [w + rate * lasting if stop > moment else 0.0 for w, rate, stop in zip(v, rates, stops, strict=True)]
        before = moment
    return segments_of(start, motion, iter(stretches))


# --- steering --------------------------------------------------------------------------------------------------------


def steer(
    state: JointState,
    target: Target,
    limits: JointLimits,
    hardest: JointLimits,
    tick: float,
    start: float,
    motion: Motion,
    _coming: Coming,
) -> tuple[Segment, ...]:
    """Plan a tick [s] towards the target, on the time grid, then coasting and braking to rest. If the previous motion
    has left no room for a whole tick, brake at once, at the `hardest` limits."""
    rows = zip(
        state.joints,
        state.velocity,
        target.joints,
        target.velocity,
        limits.velocity,
        limits.acceleration,
        limits.lower,
        limits.upper,
        strict=True,
    )
    v1 = tuple(
        _next_velocity(q, v, p, w, v_max * LIMIT_MARGIN, a_max * LIMIT_MARGIN, low, high, tick)
        for q, v, p, w, v_max, a_max, low, high in rows
    )
    segments = replay_steering(state, v1, limits, tick, start, motion)
    if stay_inside(segments, limits.lower, limits.upper):
        return segments
    return joint_stop_each(state, hardest, start, motion)


def replay_steering(
    state: JointState, v1: Joints, limits: JointLimits, tick: float, start: float, motion: Motion
) -> tuple[Segment, ...]:
    """Plan a tick in which the joints reach the velocities v1, then coasting, then braking to rest: all joints together
    if there is enough room, else each in its own time.
    """
    path = JointPath(tuple(map(parabola, state.joints, state.velocity, v1, (tick,) * len(v1))))
    stretches: list[tuple[float, Phase, Path]] = [(tick, Phase.BLEND, path)]
    if any(v1):
        path = JointPath(tuple(zip(path.joints(tick), v1, strict=True)))
        stretches.append((COASTING_TICKS * tick, Phase.CRUISE, path))
    chase = segments_of(start, motion, iter(stretches))
    last = chase[-1]
    after = JointState(path.joints(last.duration), v1)
    stop = joint_stop(after, limits, last.finish, motion)
    for segment in stop:
        assert isinstance(segment.path, JointPath)
        ends = segment.path.joints(segment.duration)
        if not all(low <= q <= high for q, low, high in zip(ends, limits.lower, limits.upper, strict=True)):
            return (*chase, *joint_stop_each(after, limits, last.finish, motion))
    return (*chase, *stop)


def steering_of(segments: Sequence[Segment]) -> Joints | None:
    """Return the velocities v1 from which `replay_steering` makes these segments; None if it cannot have made them."""
    path = segments[0].path
    if segments[0].phase is not Phase.BLEND or not isinstance(path, JointPath):
        return None
    if len(segments) == 1:
        return (0.0,) * len(path.coefficients)
    coast = segments[1].path
    return tuple(row[1] for row in coast.coefficients) if isinstance(coast, JointPath) and coast.degree == 1 else None


def _next_velocity(
    q: float, v: float, p: float, w: float, v_max: float, a_max: float, low: float, high: float, tick: float
) -> float:
    """Return the velocity of a joint at the end of the tick."""
    response = RESPONSE_TICKS * tick
    error = p - q
    closing = copysign(min(abs(error) / (2.0 * response), sqrt(a_max * abs(error))), error)
    wanted = v + (min(max(w + closing, -v_max), v_max) - v) * min(2.0 * tick / response, 1.0)
    change = a_max * tick
    v1 = min(max(wanted, v - change), v + change)
    fastest = _fastest(high - q, v, a_max, tick)
    if v1 > fastest:
        return max(fastest, v - change)
    slowest = -_fastest(q - low, -v, a_max, tick)
    return min(slowest, v + change) if v1 < slowest else v1


def _fastest(room: float, v: float, a_max: float, tick: float) -> float:
    """Return the maximum velocity v1 at the end of the tick from which the joint can still stop within `room`:

    (v + v1) tick / 2 + v1 coasting + v1^2 / (2 a) <= room, for v1 >= 0.

    Return 0 if there is no such velocity. Here v is the velocity at the start of the tick, and `coasting` is the time
    at v1 before the joint brakes [s]: COASTING_TICKS ticks and one instant of the time grid, because the duration of
    braking is rounded up to the grid.
    """
    left = room - 0.5 * v * tick
    if left <= 0.0:
        return 0.0
    b = a_max * (tick * (0.5 + COASTING_TICKS) + TICK)
    return sqrt(b * b + 2.0 * a_max * left) - b


LAW = Law(
    smooth=False,
    samples=8,
    joint_motion=joint_motion,
    joint_stops=joint_stops,
    straight_motion=straight_motion,
    straight_stop=straight_stop,
    steer=steer,
    replay_steering=replay_steering,
    steering_of=steering_of,
)
