"""The tool's tip over time, with bounds that prove what happens between two looks.

On each segment of the timeline the tip, its velocity and its acceleration are curves c(t). Their second derivatives
have a bound M, so that between two looks at t and t + h a curve is within M h^2 / 8 of the straight line between them.
On a straight-line segment the curves are polynomials, and M is exact. On a joint-interpolated one M follows from the
extremes of the joints' derivatives and the lengths of the links: a vector of length l, carried by rotations whose
angles have derivatives of at most x1, x2, ... in sum, has an n-th derivative of at most l B_n(x1, ..., xn), with the
complete Bell polynomials B_n (Comtet, "Advanced Combinatorics", 1974, section 3.3).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from math import comb, hypot
from typing import NamedTuple

from vrs_cli.engine.approximation import tip_of
from vrs_cli.engine.position import world_pose
from vrs_cli.engine.problem import segment_joints
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.joints import JointKind
from vrs_cli.kinematics.model import ArmTask, RobotModel, link_pose
from vrs_cli.kinematics.transform import Transform, Vector, compose, inverse, length, position
from vrs_cli.trajectory.polynomial import Polynomial, derivative, most, value
from vrs_cli.trajectory.segment import JointPath, Phase, Segment
from vrs_cli.trajectory.timeline import Timeline


class Piece(NamedTuple):
    """A curve from `start` to `finish` [s]: `at` tells where it is, so many seconds after `start`. `bend`: the most
    that the length of its second derivative can be.
    """

    start: float
    finish: float
    at: Callable[[float], Vector]
    bend: float


class TurningPiece(NamedTuple):
    """The tool's orientation from `start` to `finish` [s]. `rate`: the most that it turns [rad/s]."""

    start: float
    finish: float
    at: Callable[[float], Transform]
    rate: float


def turning_pieces(arm: RobotArm, timeline: Timeline, begin: float, end: float) -> list[TurningPiece]:
    """Return the orientation of the tool from one time to another [s]."""
    found = []
    for segment, since, until in stretches(timeline, begin, end):
        path, stands = segment.path, segment.phase is Phase.REST or since >= segment.finish
        rate = 0.0
        if not stands and isinstance(path, JointPath):
            rates = zip(path.extremes(segment.duration, 1), arm.turning, strict=True)
            rate = sum(max(-low, high) for (low, high), turns in rates if turns)
        elif not stands and not isinstance(path, JointPath):
            rate = sum(most(derivative(turn.angle), segment.duration) for turn in path.turns)
            if arm.model.task is not ArmTask.POSE:  # the arm turns the tool as it can
                rate = sum(arm.model.max_velocity)
        found.append(TurningPiece(since, until, _pose_of(arm, segment, since - segment.start), rate))
    return found


def _pose_of(arm: RobotArm, segment: Segment, first: float) -> Callable[[float], Transform]:
    """Return T_world_tool by the seconds since `first` in a segment; at rest where that is over."""
    path, frames, lasting = segment.path, segment.motion.frames, segment.duration
    if isinstance(path, JointPath):
        return lambda s: world_pose(arm, frames, path.joints(min(first + s, lasting)))
    if arm.model.task is ArmTask.POSE:
        T_world_robot = inverse(frames.base)
        return lambda s: compose(T_world_robot, path.pose(min(first + s, lasting)))
    return lambda s: world_pose(arm, frames, segment_joints(arm, segment, min(first + s, lasting)))


def tip_pieces(arm: RobotArm, timeline: Timeline, begin: float, end: float, order: int = 0) -> list[Piece]:
    """Return the place of the tool's tip in the world [m] from one time to another [s]; with `order` 1 or 2 its
    velocity [m/s] or acceleration [m/s2], with the directions of the robot's frame.
    """
    return [
        piece
        for segment, since, until in stretches(timeline, begin, end)
        if (piece := _piece(arm, segment, since, until, order)) is not None
    ]


def stretches(timeline: Timeline, begin: float, end: float) -> Iterator[tuple[Segment, float, float]]:
    """Yield what is in force from one time to another [s]: a segment, from when, until when. In a gap it is the segment
    before it, at whose end the robot stands.
    """
    index, since = timeline.index_at(begin), begin
    while True:
        segment = timeline[index]
        after = timeline[index + 1].start if index + 1 < len(timeline) else end
        for until in (min(segment.finish, end), min(max(after, segment.finish), end)):
            if until > since or until == end == since:
                yield segment, since, until
                since = until
        index += 1
        if index >= len(timeline) or after >= end:
            return


