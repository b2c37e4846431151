"""The current position function g(theta; tau[k], t): where the robot is at any time t, past or future.

A single time is evaluated in plain floats (bisection and Horner's rule), many times together with arrays.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from math import inf
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

from msgspec import Struct, structs

from vrs_cli.engine.problem import joint_acceleration, joint_velocity, segment_joints
from vrs_cli.errors import StraightLineSingular
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.transform import IDENTITY, Transform, compose, inverse, rotate
from vrs_cli.trajectory.polynomial import Polynomial, derivative
from vrs_cli.trajectory.rope import RowPart
from vrs_cli.trajectory.row import BlockTable
from vrs_cli.trajectory.segment import CartesianPath, JointPath, Segment, Turn
from vrs_cli.trajectory.state import JointState
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.commands import HAND, Frames
from vrs_cli.values.results import Position

if TYPE_CHECKING:
    from vrs_cli.kinematics.arrays import Flags, Floats, Rows

TWIST_LENGTH = 6  # number of components of a twist
POSES_AT_ONCE = 2048  # number of poses computed together: so few that they fit in the processor's cache
NO_TURN = Turn((0.0, 0.0, 1.0), (0.0,))
SINGULAR_RATE = 1.5  # multiple of a joint limit above which rates are computed one by one: the pose is nearly singular


class Watched(Protocol):
    """A robot whose position can be read while other threads move it, since a timeline never changes."""

    @property
    def arm(self) -> RobotArm: ...
    @property
    def timeline(self) -> Timeline: ...
    @property
    def now(self) -> float: ...


class PlaceArrays(Struct, frozen=True):
    """The state of the robot at N times: times (N,) [s], joints (N, n) [rad], T_world_tool (N, 3, 4) [m], and the
    opening of the hand (N,), 1 for open.
    """

    times: Floats
    joints: Floats
    T_world_tool: Floats
    hand: Floats


class PositionArrays(PlaceArrays, frozen=True):
    """The state of the robot at N times, as in `PlaceArrays`, with the velocity [rad/s] and acceleration [rad/s2] of
    the joints, (N, n) each.
    """

    velocity: Floats
    acceleration: Floats


Sampled = TypeVar("Sampled", bound=PlaceArrays)


def joints_at(arm: RobotArm, timeline: Timeline, t: float) -> Joints:
    """Return the joints at time t [rad]."""
    path, s = timeline.path_at(t)
    return path.joints(s) if isinstance(path, JointPath) else segment_joints(arm, *timeline.locate(t))


def position_at(arm: RobotArm, timeline: Timeline, t: float) -> Position:
    """Return the robot's position at time t [s]. The robot is at rest in gaps, before the first segment and after the
    last.

    At a boundary between two segments, velocity and acceleration are those of the later segment.
    """
    segment, s = timeline.locate(t)
    joints = segment_joints(arm, segment, s)
    moving = segment.moves(s)
    velocity, acceleration = rates_in(arm, segment, s, joints) if moving else ((0.0,) * len(joints),) * 2
    pose = world_pose(arm, segment.motion.frames, joints)
    hand = timeline.value_at(HAND, t)
    return Position(t, joints, velocity, acceleration, pose, hand, moving, segment.motion.text)


def joint_state_at(arm: RobotArm, timeline: Timeline, t: float) -> JointState:
    """Return the joints of `position_at` [rad, m] with their velocities and accelerations, without the pose, which
    takes less time; for controllers that call it often.
    """
    segment, s = timeline.locate(t)
    joints = segment_joints(arm, segment, s)
    if segment.moves(s):
        return JointState(joints, *rates_in(arm, segment, s, joints))
    still = (0.0,) * len(joints)
    return JointState(joints, still, still)


def destination_at(arm: RobotArm, timeline: Timeline, t: float) -> Position:
    """Return the position at the end of the motion in progress at t [s], or the position of a robot at rest."""
    return position_at(arm, timeline, finish_after(timeline, t))


def finish_after(timeline: Timeline, t: float) -> float:
    """Return when the motion in progress at t [s] ends, or when the last motion before t ended [s]."""
    index = timeline.index_at(t)
    segment = timeline[index]
    number = segment.motion.number
    while index + 1 < len(timeline) and (after := timeline[index + 1]).motion.number == number:
        index, segment = index + 1, after
    return segment.finish


def start_before(timeline: Timeline, t: float) -> float:
    """Return when the motion in progress at t [s] began [s]."""
    index = timeline.index_at(t)
    number = timeline[index].motion.number
    while index and timeline[index - 1].motion.number == number:
        index -= 1
    return timeline[index].start


def world_pose(arm: RobotArm, frames: Frames, joints: Joints) -> Transform:
    """Return T_world_tool at these joints, with the given BASE and TOOL."""
    return compose(inverse(frames.base), compose(arm.forward(joints), frames.tool))


def rates_in(arm: RobotArm, segment: Segment, s: float, joints: Joints) -> tuple[Joints, Joints]:
    """Return joint velocity and acceleration at s seconds into a segment; zero where a straight line begins or ends at
    rest in a singular pose.
    """
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
    """Return the joints at times (N,) [s], in any order: (N, n) [rad]. Sorted times are computed fastest."""
    import numpy as np

    times, back = _in_order(times)
    found = np.empty((len(times), arm.model.joint_count))
    for block, rows in _blocks(timeline, times):
        table, part = block.table()
        places, s = table.locate(times[rows], block.offset, part)
        _joints(arm, table, places, s, _lines(table, places, s), found[rows])
    return found if back is None else found[back]


def _in_order(times: Floats) -> tuple[Floats, Rows | None]:
    """Return sorted times, and for each original time its index among them (None if the times were sorted already)."""
    import numpy as np

    times = np.asarray(times, dtype=float)
    if len(times) < 2 or (times[1:] >= times[:-1]).all():
        return times, None
    order = times.argsort(kind="stable")
    back = np.empty_like(order)
    back[order] = np.arange(len(order))
    return times[order], back


def _blocks(timeline: Timeline, times: Floats) -> Iterator[tuple[RowPart, slice]]:
    """Yield each block of segments that contains some of the sorted times (N,), with the slice of these times."""
    import numpy as np

    found = list(timeline.blocks(float(times[0]), float(times[-1]))) if len(times) else []
    cuts = [0, *np.searchsorted(times, [block.begin for block in found[1:]], side="left"), len(times)]
    for block, (first, last) in zip(found, pairwise(cuts), strict=False):
        if first < last:
            yield block, slice(first, last)


class _Rates(Struct, frozen=True):
    """The joints (N, n), and arrays for their velocity and acceleration, which are still to be computed."""

    q: Floats
    qd: Floats
    qdd: Floats


class _Line(Struct, frozen=True):
    """A straight line in a table of segments, and the times for which it is evaluated.

    `rows` (k,): the indices of these times. `s` (k,): these times, counted from the start of the line [s].
    """

    segment: Segment
    path: CartesianPath
    rows: Rows
    s: Floats


def _lines(table: BlockTable, places: Rows, s: Floats) -> list[_Line]:
    """Return the straight lines among the segments at the indices `places` (N,), which are in order of time; `s` (N,):
    the times since the start of each segment [s].
    """
    import numpy as np

    found = []
    for place, rows in _runs(places) if table.straight.any() else ():
        segment = table.segment(place)
        if isinstance(segment.path, CartesianPath):
            found.append(_Line(segment, segment.path, np.arange(rows.start, rows.stop), s[rows]))
    return found


def _joints(arm: RobotArm, table: BlockTable, places: Rows, s: Floats, lines: list[_Line], out: Floats) -> None:
    """Store in `out` the joints (N, n) at `s` seconds (N,) into the segments at `places` (N,); `lines`: those segments
    that are straight lines.
    """
    table.joints(places, s, out)
    alike: dict[tuple[Any, ...], list[_Line]] = {}
    for line in lines:
        key = (
            line.segment.motion.frames.tool,
            line.path.configuration,
            tuple([guide.weights for guide in line.path.guides]),
        )
        alike.setdefault(key, []).append(line)
    for some in alike.values():
        _joints_on_lines(arm, some, out)


def _runs(places: Rows) -> Iterator[tuple[int, slice]]:
    """Yield each segment index that occurs, with the slice of the neighbouring places that have this index."""
    import numpy as np

    cuts = [0, *(np.flatnonzero(np.diff(places)) + 1), len(places)]
    for first, last in pairwise(cuts):
        yield int(places[first]), slice(first, last)


def _joints_on_lines(arm: RobotArm, lines: list[_Line], out: Floats) -> None:
    """Store in `out` (N, n) the joints on lines that have the same tool, configuration and weights of guides."""
    import numpy as np

    path, tool = lines[0].path, lines[0].segment.motion.frames.tool
    poses = flange_poses([(line.path, line.s) for line in lines], tool)
    nearest = [np.rint(line.s / line.path.seed_interval).clip(0, len(line.path.seeds) - 1) for line in lines]
    rows = zip(lines, nearest, strict=True)
    seeds = np.concatenate([np.array(line.path.seeds)[numbers.astype(np.intp)] for line, numbers in rows])
    if path.guides:
        weights = np.array([guide.weights for guide in path.guides])
        values = np.concatenate([guide_values(line.path, line.s) for line in lines])
        q = arm.batch.solve_guided(poses, seeds, weights, values)
    else:
        q = arm.for_tool(tool).batch.inverse_branch(poses, path.configuration, seeds)
    out[np.concatenate([line.rows for line in lines])] = q
    for line in lines if np.isnan(q).any() else ():
        for row, s in zip(line.rows, line.s.tolist(), strict=True):
            # the search for a single pose may succeed where the search for many poses fails
            if np.isnan(out[row]).any():
                out[row] = segment_joints(arm, line.segment, s)


def places_at(arm: RobotArm, timeline: Timeline, times: Floats) -> PlaceArrays:
    """Return the result of `positions_at` without the rates, which take the most time on straight lines."""
    return _sample_at(arm, timeline, times, PlaceArrays)


def positions_at(arm: RobotArm, timeline: Timeline, times: Floats) -> PositionArrays:
    """Return the position function g at times (N,) [s], in any order. Sorted times are computed fastest."""
    return _sample_at(arm, timeline, times, PositionArrays)


def fill(found: PositionArrays, at: Flags, rows: Sequence[Position]) -> None:
    """Store in `found` positions that were computed one by one. `at`: which rows they go to."""
    import numpy as np

    for name in ("joints", "velocity", "acceleration", "hand"):
        getattr(found, name)[at] = [getattr(row, name) for row in rows]
    found.T_world_tool[at] = np.reshape([row.T_world_tool for row in rows], (-1, 3, 4))


def poses_along(arm: RobotArm, timeline: Timeline, times: Floats, joints: Floats) -> PlaceArrays:
    """Return the state with given joints (N, n) at sorted times (N,) [s], with BASE and TOOL of the timeline."""
    return _sample_at(arm, timeline, times, PlaceArrays, joints)


def _sample_at(
    arm: RobotArm, timeline: Timeline, times: Floats, kind: type[Sampled], joints: Floats | None = None
) -> Sampled:
    """Return places or positions (`kind`) at times (N,) [s]. `joints`: joints to use instead of those of the
    timeline.
    """
    import numpy as np

    from vrs_cli.kinematics.arrays import compose_batch, stack

    times, back = _in_order(times)
    n = arm.model.joint_count
    shapes = {"joints": (n,), "T_world_tool": (3, 4), "hand": (), "velocity": (n,), "acceleration": (n,)}
    found = kind(times, *(np.zeros((len(times), *shapes[name])) for name in kind.__struct_fields__[1:]))
    frames: dict[Frames, int] = {}
    which = np.zeros(len(times), dtype=np.intp)  # for each time, the number of its frames (BASE and TOOL)
    for block, rows in _blocks(timeline, times):
        q, (table, part) = found.joints[rows], block.table()
        places, s = table.locate(times[rows], block.offset, part)
        lines = _lines(table, places, s)
        _joints(arm, table, places, s, lines, q)
        if isinstance(found, PositionArrays):
            moving = times[rows] >= table.starts[places] + block.offset
            moving &= (s < table.durations[places]) & ~table.resting[places]
            rates = _Rates(q, found.velocity[rows], found.acceleration[rows])
            _fill_rates(arm, table, places, s, moving, lines, rates)
        which[rows] = _frame_numbers(frames, table, places)
    if joints is not None:
        found.joints[:] = joints
    if timeline.event_count and len(times):
        events = timeline.events_between(float(times[0]), float(times[-1]))
        changes = [(event.time, event.value) for event in events if event.channel == HAND and not event.observed]
        begins, openings = zip((-inf, timeline.value_at(HAND, float(times[0]))), *changes, strict=True)
        found.hand[:] = np.array(openings)[np.searchsorted(begins, times, side="right") - 1]
    for one, number in frames.items():  # compute together all poses that have the same BASE and TOOL
        T_world_robot, T_flange_tool = stack([inverse(one.base), one.tool])
        based, tooled = one.base != IDENTITY, one.tool != IDENTITY
        rows_of_frame = np.flatnonzero(which == number)
        for chunk in np.split(rows_of_frame, range(POSES_AT_ONCE, len(rows_of_frame), POSES_AT_ONCE)):
            T = arm.batch.forward(found.joints[chunk])
            T = compose_batch(T_world_robot, T) if based else T
            found.T_world_tool[chunk] = compose_batch(T, T_flange_tool) if tooled else T
    return found if back is None else kind(*(column[back] for column in structs.astuple(found)))


def frames_over(timeline: Timeline, times: Floats) -> tuple[tuple[Frames, ...], Rows]:
    """Return the distinct frames (BASE and TOOL) at sorted times (N,) [s], and for each time the index of its
    frames.
    """
    import numpy as np

    frames: dict[Frames, int] = {}
    which = np.zeros(len(times), dtype=np.intp)
    for block, rows in _blocks(timeline, times):
        table, part = block.table()
        which[rows] = _frame_numbers(frames, table, table.locate(times[rows], block.offset, part)[0])
    return tuple(frames), which


def _frame_numbers(frames: dict[Frames, int], table: BlockTable, places: Rows) -> Rows:
    """Return the number of the frames of each segment at `places` (N,); new frames are added to `frames` with the next
    number.
    """
    import numpy as np

    return np.array([frames.setdefault(one, len(frames)) for one in table.frames])[table.frame_number[places]]


def _fill_rates(
    arm: RobotArm, table: BlockTable, places: Rows, s: Floats, moving: Flags, lines: list[_Line], rates: _Rates
) -> None:
    """Compute velocity and acceleration where the robot moves. `places`, `s`, `moving` (N,): index of the segment, time
    since its start [s], and whether the robot moves.
    """
    import numpy as np

    q, qd, qdd = rates.q, rates.qd, rates.qdd
    qd[moving], qdd[moving] = table.rates(places[moving], s[moving])
    alone = table.straight[places] & moving
    # if six equations determine the rates on a line uniquely, they are solved for many times at once
    if arm.steady is None and arm.model.joint_count == TWIST_LENGTH and all(arm.model.counts):
        alike: dict[Transform, list[_Line]] = {}
        for line in lines:
            on = alone[line.rows]
            if len(line.path.turns) <= 1 and on.any():
                part = structs.replace(line, rows=line.rows[on], s=line.s[on])
                alike.setdefault(line.segment.motion.frames.tool, []).append(part)
        for tool, some in alike.items():
            _fill_line_rates(arm, tool, some, rates, alone)
    for row in np.flatnonzero(alone):
        qd[row], qdd[row] = rates_in(arm, table.segment(places[row]), float(s[row]), tuple(q[row].tolist()))


def _fill_line_rates(arm: RobotArm, tool: Transform, lines: list[_Line], rates: _Rates, alone: Flags) -> None:
    """Compute velocity and acceleration on lines with the same tool.

    Leave in `alone` only the rows that `rates_in` must compute one by one: there the joints are so fast that the pose
    is nearly singular.
    """
    import numpy as np

    rows = np.concatenate([line.rows for line in lines])
    twist, change = (np.concatenate(part) for part in zip(*[twists(line.path, line.s) for line in lines], strict=True))
    try:
        qd, qdd = arm.batch.rates(rates.q[rows], twist, change, tool)
    except np.linalg.LinAlgError:
        for line in lines if len(lines) > 1 else ():
            _fill_line_rates(arm, tool, [line], rates, alone)
        return
    slow = np.abs(qd) <= SINGULAR_RATE * np.array(arm.model.max_velocity)
    slow &= np.abs(qdd) <= SINGULAR_RATE * np.array(arm.model.max_acceleration)
    rates.qd[rows], rates.qdd[rows], alone[rows] = qd, qdd, ~slow.all(axis=1)


def flange_poses(lines: Sequence[tuple[CartesianPath, Floats]], T_flange_tool: Transform) -> Floats:
    """Return T_robot_flange (N, 3, 4) on paths of the tool. `lines`: each path with its times (k,) [s]; the result has
    one path after another.
    """
    import numpy as np
    from numpy.polynomial.polynomial import polyval

    from vrs_cli.kinematics.arrays import compose_batch, rotation_about_batch, stack

    counts = [len(s) for _, s in lines]
    T_robot_tool = np.repeat(stack([path.orientation for path, _ in lines]), counts, axis=0)
    T_robot_tool[:, :, 3] = np.concatenate([_values(path.position, s).T for path, s in lines])
    for level in range(max(len(path.turns) for path, _ in lines)):
        turns = [path.turns[level] if level < len(path.turns) else NO_TURN for path, _ in lines]
        axes = np.repeat([turn.axis for turn in turns], counts, axis=0)
        angles = np.concatenate([polyval(s, turn.angle) for turn, (_, s) in zip(turns, lines, strict=True)])
        T_robot_tool[:, :, :3] = T_robot_tool[:, :, :3] @ rotation_about_batch(axes, angles)
    if T_flange_tool == IDENTITY:
        return T_robot_tool
    return compose_batch(T_robot_tool, stack([inverse(T_flange_tool)])[0])


def twists(path: CartesianPath, s: Floats) -> tuple[Floats, Floats]:
    """Return `CartesianPath.twist` and `twist_rate` at times (N,), as arrays (N, 6). The path has at most one turn."""
    import numpy as np

    rates = [derivative(a) for a in (*path.position, *[turn.angle for turn in path.turns])]
    values = _values([*rates, *map(derivative, rates)], s).T
    twist, change = np.zeros((len(s), 6)), np.zeros((len(s), 6))
    for derivatives, part in ((twist, values[:, : len(rates)]), (change, values[:, len(rates) :])):
        derivatives[:, :3] = part[:, :3]
        for turn in path.turns:
            derivatives[:, 3:] = part[:, 3:] * np.array(rotate(path.orientation, turn.axis))
    return twist, change


def _values(polynomials: Sequence[Polynomial], s: Floats) -> Floats:
    """Return the values (m, N) of m polynomials at times (N,)."""
    import numpy as np
    from numpy.polynomial.polynomial import polyval

    table = np.zeros((max(map(len, polynomials)), len(polynomials)))
    for column, a in enumerate(polynomials):
        table[: len(a), column] = a
    return np.asarray(polyval(s, table), dtype=float)


def guide_values(path: CartesianPath, s: Floats) -> Floats:
    """Return the values of a path's guides at times (N,): (N, r)."""
    import numpy as np
    from numpy.polynomial.polynomial import polyval

    values = np.empty((len(s), len(path.guides)))
    for r, guide in enumerate(path.guides):
        values[:, r] = polyval(s, guide.value)
    return values
