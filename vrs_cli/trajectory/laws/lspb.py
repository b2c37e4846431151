"""Segments of one motion: blend from the present state, cruise on the line to the target, slow down to rest.

From rest the blend is the acceleration. In joint space all joints, in Cartesian space position and rotation of the
tool tip start and stop together (`lspb_times`).
"""

from __future__ import annotations

from collections.abc import Iterator

from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.transform import (
    Transform,
    Vector,
    axis_angle,
    compose,
    inverse,
    length,
    position,
    rotated_back,
    rotation_about,
    scaled,
    subtracted,
)
from vrs_cli.trajectory.instant import up_to_grid
from vrs_cli.trajectory.laws.law import Law
from vrs_cli.trajectory.laws.lspb_steering import joint_stops, steer, steered, steering_of
from vrs_cli.trajectory.laws.lspb_times import (
    Component,
    Demand,
    Times,
    VectorPart,
    from_motion,
    from_rest,
    search,
    vector_demands,
)
from vrs_cli.trajectory.polynomial import Polynomial, parabola, value
from vrs_cli.trajectory.segment import JointPath, Path, Phase, Segment, ToolStretch, segments_of
from vrs_cli.trajectory.state import NEGLIGIBLE, JointLimits, JointState, ToolLimits, ToolState
from vrs_cli.values.motion import Motion

FIRST_STEPS = 4  # towards the shortest blend of two lines, which is the quickest as a rule


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
    return segments_of(start, motion, _joint_stretches(state, goal, times, resting))


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


# --- Cartesian space -------------------------------------------------------------------------------------------


def straight_motion(state: ToolState, target: Transform, limits: ToolLimits, least: float = 0.0) -> list[ToolStretch]:
    """The shortest straight-line motion to rest at T_robot_tool `target`; empty when the tool is there already."""
    line = _ToolMotion(state, target, limits)
    times = line.times(least)
    return list(line.stretches(times)) if times.reach > 0.0 else []


def straight_stop(state: ToolState, limits: ToolLimits) -> list[ToolStretch]:
    """The tool to rest as soon as it can, on the line that it moves on."""
    line = _ToolMotion(state, state.pose, limits)
    blend = up_to_grid(max(length(state.velocity) / limits.acceleration, line.spin / limits.spin_acceleration))
    return [stretch._replace(phase=Phase.DECELERATE) for stretch in line.stretches(Times(blend, 0.0, 0.0))]


class _ToolMotion:
    """A straight line from a state to a target, with its rotation: first the present spin dies, then one turn."""

    def __init__(self, state: ToolState, target: Transform, limits: ToolLimits) -> None:
        self.state, self.target, self.limits = state, target, limits
        self.displacement = subtracted(position(target), position(state.pose))
        self.guided = [guide.end - guide.value for guide in state.guides]
        self.spin = length(state.spin)
        self.spin_axis = (
            scaled(rotated_back(state.pose, state.spin), 1.0 / self.spin) if self.spin > NEGLIGIBLE else (0.0, 0.0, 1.0)
        )

    def times(self, least: float) -> Times:
        limits, state = self.limits, self.state
        if state.at_rest:
            _, angle = self.turn(0.0)
            tip = Component(length(self.displacement), 0.0, limits.speed, limits.acceleration)
            turning = Component(angle, 0.0, limits.spin, limits.spin_acceleration)
            others = [Component(way, 0.0, limits.guide, limits.guide_acceleration) for way in self.guided]
            return from_rest([tip, turning, *others], least)
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

    def orientation_after(self, blend: float) -> Transform:
        """The orientation reached by the present spin while it dies."""
        if self.spin <= NEGLIGIBLE:
            return self.state.pose
        return compose(self.state.pose, rotation_about(self.spin_axis, 0.5 * self.spin * blend))

    def turn(self, blend: float) -> tuple[Vector, float]:
        """Axis and angle of the turn that is left after the spin has died."""
        return axis_angle(compose(inverse(self.orientation_after(blend)), self.target))

    def stretches(self, times: Times) -> Iterator[ToolStretch]:
        blend, cruise, slow = times
        reach = times.reach
        state = self.state
        p0 = position(state.pose)
        ahead = subtracted(self.displacement, scaled(state.velocity, 0.5 * blend))
        v1 = scaled(ahead, 1.0 / reach) if cruise or slow else (0.0, 0.0, 0.0)
        axis, angle = self.turn(blend)
        w1 = angle / reach if cruise or slow else 0.0
        way = _parabolas(p0, state.velocity, v1, blend)
        going = cruise or slow
        rates = [
            (to - 0.5 * guide.rate * blend) / reach if going else 0.0
            for to, guide in zip(self.guided, state.guides, strict=True)
        ]
        guides = tuple(
            parabola(guide.value, guide.rate, u1, blend) for guide, u1 in zip(state.guides, rates, strict=True)
        )
        dying = ((self.spin_axis, parabola(0.0, self.spin, 0.0, blend)),) if self.spin > NEGLIGIBLE else ()
        turning = ((axis, parabola(0.0, 0.0, w1, blend)),) if w1 else ()
        phase = Phase.ACCELERATE if state.at_rest else Phase.BLEND
        yield ToolStretch(blend, phase, way, state.pose, dying + turning, guides)
        p, angle, R = _ends(way, blend), 0.5 * w1 * blend, self.orientation_after(blend)
        at = [value(a, blend) for a in guides]
        if cruise:
            way = ((p[0], v1[0]), (p[1], v1[1]), (p[2], v1[2]))
            guides = tuple(zip(at, rates, strict=True))
            yield ToolStretch(cruise, Phase.CRUISE, way, R, ((axis, (angle, w1)),) if w1 else (), guides)
            p, angle, at = _ends(way, cruise), angle + w1 * cruise, [value(a, cruise) for a in guides]
        if slow:
            turning = ((axis, parabola(angle, w1, 0.0, slow)),) if w1 else ()
            way = _parabolas(p, v1, (0.0, 0.0, 0.0), slow)
            guides = tuple(parabola(u, u1, 0.0, slow) for u, u1 in zip(at, rates, strict=True))
            yield ToolStretch(slow, Phase.DECELERATE, way, R, turning, guides)


def _parabolas(p: Vector, v0: Vector, v1: Vector, duration: float) -> tuple[Polynomial, Polynomial, Polynomial]:
    x, y, z = map(parabola, p, v0, v1, (duration,) * 3)
    return x, y, z


def _ends(position: tuple[Polynomial, ...], duration: float) -> Vector:
    x, y, z = (value(a, duration) for a in position)
    return x, y, z


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
