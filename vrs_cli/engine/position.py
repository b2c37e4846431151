"""The current position function g: where the robot is at any time, past or future.

g(theta; tau[k], t). One time in plain floats (bisection and Horner), many times with arrays.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

from vrs_cli.engine.planner import segment_joints
from vrs_cli.errors import StraightLineSingular
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.transform import Transform, compose, inverse
from vrs_cli.trajectory.motion import Motion
from vrs_cli.trajectory.segment import JointPath, Phase, Segment
from vrs_cli.trajectory.timeline import Timeline

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Position:
    """The robot at one time: joints [rad], their velocity [rad/s] and acceleration [rad/s2], T_world_tool [m].

    `hand` is 1 open, 0 closed. `motion` is the one in force (the last one, while the robot stands).
    """

    time: float
    joints: Joints
    velocity: Joints
    acceleration: Joints
    T_world_tool: Transform
    hand: float
    moving: bool
    motion: Motion


@dataclass(frozen=True, slots=True)
class Positions:
    """The robot at N times: (N,) [s], joints and their derivatives (N, n) [rad], T_world_tool (N, 3, 4), hand (N,)."""

    times: Floats
    joints: Floats
    velocity: Floats
    acceleration: Floats
    T_world_tool: Floats
    hand: Floats


def joints_at(arm: RobotArm, timeline: Timeline, t: float) -> Joints:
    """The joints at time t [rad]."""
    segment, s = timeline.locate(t)
    path = segment.path
    if path.__class__ is JointPath:
        return path.joints(s)
    return segment_joints(arm, segment, s)


def position_at(arm: RobotArm, timeline: Timeline, t: float) -> Position:
    """Everything about the robot at time t [s]. In gaps, before the first segment and after the last it stands still.

    On a boundary the velocity and acceleration are those of the segment that begins.
    """
    segment, s = timeline.locate(t)
    joints = segment_joints(arm, segment, s)
    still = (0.0,) * len(joints)
    moving = segment.phase is not Phase.REST and t < timeline[timeline.index_at(t)].finish
    velocity, acceleration = _rates(arm, segment, s, joints) if moving else (still, still)
    pose = world_pose(arm, segment.motion, joints)
    return Position(t, joints, velocity, acceleration, pose, segment.motion.hand, moving, segment.motion)


def world_pose(arm: RobotArm, motion: Motion, joints: Joints) -> Transform:
    """T_world_tool, with the BASE and TOOL of a motion."""
    frames = motion.frames
    return compose(inverse(frames.base), compose(arm.forward(joints), frames.tool))


def _rates(arm: RobotArm, segment: Segment, s: float, joints: Joints) -> tuple[Joints, Joints]:
    """Joint velocity and acceleration inside a segment; zero where a straight line begins or ends at rest."""
    path = segment.path
    if isinstance(path, JointPath):
        return path.velocity(s), path.acceleration(s)
    tool = segment.motion.frames.tool
    still = velocity = (0.0,) * len(joints)
    try:
        twist = path.twist(s)
        if any(twist):
            velocity = arm.joint_velocity(joints, twist, tool)
        bias = arm.acceleration_bias(joints, velocity, tool)
        vx, vy, vz, wx, wy, wz = (a - b for a, b in zip(path.twist_rate(s), bias, strict=True))
        return velocity, arm.joint_velocity(joints, (vx, vy, vz, wx, wy, wz), tool)
    except StraightLineSingular:  # only where a line begins or ends at rest in a singular pose: no rate is defined
        return velocity, still


# --- many times ------------------------------------------------------------------------------------------------


def positions_at(arm: RobotArm, timeline: Timeline, times: Floats) -> Positions:
    """g for an array of times (N,) [s], in any order; sorted times are fastest."""
    import numpy as np

    times = np.asarray(times, dtype=float)
    n = arm.model.joint_count
    result = Positions(
        times,
        np.empty((len(times), n)),
        np.zeros((len(times), n)),
        np.zeros((len(times), n)),
        np.empty((len(times), 3, 4)),
        np.empty(len(times)),
    )
    for segment, rows in _groups(timeline, times):
        _fill(arm, segment, rows, result)
    return result


def _groups(timeline: Timeline, times: Floats) -> Iterator[tuple[Segment, NDArray[np.intp]]]:
    """The rows of `times` that fall to each segment."""
    import numpy as np

    order = np.argsort(times, kind="stable")
    ordered = times[order]
    first = 0
    while first < len(ordered):
        index = timeline.index_at(float(ordered[first]))
        last = len(ordered)
        if index + 1 < len(timeline):
            last = max(int(np.searchsorted(ordered, timeline[index + 1].start, side="left")), first + 1)
        yield timeline[index], order[first:last]
        first = last


def _fill(arm: RobotArm, segment: Segment, rows: NDArray[np.intp], out: Positions) -> None:
    import numpy as np

    from vrs_cli.kinematics import transform_batch as batch

    frames = segment.motion.frames
    s = np.clip(out.times[rows] - segment.start, 0.0, segment.duration)
    path = segment.path
    if isinstance(path, JointPath):
        q, qd, qdd = _joint_rows(path, s)
    else:
        q, qd, qdd = _cartesian_rows(arm, segment, s)
    moving = ((out.times[rows] < segment.finish) & (out.times[rows] >= segment.start))[:, None]
    out.joints[rows] = q
    out.velocity[rows] = np.where(moving, qd, 0.0)
    out.acceleration[rows] = np.where(moving, qdd, 0.0)
    T_world_robot, T_flange_tool = batch.stack([inverse(frames.base), frames.tool])
    T_world_flange = batch.compose_batch(T_world_robot, arm.forward_batch(q))
    out.T_world_tool[rows] = batch.compose_batch(T_world_flange, T_flange_tool)
    out.hand[rows] = segment.motion.hand


def _joint_rows(path: JointPath, s: Floats) -> tuple[Floats, Floats, Floats]:
    import numpy as np

    degree = len(path.coefficients[0])
    a = np.array(path.coefficients)
    powers = np.arange(degree, dtype=float)
    first = a[:, 1:] * powers[1:]
    second = first[:, 1:] * powers[1:-1]
    return _horner(a, s), _horner(first, s), _horner(second, s)


def _horner(a: Floats, s: Floats) -> Floats:
    """Rows of ascending coefficients (n, k) at (N,) -> (N, n)."""
    import numpy as np

    result = np.zeros((len(s), len(a)))
    for column in a.T[::-1]:
        result = result * s[:, None] + column
    return result


def _cartesian_rows(arm: RobotArm, segment: Segment, s: Floats) -> tuple[Floats, Floats, Floats]:
    """The scalar function row by row: its seeds make every row independent of the others."""
    import numpy as np

    rows = [segment_joints(arm, segment, float(x)) for x in s]
    rates = [_rates(arm, segment, float(x), q) for x, q in zip(s, rows, strict=True)]
    return np.array(rows), np.array([v for v, _ in rates]), np.array([a for _, a in rates])
