"""A timeline as messages for joint_trajectory_controller of ros2_control.

Between two points with positions and velocities the controller goes on the cubic through them, and where both have
accelerations too, on the quintic ("Trajectory Representation" in its documentation). A segment of LSPB or SCURVE in
joint space is a cubic, so points at its boundaries are enough. Straight lines of the tool and segments of a higher
degree get a point every 20 ms. A point has no accelerations where these jump: the splines
beside it are cubics then, as LSPB is.

All is computed from a timeline; nothing here reads a clock or a socket.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from math import ceil, inf
from pathlib import Path
from typing import Any

from msgspec import Struct

from vrs_cli.bodies.scenario import load_toml
from vrs_cli.engine.position import accelerations_at_ends, joint_state_at
from vrs_cli.errors import IllegalValue
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.data_reader import ANGLE, LENGTH, DataReader
from vrs_cli.kinematics.joints import JointKind, Joints
from vrs_cli.trajectory.segment import JointPath, Segment
from vrs_cli.trajectory.timeline import Timeline

LINE_PERIOD = 0.02  # [s] between two points where the path is no cubic
CUBIC = 3
MIN_STEP = 1e-6  # [s] between two points: controllers count nanoseconds, and want times that rise
JUMP = 1e-6  # a difference of accelerations that is none [rad/s2, m/s2]
MIN_LENGTH = 0.5  # [s] that a trajectory lasts, for controllers refuse one that has ended
PAST = 0.05  # [s] a trajectory that is to begin at once is stamped so much before now, so that no clock thinks it waits
MARGIN = 0.2  # [s] a trajectory may come so late
NANOSECONDS = 1_000_000_000


class TrajectoryPoint(Struct, frozen=True):
    """Joints [rad, m], their velocities and accelerations at a time [s] of the robot's clock.

    `acceleration` is empty where it jumps.
    """

    t: float
    joints: Joints
    velocity: Joints
    acceleration: Joints = ()


def trajectory_points(arm: RobotArm, timeline: Timeline, begin: float, horizon: float = inf) -> list[TrajectoryPoint]:
    """Return the points of a timeline from `begin` [s] on until it rests for good, or first rests `horizon` [s] later
    or more: at the boundaries of its segments, and every LINE_PERIOD where a segment is no cubic.

    The first one is at `begin`, the last one rests, at least MIN_LENGTH later.
    """
    state = joint_state_at(arm, timeline, begin)
    points = [TrajectoryPoint(begin, *state)]
    for t, before in _times(arm, timeline, begin):
        if t - points[-1].t >= MIN_STEP:
            joints, velocity, acceleration = joint_state_at(arm, timeline, t)
            continuous = before is None or all(abs(a - b) <= JUMP for a, b in zip(before, acceleration, strict=True))
            points.append(TrajectoryPoint(t, joints, velocity, acceleration if continuous else ()))
            if t >= begin + horizon and not any(velocity):
                break
    last, still = points[-1], (0.0,) * len(state.joints)
    if len(points) > 1:
        points[-1] = TrajectoryPoint(last.t, last.joints, still, last.acceleration and still)
    if last.t < begin + MIN_LENGTH:
        points.append(TrajectoryPoint(begin + MIN_LENGTH, last.joints, still, still))
    return points


def _times(arm: RobotArm, timeline: Timeline, begin: float) -> Iterator[tuple[float, Joints | None]]:
    """Yield the times [s] of the points after `begin`, each with the acceleration just before it; None: as after it."""
    for index in range(timeline.index_at(begin), len(timeline)):
        segment = timeline[index]
        if segment.finish <= begin:
            continue
        if segment.start > begin:
            rests = index == 0 or timeline[index - 1].finish < segment.start
            yield segment.start, (0.0,) * arm.model.joint_count if rests else None
        for t in _inside(segment, begin):
            yield t, None
        yield segment.finish, accelerations_at_ends(arm, segment)[1]


def _inside(segment: Segment, begin: float) -> Iterator[float]:
    if isinstance(segment.path, JointPath) and segment.path.degree <= CUBIC:
        return
    start = max(segment.start, begin)
    parts = ceil((segment.finish - start) / LINE_PERIOD)
    for k in range(1, parts):
        yield start + k * (segment.finish - start) / parts


def standing_points(joints: Joints, begin: float) -> list[TrajectoryPoint]:
    """Return the points of an arm that stays at its joints [rad, m] from `begin` [s] on."""
    still = (0.0,) * len(joints)
    return [TrajectoryPoint(t, joints, still, still) for t in (begin, begin + MIN_LENGTH)]


def trajectory_begins(now: float, cut: float, waiting: float | None, *, replaces: bool) -> list[float]:
    """Return when the trajectories are to begin [s] that make a change of the timeline from `cut` on known.

    `replaces`: whether the controller has `allow_trajectory_replacement`. Then it keeps one trajectory that is stamped
    in the future until its time, and `waiting` is when that begins. A newer one takes its place, but one that begins at
    once does not; so where time is short, one begins at once, and another one takes the place of that which waits.
    Without it, a trajectory takes the place of the other at once, whatever its stamp: it has to begin now.
    """
    if not replaces:
        return [now - PAST]
    if waiting is None or waiting <= now:
        return [max(cut, now - PAST)]
    begin = min(cut, waiting)
    return [begin] if begin > now + MARGIN else [now - PAST, waiting]


# --- names and signs of joints -------------------------------------------------------------------------------------


class RosJoint(Struct, frozen=True):
    """A joint as ROS has it: its value there is `sign` times the robot's, plus `offset` [rad, m]."""

    name: str
    sign: int = 1
    offset: float = 0.0


