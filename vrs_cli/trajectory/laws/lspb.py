"""Segments of one motion: blend from the present state, cruise on the line to the target, slow down to rest.

From rest the blend is the acceleration. In joint space all joints, in Cartesian space position and rotation of the
tool tip start and stop together (`lspb_times`).
"""

from __future__ import annotations

from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.transform import Transform, length, rotated_back, scaled
from vrs_cli.trajectory.instant import up_to_grid
from vrs_cli.trajectory.laws.course import Course, ToolMotion, VelocityChange, joint_stretches
from vrs_cli.trajectory.laws.law import Law
from vrs_cli.trajectory.laws.lspb_steering import joint_stops, steer, steered, steering_of
from vrs_cli.trajectory.laws.lspb_times import (
    Blend,
    Component,
    Demand,
    VectorPart,
    from_motion,
    from_rest,
    search,
    vector_demands,
)
from vrs_cli.trajectory.segment import Phase, Segment, ToolStretch, segments_of
from vrs_cli.trajectory.state import NEGLIGIBLE, JointLimits, JointState, ToolLimits, ToolState
from vrs_cli.values.motion import Motion

FIRST_STEPS = 4  # towards the shortest blend of two lines, which is the quickest as a rule


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
    change, going = course.change, not course.stops_at_once
    cruising = [change.ahead(way, v, 0.0) / reach if going else 0.0 for way, v, _, _ in components]
    return segments_of(start, motion, joint_stretches(course, state.joints, state.velocity, cruising, first))


def straight_motion(state: ToolState, target: Transform, limits: ToolLimits, least: float = 0.0) -> list[ToolStretch]:
    """The shortest straight-line motion to rest at T_robot_tool `target`; empty when the tool is there already."""
    line = _ToolMotion(state, target, limits)
    return list(line.stretches(line.course(least)))


def straight_stop(state: ToolState, limits: ToolLimits) -> list[ToolStretch]:
    """The tool to rest as soon as it can, on the line that it moves on."""
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
        """The shortest times within the limits."""
        limits, state = self.limits, self.state
        if state.at_rest:
            _, angle = self.turn(Blend(0.0))
            tip = Component(length(self.displacement), 0.0, limits.speed, limits.acceleration)
            turning = Component(angle, 0.0, limits.spin, limits.spin_acceleration)
            ways = [guide.end - guide.value for guide in state.guides]
            others = [Component(way, 0.0, limits.guide, limits.guide_acceleration) for way in ways]
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
        _, angle = self.turn(Blend(blend))
        if angle > NEGLIGIBLE:
            limits = self.limits
            high = min(high, limits.spin / angle, (limits.blend_spin_acceleration * blend - self.spin) / angle)
            slowing = max(slowing, angle / limits.spin_acceleration)
        return Demand(low, high, slowing)


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
