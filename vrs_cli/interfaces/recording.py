"""Make a program from a recorded motion of an arm: the program moves the tool along the same path. The path is divided
into joint-interpolated motions between precision points, as few as the tolerance for the tool's position and
orientation allows (Douglas and Peucker, "Algorithms for the reduction of the number of points required to represent a
digitized line", 1973). The program rounds its corners, also within the tolerance. A test run in virtual time compares
the program with the path; if the difference exceeds the tolerance, a program with more points is made."""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil, dist, radians
from typing import NamedTuple

from vrs_cli.engine.engine import Engine
from vrs_cli.engine.position import position_at
from vrs_cli.errors import UsageError
from vrs_cli.kinematics import transform
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.joints import Joints, largest_change, put_inside
from vrs_cli.language.words.values import plain
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.commands import Break, JointTarget, Move, SetParameter

LOOK_STEP_S = 0.01  # [s] time between two samples of the recorded path
STANDS = 1e-6  # [rad, m] a joint counts as at rest if it moves by less than this
DECIMALS = 4  # the program gives joint values [deg, mm] with this many decimals
ATTEMPTS = 6
FIRST_SHARE = 0.7  # choose points with this fraction of the tolerance, because rounded corners add to the distance
FINER_SHARE = 0.6  # each new attempt reduces that tolerance and the rounding by this factor
SAME_POSE_SHARE = 0.2  # skip a sample nearer to the previous one than this fraction of the tolerance
NEAR_POINTS = 60  # search for the nearest path point only among this many points ahead, to save time
MAX_RECORDING_S = 3600.0  # [s] maximum duration of a recording


class Tolerance(NamedTuple):
    """The allowed distance of a tool from a path [m], and its allowed rotation from the path's orientation [rad]."""

    away: float
    turned: float

    def times(self, part: float) -> Tolerance:
        return Tolerance(part * self.away, part * self.turned)


RECORDED = Tolerance(0.002, radians(1.0))  # tolerance for programs made from a path along which a user dragged the tool
Way = tuple[Joints, ...]  # joints at successive points of a path


def way_of(arm: RobotArm, timeline: Timeline, begin: float, end: float, tolerance: Tolerance) -> Way:
    """Return the path of the arm from time `begin` to time `end` [s]. A point is left out if it is nearer to the
    previous point than a fraction of the tolerance."""
    count, least = max(ceil((end - begin) / LOOK_STEP_S), 1), tolerance.times(SAME_POSE_SHARE)
    found = [position_at(arm, timeline, begin + (end - begin) * k / count) for k in range(count + 1)]
    kept = [found[0]]
    for one in found[1:]:
        if _miss(kept[-1].T_world_tool, one.T_world_tool, least) > 1.0:
            kept.append(one)
    if largest_change(kept[-1].joints, found[-1].joints) > STANDS:
        kept.append(found[-1])
    return tuple(one.joints for one in kept)


def recorded_program(
    arm: RobotArm, timeline: Timeline, begin: float, end: float, name: str, tolerance: Tolerance
) -> str:
    """Return the text of a program with the given name that moves the tool along the path of the arm between the times
    `begin` and `end` [s]. Raises UsageError if the arm did not move."""
    if end - begin > MAX_RECORDING_S:
        raise UsageError(f"{end - begin:.0f} s of motion", f"record {MAX_RECORDING_S:.0f} s at most")
    way = way_of(arm, timeline, begin, end, tolerance)
    if len(way) < 2:
        raise UsageError("the arm stood all the time", "drag the tool while it is recorded")
    tool = timeline.locate(begin)[0].motion.frames.tool
    rounded, finer = 0.5 * tolerance.away, tolerance.times(FIRST_SHARE)
    for attempt in range(ATTEMPTS):
        chosen = [_as_written(arm, way[k]) for k in corners(arm, tool, way, finer)]
        last = attempt == ATTEMPTS - 1
        rounding = 0.0 if last else rounded
        if last or _follows_way(arm, tool, way, chosen, rounding, tolerance):
            break
        rounded, finer = FINER_SHARE * rounded, finer.times(FINER_SHARE)
    units = arm.model.units
    moves = (f"MOVE #PPOINT({', '.join(plain(round(x, DECIMALS)) for x in units.to_display(q))})" for q in chosen)
    beginning = (f".PROGRAM {name}", f"PARAMETER ROUNDING = {plain(round(1000.0 * rounding, 3))}")
    return "\n".join((*beginning, *moves, "BREAK", "PARAMETER ROUNDING = DECEL", ".END", ""))


# --- the necessary points of a path -----------------------------------------------------------------------------------


def corners(arm: RobotArm, T_flange_tool: transform.Transform, way: Way, tolerance: Tolerance) -> list[int]:
    """Return the indexes of points of a path such that joint-interpolated motions between them follow the path within
    the tolerance."""
    seen = [transform.compose(arm.forward(q), T_flange_tool) for q in way]
    chosen, open_ = [0], [(0, len(seen) - 1)]
    while open_:
        a, b = open_.pop()
        worst, miss = _worst(arm, T_flange_tool, way, seen, (a, b), tolerance)
        if miss > 1.0:
            open_ += [(worst, b), (a, worst)]  # last in, first out: the half nearer to the start is divided first
        else:
            chosen.append(b)
    return chosen


