"""Define the state of the robot on a segment, and the planner's problem: a motion that starts in such a state.

The module also computes the joints, with their velocities, accelerations and jerks, that follow the path of a tool. If
the turn of the flange about its own axis a is free (`ArmTask.POINTING`), the path does not prescribe it: the arm turns
faster than the path by psi'. With the angular velocity w of the path and a' = w x a:

    w_arm   = w   + psi' a
    w_arm'  = w'  + psi' a'                + psi'' a
    w_arm'' = w'' + psi' a'' + 2 psi'' a'  + psi''' a

The components along a are free. The joints must produce the other components.
"""

from __future__ import annotations

from collections.abc import Callable
from math import inf

from msgspec import Struct

from vrs_cli.errors import PathWithoutJoints
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.joints import Joints, Twist
from vrs_cli.kinematics.model import ArmTask
from vrs_cli.kinematics.transform import (
    Transform,
    Vector,
    compose,
    cross,
    dot,
    inverse,
    scaled_vector,
    vector_difference,
    vector_sum,
)
from vrs_cli.trajectory.laws.law import LAWS
from vrs_cli.trajectory.polynomial import value_and_rate
from vrs_cli.trajectory.segment import STILL, CartesianPath, JointPath, Path, Segment
from vrs_cli.trajectory.state import JointState, ToolState
from vrs_cli.values.commands import Motion, MotionKind

# number of cached states: a plan needs the states at the ends of its segments several times
MAX_REMEMBERED_STATES = 128
SLOWEST = 20.0  # default of PARAMETER STRETCH: the maximum factor by which a line may be slowed down


class _FreeTurn(Struct, frozen=True):
    """The free turn of a flange about its own axis a: `axis` is a, `axis_rate` its derivative a', `spin` the path's
    angular velocity w [rad/s], and `extra` is psi' [rad/s].
    """

    axis: Vector
    axis_rate: Vector
    spin: Vector
    extra: float


def joints_on(arm: RobotArm, path: CartesianPath, s: float, T_robot_flange: Transform, near: Joints) -> Joints | None:
    """Return the joints [rad] nearest to `near` at s seconds into a path, where the flange has the given pose; None if
    the pose is out of reach.
    """
    if path.guides:
        return arm.guided_joints(T_robot_flange, near, path.demands(s))
    return arm.branch_joints(T_robot_flange, path.configuration, near)


def state_on(
    arm: RobotArm, path: CartesianPath, s: float, tool: tuple[Transform, Twist], T_robot_flange: Transform, near: Joints
) -> tuple[Joints, Joints] | None:
    """Return the joints that `joints_on` finds and their velocities [rad/s], solved together. `tool`: pose and twist of
    the tool at that time. None if the arm cannot solve them together, or if the search from `near` does not converge.
    """
    pose, (vx, vy, vz, wx, wy, wz) = tool
    x, y, z = T_robot_flange.px - pose.px, T_robot_flange.py - pose.py, T_robot_flange.pz - pose.pz
    twist = vx + wy * z - wz * y, vy + wz * x - wx * z, vz + wx * y - wy * x, wx, wy, wz
    guided = [value_and_rate(guide.value, s) for guide in path.guides]
    demands = tuple([(guide.weights, value) for guide, (value, _) in zip(path.guides, guided, strict=True)])
    return arm.guided_state(T_robot_flange, near, demands, twist, [rate for _, rate in guided])


def joint_velocity(
    arm: RobotArm, path: CartesianPath, s: float, q: Joints, twist: Twist, T_flange_tool: Transform
) -> Joints:
    """Return the joint velocities [rad/s] at s seconds into a path, for the joints q and the twist of the tool. Raises
    StraightLineSingular.
    """
    if arm.steady is not None:
        return arm.steady.rates_on(q, _flange_poses(path, s, T_flange_tool), twist, T_flange_tool, 1)[0]
    return arm.joint_velocity(q, twist, T_flange_tool, path.demands(s, 1))


