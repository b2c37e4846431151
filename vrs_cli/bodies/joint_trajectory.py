"""Convert a timeline to messages for joint_trajectory_controller of ros2_control, without input or output.

Between two points with positions and velocities the controller follows the cubic through them; if both have
accelerations too, the quintic ("Trajectory Representation" in its documentation). A segment of LSPB or SCURVE in joint
space is a cubic, so points at its boundaries suffice. Straight lines of the tool and segments of a higher degree get a
point every 20 ms. Where accelerations jump, a point has no acceleration, so the splines on both sides of it are cubics.
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
from vrs_cli.trajectory.segment import JointPath
from vrs_cli.trajectory.timeline import Timeline

LINE_PERIOD = 0.02  # [s] time between two points where the path is not a cubic
CUBIC = 3
# [s] minimum time between two points, because controllers require increasing times in whole nanoseconds
MIN_STEP = 1e-6
JUMP = 1e-6  # [rad/s2, m/s2] minimum change of an acceleration that counts as a jump
MIN_LENGTH = 0.5  # [s] minimum duration of a trajectory, because controllers refuse one that has already ended
PAST = 0.05  # [s] how far the stamp of an immediate trajectory is in the past, so the controller begins immediately
MARGIN = 0.2  # [s] assumed maximum time until a sent trajectory arrives
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
    """Return the points of a timeline from `begin` [s] until its end, or until a rest at least `horizon` [s] later.

    There are points at the boundaries of segments, and every LINE_PERIOD in segments that are not cubics. The first
    point is at `begin`; the last one is at rest, at least MIN_LENGTH later.
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
    """Yield the times of the points after `begin` [s], each with the acceleration just before this time; None where the
    acceleration cannot jump."""
    for index in range(timeline.index_at(begin), len(timeline)):
        segment = timeline[index]
        if segment.finish <= begin:
            continue
        if segment.start > begin:
            rests = index == 0 or timeline[index - 1].finish < segment.start
            yield segment.start, (0.0,) * arm.model.joint_count if rests else None
        if not isinstance(segment.path, JointPath) or segment.path.degree > CUBIC:
            start = max(segment.start, begin)
            parts = ceil((segment.finish - start) / LINE_PERIOD)
            for k in range(1, parts):
                yield start + k * (segment.finish - start) / parts, None
        yield segment.finish, accelerations_at_ends(arm, segment)[1]


def standing_points(joints: Joints, begin: float) -> list[TrajectoryPoint]:
    """Return the points of an arm that stays at its joints [rad, m], beginning at `begin` [s]."""
    still = (0.0,) * len(joints)
    return [TrajectoryPoint(t, joints, still, still) for t in (begin, begin + MIN_LENGTH)]


def trajectory_begins(now: float, cut: float, waiting: float | None, *, replaces: bool) -> list[float]:
    """Return the start times [s] of the trajectories that tell a controller about a change of the timeline at `cut`
    [s].

    `replaces`: the controller has `allow_trajectory_replacement`. Then it keeps one trajectory with a future stamp
    until this time; `waiting` is its start time. A newer trajectory with a future stamp replaces the waiting one; an
    immediate trajectory does not. So if time is short, one trajectory starts immediately, and a second one replaces the
    waiting one. Without the setting each trajectory replaces the last one immediately, whatever its stamp, so it has to
    start now.
    """
    if not replaces:
        return [now - PAST]
    if waiting is None or waiting <= now:
        return [max(cut, now - PAST)]
    begin = min(cut, waiting)
    return [begin] if begin > now + MARGIN else [now - PAST, waiting]


# --- names and signs of joints -------------------------------------------------------------------------------------


class RosJoint(Struct, frozen=True):
    """A joint of ROS: its value is `sign` times the robot's, plus `offset` [rad, m]."""

    name: str
    sign: int = 1
    offset: float = 0.0


def read_joints(text: str | None, kinds: Sequence[JointKind]) -> tuple[RosJoint, ...]:
    """Read the option `--joints`: names separated by commas, or a file NAME.toml; None: joint_1, joint_2 and so on.
    Raises IllegalValue if there is not one name for each joint, and FileError for files."""
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
    """Read a file of joints: one table [[joint]] per joint, in order, with name, sign and offset [deg, mm]."""
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
    """Return a trajectory_msgs/msg/JointTrajectory as JSON values. `begin`: the time of its stamp [s]; None: the time
    of the first point. If the stamp is earlier than the first point, the controller follows a spline from its state at
    the stamp to the first point. `offset` [s]: the clock of ROS minus the robot's clock; None: no stamp, so the
    trajectory starts on arrival."""
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
    """Convert a time or duration [s], not negative, to builtin_interfaces/msg/Time."""
    seconds, nanoseconds = divmod(round(t * NANOSECONDS), NANOSECONDS)
    return {"sec": seconds, "nanosec": nanoseconds}