def read_joints(text: str | None, kinds: Sequence[JointKind]) -> tuple[RosJoint, ...]:
    """Return the joints that `--joints` says: names with commas between, or a file NAME.toml; without it joint_1,
    joint_2 and so on. Raises IllegalValue if they are not one for each joint, and for files FileError.
    """
    if text is None:
        found = tuple(RosJoint(f"joint_{number}") for number in range(1, len(kinds) + 1))
    elif text.endswith(".toml"):
        found = _load_joints(Path(text), kinds)
    else:
        found = tuple(RosJoint(name.strip()) for name in text.split(","))
    names = [one.name for one in found]
    if len(found) != len(kinds) or len(set(names)) != len(names) or not all(names):
        raise IllegalValue(f"joints {', '.join(names)}", f"{len(kinds)} different names, one for each joint")
    return found


def _load_joints(path: Path, kinds: Sequence[JointKind]) -> tuple[RosJoint, ...]:
    """Read a file of joints: for each joint, in their order, a table [[joint]] with name, sign and offset [deg, mm]."""
    reader = DataReader(str(path), human=True)
    rows = reader.table(load_toml(path, "a file of joints"), "the file", ["joint"])["joint"]
    if not isinstance(rows, list) or len(rows) != len(kinds):
        raise reader.wrong("joint", f"is not a list of {len(kinds)} tables", "write [[joint]] for each joint")
    found = list[RosJoint]()
    for number, (row, kind) in enumerate(zip(rows, kinds, strict=True), 1):
        key = f"joint {number}"
        table = reader.table(row, key, ["name"], ["sign", "offset"])
        sign = table.get("sign", 1)
        if isinstance(sign, bool) or sign not in (1, -1):
            raise reader.wrong(f"{key} sign", "is another", "give 1 or -1")
        quantity = ANGLE if kind is JointKind.REVOLUTE else LENGTH
        offset = reader.number(table.get("offset", 0.0), f"{key} offset", quantity)
        found.append(RosJoint(reader.word(table["name"], f"{key} name"), 1 if sign == 1 else -1, offset))
    return tuple(found)


# --- messages ------------------------------------------------------------------------------------------------------


def trajectory_message(
    points: Sequence[TrajectoryPoint], joints: Sequence[RosJoint], offset: float | None, begin: float | None = None
) -> Mapping[str, Any]:
    """Return a trajectory_msgs/msg/JointTrajectory as JSON has it.

    `begin`: the time [s] of its stamp, that of the first point if it is left out. If it is earlier, the controller goes
    by a spline from where it is then to the first point. `offset` [s]: the clock of ROS minus the robot's; None for no
    stamp: the trajectory begins when it comes.
    """
    first = points[0].t if begin is None else begin
    return {
        "header": {"stamp": ros_time(0.0 if offset is None else first + offset), "frame_id": ""},
        "joint_names": [one.name for one in joints],
        "points": [
            {
                "positions": [one.sign * q + one.offset for one, q in zip(joints, point.joints, strict=True)],
                "velocities": _with_signs(joints, point.velocity),
                "accelerations": _with_signs(joints, point.acceleration),
                "effort": [],
                "time_from_start": ros_time(point.t - first),
            }
            for point in points
        ],
    }


def _with_signs(joints: Sequence[RosJoint], values: Joints) -> list[float]:
    return [one.sign * value for one, value in zip(joints, values, strict=True)] if values else []


def ros_time(t: float) -> Mapping[str, int]:
    """Return a time or duration [s], not negative, as builtin_interfaces has it."""
    seconds, nanoseconds = divmod(round(t * NANOSECONDS), NANOSECONDS)
    return {"sec": seconds, "nanosec": nanoseconds}
