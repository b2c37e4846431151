"""Motions on one polynomial of degree 5: position, velocity and acceleration at both ends determine the polynomial.

From rest to rest, with the distance D and the time T,

    p = D (10 x^3 - 15 x^4 + 6 x^5),  x = t / T;   max v = 15/8 D/T,  max a = 10/sqrt(3) D/T^2,  max jerk = 60 D/T^3,

so T follows from the limits. (Craig, Introduction to Robotics, 7.3; Biagiotti and Melchiorri, Trajectory Planning for
Automatic Machines and Robots, 2.1.) For a motion that starts in motion, T is the least time found for which the
extremes of all derivatives keep the limits. With an acceleration at the start there may be no such T: the motion then
brakes first. Motions are braked and steered with limited jerk, as in SCURVE. The second half of a motion slows down, so
the next one may round its end.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import cbrt, hypot, sqrt
from typing import NamedTuple

from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.transform import (
    Transform,
    Vector,
    axis_angle,
    compose,
    cross,
    dot,
    inverse,
    length,
    position,
    rotated_back,
    rotation_about,
    scaled_vector,
    vector_difference,
)
from vrs_cli.trajectory.instant import up_to_grid
from vrs_cli.trajectory.laws.law import Law, NoTimes
from vrs_cli.trajectory.laws.lspb import MARGIN
from vrs_cli.trajectory.laws.scurve import spin_turns, straight_stop
from vrs_cli.trajectory.laws.scurve_steering import joint_stops, replay_steering, steer, steering_of
from vrs_cli.trajectory.polynomial import Polynomial, bisect_interval, derivative, most, taylor_shift, value
from vrs_cli.trajectory.segment import JointPath, Phase, Segment, ToolStretch, segments_of
from vrs_cli.trajectory.state import NEGLIGIBLE, JointLimits, JointState, ToolLimits, ToolState
from vrs_cli.values.commands import Motion

# factors of D/T, D/T^2, D/T^3 in the maxima of velocity, acceleration and jerk of a motion from rest
FASTEST, STEEPEST, SHARPEST = 15.0 / 8.0, 10.0 / sqrt(3.0), 60.0
TIME_FACTOR = 1.06  # ratio of each tried time to the one before
MAX_TRIES = 160
MIN_TIME_S = 1e-3  # minimum time [s] of a motion that begins in motion
# factor that allows for rounding where a limit is raised to the value at the start of the motion
PEAK_TOLERANCE = 1.0 + 1e-6
HALVINGS = 5  # number of halvings of the interval between a time that is too short and one that is long enough

Part = tuple[float, float, float]  # remaining displacement, current velocity and current acceleration of a component


class Bounds(NamedTuple):
    """The maximum velocity, acceleration and jerk of a component."""

    velocity: float
    acceleration: float
    jerk: float


def quintic(p: float, part: Part, lasting: float) -> Polynomial:
    """Return the polynomial from position p, with a part's velocity and acceleration, to rest after the part's
    displacement.
    """
    way, v, a = part
    v, a = v * lasting, a * lasting * lasting
    c3, c4, c5 = 10.0 * way - 6.0 * v - 1.5 * a, -15.0 * way + 8.0 * v + 1.5 * a, 6.0 * way - 3.0 * v - 0.5 * a
    square = lasting * lasting
    cube = square * lasting
    return p, part[1], 0.5 * part[2], c3 / cube, c4 / (square * square), c5 / (square * cube)


def from_rest(ways: Sequence[tuple[float, Bounds]], least: float) -> float:
    """Return the shortest time [s] in which all displacements, from rest to rest, keep their bounds; 0 if all
    displacements are 0.
    """
    if max(abs(way) for way, _ in ways) <= NEGLIGIBLE:
        return 0.0
    times = [
        max(FASTEST * abs(way) / v, sqrt(STEEPEST * abs(way) / a), cbrt(SHARPEST * abs(way) / jerk))
        for way, (v, a, jerk) in ways
    ]
    return _on_grid(max(*times, least))


def from_motion(keeps: Callable[[float], bool], shortest: float) -> float:
    """Return the shortest time [s] found for which `keeps` is true, at least `shortest`. Raises NoTimes."""
    short = long = max(shortest, MIN_TIME_S)
    for _ in range(MAX_TRIES):
        if keeps(long):
            break
        short, long = long, TIME_FACTOR * long
    else:
        raise NoTimes("no time brings the motion to its target within the limits")
    least, _ = bisect_interval(keeps, long, short, HALVINGS if long > short else 0)
    return _on_grid(least)


def _on_grid(lasting: float) -> float:
    """Round a time [s] up so that half of it is also on the grid."""
    return 2.0 * up_to_grid(0.5 * lasting * MARGIN)


def _keeps(part: Part, bounds: Bounds, lasting: float) -> bool:
    rates = derivative(quintic(0.0, part, lasting))
    bends = derivative(rates)
    # the check that costs least comes first
    rows = (derivative(bends), bounds.jerk), (bends, bounds.acceleration), (rates, bounds.velocity)
    return all(most(row, lasting) <= bound for row, bound in rows)


# --- joint space -----------------------------------------------------------------------------------------------


def joint_motion(
    state: JointState, goal: Joints, limits: JointLimits, start: float, motion: Motion, least: float = 0.0
) -> tuple[Segment, ...]:
    """Plan the joint-interpolated motion to rest at `goal`; `least`: the least duration [s]. Raises NoTimes."""
    rows = zip(state.joints, state.velocity, state.present_acceleration, goal, strict=True)
    parts = [(to - at, v, a) for at, v, a, to in rows]
    bounds = map(_joint_bounds, parts, limits.velocity, limits.acceleration, limits.jerk, limits.peak)
    pairs = list(zip(parts, bounds, strict=True))
    if state.at_rest:
        lasting = from_rest([(way, bound) for (way, _, _), bound in pairs], least)
    else:
        shortest = max(max(abs(way) / bound.velocity, abs(v) / bound.acceleration) for (way, v, _), bound in pairs)
        lasting = from_motion(
            lambda time: all(_keeps(part, bound, time) for part, bound in pairs), max(shortest, least)
        )
    if not lasting:
        return ()
    half = 0.5 * lasting
    begin = tuple(quintic(at, part, lasting) for at, part in zip(state.joints, parts, strict=True))
    end = tuple(taylor_shift(a, half) for a in begin)
    first = Phase.ACCELERATE if state.at_rest else Phase.BLEND
    stretches = (half, first, JointPath(begin)), (half, Phase.DECELERATE, JointPath(end))
    return segments_of(start, motion, iter(stretches))


def _joint_bounds(part: Part, velocity: float, acceleration: float, jerk: float, peak: float) -> Bounds:
    """Return the limits of a joint; the velocity limit is raised to the velocity that the joint has or that its
    acceleration leads to.
    """
    _, v, a = part
    coming = abs(v) + (0.5 * a * a / jerk if a * v > 0.0 else 0.0)
    fastest = max(velocity, min(coming, peak), abs(v))
    return Bounds(fastest * PEAK_TOLERANCE, max(acceleration, abs(a)) * PEAK_TOLERANCE, jerk)


# --- Cartesian space -------------------------------------------------------------------------------------------


def straight_motion(state: ToolState, target: Transform, limits: ToolLimits, least: float = 0.0) -> list[ToolStretch]:
    """Plan the straight-line motion to rest at T_robot_tool `target`; empty if the tool is at the target already.

    Raises NoTimes if the state at the start allows no such motion.
    """
    way = vector_difference(position(target), position(state.pose))
    if state.at_rest:
        _, angle = state.turn_to(target)
        tip = length(way), Bounds(limits.speed, limits.acceleration, limits.jerk)
        turning = angle, Bounds(limits.spin, limits.spin_acceleration, limits.spin_jerk)
        slowest = Bounds(limits.guide, limits.guide_acceleration, limits.guide_jerk)
        others = [(guide.end - guide.value, slowest) for guide in state.guides]
        lasting = from_rest([tip, turning, *others], least)
    else:
        tips = _tip_parts(state, way)
        stopping = length(state.velocity) / limits.blend_acceleration
        shortest = max(least, length(way) / limits.speed, stopping, length(state.spin) / limits.blend_spin_acceleration)
        lasting = from_motion(lambda time: _tool_keeps(state, target, limits, tips, time), shortest)
    if not lasting:
        return []
    place, half = position(state.pose), 0.5 * lasting
    parts = zip(way, state.velocity, state.acceleration, strict=True)
    x, y, z = (quintic(p, part, lasting) for p, part in zip(place, parts, strict=True))
    turns = _turns(state, target, lasting)
    first = Phase.ACCELERATE if state.at_rest else Phase.BLEND
    later = tuple((axis, taylor_shift(angle, half)) for axis, angle in turns)
    end = taylor_shift(x, half), taylor_shift(y, half), taylor_shift(z, half)
    guides = tuple(
        quintic(guide.value, (guide.end - guide.value, guide.rate, guide.acceleration), lasting)
        for guide in state.guides
    )
    return [
        ToolStretch(half, first, (x, y, z), state.pose, tuple(turns), guides),
        ToolStretch(half, Phase.DECELERATE, end, state.pose, later, tuple(taylor_shift(a, half) for a in guides)),
    ]


def _tip_parts(state: ToolState, way: Vector) -> list[Part]:
    """Return the tip's displacement, velocity and acceleration along the line, and in two directions across it."""
    size = length(way)
    along = scaled_vector(way, 1.0 / size) if size > NEGLIGIBLE else (1.0, 0.0, 0.0)
    beside = vector_difference(state.velocity, scaled_vector(along, dot(state.velocity, along)))
    if length(beside) <= NEGLIGIBLE:
        beside = cross(along, (0.0, 0.0, 1.0) if abs(along[2]) < 0.9 else (1.0, 0.0, 0.0))
    beside = scaled_vector(beside, 1.0 / length(beside))
    axes = along, beside, cross(along, beside)
    return [(dot(way, axis), dot(state.velocity, axis), dot(state.acceleration, axis)) for axis in axes]


