"""Segments of one jerk-limited motion: the same as `lspb`, with the times of `scurve_times`.

Position, velocity and acceleration are continuous from the state that the motion begins in to its end at rest.
"""

from __future__ import annotations

from collections.abc import Iterator

from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.transform import (
    Transform,
    Vector,
    added,
    axis_angle,
    compose,
    dot,
    inverse,
    length,
    position,
    rotated_back,
    rotation_about,
    scaled,
    subtracted,
)
from vrs_cli.trajectory.instant import up_to_grid
from vrs_cli.trajectory.laws.law import Law, NoTimes
from vrs_cli.trajectory.laws.lspb_times import MARGIN
from vrs_cli.trajectory.laws.scurve_joints import stretches
from vrs_cli.trajectory.laws.scurve_steering import joint_stops, steer, steered, steering_of
from vrs_cli.trajectory.laws.scurve_times import (
    NONE,
    Bounds,
    Change,
    Course,
    ScalarPart,
    VectorLimits,
    both,
    from_rest,
    keeps,
    search,
    turn_bounds,
    vector_bounds,
)
from vrs_cli.trajectory.polynomial import value
from vrs_cli.trajectory.segment import JointPath, Path, Phase, Segment, ToolStretch, segments_of
from vrs_cli.trajectory.state import NEGLIGIBLE, STEADY, GuideState, JointLimits, JointState, ToolLimits, ToolState
from vrs_cli.values.motion import Motion

STRETCH = 1.02  # powers of it are factors by which the likely times of a stop are tried
STRETCHES = (-150, 150)  # the powers, from short to long
RISES = (0.01, 0.1, 0.3, 0.6, 1.0)  # of a ramp


# --- joint space -----------------------------------------------------------------------------------------------


def joint_motion(
    state: JointState, goal: Joints, limits: JointLimits, start: float, motion: Motion, least: float = 0.0
) -> tuple[Segment, ...]:
    """The joint-interpolated motion to rest at `goal`; `least`: the least duration [s]."""
    if not state.at_rest:
        return segments_of(start, motion, stretches(state, goal, limits, least))
    rows = zip(state.joints, goal, limits.velocity, limits.acceleration, limits.jerk, strict=True)
    parts = [ScalarPart(to - at, v_max, a_max, j_max) for at, to, v_max, a_max, j_max in rows]
    return segments_of(start, motion, _from_rest(state.joints, goal, from_rest(parts, least)))


def _from_rest(joints: Joints, goal: Joints, course: Course) -> Iterator[tuple[float, Phase, Path]]:
    reach = course.reach
    if reach <= 0.0:
        return
    change, cruise, slow = course
    cruising = [(to - at) / reach for at, to in zip(joints, goal, strict=True)]
    ways = [change.polynomials(at, 0.0, 0.0, v1) for at, v1 in zip(joints, cruising, strict=True)]
    for duration, path in zip(change.durations, zip(*ways, strict=True), strict=True):
        yield duration, Phase.ACCELERATE, JointPath(path)
    q = tuple(value(way[-1], change.durations[-1]) for way in ways)
    if cruise:
        path = tuple(zip(q, cruising, strict=True))
        yield cruise, Phase.CRUISE, JointPath(path)
        q = tuple(value(a, cruise) for a in path)
    if slow.lasts:
        slowing = [slow.polynomials(p, v, 0.0, 0.0) for p, v in zip(q, cruising, strict=True)]
        for duration, path in zip(slow.durations, zip(*slowing, strict=True), strict=True):
            yield duration, Phase.DECELERATE, JointPath(path)


# --- Cartesian space -------------------------------------------------------------------------------------------


def straight_motion(state: ToolState, target: Transform, limits: ToolLimits, least: float = 0.0) -> list[ToolStretch]:
    """The straight-line motion to rest at T_robot_tool `target`; empty when the tool is there already.

    Raises NoTimes where the state at the start allows none.
    """
    line = _ToolMotion(state, target, limits)
    course = line.course(least)
    return list(line.stretches(course)) if course.reach > 0.0 else []


def straight_stop(state: ToolState, limits: ToolLimits) -> list[ToolStretch]:
    """The tool to rest about as soon as it can, on the line that it moves on. Raises NoTimes."""
    line = _ToolMotion(state, state.pose, limits)
    stretches = line.stretches(Course(line.stop(), 0.0, NONE))
    return [stretch._replace(phase=Phase.DECELERATE) for stretch in stretches]


