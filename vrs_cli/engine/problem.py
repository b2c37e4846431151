"""What is to be planned: a motion out of a state of the robot."""

from __future__ import annotations

from math import inf

from msgspec import Struct

from vrs_cli.engine.rates import joint_acceleration, joint_velocity, joints_on
from vrs_cli.errors import PathWithoutJoints
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.transform import Transform, added, compose, inverse
from vrs_cli.trajectory.laws.table import LAWS
from vrs_cli.trajectory.segment import STILL, JointPath, Segment
from vrs_cli.trajectory.state import JointState, ToolState
from vrs_cli.values.motion import Motion

SLOWEST = 20.0  # a line is slowed down at most so many times, unless PARAMETER STRETCH says otherwise


class Here(Struct, frozen=True):
    """Where the robot is and how it moves: the state from which a motion is planned.

    `tool` is T_robot_tool with its velocity, known when the robot is on a straight line, for the TOOL `T_flange_tool`.
    """

    joints: JointState
    tool: ToolState | None = None
    T_flange_tool: Transform | None = None

    def standing(self) -> Here:
        """The same place, at rest."""
        joints = JointState(self.joints.joints, (0.0,) * len(self.joints.joints))
        return Here(joints, self.tool and ToolState(self.tool.pose, STILL, STILL), self.T_flange_tool)

    def tool_state(self, arm: RobotArm, T_flange_tool: Transform) -> ToolState:
        """The state of the tip of a tool; by the Jacobian when it is not known."""
        if self.tool is not None and self.T_flange_tool == T_flange_tool:
            return self.tool
        q, qd = self.joints.joints, self.joints.velocity
        pose = compose(arm.forward(q), T_flange_tool)
        if self.joints.at_rest:
            return ToolState(pose, STILL, STILL)
        twist = arm.twist(q, qd, T_flange_tool)
        if not self.joints.acceleration:
            return ToolState(pose, twist[:3], twist[3:])
        rates, bias = arm.twist(q, self.joints.acceleration, T_flange_tool), arm.acceleration_bias(q, qd, T_flange_tool)
        return ToolState(pose, twist[:3], twist[3:], added(rates[:3], bias[:3]), added(rates[3:], bias[3:]))


def segment_joints(arm: RobotArm, segment: Segment, s: float) -> Joints:
    """Joints at t_s + s of a segment [rad].

    Raises PathWithoutJoints where none lead to the pose: never for what was planned, for that was decided before.
    """
    path = segment.path
    if isinstance(path, JointPath):
        return path.joints(s)
    flange = compose(path.pose(s), inverse(segment.motion.frames.tool))
    joints = joints_on(arm.holding(segment.motion.frames.tool), path, s, flange, path.seed(s))
    if joints is None:
        raise PathWithoutJoints(
            f"{s:.3f} s into {segment.motion.text or 'a motion'}",
            "the file may be damaged, or of a version that made such lines; UNDO the motion, or plan it again",
        )
    return joints


def state_at(arm: RobotArm, segment: Segment, s: float) -> Here:
    """Position, velocity and acceleration at t_s + s of a segment; at rest from its end on if it ends at rest.

    The acceleration is that of a jerk-limited motion, for the next one to carry on with. That of a motion with
    parabolic blends may jump, so it is not kept.
    """
    path = segment.path
    joints = segment_joints(arm, segment, s)
    smoothly = LAWS[segment.motion.profile].smooth
    if isinstance(path, JointPath):
        return Here(JointState(joints, path.velocity(s), path.acceleration(s) if smoothly else ()))
    (pose, twist), frame = path.state(s), segment.motion.frames.tool
    rates = path.twist_rate(s) if smoothly else (0.0,) * 6
    tool = ToolState(pose, twist[:3], twist[3:], rates[:3], rates[3:])
    if tool.at_rest:
        return Here(JointState(joints, (0.0,) * len(joints)), tool, frame)
    velocity = joint_velocity(arm, path, s, joints, twist, frame)
    acceleration = joint_acceleration(arm, path, s, joints, velocity, frame) if smoothly else ()
    return Here(JointState(joints, velocity, acceleration), tool, frame)


def rest_after(arm: RobotArm, segment: Segment) -> Here:
    """The place where a segment ends, at rest."""
    return state_at(arm, segment, segment.duration).standing()


class Problem(Struct, frozen=True):
    """A motion to plan: of which arm, out of which state, and from when on [s].

    A straight line may be slowed down `slowest` times; one that would end after `latest` [s] is of no use.
    """

    arm: RobotArm
    here: Here
    motion: Motion
    begin: float
    slowest: float = SLOWEST
    latest: float = inf

    @property
    def tool(self) -> ToolState:
        """The state of the tip of the motion's tool."""
        return self.here.tool_state(self.arm, self.motion.frames.tool)


class NoWay(Exception):
    """A motion has no way that begins with the velocities that there are."""


class NotInTime(Exception):
    """A motion would end after the time that its problem names."""


class NoRoomToStop(Exception):
    """No way of braking keeps every joint in its range: the motion that is interrupted has to go on."""