def _tool_keeps(state: ToolState, target: Transform, limits: ToolLimits, tips: Sequence[Part], time: float) -> bool:
    """Return whether a motion of duration `time` [s] keeps the limits: the limits of a blend in its first half, the
    ordinary limits in its second half.

    The magnitude of a vector is bounded by the extremes of its components.
    """
    spins = [angle for _, angle in _turns(state, target, time)]
    return _group_keeps(
        [quintic(0.0, part, time) for part in tips],
        time,
        max(limits.speed, length(state.velocity) * PEAK_TOLERANCE),
        max(limits.blend_acceleration, length(state.acceleration) * PEAK_TOLERANCE),
        limits.acceleration,
        limits.blend_jerk,
    ) and _group_keeps(
        spins,
        time,
        max(limits.spin, length(state.spin) * PEAK_TOLERANCE),
        max(limits.blend_spin_acceleration, length(state.spin_rate) * PEAK_TOLERANCE),
        limits.spin_acceleration,
        limits.blend_spin_jerk,
    )


def _group_keeps(
    rows: Sequence[Polynomial], time: float, speed: float, blending: float, slowing: float, jerk: float
) -> bool:
    half = 0.5 * time
    bends = [derivative(derivative(a)) for a in rows]
    return (
        hypot(*(most(derivative(a), time) for a in bends)) <= jerk
        and hypot(*(most(a, half) for a in bends)) <= blending
        and hypot(*(most(taylor_shift(a, half), half) for a in bends)) <= slowing
        and hypot(*(most(derivative(a), time) for a in rows)) <= speed
    )