def _worst(
    arm: RobotArm,
    T_flange_tool: transform.Transform,
    joints: Sequence[Joints],
    seen: Sequence[transform.Transform],
    ends: tuple[int, int],
    tolerance: Tolerance,
) -> tuple[int, float]:
    """Return the index of the path point that is farthest from the direct motion between the points with the indexes
    `ends`, and its distance as a multiple of the tolerance."""
    a, b = ends
    begin, way = joints[a], [y - x for x, y in zip(joints[a], joints[b], strict=True)]
    square = sum([x * x for x in way])
    worst, most = a, 0.0
    for k in range(a + 1, b):
        share = sum([w * (x - p) for w, x, p in zip(way, joints[k], begin, strict=True)]) / square if square else 0.0
        part = min(max(share, 0.0), 1.0)
        there = transform.compose(
            arm.forward(tuple([p + part * w for p, w in zip(begin, way, strict=True)])), T_flange_tool
        )
        if (miss := _miss(there, seen[k], tolerance)) > most:
            worst, most = k, miss
    return worst, most


def _miss(a: transform.Transform, b: transform.Transform, tolerance: Tolerance) -> float:
    return max(transform.distance(a, b) / tolerance.away, transform.angle_between(a, b) / tolerance.turned)


# --- the program -----------------------------------------------------------------------------------------------------


def _as_written(arm: RobotArm, q: Joints) -> Joints:
    """Return the joints as they are written in a program: rounded to DECIMALS, and limited to their ranges."""
    units, model = arm.model.units, arm.model
    rounded = units.read(tuple(round(x, DECIMALS) for x in units.to_display(q)))
    return put_inside(rounded, model.lower, model.upper)


def _follows_way(
    arm: RobotArm,
    T_flange_tool: transform.Transform,
    way: Way,
    joints: Sequence[Joints],
    rounding: float,
    tolerance: Tolerance,
) -> bool:
    """Run the program with the given joints in virtual time. Return whether its path and the recorded path `way` are
    everywhere within the tolerance of each other. `rounding` [m]: how much the program rounds corners."""
    engine = Engine(arm.model, start=joints[0])
    engine.perform(SetParameter("ROUNDING", 1000.0 * rounding), program=True)
    for q in joints[1:]:
        engine.perform(Move(JointTarget(q), straight=False), program=True)
    engine.perform(Break(), program=True)
    done = way_of(engine.arm, engine.timeline, 0.0, engine.end, tolerance)
    tools = [transform.compose(arm.forward(q), T_flange_tool) for q in done]
    seen = [transform.compose(arm.forward(q), T_flange_tool) for q in way]
    return all(_covers(some, others, tolerance) for some, others in ((tools, seen), (seen, tools)))


def _covers(some: Sequence[transform.Transform], others: Sequence[transform.Transform], tolerance: Tolerance) -> bool:
    """Return whether each pose of `some` is near the path through the poses `others`. Both sequences have the same
    direction."""
    near, weight = 0, (tolerance.away / tolerance.turned) ** 2
    for pose in some:
        nearest = min(range(near, min(near + NEAR_POINTS, len(others))), key=lambda k: _unlike(pose, others[k], weight))
        sides = [k for k in (nearest - 1, nearest) if 0 <= k < len(others) - 1] or [0]
        if all(_deviation(pose, others[k], others[min(k + 1, len(others) - 1)], tolerance) > 1.0 for k in sides):
            return False
        near = max(near, nearest - 1)
    return True


def _unlike(a: transform.Transform, b: transform.Transform, weight: float) -> float:
    """Return the squared distance of two poses plus the weighted squared distance of their axes. For small distances
    this orders pairs of poses as `_miss` does, but is faster to compute."""
    squares = [(x - y) * (x - y) for x, y in zip(a, b, strict=True)]
    away = squares[3] + squares[7] + squares[11]
    return away + 0.5 * weight * (sum(squares) - away)


def _deviation(
    pose: transform.Transform, a: transform.Transform, b: transform.Transform, tolerance: Tolerance
) -> float:
    """Return the distance of a pose from the straight line between the poses a and b, as a multiple of the
    tolerance."""
    way = transform.vector_difference(transform.position(b), transform.position(a))
    square = transform.dot(way, way)
    part = (
        transform.dot(transform.vector_difference(transform.position(pose), transform.position(a)), way) / square
        if square
        else 0.0
    )
    away = dist(transform.position(pose), transform.along(transform.position(a), way, min(max(part, 0.0), 1.0)))
    turned = min(transform.angle_between(pose, a), transform.angle_between(pose, b)) - 0.5 * transform.angle_between(
        a, b
    )
    return max(away / tolerance.away, turned / tolerance.turned)
