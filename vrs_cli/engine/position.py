"""The current position function g: where the robot is at any time, past or future.

g(theta; tau[k], t). A single time is evaluated in plain floats (bisection and Horner), many times with arrays.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from math import inf
from typing import TYPE_CHECKING, Protocol, TypeVar

from msgspec import Struct, structs

from vrs_cli.engine.problem import joint_acceleration, joint_velocity, segment_joints
from vrs_cli.errors import StraightLineSingular
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.transform import Transform, compose, inverse, rotate
from vrs_cli.trajectory.polynomial import Polynomial, derivative
from vrs_cli.trajectory.rope import RowPart
from vrs_cli.trajectory.row import BlockTable
from vrs_cli.trajectory.segment import CartesianPath, JointPath, Phase, Segment
from vrs_cli.trajectory.state import JointState
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.commands import HAND, Frames
from vrs_cli.values.results import Position

if TYPE_CHECKING:
    from vrs_cli.kinematics.arrays import Flags, Floats, Rows

TWIST_LENGTH = 6  # number of components of a twist
POSES_AT_ONCE = 2048  # number of poses computed at once, so that they stay in the processor's cache
SINGULAR_RATE = 1.5  # factor on a joint's velocity limit that no motion reaches


class Watched(Protocol):
    """A robot whose position can be read while other threads move it, since a timeline never changes."""

    @property
    def arm(self) -> RobotArm: ...
    @property
    def timeline(self) -> Timeline: ...
    @property
    def now(self) -> float: ...


class PlaceArrays(Struct, frozen=True):
    """Where the robot is at N times: (N,) [s], joints (N, n) [rad], T_world_tool (N, 3, 4) [m], hand (N,), 1 open."""

    times: Floats
    joints: Floats
    T_world_tool: Floats
    hand: Floats


class PositionArrays(PlaceArrays, frozen=True):
    """Places with the velocity [rad/s] and acceleration [rad/s2] of the joints, (N, n) each."""

    velocity: Floats
    acceleration: Floats


Sampled = TypeVar("Sampled", bound=PlaceArrays)


def joints_at(arm: RobotArm, timeline: Timeline, t: float) -> Joints:
    """Return the joints at time t [rad]."""
    path, s = timeline.path_at(t)
    return path.joints(s) if isinstance(path, JointPath) else segment_joints(arm, *timeline.locate(t))


def position_at(arm: RobotArm, timeline: Timeline, t: float) -> Position:
    """Return the robot's position at time t [s]. In gaps, before the first segment and after the last it stands still.

    On a boundary the velocity and acceleration are those of the segment that begins.
    """
    segment, s = timeline.locate(t)
    joints = segment_joints(arm, segment, s)
    moving = _moves(timeline, segment, t)
    velocity, acceleration = rates_in(arm, segment, s, joints) if moving else ((0.0,) * len(joints),) * 2
    pose = world_pose(arm, segment.motion.frames, joints)
    hand = timeline.value_at(HAND, t)
    return Position(t, joints, velocity, acceleration, pose, hand, moving, segment.motion.text)


def joint_state_at(arm: RobotArm, timeline: Timeline, t: float) -> JointState:
    """Return only the joints of `position_at` and their rates [rad, m], for controllers that call often."""
    segment, s = timeline.locate(t)
    joints = segment_joints(arm, segment, s)
    if _moves(timeline, segment, t):
        return JointState(joints, *rates_in(arm, segment, s, joints))
    still = (0.0,) * len(joints)
    return JointState(joints, still, still)


def _moves(timeline: Timeline, segment: Segment, t: float) -> bool:
    return segment.phase is not Phase.REST and t < timeline[timeline.index_at(t)].finish


def destination_at(arm: RobotArm, timeline: Timeline, t: float) -> Position:
    """Return the end position of the motion under way at t [s], or the position of a standing robot."""
    return position_at(arm, timeline, finish_after(timeline, t))


def finish_after(timeline: Timeline, t: float) -> float:
    """Return when the motion under way at t [s] ends, or when the last motion ended."""
    index = timeline.index_at(t)
    segment = timeline[index]
    number = segment.motion.number
    while index + 1 < len(timeline) and (after := timeline[index + 1]).motion.number == number:
        index, segment = index + 1, after
    return segment.finish


def start_before(timeline: Timeline, t: float) -> float:
    """Return when the motion under way at t [s] began."""
    index = timeline.index_at(t)
    number = timeline[index].motion.number
    while index and timeline[index - 1].motion.number == number:
        index -= 1
    return timeline[index].start


def world_pose(arm: RobotArm, frames: Frames, joints: Joints) -> Transform:
    """Return T_world_tool of joints, with BASE and TOOL."""
    return compose(inverse(frames.base), compose(arm.forward(joints), frames.tool))


def rates_in(arm: RobotArm, segment: Segment, s: float, joints: Joints) -> tuple[Joints, Joints]:
    """Return joint velocity and acceleration inside a segment; zero where a straight line begins or ends at rest."""
    path = segment.path
    if isinstance(path, JointPath):
        return path.velocity(s), path.acceleration(s)
    tool = segment.motion.frames.tool
    still = velocity = (0.0,) * len(joints)
    try:
        twist = path.twist(s)
        if any(twist):
            velocity = joint_velocity(arm, path, s, joints, twist, tool)
        return velocity, joint_acceleration(arm, path, s, joints, velocity, tool)
    except StraightLineSingular:  # rates are not defined where a line begins or ends at rest in a singular pose
        return velocity, still


def accelerations_at_ends(arm: RobotArm, segment: Segment) -> tuple[Joints, Joints]:
    """Return the joint accelerations [rad/s2] with which a segment begins and ends."""
    if isinstance(segment.path, JointPath):
        return segment.path.acceleration(0.0), segment.path.acceleration(segment.duration)
    ends = ((s, segment_joints(arm, segment, s)) for s in (0.0, segment.duration))
    begin, end = (rates_in(arm, segment, s, joints)[1] for s, joints in ends)
    return begin, end


# --- many times ------------------------------------------------------------------------------------------------


def joints_over(arm: RobotArm, timeline: Timeline, times: Floats) -> Floats:
    """Return the joints at times (N,) [s], in any order: (N, n) [rad]. Sorted times are fastest."""
    import numpy as np

    times, back = _in_order(times)
    found = np.empty((len(times), arm.model.joint_count))
    for block, rows in _blocks(timeline, times):
        table, part = block.table()
        places, s = table.locate(times[rows], block.offset, part)
        _joints(arm, table, places, s, found[rows])
    return found if back is None else found[back]


def _in_order(times: Floats) -> tuple[Floats, Rows | None]:
    """Sort times; return them, and for each original time its index among them (None if the times were sorted)."""
    import numpy as np

    times = np.asarray(times, dtype=float)
    if len(times) < 2 or (times[1:] >= times[:-1]).all():
        return times, None
    order = times.argsort(kind="stable")
    back = np.empty_like(order)
    back[order] = np.arange(len(order))
    return times[order], back


def _blocks(timeline: Timeline, times: Floats) -> Iterator[tuple[RowPart, slice]]:
    """Yield the blocks in which sorted times (N,) lie, each with the slice of times in it."""
    import numpy as np

    found = list(timeline.blocks(float(times[0]), float(times[-1]))) if len(times) else []
    cuts = [0, *np.searchsorted(times, [block.begin for block in found[1:]], side="left"), len(times)]
    for block, (first, last) in zip(found, pairwise(cuts), strict=False):
        if first < last:
            yield block, slice(first, last)


def _joints(arm: RobotArm, table: BlockTable, places: Rows, s: Floats, out: Floats) -> None:
    """Store in `out` the joints (N, n) at `s` seconds (N,) into the segments at `places` (N,), which are in order of
    time.
    """
    table.joints(places, s, out)
    if table.straight.any():
        for place, rows in _runs(places):
            if table.straight[place]:
                out[rows] = _joints_on_line(arm, table.segment(place), s[rows])


def _runs(places: Rows) -> Iterator[tuple[int, slice]]:
    """Yield each run of equal places, with its slice."""
    import numpy as np

    cuts = [0, *(np.flatnonzero(np.diff(places)) + 1), len(places)]
    for first, last in pairwise(cuts):
        yield int(places[first]), slice(first, last)


def _joints_on_line(arm: RobotArm, segment: Segment, s: Floats) -> Floats:
    """Return `segment_joints` for many times (N,): (N, n)."""
    import numpy as np

    path = segment.path
    assert not isinstance(path, JointPath)
    nearest = np.clip(np.rint(s / path.seed_interval), 0, len(path.seeds) - 1).astype(np.intp)
    seeds = np.array(path.seeds)[nearest]
    tool = segment.motion.frames.tool
    poses = flange_poses(path, s, tool)
    if path.guides:
        q = arm.batch.solve_guided(
            poses, seeds, np.array([guide.weights for guide in path.guides]), guide_values(path, s)
        )
    else:
        q = arm.holding(tool).batch.inverse_branch(poses, path.configuration, seeds)
    for row in np.flatnonzero(np.isnan(q).any(axis=1)):  # a search of many poses may end sooner than of one
        q[row] = segment_joints(arm, segment, float(s[row]))
    return q


def places_at(arm: RobotArm, timeline: Timeline, times: Floats) -> PlaceArrays:
    """Return `positions_at` without the rates, which are the most expensive part on straight lines."""
    return _sample_at(arm, timeline, times, PlaceArrays)


def positions_at(arm: RobotArm, timeline: Timeline, times: Floats) -> PositionArrays:
    """Return g for times (N,) [s], in any order. Sorted times are fastest."""
    return _sample_at(arm, timeline, times, PositionArrays)


def fill(found: PositionArrays, at: Flags, rows: Sequence[Position]) -> None:
    """Store positions that were computed one by one in the rows `at`."""
    import numpy as np

    for name in ("joints", "velocity", "acceleration", "hand"):
        getattr(found, name)[at] = [getattr(row, name) for row in rows]
    found.T_world_tool[at] = np.reshape([row.T_world_tool for row in rows], (-1, 3, 4))


def poses_along(arm: RobotArm, timeline: Timeline, times: Floats, joints: Floats) -> PlaceArrays:
    """Return the places of given joints (N, n) at sorted times (N,) [s], with BASE and TOOL of the timeline."""
    return _sample_at(arm, timeline, times, PlaceArrays, joints)


def _sample_at(
    arm: RobotArm, timeline: Timeline, times: Floats, kind: type[Sampled], joints: Floats | None = None
) -> Sampled:
    """Return places, or positions, at times (N,) [s]; `joints`: joints to use instead of those of the timeline."""
    import numpy as np

    from vrs_cli.kinematics.arrays import compose_batch, stack

    times, back = _in_order(times)
    n = arm.model.joint_count
    shapes = {"joints": (n,), "T_world_tool": (3, 4), "hand": (), "velocity": (n,), "acceleration": (n,)}
    found = kind(times, *(np.zeros((len(times), *shapes[name])) for name in kind.__struct_fields__[1:]))
    frames: dict[Frames, int] = {}
    which = np.zeros(len(times), dtype=np.intp)  # the number of the frames at each time
    for block, rows in _blocks(timeline, times):
        q, (table, part) = found.joints[rows], block.table()
        places, s = table.locate(times[rows], block.offset, part)
        _joints(arm, table, places, s, q)
        if isinstance(found, PositionArrays):
            begun, rates = times[rows] >= table.starts[places] + block.offset, (found.velocity, found.acceleration)
            moving = begun & (s < table.durations[places]) & ~table.resting[places]
            _fill_rates(arm, table, places, s, moving, q, (rates[0][rows], rates[1][rows]))
        numbers = [frames.setdefault(one, len(frames)) for one in table.frames]
        which[rows] = numbers[0] if len(numbers) == 1 else np.take(numbers, table.frame_number[places])
    if joints is not None:
        found.joints[:] = joints
    changes = list(timeline.changes(HAND)) if timeline.event_count else []
    if changes:
        begins, openings = zip((-inf, 0.0), *changes, strict=True)
        found.hand[:] = np.array(openings)[np.searchsorted(begins, times, side="right") - 1]
    for one, number in frames.items():  # each computes many poses at once
        T_world_robot, T_flange_tool = stack([inverse(one.base), one.tool])
        rows_of_frame = np.flatnonzero(which == number)
        for chunk in np.split(rows_of_frame, range(POSES_AT_ONCE, len(rows_of_frame), POSES_AT_ONCE)):
            T_world_flange = compose_batch(T_world_robot, arm.batch.forward(found.joints[chunk]))
            found.T_world_tool[chunk] = compose_batch(T_world_flange, T_flange_tool)
    return found if back is None else kind(*(column[back] for column in structs.astuple(found)))


def _fill_rates(
    arm: RobotArm, table: BlockTable, places: Rows, s: Floats, moving: Flags, q: Floats, out: tuple[Floats, Floats]
) -> None:
    """Compute velocity and acceleration where the robot moves; `places`, `s`, `moving` (N,), `q` and `out` (N, n)."""
    import numpy as np

    qd, qdd = out
    qd[moving], qdd[moving] = table.rates(places[moving], s[moving])
    alone = table.straight[places] & moving
    # the rates of a line are the unique solution of six equations; they are solved for many times at once
    at_once = arm.steady is None and arm.model.joint_count == TWIST_LENGTH and all(arm.model.counts)
    for place, rows in _runs(places) if at_once and alone.any() else ():
        these = rows.start + np.flatnonzero(alone[rows])
        if len(these):
            qd[these], qdd[these], alone[these] = _rates_on_line(arm, table.segment(place), s[these], q[these])
    for row in np.flatnonzero(alone):
        segment = table.segment(places[row])
        qd[row], qdd[row] = rates_in(arm, segment, float(s[row]), tuple(q[row].tolist()))


def _rates_on_line(arm: RobotArm, segment: Segment, s: Floats, q: Floats) -> tuple[Floats, Floats, Flags]:
    """Return velocity and acceleration along a straight line (N, n), and the rows (N,) that `rates_in` must compute one
    by one.

    These are all rows of a line with several turns, and rows whose joints are so fast that the pose is nearly singular.
    """
    import numpy as np

    path = segment.path
    assert not isinstance(path, JointPath)
    alone = np.ones(len(s), dtype=np.bool_)
    if len(path.turns) > 1:
        return q, q, alone
    try:
        qd, qdd = arm.batch.rates(q, *twists(path, s), segment.motion.frames.tool)
    except np.linalg.LinAlgError:
        return q, q, alone
    fast = np.abs(qd) > SINGULAR_RATE * np.array(arm.model.max_velocity)
    steep = np.abs(qdd) > SINGULAR_RATE * np.array(arm.model.max_acceleration)
    return qd, qdd, np.asarray((fast | steep).any(axis=1))


def flange_poses(path: CartesianPath, s: Floats, T_flange_tool: Transform) -> Floats:
    """Return T_robot_flange (N, 3, 4) at times (N,) [s] of a path of the tool."""
    import numpy as np
    from numpy.polynomial.polynomial import polyval

    from vrs_cli.kinematics.arrays import compose_batch, rotation_about_batch, stack

    position = np.stack([polyval(s, a) for a in path.position], axis=-1)
    (R,) = stack([path.orientation])[:, :, :3]
    for turn in path.turns:
        angle = polyval(s, turn.angle).astype(float)
        R = R @ rotation_about_batch(np.array(turn.axis), angle)
    T_robot_tool = np.concatenate((np.broadcast_to(R, (len(s), 3, 3)), position[:, :, None]), axis=2)
    (T_tool_flange,) = stack([inverse(T_flange_tool)])
    return compose_batch(T_robot_tool, T_tool_flange)


def twists(path: CartesianPath, s: Floats) -> tuple[Floats, Floats]:
    """Return `CartesianPath.twist` and `twist_rate` at times (N,), (N, 6) each, of a path with at most one turn."""
    import numpy as np

    twist, change = np.zeros((len(s), 6)), np.zeros((len(s), 6))
    for i, a in enumerate(path.position):
        _, twist[:, i], change[:, i] = _derivatives(a, s)
    for turn in path.turns:
        axis = np.array(rotate(path.orientation, turn.axis))
        _, rate, second = _derivatives(turn.angle, s)
        twist[:, 3:], change[:, 3:] = rate[:, None] * axis, second[:, None] * axis
    return twist, change


def _derivatives(a: Polynomial, s: Floats) -> list[Floats]:
    """Return p, dp/dt and d2p/dt2 at times (N,)."""
    import numpy as np
    from numpy.polynomial.polynomial import polyval

    first = derivative(a)
    return [np.asarray(polyval(s, one), dtype=float) for one in (a, first, derivative(first))]


def guide_values(path: CartesianPath, s: Floats) -> Floats:
    """Return the values of a path's guides at times (N,): (N, r)."""
    import numpy as np
    from numpy.polynomial.polynomial import polyval

    values = np.empty((len(s), len(path.guides)))
    for r, guide in enumerate(path.guides):
        values[:, r] = polyval(s, guide.value)
    return values