def _piece(arm: RobotArm, segment: Segment, since: float, until: float, order: int) -> Piece | None:
    """Return the curve of a segment between two times [s]."""
    first, stands = since - segment.start, segment.phase is Phase.REST or since >= segment.finish
    if stands:
        place = tip_of(arm, segment)(min(first, segment.duration)) if order == 0 else (0.0, 0.0, 0.0)
        return Piece(since, until, lambda _: place, 0.0)
    curve, bend = _curve(arm, segment, order)
    return Piece(since, until, lambda s: curve(first + s), bend)


def _curve(arm: RobotArm, segment: Segment, order: int) -> tuple[Callable[[float], Vector], float]:
    """Return the curve of a moving segment, and the most of its second derivative."""
    path, tool = segment.path, segment.motion.frames.tool
    if not isinstance(path, JointPath):
        rows = [_derived(a, order) for a in path.position]
        bend = hypot(*(most(_derived(a, 2), segment.duration) for a in rows))
        if order == 0:
            return tip_of(arm, segment), bend
        x, y, z = rows
        return (lambda s: (value(x, s), value(y, s), value(z, s))), bend
    bounds = [
        [max(-low, high) for low, high in path.extremes(segment.duration, which)] for which in range(1, order + 3)
    ]
    bend = carried(arm.model, tool, bounds)
    if order == 0:
        return tip_of(arm, segment), bend
    if order == 1:
        return (lambda s: _linear(arm.twist(path.joints(s), path.velocity(s), tool))), bend

    def acceleration(s: float) -> Vector:
        q, qd = path.joints(s), path.velocity(s)
        rates, bias = arm.twist(q, path.acceleration(s), tool), arm.acceleration_bias(q, qd, tool)
        return rates[0] + bias[0], rates[1] + bias[1], rates[2] + bias[2]

    return acceleration, bend


def _linear(twist: Sequence[float]) -> Vector:
    return twist[0], twist[1], twist[2]


def _derived(a: Polynomial, order: int) -> Polynomial:
    for _ in range(order):
        a = derivative(a)
    return a


def carried(model: RobotModel, T_flange_tool: Transform, bounds: Sequence[Sequence[float]]) -> float:
    """Return the most that the last derivative of the tip's place can be. `bounds`: for each order of derivative, from
    1 on, the most of each joint [rad, m].
    """
    order, sums, total = len(bounds), [0.0] * len(bounds), 0.0
    for i, link in enumerate(model.links, 1):
        T = link_pose(model, i, 0.0)
        reach = length(position(compose(T, T_flange_tool) if i == model.joint_count else T))
        if link.kind is JointKind.REVOLUTE:
            sums = [x + row[i - 1] for x, row in zip(sums, bounds, strict=True)]
            total += reach * _bell(sums)
        else:
            slides = [reach + max(abs(model.lower[i - 1]), abs(model.upper[i - 1])), *(row[i - 1] for row in bounds)]
            total += sum(comb(order, k) * slides[k] * _bell(sums[: order - k]) for k in range(order + 1))
    return total


def _bell(x: Sequence[float]) -> float:
    """Return the complete Bell polynomial of x1, ..., xn; 1 of none."""
    found = [1.0]
    for n in range(len(x)):
        found.append(sum(comb(n, k) * found[n - k] * x[k] for k in range(n + 1)))
    return found[-1]


# --- where the robot stands ------------------------------------------------------------------------------------------

STILL = 1e-6  # [rad/s, m/s] a joint that is no faster stands


def stops(timeline: Timeline, begin: float, end: float) -> list[tuple[float, float]]:
    """Return from when to when the arm stands between two times [s]; both are one where it goes on at once."""
    found = list[tuple[float, float]]()
    for segment, since, until in stretches(timeline, begin, end):
        if segment.phase is Phase.REST or since >= segment.finish:
            found.append((since, until))
            continue
        if since == segment.start and _stands(segment, 0.0):
            found.append((since, since))
        if until == segment.finish and _stands(segment, segment.duration):
            found.append((until, until))
    joined = list[tuple[float, float]]()
    for since, until in found:
        if joined and since <= joined[-1][1]:
            joined[-1] = joined[-1][0], max(until, joined[-1][1])
        else:
            joined.append((since, until))
    return joined


def _stands(segment: Segment, s: float) -> bool:
    """Return whether the arm stands for an instant, s seconds into a segment."""
    path = segment.path
    rates = path.velocity(s) if isinstance(path, JointPath) else path.twist(s)
    return all(abs(rate) <= STILL for rate in rates)
