"""The laws of a timeline, as checks: continuity, limits, targets, lines, and what an edit may touch."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import pairwise
from math import sqrt

from vrs_cli.engine.engine import Engine
from vrs_cli.engine.position import position_at
from vrs_cli.engine.problem import segment_joints, state_at
from vrs_cli.kinematics.joints import Joints, joints_outside, largest_change
from vrs_cli.kinematics.model import LEVEL, STRAIGHT, ArmTask
from vrs_cli.kinematics.transform import Transform, angle_between, compose, distance
from vrs_cli.trajectory.laws.law import LAWS
from vrs_cli.trajectory.polynomial import derivative, value
from vrs_cli.trajectory.segment import CartesianPath, JointPath, Phase, Segment
from vrs_cli.trajectory.timeline import Timeline, TimelineDelta
from vrs_cli.values.commands import MotionKind, Start

POSITION = 1e-8  # [rad] joints at a boundary, where one side may be found by inverse kinematics
POSE_ROUNDING = 2e-16  # of a pose, from which joints are found
MOST_ROUNDING = 1e-6  # [rad]
VELOCITY = 1e-6  # [rad/s]
ACCELERATION = 1e-4  # [rad/s2]
JERK_ON_LINE = 1.02  # of a joint on a straight line, where it is found by differences
SLOPE = 1e-2  # of an acceleration that is found by differences, and [rad/s2]
SHORT = 1e-3  # [s] a segment in which differences are rounding
LIMIT = 1.0 + 1e-5  # rounding
ON_LINE = 1e-6  # [m]
PLACE, TURN = 1e-9, 1e-7  # [m, rad] of a pose beside its target
PARTS = (1e-6, *((k + 0.37) / 9.4 for k in range(9)), 1.0 - 1e-6)  # of a segment: inside, and next to both ends


def check_continuous(engine: Engine, segments: Iterable[Segment]) -> None:
    """Position and velocity are continuous from each of these consecutive segments to the next."""
    for a, b in pairwise(segments):
        assert a.finish <= b.start
        left, right = state_at(engine.arm, a, a.duration).joints, state_at(engine.arm, b, 0.0).joints
        assert largest_change(left.joints, right.joints) <= POSITION + rounding(engine, right.joints), (a, b)
        if a.finish == b.start and a.duration and b.duration:
            assert largest_change(left.velocity, right.velocity) <= VELOCITY, (a, b)
            if left.acceleration and right.acceleration and not singular(engine, right.joints):
                assert largest_change(left.acceleration, right.acceleration) <= ACCELERATION, (a, b)
        if a.finish < b.start:
            assert max(map(abs, left.velocity)) <= VELOCITY, "the robot stands still in a gap"


def rounding(engine: Engine, joints: Joints) -> float:
    """By how much rounding may turn a joint next to a singular pose [rad]: as much more as that is nearer."""
    return min(POSE_ROUNDING / max(min(engine.arm.singularity(joints)), POSE_ROUNDING), MOST_ROUNDING)


def singular(engine: Engine, joints: Joints) -> bool:
    """Whether a line that rests here may have no rates to compare."""
    return min(engine.arm.singularity(joints)) < 1e-3


def check_limits(engine: Engine, segments: Iterable[Segment]) -> None:
    """No joint leaves its range, moves or accelerates too fast anywhere in these segments."""
    model = engine.model
    for segment in segments:
        for part in PARTS:
            t = segment.start + segment.duration * part
            here = position_at(engine.arm, engine.timeline, t)
            assert not joints_outside(here.joints, model.lower, model.upper), (segment, t)
            for v, v_max in zip(here.velocity, model.max_velocity, strict=True):
                assert abs(v) <= v_max * LIMIT, (segment, t)
            if not isinstance(segment.path, CartesianPath) or not singular(engine, here.joints):
                for a, a_max in zip(here.acceleration, model.max_acceleration, strict=True):
                    assert abs(a) <= a_max * LIMIT, (segment, t)
                if LAWS[segment.motion.profile].smooth and segment.duration:
                    check_jerk(engine, segment, segment.duration * part)


def check_jerk(engine: Engine, segment: Segment, s: float) -> None:
    """No joint has too much jerk s seconds into a segment of a jerk-limited motion."""
    for j, j_max in zip(jerk(engine, segment, s), engine.model.max_jerk, strict=True):
        allowed = LIMIT if isinstance(segment.path, JointPath) else JERK_ON_LINE
        assert abs(j) <= j_max * allowed, (segment, s, j / j_max)


def jerk(engine: Engine, segment: Segment, s: float) -> Joints:
    """Joint jerks: of polynomials, or from the accelerations a little earlier and later."""
    path = segment.path
    if isinstance(path, JointPath):
        return tuple(value(derivative(derivative(derivative(a))), s) for a in path.coefficients)
    step = 1e-4 * segment.duration
    middle = min(max(s, step), segment.duration - step)
    before, after = (state_at(engine.arm, segment, middle + side).joints for side in (-step, step))
    if not (before.acceleration and after.acceleration):  # it rests
        return (0.0,) * len(before.joints)
    return tuple((b - a) / (2.0 * step) for a, b in zip(before.acceleration, after.acceleration, strict=True))


def check_accelerations(engine: Engine, segments: Iterable[Segment]) -> None:
    """On straight lines the joint acceleration is the rate of the joint velocity."""
    for segment in segments:
        if not isinstance(segment.path, CartesianPath) or segment.duration < SHORT:
            continue
        step = 1e-3 * segment.duration
        for part in (0.3, 0.7):
            t = segment.start + part * segment.duration
            before, here, after = (position_at(engine.arm, engine.timeline, t + side) for side in (-step, 0.0, step))
            if min(engine.arm.singularity(here.joints)) < 0.1:
                continue
            for v, a, w in zip(before.velocity, here.acceleration, after.velocity, strict=True):
                mean = (w - v) / (2.0 * step)
                assert abs(a - mean) <= SLOPE * (1.0 + abs(a)), (segment, t)


def check_target(engine: Engine) -> None:
    """The last segment of the timeline, which nothing interrupted, ends on its target."""
    last = engine.timeline[len(engine.timeline) - 1]
    motion = last.motion
    q = segment_joints(engine.arm, last, last.duration)
    if motion.goal is not None:
        assert largest_change(q, motion.goal) <= 1e-9
    if motion.pose is not None:
        check_pose(engine, compose(engine.arm.forward(q), motion.frames.tool), motion.pose)


def check_pose(engine: Engine, have: Transform, want: Transform) -> None:
    """Two poses of a tool are the same, in what counts for the robot: an arm that keeps its tool as steady as it can
    has the place exactly, and turns the tool as little as its joints allow.
    """
    task = engine.model.task
    assert distance(have, want) <= (LEVEL if short(engine) else PLACE)
    if engine.arm.steady is not None:
        return
    if all(task.counts[3:]) or task in (ArmTask.UPRIGHT, ArmTask.PLANE):
        assert angle_between(have, want) <= (STRAIGHT if short(engine) else TURN)


def short(engine: Engine) -> bool:
    """Whether the arm has too few joints for its task: it is where it should be as well as three decimals tell."""
    return engine.model.task.size > engine.model.joint_count


def check_rounding(engine: Engine, segments: Sequence[Segment]) -> None:
    """Where a motion rounds a corner, the tip is no farther from it than ROUNDING says."""
    for before, after in pairwise(segments):
        near, motion = after.motion.rounding, before.motion
        if near is None or after.motion.number == motion.number or before.finish < after.start:
            continue
        if motion.kind is MotionKind.REST or before.phase is not Phase.DECELERATE:
            continue
        corner = motion.pose or compose(engine.arm.forward(motion.goal or ()), motion.frames.tool)
        tip = compose(engine.arm.forward(segment_joints(engine.arm, before, before.duration)), motion.frames.tool)
        assert distance(tip, corner) <= near + LEVEL


def check_lines(engine: Engine, segments: Sequence[Segment]) -> None:
    """A straight line from rest stays on the line from where it starts to its target."""
    for index, first in enumerate(segments):
        motion = first.motion
        starts = index == 0 or segments[index - 1].motion.number != motion.number
        if motion.kind is not MotionKind.STRAIGHT or motion.start is Start.BLEND or not starts or motion.pose is None:
            continue
        if not isinstance(first.path, CartesianPath) or any(first.path.twist(0.0)):
            continue
        here = first.path.pose(0.0)
        a, b = (here.px, here.py, here.pz), (motion.pose.px, motion.pose.py, motion.pose.pz)
        for segment in segments[index:]:
            if segment.motion.number != motion.number:
                break
            for k in range(5):
                q = segment_joints(engine.arm, segment, segment.duration * k / 4)
                tip = compose(engine.arm.forward(q), motion.frames.tool)
                assert off_line((tip.px, tip.py, tip.pz), a, b) <= (LEVEL if short(engine) else ON_LINE)


def off_line(p: tuple[float, ...], a: tuple[float, ...], b: tuple[float, ...]) -> float:
    """How far p is from the line through a and b."""
    ab = [y - x for x, y in zip(a, b, strict=True)]
    ap = [y - x for x, y in zip(a, p, strict=True)]
    square = sum(x * x for x in ab)
    along = sum(x * y for x, y in zip(ab, ap, strict=True)) / square if square else 0.0
    return sqrt(sum((y - along * x) ** 2 for x, y in zip(ab, ap, strict=True)))


def check_edit(before: Timeline, delta: TimelineDelta, after: Timeline) -> None:
    """What comes before the cut stays as it was, what comes after the edit is shifted, its paths the very same."""
    olds, news = list(before), list(after)
    old, new = olds[delta.keep + delta.drop :], news[delta.keep + len(delta.segments) :]
    assert len(old) == len(new)
    for a, b in zip(old, new, strict=True):
        assert b.path is a.path
        assert b.start == a.start + delta.shift
        assert b.finish == a.finish + delta.shift
    kept = max(delta.keep - 1, 0)
    assert news[:kept] == olds[:kept]


def edited(delta: TimelineDelta, after: Timeline) -> list[Segment]:
    """The segments that an edit made, with one neighbour on either side."""
    first, last = max(delta.keep - 1, 0), min(delta.keep + len(delta.segments) + 1, len(after))
    return [after[i] for i in range(first, last)]