def joint_acceleration(
    arm: RobotArm, path: CartesianPath, s: float, q: Joints, qd: Joints, T_flange_tool: Transform
) -> Joints:
    """Return the joint accelerations [rad/s2] at s seconds into a path, for the joints q and their velocities qd.
    Raises StraightLineSingular.
    """
    if arm.steady is not None:
        return arm.steady.rates_on(q, _flange_poses(path, s, T_flange_tool), path.twist(s), T_flange_tool, 2)[1]
    rate = path.twist_rate(s)
    if arm.model.task is ArmTask.POINTING:
        rate = _asked_acceleration(_free_turn(arm, path, s, q, qd), rate)
    return arm.joint_acceleration(q, qd, rate, T_flange_tool, path.demands(s, 2) if path.guides else ())


def joint_acceleration_and_jerk(
    arm: RobotArm, path: CartesianPath, s: float, q: Joints, qd: Joints, T_flange_tool: Transform
) -> tuple[Joints, Joints]:
    """Return the result of `joint_acceleration` and the joint jerks [rad/s3]."""
    if arm.steady is not None:
        poses = _flange_poses(path, s, T_flange_tool)
        _, qdd, jerk = arm.steady.rates_on(q, poses, path.twist(s), T_flange_tool, 3)
        return qdd, jerk
    rate, change = path.twist_rates(s)
    second, third = path.demands(s, 2), path.demands(s, 3)
    if arm.model.task is not ArmTask.POINTING:
        qdd = arm.joint_acceleration(q, qd, rate, T_flange_tool, second)
        return qdd, arm.joint_jerk(q, qd, qdd, change, T_flange_tool, third)
    turn = _free_turn(arm, path, s, q, qd)
    qdd = arm.joint_acceleration(q, qd, _asked_acceleration(turn, rate), T_flange_tool, second)
    spin_rate = vector_sum(arm.twist(q, qdd)[3:], arm.acceleration_bias(q, qd)[3:])
    extra_rate = dot(vector_difference(spin_rate, rate[3:]), turn.axis)
    again = vector_sum(cross(rate[3:], turn.axis), cross(turn.spin, turn.axis_rate))
    more = vector_sum(scaled_vector(again, turn.extra), scaled_vector(turn.axis_rate, 2.0 * extra_rate))
    return qdd, arm.joint_jerk(q, qd, qdd, (*change[:3], *vector_sum(change[3:], more)), T_flange_tool, third)


def _flange_poses(path: CartesianPath, s: float, T_flange_tool: Transform) -> Callable[[float], Transform]:
    """Return a function that maps a time after s [s] to the flange pose that the path requires."""
    T_tool_flange = inverse(T_flange_tool)
    return lambda later: compose(path.pose(s + later), T_tool_flange)


def _free_turn(arm: RobotArm, path: CartesianPath, s: float, q: Joints, qd: Joints) -> _FreeTurn:
    """Return the free turn of the flange: what the arm turns in addition to the path."""
    flange, spin = arm.forward(q), path.twist(s)[3:]
    a = flange.ax, flange.ay, flange.az
    return _FreeTurn(a, cross(spin, a), spin, dot(vector_difference(arm.twist(q, qd)[3:], spin), a))


def _asked_acceleration(turn: _FreeTurn, rate: Twist) -> Twist:
    """Return the rate of a path's twist, with the contribution of the free turn added."""
    return (*rate[:3], *vector_sum(rate[3:], scaled_vector(turn.axis_rate, turn.extra)))


class Here(Struct, frozen=True):
    """The state from which a motion is planned: the positions and velocities of the robot.

    `tool`: the pose T_robot_tool with its velocity, if the robot is on a straight line; its tool is `T_flange_tool`.
    """

    joints: JointState
    tool: ToolState | None = None
    T_flange_tool: Transform | None = None

    def at_rest(self) -> Here:
        """Return the state at the same position, but at rest."""
        joints = JointState(self.joints.joints, (0.0,) * len(self.joints.joints))
        return Here(joints, self.tool and ToolState(self.tool.pose, STILL, STILL), self.T_flange_tool)

    def tool_state(self, arm: RobotArm, T_flange_tool: Transform) -> ToolState:
        """Return the state of the tip of the given tool; if it is not known, it is computed with the Jacobian."""
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
        return ToolState(pose, twist[:3], twist[3:], vector_sum(rates[:3], bias[:3]), vector_sum(rates[3:], bias[3:]))


def segment_joints(arm: RobotArm, segment: Segment, s: float) -> Joints:
    """Return the joints [rad] at s seconds after the start of a segment.

    Raises PathWithoutJoints if no joints reach the pose, which does not occur for segments planned by this program.
    """
    path = segment.path
    return path.joints(s) if isinstance(path, JointPath) else _joints_with(arm, segment, path, s, path.pose(s))


