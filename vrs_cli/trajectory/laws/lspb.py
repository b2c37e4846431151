"""LSPB: linear motions with parabolic blends. A motion blends from the present state, cruises, and slows down to rest.

From rest the blend is the acceleration. In joint space all joints, in Cartesian space position and rotation of the
tool tip start and stop together (`lspb_times`).

Steering, a tick at a time: the joints chase a target that moves, each as well as its limits allow. Every joint wants
the velocity `w + g(e)`: that of its target, and one that takes away the error e within a short time, but no more than
it can brake from on the way: g(e) = e / (2 D), at most sqrt(a |e|). It changes its velocity towards that within D / 2.
Where limits do not matter this is the critically damped law  q'' = e / D^2 + 2 (w - q') / D  for a target that keeps
its velocity w, so it follows such a target without a lag. It is held for one tick, as a parabola. When no other target
comes, the joints coast for a while and then brake. A joint always leaves itself room for both before the end of its
range; so it stays inside whatever comes, if it did at the beginning.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import copysign, sqrt

from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.transform import Transform, length, rotated_back, scaled
from vrs_cli.trajectory.instant import TICK, up_to_grid
from vrs_cli.trajectory.laws.course import Blend, Course, ToolMotion, VelocityChange, joint_stretches
from vrs_cli.trajectory.laws.law import Coming, Law
from vrs_cli.trajectory.laws.lspb_times import (
    Component,
    Demand,
    from_motion,
    from_rest,
    search,
    vector_demands,
)
from vrs_cli.trajectory.polynomial import parabola, value
from vrs_cli.trajectory.segment import JointPath, Path, Phase, Segment, ToolStretch, segments_of, stay_inside
from vrs_cli.trajectory.state import NEGLIGIBLE, JointLimits, JointState, Target, ToolLimits, ToolState
from vrs_cli.values.commands import Motion

FIRST_STEPS = 4  # towards the shortest blend of two lines, which is the quickest as a rule
RESPONSE = 2.5  # D in ticks: quick, and steady for targets that are known once a tick
COASTING = 1.0  # ticks: how late the next target may come without a jolt
SPARE = 1.0 - 1e-9  # of limits, for rounding


def joint_motion(
    state: JointState, goal: Joints, limits: JointLimits, start: float, motion: Motion, least: float = 0.0
) -> tuple[Segment, ...]:
    """The shortest joint-interpolated motion to rest at `goal`; `least`: the least duration [s]."""
    rows = zip(state.joints, state.velocity, goal, limits.velocity, limits.acceleration, strict=True)
    components = [Component(to - at, v, v_max, a_max) for at, v, to, v_max, a_max in rows]
    resting = state.at_rest
    course = from_rest(components, least) if resting else from_motion(components, least)
    reach, first = course.reach, Phase.ACCELERATE if resting else Phase.BLEND
    if reach <= 0.0:
        return ()
    blend, still = course.change.lasts, (0.0,) * len(components)
    cruising = still if course.stops_at_once else [(way - 0.5 * v * blend) / reach for way, v, *_ in components]
    return segments_of(start, motion, joint_stretches(course, state.joints, state.velocity, cruising, first))


def straight_motion(state: ToolState, target: Transform, limits: ToolLimits, least: float = 0.0) -> list[ToolStretch]:
    """The shortest straight-line motion to rest at T_robot_tool `target`; empty when the tool is there already."""
    line = _ToolMotion(state, target, limits)
    return list(line.stretches(line.course(least)))


def straight_stop(state: ToolState, limits: ToolLimits) -> list[ToolStretch]:
    """Return the stretches that bring the tool to rest as soon as possible, on the line that it moves on."""
    line = _ToolMotion(state, state.pose, limits)
    blend = up_to_grid(max(length(state.velocity) / limits.acceleration, line.spin / limits.spin_acceleration))
    stop = Course(Blend(blend), 0.0, Blend(0.0))
    return [stretch._replace(phase=Phase.DECELERATE) for stretch in line.stretches(stop)]


class _ToolMotion(ToolMotion):
    def __init__(self, state: ToolState, target: Transform, limits: ToolLimits) -> None:
        self.spin = length(state.spin)
        dying = self.spin > NEGLIGIBLE
        axes = [scaled(rotated_back(state.pose, state.spin), 1.0 / self.spin)] if dying else []
        super().__init__(state, target, limits, [(axis, self.spin, 0.0) for axis in axes])

    def turned(self, change: VelocityChange, spin: float) -> float:
        return 0.5 * spin * change.lasts

    def course(self, least: float) -> Course:
        """Return the shortest times within the limits."""
        limits, state = self.limits, self.state
        if state.at_rest:
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
        return search(self._demands, shortest, guess, least, FIRST_STEPS)

    def _demands(self, blend: float) -> Demand:
        """Return the bounds of position and rotation together; the dying spin and the new turn share the angular
        acceleration.
        """
        low, high, slowing = vector_demands(self.displacement, self.state.velocity, self.limits, blend)
        _, angle = self.turn(Blend(blend))
        if angle > NEGLIGIBLE:
            limits = self.limits
            high = min(high, limits.spin / angle, (limits.blend_spin_acceleration * blend - self.spin) / angle)
            slowing = max(slowing, angle / limits.spin_acceleration)
        return Demand(low, high, slowing)


# --- stops -----------------------------------------------------------------------------------------------------------


def joint_stops(state: JointState, limits: JointLimits, start: float, motion: Motion) -> Iterator[tuple[Segment, ...]]:
    """Yield the ways to rest: all joints together, then each as fast as it can."""
    yield joint_stop(state, limits, start, motion)
    yield joint_stop_each(state, limits, start, motion)


def joint_stop(state: JointState, limits: JointLimits, start: float, motion: Motion) -> tuple[Segment, ...]:
    """Bring all joints to rest together, along the present direction."""
    blend = max(_stopping_times(state, limits))
    pairs = zip(state.joints, state.velocity, strict=True)
    path = JointPath(tuple(parabola(q, v, 0.0, blend) if blend else (q,) for q, v in pairs))
    return segments_of(start, motion, iter([(blend, Phase.DECELERATE, path)]))


def _stopping_times(state: JointState, limits: JointLimits) -> list[float]:
    return [up_to_grid(abs(v) / a) for v, a in zip(state.velocity, limits.acceleration, strict=True)]


def joint_stop_each(state: JointState, limits: JointLimits, start: float, motion: Motion) -> tuple[Segment, ...]:
    """Bring every joint to rest as fast as it can, each in its own time.

    No joint goes farther than it would have to go anyway. So this stays inside joint limits if the interrupted motion
    would have.
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
    """Plan a tick [s] towards the target, on the time grid, then coasting and braking to rest. If the motion before has
    left no room for a whole tick, brake at once, at the `hardest` limits.
    """
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
        _next_velocity(q, v, p, w, v_max * SPARE, a_max * SPARE, low, high, tick)
        for q, v, p, w, v_max, a_max, low, high in rows
    )
    segments = steered(state, v1, limits, tick, start, motion)
    if stay_inside(segments, limits.lower, limits.upper):
        return segments
    return joint_stop_each(state, hardest, start, motion)


