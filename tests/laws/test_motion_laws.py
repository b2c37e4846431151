"""Laws that hold for every timeline, after every command: random sequences of motions, inserted and appended."""

from __future__ import annotations

from itertools import pairwise
from math import radians, sqrt

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from vrs_cli.engine.commands import (
    AlignedTarget,
    Delay,
    JointOffsetTarget,
    JointTarget,
    Move,
    OperateHand,
    PoseTarget,
    SetMonitorSpeed,
    SetParameter,
    SetSpeed,
    Stamp,
    ToolOffsetTarget,
)
from vrs_cli.engine.engine import Engine
from vrs_cli.engine.planner import segment_joints, state_at
from vrs_cli.engine.position import position_at
from vrs_cli.errors import MotionError
from vrs_cli.kinematics.joints import Joints, joints_outside, largest_change
from vrs_cli.kinematics.model import load_robot
from vrs_cli.kinematics.transform import angle_between, compose, distance, from_oat, translation
from vrs_cli.trajectory.delta import TimelineDelta
from vrs_cli.trajectory.motion import Kind, Start
from vrs_cli.trajectory.segment import CartesianPath
from vrs_cli.trajectory.timeline import Timeline

MODEL = load_robot("puma560")
POSITION = 1e-8  # [rad] joints at a boundary, where one side may be found by inverse kinematics
VELOCITY = 1e-6  # [rad/s]
LIMIT = 1.0 + 1e-5  # rounding
ON_LINE = 1e-6  # [m]
PARTS = (1e-6, *((k + 0.37) / 9.4 for k in range(9)), 1.0 - 1e-6)  # of a segment: inside, and next to both ends

fractions = st.floats(0.0, 1.0)
joint_targets = st.tuples(*[fractions] * 6).map(
    lambda u: JointTarget(
        tuple(low + (high - low) * f for f, low, high in zip(u, MODEL.lower, MODEL.upper, strict=True))
    )
)
pose_targets = st.tuples(
    st.floats(-0.3, 0.3),
    st.floats(0.35, 0.6),
    st.floats(-0.4, 0.1),
    st.floats(30.0, 150.0),
    st.floats(50.0, 90.0),
    st.floats(-60.0, 60.0),
).map(lambda p: PoseTarget(from_oat(p[0], p[1], p[2], *map(radians, p[3:]))))
relative_targets = (
    st.builds(JointOffsetTarget, joint=st.integers(1, 6), change=st.floats(-1.0, 1.0))
    | st.floats(-0.1, 0.1).map(lambda z: ToolOffsetTarget(translation(0.0, 0.0, z)))
    | st.just(AlignedTarget())
)
ABOVE_THE_TABLE = Move(PoseTarget(from_oat(0.0, 0.45, -0.15, radians(90), radians(90), 0.0)), straight=False)
stamps = st.none() | st.floats(0.0, 12.0).map(Stamp)
moves = st.builds(
    Move,
    target=joint_targets | pose_targets | pose_targets | pose_targets | relative_targets,
    straight=st.booleans(),
    hand=st.none() | st.sampled_from([0.0, 1.0]),
    stamp=stamps,
    text=st.just("MOVE"),
)
speeds = st.builds(SetSpeed, value=st.floats(5.0, 100.0), always=st.booleans())
others = (
    speeds
    | st.builds(Delay, seconds=st.floats(0.0, 2.0))
    | st.builds(OperateHand, opening=st.sampled_from([0.0, 1.0]), immediate=st.booleans())
    | st.builds(SetParameter, name=st.just("INSERT"), value=st.sampled_from(["ON", "ON", "OFF"]))
)
steps = st.lists(st.tuples(moves | moves | moves | others, st.booleans()), min_size=4, max_size=16)


def performed(sequence: list[tuple[object, bool]]) -> tuple[Engine, list[tuple[Timeline, TimelineDelta, Timeline]]]:
    """The engine after a sequence of requests (impossible ones are refused), and every edit: before, delta, after."""
    engine = Engine(MODEL)
    edits: list[tuple[Timeline, TimelineDelta, Timeline]] = []
    before = [engine.timeline]

    def note(delta: TimelineDelta, after: Timeline) -> None:
        edits.append((before[-1], delta, after))
        before.append(after)

    engine.listeners.append(note)
    engine.perform(ABOVE_THE_TABLE, program=True)
    for request, program in sequence:
        try:
            engine.perform(request, program=program)  # type: ignore[arg-type]
        except MotionError:
            assert engine.timeline is before[-1], "a refused motion leaves the timeline as it was"
    return engine, edits


def check_continuous(engine: Engine) -> None:
    segments = list(engine.timeline)
    for a, b in pairwise(segments):
        assert a.finish <= b.start
        left, right = state_at(engine.arm, a, a.duration).joints, state_at(engine.arm, b, 0.0).joints
        assert largest_change(left.joints, right.joints) <= POSITION, (a, b)
        if a.finish == b.start and a.duration and b.duration:
            assert largest_change(left.velocity, right.velocity) <= VELOCITY, (a, b)
        if a.finish < b.start:
            assert max(map(abs, left.velocity)) <= VELOCITY, "the robot stands still in a gap"


def singular(engine: Engine, joints: Joints) -> bool:
    """Whether a line that rests here may have no rates to compare."""
    return min(engine.arm.singularity(joints)) < 1e-3


def check_limits(engine: Engine) -> None:
    for segment in engine.timeline:
        for part in PARTS:
            t = segment.start + segment.duration * part
            here = position_at(engine.arm, engine.timeline, t)
            assert not joints_outside(here.joints, MODEL.lower, MODEL.upper), (segment, t)
            for v, v_max in zip(here.velocity, MODEL.max_velocity, strict=True):
                assert abs(v) <= v_max * LIMIT, (segment, t)
            if not isinstance(segment.path, CartesianPath) or not singular(engine, here.joints):
                for a, a_max in zip(here.acceleration, MODEL.max_acceleration, strict=True):
                    assert abs(a) <= a_max * LIMIT, (segment, t)


