"""Segments of one jerk-limited motion: the same as `lspb`, with the times of `scurve_times`.

Position, velocity and acceleration are continuous from the state that the motion begins in to its end at rest.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice

from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.transform import (
    Transform,
    Vector,
    dot,
    length,
    rotated_back,
    scaled,
    subtracted,
)
from vrs_cli.trajectory.instant import up_to_grid
from vrs_cli.trajectory.laws.course import NONE, Change, Course, ToolMotion, joint_stretches
from vrs_cli.trajectory.laws.law import Law, NoTimes
from vrs_cli.trajectory.laws.lspb_times import MARGIN, Component
from vrs_cli.trajectory.laws.scurve_joints import stretches
from vrs_cli.trajectory.laws.scurve_steering import joint_stops, steer, steered, steering_of
from vrs_cli.trajectory.laws.scurve_times import (
    Bounds,
    both,
    from_rest,
    keeps,
    search,
    turn_bounds,
    vector_bounds,
)
from vrs_cli.trajectory.segment import STILL, Phase, Segment, ToolStretch, segments_of
from vrs_cli.trajectory.state import NEGLIGIBLE, STEADY, JointLimits, JointState, ToolLimits, ToolState
from vrs_cli.values.commands import Motion

STRETCH = 1.02  # powers of it are factors by which the likely times of a stop are tried
STRETCHES = (-150, 150)  # the powers, from short to long
RISES = (0.01, 0.1, 0.3, 0.6, 1.0)  # of a ramp


def joint_motion(
    state: JointState, goal: Joints, limits: JointLimits, start: float, motion: Motion, least: float = 0.0
) -> tuple[Segment, ...]:
    """The joint-interpolated motion to rest at `goal`; `least`: the least duration [s]."""
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
    """The straight-line motion to rest at T_robot_tool `target`; empty when the tool is there already.

    Raises NoTimes where the state at the start allows none.
    """
    line = _ToolMotion(state, target, limits)
    return list(line.stretches(line.course(least)))


def straight_stop(state: ToolState, limits: ToolLimits) -> list[ToolStretch]:
    """Return the stretches that bring the tool to rest about as soon as possible, on the line that it moves on. Raises
    NoTimes.
    """
    line = _ToolMotion(state, state.pose, limits)
    stretches = line.stretches(Course(line.stop(), 0.0, NONE))
    return [stretch._replace(phase=Phase.DECELERATE) for stretch in stretches]


class _ToolMotion(ToolMotion):
    """The spin dies as a turn about its axis and, where its rate points elsewhere, as another about an axis across."""

    def __init__(self, state: ToolState, target: Transform, limits: ToolLimits) -> None:
        self.spin, self.spin_rate = rotated_back(state.pose, state.spin), STILL
        if state.accelerating:
            self.acceleration, self.spin_rate = state.acceleration, rotated_back(state.pose, state.spin_rate)
        super().__init__(state, target, limits, list(spin_turns(self.spin, self.spin_rate)))

    def course(self, least: float) -> Course:
        limits = self.limits
        if self.state.at_rest:
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
        """Return the shortest times found in which velocity and spin end, with their accelerations. Raises NoTimes.

        The first ramp is tried as several parts of the last one: a tool that slows down already needs a short one.
        """
        limits, found = self.limits, list[Change]()
        ramp = max(limits.acceleration / limits.jerk, limits.spin_acceleration / limits.spin_jerk)
        lasting = max(length(self.state.velocity) / limits.acceleration, length(self.spin) / limits.spin_acceleration)
        tip = self.state.velocity, self.acceleration, limits.acceleration * MARGIN, limits.jerk * MARGIN
        spin = self.spin, self.spin_rate, limits.spin_acceleration * MARGIN, limits.spin_jerk * MARGIN
        for rise in RISES:
            times = (rise * ramp, max(lasting - 0.5 * (1.0 + rise) * ramp, 0.0), ramp)
            stretched = (Change(*(up_to_grid(duration * STRETCH**k) for duration in times)) for k in range(*STRETCHES))
            found += islice((change for change in stretched if keeps(change, *tip) and keeps(change, *spin)), 1)
        if not found:
            raise NoTimes("no change of velocity within the limits ends at rest")
        return min(found, key=lambda change: change.lasts)

    def _demands(self, change: Change) -> Bounds:
        """Return the bounds of position and rotation together; the dying spin and the new turn share the angular
        limits.
        """
        _, angle = self.turn(change)
        return both(
            vector_bounds(self.displacement, self.state.velocity, self.acceleration, self.limits, change),
            turn_bounds(angle, change, self.spin, self.spin_rate, self.limits),
        )


def spin_turns(spin: Vector, spin_rate: Vector) -> Iterator[tuple[Vector, float, float]]:
    """Yield the turns by which a spin dies: axis, speed and acceleration at the start."""
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