def steered(
    state: JointState, v1: Joints, limits: JointLimits, tick: float, start: float, motion: Motion
) -> tuple[Segment, ...]:
    """Plan a tick in which the joints come to the velocities v1, then coasting, and braking to rest: all joints
    together if there is room for that, else each in its own time.
    """
    path = JointPath(tuple(map(parabola, state.joints, state.velocity, v1, (tick,) * len(v1))))
    stretches: list[tuple[float, Phase, Path]] = [(tick, Phase.BLEND, path)]
    if any(v1):
        path = JointPath(tuple(zip(path.joints(tick), v1, strict=True)))
        stretches.append((COASTING * tick, Phase.CRUISE, path))
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
    """Return the velocities with which `steered` made the segments; None if it did not."""
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
    response = RESPONSE * tick
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
    """The greatest velocity at the end of the tick from which the way to the end of the range is enough:

    (v + v1) tick / 2 + v1 coasting + v1^2 / (2 a) <= room, for v1 >= 0; 0 where there is no such velocity. Braking may
    take an instant of the time grid longer, which is added to the coasting.
    """
    left = room - 0.5 * v * tick
    if left <= 0.0:
        return 0.0
    b = a_max * (tick * (0.5 + COASTING) + TICK)
    return sqrt(b * b + 2.0 * a_max * left) - b


LAW = Law(
    smooth=False,
    samples=8,
    joint_motion=joint_motion,
    joint_stops=joint_stops,
    straight_motion=straight_motion,
    straight_stop=straight_stop,
    steer=steer,
    steered=steered,
    steering_of=steering_of,
)
