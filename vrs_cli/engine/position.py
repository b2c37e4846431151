"""The current position function g: where the robot is at any time, past or future.

g(theta; tau[k], t). One time in plain floats (bisection and Horner), many times with arrays.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

from vrs_cli.engine.planner import segment_joints
from vrs_cli.errors import StraightLineSingular
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.transform import Transform, compose, inverse
from vrs_cli.trajectory.leaf_table import LeafTable, leaf_table
from vrs_cli.trajectory.motion import Motion
from vrs_cli.trajectory.segment import JointPath, Phase, Segment
from vrs_cli.trajectory.timeline import Timeline

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]
    Rows = NDArray[np.intp]


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
    order = np.argsort(times, kind="stable")
    for offset, table, rows in _leaves(timeline, times, order):
        _fill(arm, offset, table, rows, result)
    return result


def _leaves(timeline: Timeline, times: Floats, order: Rows) -> Iterator[tuple[float, LeafTable, Rows]]:
    """The rows of `times`, by `order` in their order, that fall to each leaf of the timeline."""
    import numpy as np

    if not len(times):
        return
    ordered = times[order]
    found = list(timeline.leaves(float(ordered[0]), float(ordered[-1])))
    begins = [offset + leaf.begin for offset, leaf in found]
    cuts = [0, *np.searchsorted(ordered, begins[1:], side="left"), len(ordered)]
    for (offset, leaf), (first, last) in zip(found, pairwise(cuts), strict=True):
        if first < last:
            yield offset, leaf_table(leaf), order[first:last]


def _fill(arm: RobotArm, offset: float, table: LeafTable, rows: Rows, out: Positions) -> None:
    """What the segments of one leaf say of the times in `rows`, which are in order."""
    import numpy as np

    from vrs_cli.kinematics import transform_batch as batch

    local = out.times[rows] - offset
    places = np.clip(np.searchsorted(table.starts, local, side="right") - 1, 0, None)
    since = local - table.starts[places]
    s = np.clip(since, 0.0, table.durations[places])
    q, qd, qdd = table.rates(places, s)
    for row in np.flatnonzero(table.straight[places]):
        segment = table.segments[places[row]]
        joints = segment_joints(arm, segment, float(s[row]))
        q[row] = joints
        qd[row], qdd[row] = _rates(arm, segment, float(s[row]), joints)
    moving = ((since >= 0.0) & (since < table.durations[places]) & ~table.resting[places])[:, None]
    out.joints[rows] = q
    out.velocity[rows] = np.where(moving, qd, 0.0)
    out.acceleration[rows] = np.where(moving, qdd, 0.0)
    out.hand[rows] = table.hand[places]
    T_robot_flange = arm.forward_batch(q)
    for number, frames in enumerate(table.frames):
        with_these = table.frame_number[places] == number
        T_world_robot, T_flange_tool = batch.stack([inverse(frames.base), frames.tool])
        T_world_flange = batch.compose_batch(T_world_robot, T_robot_flange[with_these])
        out.T_world_tool[rows[with_these]] = batch.compose_batch(T_world_flange, T_flange_tool)