def check_targets(engine: Engine) -> None:
    """The last segment of a motion that nothing interrupted ends on its target."""
    last = engine.timeline[len(engine.timeline) - 1]
    motion = last.motion
    q = segment_joints(engine.arm, last, last.duration)
    if motion.goal is not None:
        assert largest_change(q, motion.goal) <= 1e-9
    if motion.pose is not None:
        tip = compose(engine.arm.forward(q), motion.frames.tool)
        assert distance(tip, motion.pose) <= 1e-9
        assert angle_between(tip, motion.pose) <= 1e-7


def check_lines(engine: Engine) -> None:
    """A straight line from rest stays on the line from where it starts to its target."""
    segments = list(engine.timeline)
    for index, first in enumerate(segments):
        motion = first.motion
        starts = index == 0 or segments[index - 1].motion.number != motion.number
        if motion.kind is not Kind.STRAIGHT or motion.start is Start.BLEND or not starts or motion.pose is None:
            continue
        if not isinstance(first.path, CartesianPath) or any(first.path.twist(0.0)):
            continue
        here = first.path.pose(0.0)
        a, b = (here.px, here.py, here.pz), (motion.pose.px, motion.pose.py, motion.pose.pz)
        for segment in segments[index:]:
            if segment.motion.number != motion.number:
                break
            for k in range(5):
                s = segment.duration * k / 4
                q = segment_joints(engine.arm, segment, s)
                tip = compose(engine.arm.forward(q), motion.frames.tool)
                assert off_line((tip.px, tip.py, tip.pz), a, b) <= ON_LINE


def off_line(p: tuple[float, ...], a: tuple[float, ...], b: tuple[float, ...]) -> float:
    ab = [y - x for x, y in zip(a, b, strict=True)]
    ap = [y - x for x, y in zip(a, p, strict=True)]
    square = sum(x * x for x in ab)
    along = sum(x * y for x, y in zip(ab, ap, strict=True)) / square if square else 0.0
    return sqrt(sum((y - along * x) ** 2 for x, y in zip(ab, ap, strict=True)))


def check_tail_untouched(before: Timeline, delta: TimelineDelta, after: Timeline) -> None:
    old = list(before)[delta.keep + delta.drop :]
    new = list(after)[delta.keep + len(delta.segments) :]
    assert len(old) == len(new)
    for a, b in zip(old, new, strict=True):
        assert b.path is a.path
        assert b.start == a.start + delta.shift
        assert b.finish == a.finish + delta.shift
    kept = list(after)[: max(delta.keep - 1, 0)]
    assert kept == list(before)[: len(kept)]


@settings(max_examples=300, deadline=None, suppress_health_check=list(HealthCheck), derandomize=True)
@given(steps)
def test_every_timeline_keeps_the_laws(sequence: list[tuple[object, bool]]) -> None:
    engine, edits = performed(sequence)
    check_continuous(engine)
    check_limits(engine)
    check_targets(engine)
    check_lines(engine)
    replayed = engine.initial
    for before, delta, after in edits:
        check_tail_untouched(before, delta, after)
        replayed = replayed.apply(delta)
        assert replayed == after
    assert replayed == engine.timeline


@settings(max_examples=60, deadline=None, suppress_health_check=list(HealthCheck), derandomize=True)
@given(steps)
def test_undo_gives_back_the_timeline_to_the_bit(sequence: list[tuple[object, bool]]) -> None:
    engine, edits = performed(sequence)
    for before, _, _ in reversed(list(edits)):
        engine.undo()
        assert engine.timeline == before
    assert engine.timeline == engine.initial
    with pytest.raises(Exception, match="no motion to undo"):
        engine.undo()


def test_a_line_out_of_a_motion_at_full_speed_asks_no_joint_for_too_much() -> None:
    engine = Engine(MODEL)
    turned = tuple(map(radians, (40.9, -102.4, -6.3, 124.3, -46.8, 48.3)))
    line = PoseTarget(from_oat(0.2807, 0.6017, -0.1336, *map(radians, (119.7, 89.9, -28.2))))
    engine.perform(Move(PoseTarget(from_oat(0.2077, 0.3958, 0.0921, *map(radians, (111.8, 63.2, 24.1)))), False))
    engine.perform(Move(JointTarget(turned), straight=False))
    engine.perform(Move(line, straight=True, stamp=Stamp(2.577)))
    check_continuous(engine)
    check_limits(engine)


def test_a_line_past_a_singularity_is_slow_enough_at_the_very_peak() -> None:
    engine = Engine(MODEL)
    target = from_oat(0.0391, 0.5768, 0.0519, *map(radians, (94.2, 91.2, 24.4)))
    engine.perform(Move(PoseTarget(target), straight=False), program=True)
    engine.perform(SetMonitorSpeed(20.0))
    back = ToolOffsetTarget(translation(0.0, 0.0, -0.04))
    engine.perform(Move(back, straight=True, stamp=Stamp(0.144)))
    line = list(engine.timeline)[-2]
    assert isinstance(line.path, CartesianPath)
    fastest = 0.0
    for k in range(20_000):
        here = position_at(engine.arm, engine.timeline, line.start + (k + 0.5) / 20_000 * 0.1 * line.duration)
        fastest = max(fastest, *(abs(v) / most for v, most in zip(here.velocity, MODEL.max_velocity, strict=True)))
    assert 0.95 < fastest <= LIMIT