class _ToolMotion:
    """A straight line from a state to a target, with its rotation: the present spin dies, then one turn.

    The spin dies as a turn about its axis and, where its rate points elsewhere, as another about an axis across.
    """

    def __init__(self, state: ToolState, target: Transform, limits: ToolLimits) -> None:
        self.state, self.target, self.limits = state, target, limits
        self.displacement = subtracted(position(target), position(state.pose))
        still = not state.accelerating
        self.acceleration = (0.0, 0.0, 0.0) if still else state.acceleration
        self.spin = rotated_back(state.pose, state.spin)
        self.spin_rate = (0.0, 0.0, 0.0) if still else rotated_back(state.pose, state.spin_rate)
        self.dying = tuple(spin_turns(self.spin, self.spin_rate))

    def course(self, least: float) -> Course:
        limits = self.limits
        if self.state.at_rest:
            _, angle = self.turn(NONE)
            way = length(self.displacement)
            tip = ScalarPart(way, limits.speed, limits.acceleration, limits.jerk)
            turning = ScalarPart(angle, limits.spin, limits.spin_acceleration, limits.spin_jerk)
            return from_rest([tip, turning, *map(self._guided, self.state.guides)], least)
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

    def _guided(self, guide: GuideState) -> ScalarPart:
        a = self.limits
        return ScalarPart(guide.end - guide.value, a.guide, a.guide_acceleration, a.guide_jerk)

    def stop(self) -> Change:
        """The shortest times found in which velocity and spin end, with their accelerations. Raises NoTimes."""
        found = [change for rise in RISES if (change := self._stop(rise)) is not None]
        if not found:
            raise NoTimes("no change of velocity within the limits ends at rest")
        return min(found, key=lambda change: change.lasts)

    def _stop(self, rise: float) -> Change | None:
        """Times of a stop whose first ramp is a part of the last one: that a tool which slows down already is quick."""
        limits = self.limits
        ramp = max(limits.acceleration / limits.jerk, limits.spin_acceleration / limits.spin_jerk)
        lasting = max(length(self.state.velocity) / limits.acceleration, length(self.spin) / limits.spin_acceleration)
        times = (rise * ramp, max(lasting - 0.5 * (1.0 + rise) * ramp, 0.0), ramp)
        for k in range(*STRETCHES):
            change = Change(*(up_to_grid(duration * STRETCH**k) for duration in times))
            if self._ends(change):
                return change
        return None

    def _ends(self, change: Change) -> bool:
        """Whether a change to rest keeps the limits."""
        limits = self.limits
        return keeps(
            change, self.state.velocity, self.acceleration, limits.acceleration * MARGIN, limits.jerk * MARGIN
        ) and keeps(change, self.spin, self.spin_rate, limits.spin_acceleration * MARGIN, limits.spin_jerk * MARGIN)

    def _demands(self, change: Change) -> Bounds:
        """Position and rotation together; the dying spin and the new turn share the angular limits."""
        a = self.limits
        tip = VectorLimits(a.speed, a.acceleration, a.jerk, a.blend_acceleration, a.blend_jerk)
        turn = VectorLimits(a.spin, a.spin_acceleration, a.spin_jerk, a.blend_spin_acceleration, a.blend_spin_jerk)
        _, angle = self.turn(change)
        return both(
            vector_bounds(self.displacement, self.state.velocity, self.acceleration, tip, change),
            turn_bounds(angle, change, self.spin, self.spin_rate, turn),
        )

    def orientation_after(self, change: Change) -> Transform:
        """The orientation reached while the present spin dies."""
        R = self.state.pose
        for axis, rate, acceleration in self.dying:
            k0, k1 = change.ways
            angle = rate * change.lasts + acceleration * k0 + change.level(rate, acceleration, 0.0) * k1
            R = compose(R, rotation_about(axis, angle))
        return R

    def turn(self, change: Change) -> tuple[Vector, float]:
        """Axis and angle of the turn that is left after the spin has died."""
        return axis_angle(compose(inverse(self.orientation_after(change)), self.target))

    def stretches(self, course: Course) -> Iterator[ToolStretch]:
        change, cruise, slow = course
        state, reach = self.state, course.reach
        k0, _ = change.ways
        carried = added(state.velocity, scaled(self.acceleration, 0.5 * change.rise))
        way = subtracted(self.displacement, scaled(state.velocity, change.lasts))
        ahead = added(subtracted(way, scaled(self.acceleration, k0)), scaled(carried, change.lag))
        v1 = (0.0, 0.0, 0.0) if course.stops_at_once else scaled(ahead, 1.0 / reach)
        rates = [0.0 if course.stops_at_once else _ahead(guide, change) / reach for guide in state.guides]
        axis, angle = self.turn(change)
        w1 = 0.0 if course.stops_at_once else angle / reach
        place = position(state.pose)
        phase = Phase.ACCELERATE if state.at_rest else Phase.BLEND
        times = change.durations
        ways = [
            change.polynomials(p, v, a, w)
            for p, v, a, w in zip(place, state.velocity, self.acceleration, v1, strict=True)
        ]
        others = [
            change.polynomials(guide.value, guide.rate, guide.acceleration, u1)
            for guide, u1 in zip(state.guides, rates, strict=True)
        ]
        turns = [(k, change.polynomials(0.0, rate, acceleration, 0.0)) for k, rate, acceleration in self.dying]
        if w1:
            turns.append((axis, change.polynomials(0.0, 0.0, 0.0, w1)))
        for i, duration in enumerate(times):
            x, y, z = (row[i] for row in ways)
            turning, guides = tuple((k, row[i]) for k, row in turns), tuple(row[i] for row in others)
            yield ToolStretch(duration, phase, (x, y, z), state.pose, turning, guides)
        at = [value(row[-1], times[-1]) for row in others]
        p = [value(row[-1], times[-1]) for row in ways]
        turned, R = value(turns[-1][1][-1], times[-1]) if w1 else 0.0, self.orientation_after(change)
        if cruise:
            x, y, z = zip(p, v1, strict=True)
            guides = tuple(zip(at, rates, strict=True))
            yield ToolStretch(cruise, Phase.CRUISE, (x, y, z), R, ((axis, (turned, w1)),) if w1 else (), guides)
            at = [value(row, cruise) for row in guides]
            p, turned = [value(row, cruise) for row in (x, y, z)], turned + w1 * cruise
        if slow.lasts:
            slowing = [slow.polynomials(q, v, 0.0, 0.0) for q, v in zip(p, v1, strict=True)]
            back = slow.polynomials(turned, w1, 0.0, 0.0)
            others = [slow.polynomials(u, u1, 0.0, 0.0) for u, u1 in zip(at, rates, strict=True)]
            for i, duration in enumerate(slow.durations):
                x, y, z = (row[i] for row in slowing)
                turning, guides = ((axis, back[i]),) if w1 else (), tuple(row[i] for row in others)
                yield ToolStretch(duration, Phase.DECELERATE, (x, y, z), R, turning, guides)


def _ahead(guide: GuideState, change: Change) -> float:
    """The way of a guide but for what its rate and its acceleration at the start make of it."""
    k0, _ = change.ways
    carried = guide.rate + 0.5 * change.rise * guide.acceleration
    way = guide.end - guide.value - guide.rate * change.lasts - guide.acceleration * k0
    return way + change.lag * carried


def spin_turns(spin: Vector, spin_rate: Vector) -> Iterator[tuple[Vector, float, float]]:
    """The turns by which a spin dies: axis, speed and acceleration at the start."""
    size = length(spin)
    axis = scaled(spin, 1.0 / size) if size > NEGLIGIBLE else (0.0, 0.0, 0.0)
    along = dot(spin_rate, axis)
    if size > NEGLIGIBLE:
        yield axis, size, along
    across = subtracted(spin_rate, scaled(axis, along))
    if length(across) > STEADY:
        yield scaled(across, 1.0 / length(across)), 0.0, length(across)


LAW = Law(
    smooth=True,
    samples=4,  # it has more stretches
    joint_motion=joint_motion,
    joint_stops=joint_stops,
    straight_motion=straight_motion,
    straight_stop=straight_stop,
    steer=steer,
    steered=steered,
    steering_of=steering_of,
)