def _turns(state: ToolState, target: Transform, time: float) -> list[tuple[Vector, Polynomial]]:
    """Return the turns of a motion: the current spin decays, and a single turn from rest to rest makes the remaining
    rotation.
    """
    spin, spin_rate = rotated_back(state.pose, state.spin), rotated_back(state.pose, state.spin_rate)
    turns, turned = list[tuple[Vector, Polynomial]](), state.pose
    for axis, rate, change in spin_turns(spin, spin_rate):
        gain = change * time
        cubic = -(rate + 2.0 * gain / 3.0) / (time * time)
        # degree 4: it comes to rest, at an angle that is not prescribed
        angle = 0.0, rate, 0.5 * change, cubic, (0.5 * rate + 0.25 * gain) / time**3
        turns.append((axis, angle))
        turned = compose(turned, rotation_about(axis, value(angle, time)))
    axis, left = axis_angle(compose(inverse(turned), target))
    return [*turns, (axis, quintic(0.0, (left, 0.0, 0.0), time))] if abs(left) > NEGLIGIBLE else turns


LAW = Law(
    smooth=True,
    samples=8,
    joint_motion=joint_motion,
    joint_stops=joint_stops,
    straight_motion=straight_motion,
    straight_stop=straight_stop,
    steer=steer,
    replay_steering=replay_steering,
    steering_of=steering_of,
)