def _joints_with(arm: RobotArm, segment: Segment, path: CartesianPath, s: float, pose: Transform) -> Joints:
    """Return the joints at s seconds after the start of a straight-line segment, where the tool has the given pose."""
    flange = compose(pose, inverse(segment.motion.frames.tool))
    joints = joints_on(arm.for_tool(segment.motion.frames.tool), path, s, flange, path.seed(s))
    if joints is None:
        raise PathWithoutJoints(
            f"{s:.3f} s into {segment.motion.text or 'a motion'}",
            "the file may be damaged, or of a version that made such lines; UNDO the motion, or plan it again",
        )
    return joints


def state_at(arm: RobotArm, segment: Segment, s: float) -> Here:
    """Return position, velocity and acceleration at s seconds after the start of a segment. After the end of a segment
    that ends at rest, return the state at rest.

    The acceleration of a jerk-limited motion is included, since the next motion must continue it. The acceleration of a
    motion with parabolic blends may jump, so it is omitted.
    """
    path, key = segment.path, (id(segment.path), s)
    smoothly, frame = LAWS[segment.motion.profile].smooth, segment.motion.frames.tool
    known = _REMEMBERED_STATES.get(key)
    if known is not None and known[0] is path and known[1:4] == (arm, smoothly, frame):
        return known[4]
    here = _state_at(arm, segment, s, smoothly=smoothly)
    if segment.motion.kind is MotionKind.STEERED:  # the state of a steering tick is needed only once
        return here
    if len(_REMEMBERED_STATES) >= MAX_REMEMBERED_STATES:
        _REMEMBERED_STATES.clear()
    _REMEMBERED_STATES[key] = path, arm, smoothly, frame, here
    return here


def _state_at(arm: RobotArm, segment: Segment, s: float, *, smoothly: bool) -> Here:
    """Compute the state that `state_at` returns and caches."""
    path, frame = segment.path, segment.motion.frames.tool
    if isinstance(path, JointPath):
        return Here(JointState(path.joints(s), path.velocity(s), path.acceleration(s) if smoothly else ()))
    pose, twist = path.states()(s)
    joints = _joints_with(arm, segment, path, s, pose)
    rates = path.twist_rate(s) if smoothly else (0.0,) * 6
    tool = ToolState(pose, twist[:3], twist[3:], rates[:3], rates[3:])
    if tool.at_rest:
        return Here(JointState(joints, (0.0,) * len(joints)), tool, frame)
    velocity = joint_velocity(arm, path, s, joints, twist, frame)
    acceleration = joint_acceleration(arm, path, s, joints, velocity, frame) if smoothly else ()
    return Here(JointState(joints, velocity, acceleration), tool, frame)


def rest_after(arm: RobotArm, segment: Segment) -> Here:
    """Return the state at the end of a segment, at rest."""
    return state_at(arm, segment, segment.duration).at_rest()


class Problem(Struct, frozen=True):
    """A motion to plan: its arm, the state in which it begins, and `begin`, the minimum start time [s].

    A straight line may be slowed down by the factor `slowest`. A motion that would end after `latest` [s] is not
    needed. `deadline` returns a later limit [s], for motions that end after `latest`; the call is slow, because it
    plans a motion.
    """

    arm: RobotArm
    here: Here
    motion: Motion
    begin: float
    slowest: float = SLOWEST
    latest: float = inf
    deadline: Callable[[], float] | None = None

    def check_in_time(self, finish: float) -> None:
        """Raise NotInTime if a motion that ends at this time [s] is not needed."""
        if finish > self.latest and (self.deadline is None or finish > self.deadline()):
            raise NotInTime

    @property
    def tool(self) -> ToolState:
        """The state of the tip of the motion's tool."""
        return self.here.tool_state(self.arm, self.motion.frames.tool)


_REMEMBERED_STATES: dict[tuple[int, float], tuple[Path, RobotArm, bool, Transform, Here]] = {}  # keyed by path and time


class NoWay(Exception):
    """The motion cannot start with the current velocities of the joints."""


class NotInTime(Exception):
    """A motion would end after the `latest` time of the problem."""


class NoRoomToStop(Exception):
    """Braking cannot keep every joint in its range, so the interrupted motion must continue."""
