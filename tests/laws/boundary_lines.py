"""Straight lines through and beside the singular poses of every robot and the edge of its reach, and what g says there.

The joints are read at 1 kHz, and ten times as closely where segments meet, and checked apart from what planned
them: poses by the links of the robot's table and numpy, rates by differences.
`python -m tests.laws.boundary_lines SEEDS [FIRST] [ROBOT ...]` prints the seed of every line that breaks a law.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import pi
from random import Random

import numpy as np
from numpy.typing import NDArray

from tests.by_hand import command
from tests.laws.lines import count_faults
from vrs_cli.engine.position import joints_over
from vrs_cli.engine.problem import Here, Problem
from vrs_cli.engine.single_motion import plan_motion
from vrs_cli.errors import MotionError
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.joints import JointKind, Joints, Profile
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.robot_file import load_robot, robot_names
from vrs_cli.kinematics.transform import (
    IDENTITY,
    Transform,
    Vector,
    at_position,
    compose,
    inverse,
    position,
    rotation_about,
    translation,
)
from vrs_cli.trajectory.segment import CartesianPath, Segment
from vrs_cli.trajectory.state import JointState
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.commands import Frames, Motion, MotionKind, Start

Floats = NDArray[np.float64]

RATE, CLOSELY = 1e-3, 1e-4  # [s] between two readings
MOST_READINGS = 20_000  # of a whole line: some take minutes
WINDOW = 0.01  # [s] around the instants that are read closely
MOST_WINDOWS = 12
PLACE = 1e-9  # [m] of a pose
LIMIT = 1.001
ROUNDING = 4e-8  # [rad] of a joint on a boundary, where it is found from the root of a rounded square
TWICE_ROUNDING = 1e-4  # [rad] on two boundaries all along: the root of the root of a rounded square
ANGLE_ROUNDING = 1e-15  # of a vector whose direction is the angle of a joint
WRIST = 4  # the joint of a straight wrist, by its index
DRAWS = 1000  # of lines, until the arm can stand where one begins
NEWTON_STEPS = 6
MOST_SLOPE = 1e6  # [m2]
STEP = 1e-6  # [m] of a gradient
NAMED = 9  # the last digit of seeds whose line begins in a named pose
PAIRS = (7, 8)  # and of those whose line begins or ends where boundaries meet
BISECTIONS, PARTS = 60, 24  # to find a place by
SINGULAR = 1e-9  # measure of a pose
ALONG = 1e-6  # the greatest measure of a line that lies on a boundary


@dataclass(frozen=True)
class Line:
    """A line, and the joints from which it starts."""

    start: Joints
    begin: Transform
    end: Transform
    tool: Transform
    profile: Profile
    speed: float


def check_line(model: RobotModel, seed: int) -> bool:
    """Every law for one line; whether it is possible."""
    arm, random = arm_for(model), Random(seed)
    last = seed % 10
    draw = line_from_named_pose if last == NAMED else line_of_a_pair if last in PAIRS else random_line
    line = next(line for _ in range(DRAWS) if (line := draw(arm, random)) is not None)
    motion = Motion(
        1,
        MotionKind.STRAIGHT,
        Start.AT,
        pose=line.end,
        speed=line.speed,
        profile=line.profile,
        frames=Frames(tool=line.tool),
    )
    still = JointState(line.start, (0.0,) * model.joint_count)
    try:
        segments = plan_motion(Problem(arm, Here(still), motion, 0.0))
    except MotionError:
        return False
    check_segments(arm, segments)
    return True


def random_line(arm: RobotArm, random: Random) -> Line | None:
    """A line by way of a pose on a boundary or beside it; None where the arm cannot start there."""
    model = arm.model
    q = tuple(random.uniform(low, high) for low, high in zip(model.lower, model.upper, strict=True))
    tool = translation(*(random.uniform(-0.1, 0.1) for _ in range(3))) if random.random() < 0.3 else IDENTITY
    tool = tool if model.joint_count == 6 else IDENTITY
    which = random.choice(("shoulder", "outer", "inner", "wrist") if model.joint_count == 6 else ("outer", "inner"))
    pose, normal = _on_boundary(arm, which, q, tool)
    along = _direction(random, normal, model)
    off = random.choice((0.0, 0.0, 1.0, -1.0)) * 10.0 ** random.uniform(-12.0, -3.0)
    pose = at_position(pose, *(p + off * n for p, n in zip(position(pose), normal, strict=True)))
    length, part = 10.0 ** random.uniform(-2.5, -0.4), random.choice((0.0, 1.0, random.random(), random.random()))
    axis = (0.0, 0.0, 1.0) if model.joint_count < 6 else _unit(tuple(random.gauss(0.0, 1.0) for _ in range(3)))
    turn = random.choice((0.0, 0.0, random.uniform(-1.0, 1.0))) if model.task.turns else 0.0
    begin = _beside(pose, along, -part * length, axis, -part * turn)
    end = _beside(pose, along, (1.0 - part) * length, axis, (1.0 - part) * turn)
    starts = [q for q in arm.branches(compose(begin, inverse(tool))) if q is not None and arm.limits_ok(q)]
    if not starts:
        return None
    profile = random.choice((Profile.LSPB, Profile.LSPB, Profile.SCURVE))
    return Line(random.choice(starts), begin, end, tool, profile, 10.0 ** random.uniform(-2.0, 0.0))


def line_from_named_pose(arm: RobotArm, random: Random) -> Line | None:
    """A line from READY or the like, where several boundaries may meet, or from beside it."""
    model = arm.model
    off = random.choice((0.0, 0.0, 10.0 ** random.uniform(-12.0, -3.0)))
    start = tuple(q + off * random.uniform(-1.0, 1.0) for q in random.choice(list(model.poses.values())))
    if not arm.limits_ok(start):
        return None
    along = tuple(random.choice((0.0, random.gauss(0.0, 1.0))) for _ in range(2 if model.joint_count < 6 else 3))
    if not any(along):
        return None
    begin, turn = arm.forward(start), random.choice((0.0, random.uniform(-1.0, 1.0))) if model.task.turns else 0.0
    axis = (0.0, 0.0, 1.0) if model.joint_count < 6 else _unit(tuple(random.gauss(0.0, 1.0) for _ in range(3)))
    end = _beside(begin, _unit((*along, 0.0)[:3]), 10.0 ** random.uniform(-2.5, -0.4), axis, turn)
    return Line(start, begin, end, IDENTITY, random.choice(list(Profile)), 10.0 ** random.uniform(-2.0, 0.0))


def line_of_a_pair(arm: RobotArm, random: Random) -> Line | None:
    """A line from a pose in which two boundaries meet or all three, or to it; along a boundary as often as not."""
    model = arm.model
    corner = _corner(arm, random)
    if corner is None or not arm.limits_ok(corner):
        return None
    pose, wide = arm.forward(corner), model.joint_count > 3
    straight = random.choice((0.0, 1.0, 1.0, 1.0)) if model.task.turns else 1.0
    length = straight * 10.0 ** random.uniform(-2.5, -0.7)
    up = (0.0, 0.0, random.choice((-1.0, 1.0))) if wide else (-pose.px, -pose.py, 0.0)
    anywhere = _unit((random.gauss(0.0, 1.0), random.gauss(0.0, 1.0), random.gauss(0.0, 1.0) * wide))
    along = random.choice((_unit(up), _unit(up), anywhere))
    axis = (0.0, 0.0, 1.0) if model.joint_count < 6 else random.choice(((0.0, 0.0, 1.0), (0.0, 1.0, 0.0), anywhere))
    turn = random.choice((0.0, random.uniform(-1.0, 1.0))) if straight else random.choice((-0.7, 0.7))
    other = _beside(pose, along, length, axis, turn * model.task.turns)
    profile, speed = random.choice(list(Profile)), 10.0 ** random.uniform(-1.0, 0.0)
    if random.random() < 0.5:
        return Line(corner, pose, other, IDENTITY, profile, speed)
    starts = [q for q in arm.branches(other) if q is not None and arm.limits_ok(q)]
    return Line(random.choice(starts), other, pose, IDENTITY, profile, speed) if starts else None


def _corner(arm: RobotArm, random: Random) -> Joints | None:
    """Joints at which two or three boundaries meet; of an arm that tells of none, singular ones."""
    model = arm.model
    q = [random.uniform(low, high) for low, high in zip(model.lower, model.upper, strict=True)]
    which = random.choice(("elbow shoulder", "elbow wrist", "shoulder wrist", "elbow shoulder wrist"))
    if arm.hand is None:
        for joint in random.sample(range(len(q)), min(2 if which == "elbow wrist" else 4, len(q))):
            q[joint] = random.choice((0.0, 0.0, pi / 2, -pi / 2))
        if arm.steady is not None or len(q) == 6:  # few quarter turns of their joints are singular
            return _singular(arm, q, random.sample(range(len(q)), 2))
        return tuple(q) if min(arm.singularity(tuple(q))) < SINGULAR else None
    if arm.fold is not None and "elbow" in which:
        joint, value = arm.fold
        q[joint] = value
    if len(q) > WRIST and "wrist" in which:
        q[WRIST] = min((k * pi / 2 for k in range(-2, 3)), key=lambda x: _wrist(arm, q, x))
    if len(q) > WRIST and "shoulder" in which:
        return _on_axis(arm, q, random)
    return tuple(q)


def _singular(arm: RobotArm, q: list[float], joints: list[int]) -> Joints:
    """The joints with some others, one after the other, so that the arm has least freedom."""
    for joint in joints:
        low, high = arm.model.lower[joint], arm.model.upper[joint]

        def freedom(x: float, i: int = joint) -> float:
            return min(arm.singularity((*q[:i], x, *q[i + 1 :])))

        step = (high - low) / PARTS
        best = min((low + k * step for k in range(PARTS + 1)), key=freedom)
        low, high = max(best - step, low), min(best + step, high)
        for _ in range(BISECTIONS):
            third = (high - low) / 3.0
            low, high = (low, high - third) if freedom(low + third) < freedom(high - third) else (low + third, high)
        q[joint] = low
    return tuple(q)


def _wrist(arm: RobotArm, q: list[float], x: float) -> float:
    return arm.singularity((*q[:WRIST], x, *q[WRIST + 1 :])).wrist


def _on_axis(arm: RobotArm, q: list[float], random: Random) -> Joints | None:
    """The joints with another joint 2, so that the wrist is as near to the axis of joint 1 as it comes."""
    places = [random.uniform(arm.model.lower[1], arm.model.upper[1]) for _ in range(2)]

    def outward(x: float) -> float:
        return arm.outward((q[0], x, *q[2:]))

    low, high = places
    if outward(low) * outward(high) > 0.0:
        return None
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if outward(low) * outward(middle) <= 0.0 else (middle, high)
    return (q[0], low, *q[2:])


def _on_boundary(arm: RobotArm, which: str, q: Joints, tool: Transform) -> tuple[Transform, Vector]:
    """T_robot_tool on a boundary, and the direction square to that; any where the arm has no such boundary."""
    if which == "wrist" and len(q) > WRIST:
        q = (*q[:WRIST], 0.0, *q[WRIST + 1 :])
        return compose(arm.forward(q), tool), (0.0, 0.0, 1.0)
    configuration, pose = arm.configuration(q), compose(arm.forward(q), tool)
    normal: Vector = (1.0, 0.0, 0.0)
    for _ in range(NEWTON_STEPS):
        value = _clearance(arm, which, pose, tool, configuration)
        moved = [at_position(pose, *(p + STEP * (k == i) for k, p in enumerate(position(pose)))) for i in range(3)]
        slope = [(_clearance(arm, which, P, tool, configuration) - value) / STEP for P in moved]
        square = sum(g * g for g in slope)
        if not 0.0 < square < MOST_SLOPE:
            break
        normal = _unit(tuple(slope))
        pose = at_position(pose, *(p - value * g / square for p, g in zip(position(pose), slope, strict=True)))
    return pose, normal


def _clearance(arm: RobotArm, which: str, pose: Transform, tool: Transform, configuration: object) -> float:
    value: float = getattr(arm.clearance(compose(pose, inverse(tool)), configuration), which)  # type: ignore[arg-type]
    return value


def _direction(random: Random, normal: Vector, model: RobotModel) -> Vector:
    """Any, or along the boundary; in the plane of a planar robot."""
    v = [random.gauss(0.0, 1.0) for _ in range(3)]
    if model.joint_count < 4:
        v[2] = 0.0
    if random.random() < 0.7:
        along = sum(a * n for a, n in zip(v, normal, strict=True))
        v = [a - along * n for a, n in zip(v, normal, strict=True)]
    return _unit(tuple(v))


def _unit(v: tuple[float, ...]) -> Vector:
    size = sum(x * x for x in v) ** 0.5
    x, y, z = (x / size for x in v)
    return x, y, z


def _beside(pose: Transform, along: Vector, way: float, axis: Vector, turn: float) -> Transform:
    turned = compose(pose, rotation_about(axis, turn))
    return at_position(turned, *(p + way * a for p, a in zip(position(pose), along, strict=True)))


# --- what g says -----------------------------------------------------------------------------------------------------


def check_segments(arm: RobotArm, segments: tuple[Segment, ...]) -> None:
    """Every law for the segments of one straight line, from rest to rest."""
    timeline = Timeline(segments)
    for times, q in check_rates(arm, segments):
        _check_places(arm.model, timeline, times, q)


def check_rates(arm: RobotArm, segments: tuple[Segment, ...]) -> list[tuple[Floats, Floats]]:
    """Ranges, velocities and accelerations of segments, one after the other; the times and joints that were read."""
    timeline = Timeline(segments)
    read = [(times, joints_over(arm, timeline, times)) for times in readings(segments)]
    measures = [np.array([arm.singularity(tuple(row)) for row in q.tolist()]) for _, q in read]
    for (times, q), measured in zip(read, measures, strict=True):
        _check_read(arm.model, times, q, measured, measures[0].max(axis=0) < ALONG)
    return read


def readings(segments: tuple[Segment, ...]) -> list[Floats]:
    """Times: of all of the line, and closely where segments meet."""
    begin, finish = segments[0].start, segments[-1].finish
    step = max(RATE, (finish - begin) / MOST_READINGS)
    times = [np.arange(begin, finish + step, step)]
    for segment in segments[:MOST_WINDOWS]:
        if segment.duration > 0.0:
            times.append(np.arange(max(segment.finish - WINDOW, begin), segment.finish + WINDOW, CLOSELY))
    return times


def _check_read(model: RobotModel, times: Floats, q: Floats, measures: Floats, along: NDArray[np.bool_]) -> None:
    """Ranges, velocities and accelerations of joints read at these times. `measures`: their singular measures; `along`:
    the boundaries on which the whole line lies.
    """
    step = times[1] - times[0]
    low, high = np.array(model.lower) - PLACE, np.array(model.upper) + PLACE
    assert ((q >= low) & (q <= high)).all(), "a joint leaves its range"
    near = np.where(along, 1.0, measures).min(axis=1)  # along a boundary no angle is rounding
    rounding = ROUNDING if along.sum() < 2 else TWICE_ROUNDING
    noise = (rounding + ANGLE_ROUNDING / np.maximum(near, ANGLE_ROUNDING))[:, None]
    velocity = np.diff(q, axis=0) / step
    faster = (np.abs(velocity) - 2.0 * noise[1:] / step) / np.array(model.max_velocity)
    assert faster.max() <= LIMIT, f"joint {_worst(faster)} moves {faster.max():.4f} times too fast, {step} s"
    noise = np.maximum(np.maximum(noise[2:], noise[1:-1]), noise[:-2])
    sooner = (np.abs(np.diff(velocity, axis=0)) - 4.0 * noise / step) / (step * np.array(model.max_acceleration))
    assert sooner.max() <= LIMIT, f"joint {_worst(sooner)} accelerates {sooner.max():.4f} times too much, {step} s"


def _check_places(model: RobotModel, timeline: Timeline, times: Floats, q: Floats) -> None:
    wanted = np.array([_wanted(timeline, float(t)) for t in times])
    found = forward(model, q, timeline[0].motion.frames.tool)[:, :3, 3]
    off = np.linalg.norm(found - wanted, axis=1).max()
    assert off <= PLACE, f"the tool is {off} m beside the path"
    a, b = wanted[0], wanted[-1]
    way = np.linalg.norm(b - a)
    beside = np.linalg.norm(np.cross(found - a, (b - a) / way), axis=1).max() if way > PLACE else 0.0
    assert beside <= 2.0 * PLACE, f"the tool is {beside} m beside the line"


def _worst(parts: Floats) -> int:
    return int(parts.max(axis=0).argmax()) + 1


def _wanted(timeline: Timeline, t: float) -> Vector:
    segment, s = timeline.locate(t)
    assert isinstance(segment.path, CartesianPath)
    return position(segment.path.pose(s))


def forward(model: RobotModel, q: Floats, tool: Transform) -> Floats:
    """T_robot_tool (N, 4, 4) of joints (N, n), link after link by the table of the robot (Denavit and Hartenberg)."""
    T = np.broadcast_to(_square(model.base), (len(q), 4, 4))
    for column, link in zip(q.T, model.links, strict=True):
        turns = link.kind is JointKind.REVOLUTE
        theta = column + link.theta if turns else np.full_like(column, link.theta)
        d = np.full_like(column, link.d) if turns else column + link.d
        T = T @ _link(theta, d, link.a, link.alpha)
    return T @ _square(model.flange) @ _square(tool)


def _link(theta: Floats, d: Floats, a: float, alpha: float) -> Floats:
    c, s = np.cos(theta), np.sin(theta)
    ca, sa = (np.cos(alpha), np.sin(alpha)) if abs(abs(alpha) - pi / 2) > 1e-15 else (0.0, np.sign(alpha))
    T = np.zeros((len(theta), 4, 4))
    T[:, 0] = np.stack((c, -s * ca, s * sa, a * c), axis=1)
    T[:, 1] = np.stack((s, c * ca, -c * sa, a * s), axis=1)
    T[:, 2, 1], T[:, 2, 2], T[:, 2, 3], T[:, 3, 3] = sa, ca, d, 1.0
    return T


def _square(T: Transform) -> Floats:
    return np.vstack((np.reshape(T, (3, 4)), (0.0, 0.0, 0.0, 1.0)))


def main(seeds: int, first: int = 0, robots: Sequence[RobotModel] = ()) -> int:
    run = range(first, first + seeds)
    return 1 if sum([count_faults(model, check_line, run) for model in robots or map(load_robot, robot_names())]) else 0


if __name__ == "__main__":
    command(main)
