"""Segments of one motion: blend from the present state, cruise on the line to the target, slow down to rest.

From rest the blend is the acceleration. In joint space all joints, in Cartesian space position and rotation of the
tool tip start and stop together (`profile`).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import inf

from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.transform import Transform, Vector, axis_angle, compose, inverse, rotation_about
from vrs_cli.trajectory.instant import up_to_grid
from vrs_cli.trajectory.motion import Motion
from vrs_cli.trajectory.polynomial import Polynomial, parabola, value
from vrs_cli.trajectory.profile import (
    NEGLIGIBLE,
    Component,
    Demand,
    Times,
    VectorPart,
    from_motion,
    from_rest,
    search,
    vector_demands,
)
from vrs_cli.trajectory.segment import JointPath, Path, Phase, Segment
from vrs_cli.trajectory.vector import length, rotated_back, scaled, subtracted

# A blend of two straight lines has the deceleration of the first and the acceleration of the second at once, as in VAL:
# so the corner is rounded on its inside. What the joints can follow is checked after.
CORNER = 2.0
FIRST_STEPS = 4  # towards the shortest blend of two lines, which is the quickest as a rule
STEADY = 1e-9  # an acceleration that is none [rad/s2, m/s2]


@dataclass(frozen=True, slots=True)
class JointState:
    """Joints, their velocities and accelerations [rad, rad/s, rad/s2].

    `acceleration` empty: none, or one that may jump (LSPB).
    """

    joints: Joints
    velocity: Joints
    acceleration: Joints = ()

    @property
    def at_rest(self) -> bool:
        return all(abs(v) <= NEGLIGIBLE for v in self.velocity) and not self.accelerating

    @property
    def accelerating(self) -> bool:
        """Whether there is an acceleration to carry on with."""
        return any(abs(a) > STEADY for a in self.acceleration)


@dataclass(frozen=True, slots=True)
class ToolState:
    """T_robot_tool with the velocity of the tool tip [m/s] and its angular velocity in the robot's frame [rad/s].

    `acceleration` [m/s2] and `spin_rate` [rad/s2] of both: zero where they may jump (LSPB).
    """

    pose: Transform
    velocity: Vector
    spin: Vector
    acceleration: Vector = (0.0, 0.0, 0.0)
    spin_rate: Vector = (0.0, 0.0, 0.0)

    @property
    def at_rest(self) -> bool:
        return length(self.velocity) <= NEGLIGIBLE and length(self.spin) <= NEGLIGIBLE and not self.accelerating

    @property
    def accelerating(self) -> bool:
        """Whether there is an acceleration to carry on with."""
        return length(self.acceleration) > STEADY or length(self.spin_rate) > STEADY


@dataclass(frozen=True, slots=True)
class JointLimits:
    """What each joint may do in a motion [rad/s, rad/s2, rad/s3]; `peak`: the velocity it may never exceed."""

    velocity: Joints
    acceleration: Joints
    jerk: Joints = ()
    peak: Joints = ()


@dataclass(frozen=True, slots=True)
class ToolLimits:
    """What the tool tip may do in a motion [m/s, m/s2, rad/s, rad/s2, m/s3, rad/s3].

    `blending`, `blending_jerk`: how many times these accelerations and jerks a blend out of a motion may have.
    """

    speed: float
    acceleration: float
    spin: float
    spin_acceleration: float
    jerk: float = inf
    spin_jerk: float = inf
    blending: float = CORNER
    blending_jerk: float = CORNER

    @property
    def blend_acceleration(self) -> float:
        return self.blending * self.acceleration

    @property
    def blend_spin_acceleration(self) -> float:
        return self.blending * self.spin_acceleration

    @property
    def blend_jerk(self) -> float:
        return self.blending_jerk * self.jerk

    @property
    def blend_spin_jerk(self) -> float:
        return self.blending_jerk * self.spin_jerk

    def slowed(self, velocity: float, acceleration: float, jerk: float = 1.0) -> ToolLimits:
        """Velocities divided by the first factor, accelerations by the second, jerks by the third."""
        return replace(
            self,
            speed=self.speed / velocity,
            acceleration=self.acceleration / acceleration,
            spin=self.spin / velocity,
            spin_acceleration=self.spin_acceleration / acceleration,
            jerk=self.jerk / jerk,
            spin_jerk=self.spin_jerk / jerk,
        )

    def blended(self, acceleration: float, jerk: float) -> ToolLimits:
        """The acceleration of a blend divided by the first factor, its jerk by the second."""
        return replace(self, blending=self.blending / acceleration, blending_jerk=self.blending_jerk / jerk)


def laid(start: float, motion: Motion, stretches: Iterator[tuple[float, Phase, Path]]) -> tuple[Segment, ...]:
    """Segments one after the other from `start`; those of no duration are left out."""
    segments = []
    for duration, phase, path in stretches:
        if duration > 0.0:
            segments.append(Segment(start, start + duration, path, phase, motion))
            start += duration
    return tuple(segments)


# --- joint space -----------------------------------------------------------------------------------------------


def joint_motion(
    state: JointState, goal: Joints, limits: JointLimits, start: float, motion: Motion, least: float = 0.0
) -> tuple[Segment, ...]:
    """The shortest joint-interpolated motion to rest at `goal`; `least`: the least duration [s]."""
    components = [
        Component(to - at, v, v_max, a_max)
        for at, v, to, v_max, a_max in zip(
            state.joints, state.velocity, goal, limits.velocity, limits.acceleration, strict=True
        )
    ]
    resting = state.at_rest
    times = from_rest(components, least) if resting else from_motion(components, least)
    return laid(start, motion, _joint_stretches(state, goal, times, resting))


def _joint_stretches(
    state: JointState, goal: Joints, times: Times, resting: bool
) -> Iterator[tuple[float, Phase, Path]]:
    reach = times.reach
    if reach <= 0.0:
        return
    blend, cruise, slow = times
    v1 = tuple(
        (to - at - 0.5 * v * blend) / reach for at, v, to in zip(state.joints, state.velocity, goal, strict=True)
    )
    if cruise == slow == 0.0:  # the blend itself ends on the target, at rest
        v1 = (0.0,) * len(v1)
    path = tuple(map(parabola, state.joints, state.velocity, v1, (blend,) * len(v1)))
    yield blend, Phase.ACCELERATE if resting else Phase.BLEND, JointPath(path)
    q = tuple(value(a, blend) for a in path)
    if cruise:
        path = tuple(zip(q, v1, strict=True))
        yield cruise, Phase.CRUISE, JointPath(path)
        q = tuple(value(a, cruise) for a in path)
    if slow:
        yield (
            slow,
            Phase.DECELERATE,
            JointPath(tuple(parabola(p, v, 0.0, slow) for p, v in zip(q, v1, strict=True))),
        )


def joint_stop(state: JointState, limits: JointLimits, start: float, motion: Motion) -> tuple[Segment, ...]:
    """Every joint to rest together, along the present direction."""
    blend = max(map(_stopping_time, state.velocity, limits.acceleration))
    return laid(start, motion, iter([(blend, Phase.DECELERATE, _stop_path(state, blend))]))


def _stopping_time(velocity: float, acceleration: float) -> float:
    return up_to_grid(abs(velocity) / acceleration)


def _stop_path(state: JointState, duration: float) -> JointPath:
    if not duration:
        return JointPath(tuple((q,) for q in state.joints))
    return JointPath(tuple(parabola(q, v, 0.0, duration) for q, v in zip(state.joints, state.velocity, strict=True)))


def joint_stop_each(state: JointState, limits: JointLimits, start: float, motion: Motion) -> tuple[Segment, ...]:
    """Every joint to rest as fast as it can, each in its own time.

    No joint goes farther than it would have to go anyway, so this stays inside joint limits wherever the motion that is
    interrupted would have.
    """
    stops = list(map(_stopping_time, state.velocity, limits.acceleration))
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
    return laid(start, motion, iter(stretches))


def rest(joints: Joints, duration: float, start: float, motion: Motion) -> Segment:
    """Stand still; also for no time at all, when only the hand or the tool changes."""
    return Segment(start, start + duration, JointPath(tuple((q,) for q in joints)), Phase.REST, motion)


# --- Cartesian space -------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class ToolStretch:
    """A stretch of a straight-line motion before its joints are known."""

    duration: float
    phase: Phase
    position: tuple[Polynomial, Polynomial, Polynomial]
    orientation: Transform
    turns: tuple[tuple[Vector, Polynomial], ...]


def straight_motion(state: ToolState, target: Transform, limits: ToolLimits, least: float = 0.0) -> list[ToolStretch]:
    """The shortest straight-line motion to rest at T_robot_tool `target`; empty when the tool is there already."""
    line = _Line(state, target, limits)
    times = line.times(least)
    return list(line.stretches(times)) if times.reach > 0.0 else []


def straight_stop(state: ToolState, limits: ToolLimits) -> list[ToolStretch]:
    """The tool to rest as soon as it can, on the line that it moves on."""
    line = _Line(state, state.pose, limits)
    blend = up_to_grid(max(length(state.velocity) / limits.acceleration, line.spin / limits.spin_acceleration))
    return [replace(stretch, phase=Phase.DECELERATE) for stretch in line.stretches(Times(blend, 0.0, 0.0))]


class _Line:
    """A straight line from a state to a target, with its rotation: first the present spin dies, then one turn."""

    def __init__(self, state: ToolState, target: Transform, limits: ToolLimits) -> None:
        self.state, self.target, self.limits = state, target, limits
        self.displacement = (
            target.px - state.pose.px,
            target.py - state.pose.py,
            target.pz - state.pose.pz,
        )
        self.spin = length(state.spin)
        self.spin_axis = (
            scaled(rotated_back(state.pose, state.spin), 1.0 / self.spin) if self.spin > NEGLIGIBLE else (0.0, 0.0, 1.0)
        )

    def times(self, least: float) -> Times:
        limits, state = self.limits, self.state
        if state.at_rest:
            _, angle = self.turn(0.0)
            position = Component(length(self.displacement), 0.0, limits.speed, limits.acceleration)
            return from_rest([position, Component(angle, 0.0, limits.spin, limits.spin_acceleration)], least)
        blending = limits.blend_acceleration
        part = VectorPart(self.displacement, state.velocity, limits.speed, limits.acceleration, blending)
        speed = length(state.velocity)
        shortest = max(max(speed - limits.speed, 0.0) / blending, self.spin / limits.blend_spin_acceleration)
        guess = max(speed / limits.acceleration, shortest)
        return search(lambda blend: self._demands(part, blend), shortest, guess, least, FIRST_STEPS)

    def _demands(self, part: VectorPart, blend: float) -> Demand:
        """Position and rotation together; the dying spin and the new turn share the angular acceleration."""
        low, high, slowing = vector_demands(part, blend)
        _, angle = self.turn(blend)
        if angle > NEGLIGIBLE:
            limits = self.limits
            high = min(high, limits.spin / angle, (limits.blend_spin_acceleration * blend - self.spin) / angle)
            slowing = max(slowing, angle / limits.spin_acceleration)
        return Demand(low, high, slowing)

    def turned(self, blend: float) -> Transform:
        """The orientation reached by the present spin while it dies."""
        if self.spin <= NEGLIGIBLE:
            return self.state.pose
        return compose(self.state.pose, rotation_about(self.spin_axis, 0.5 * self.spin * blend))

    def turn(self, blend: float) -> tuple[Vector, float]:
        """Axis and angle of the turn that is left after the spin has died."""
        return axis_angle(compose(inverse(self.turned(blend)), self.target))

    def stretches(self, times: Times) -> Iterator[ToolStretch]:
        blend, cruise, slow = times
        reach = times.reach
        state = self.state
        p0 = (state.pose.px, state.pose.py, state.pose.pz)
        ahead = subtracted(self.displacement, scaled(state.velocity, 0.5 * blend))
        v1 = scaled(ahead, 1.0 / reach) if cruise or slow else (0.0, 0.0, 0.0)
        axis, angle = self.turn(blend)
        w1 = angle / reach if cruise or slow else 0.0
        position = _parabolas(p0, state.velocity, v1, blend)
        dying = ((self.spin_axis, parabola(0.0, self.spin, 0.0, blend)),) if self.spin > NEGLIGIBLE else ()
        turning = ((axis, parabola(0.0, 0.0, w1, blend)),) if w1 else ()
        phase = Phase.ACCELERATE if state.at_rest else Phase.BLEND
        yield ToolStretch(blend, phase, position, state.pose, dying + turning)
        p, angle, R = _ends(position, blend), 0.5 * w1 * blend, self.turned(blend)
        if cruise:
            position = ((p[0], v1[0]), (p[1], v1[1]), (p[2], v1[2]))
            yield ToolStretch(cruise, Phase.CRUISE, position, R, ((axis, (angle, w1)),) if w1 else ())
            p, angle = _ends(position, cruise), angle + w1 * cruise
        if slow:
            turning = ((axis, parabola(angle, w1, 0.0, slow)),) if w1 else ()
            yield ToolStretch(slow, Phase.DECELERATE, _parabolas(p, v1, (0.0, 0.0, 0.0), slow), R, turning)


def _parabolas(p: Vector, v0: Vector, v1: Vector, duration: float) -> tuple[Polynomial, Polynomial, Polynomial]:
    x, y, z = map(parabola, p, v0, v1, (duration,) * 3)
    return x, y, z


def _ends(position: tuple[Polynomial, ...], duration: float) -> Vector:
    x, y, z = (value(a, duration) for a in position)
    return x, y, z
