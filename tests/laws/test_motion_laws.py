"""Laws that hold for every timeline, after every command: random sequences of motions, inserted and appended."""

from __future__ import annotations

from collections.abc import Sequence
from math import radians

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.examples import examples
from tests.laws.motion_laws import LIMIT, check_continuous, check_edit, check_limits, check_lines, check_target
from vrs_cli.engine.engine import Engine
from vrs_cli.engine.position import position_at
from vrs_cli.errors import MotionError
from vrs_cli.kinematics.joints import Profile
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import from_oat, translation
from vrs_cli.trajectory.laws.law import LAWS
from vrs_cli.trajectory.segment import CartesianPath
from vrs_cli.trajectory.timeline import Timeline, TimelineDelta
from vrs_cli.values.commands import (
    AlignedTarget,
    Delay,
    JointOffsetTarget,
    JointTarget,
    Move,
    OperateHand,
    PoseTarget,
    SetAcceleration,
    SetDuration,
    SetMonitorSpeed,
    SetParameter,
    SetSpeed,
    Stamp,
    ToolOffsetTarget,
)

MODEL = load_robot("puma560")

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


def performed(
    sequence: list[tuple[object, bool]], profile: str = "LSPB"
) -> tuple[Engine, list[tuple[Timeline, TimelineDelta, Timeline]]]:
    """The engine after a sequence of requests (impossible ones are refused), and every edit: before, delta, after."""
    engine = Engine(MODEL)
    engine.perform(SetParameter("PROFILE", profile))
    edits: list[tuple[Timeline, TimelineDelta, Timeline]] = []
    before = [engine.timeline]

    def note(deltas: Sequence[TimelineDelta]) -> None:
        (delta,) = deltas
        edits.append((before[-1], delta, engine.timeline))
        before.append(engine.timeline)

    engine.book.notify = note
    engine.perform(ABOVE_THE_TABLE, program=True)
    for request, program in sequence:
        try:
            engine.perform(request, program=program)  # type: ignore[arg-type]
        except MotionError:
            assert engine.timeline is before[-1], "a refused motion leaves the timeline as it was"
    return engine, edits


@examples(300)
@given(steps)
def test_every_timeline_keeps_the_laws(sequence: list[tuple[object, bool]]) -> None:
    check_laws(*performed(sequence))


accelerations = st.builds(SetAcceleration, acceleration=st.floats(20.0, 100.0))
durations = st.builds(SetDuration, seconds=st.floats(0.1, 3.0))
roundings = st.builds(SetParameter, name=st.just("ROUNDING"), value=st.just("DECEL") | st.floats(0.0, 50.0))
profiles = st.builds(
    SetParameter, name=st.just("PROFILE"), value=st.sampled_from([profile.name for profile in Profile])
)
any_request = moves | moves | moves | others | profiles | accelerations | durations | roundings
SMOOTH = [profile.name for profile in Profile if LAWS[profile].smooth]


@pytest.mark.parametrize("profile", SMOOTH)
@examples(300)
@given(st.data())
def test_every_jerk_limited_timeline_keeps_the_laws(profile: str, data: st.DataObject) -> None:
    """Most motions are of one profile, and some that they interrupt, or that interrupt them, of another."""
    words = st.sampled_from([profile, profile, *(other.name for other in Profile if other.name != profile)])
    profiles = st.builds(SetParameter, name=st.just("PROFILE"), value=words)
    request = moves | moves | moves | others | profiles | accelerations | durations | roundings
    sequence = data.draw(st.lists(st.tuples(request, st.booleans()), min_size=4, max_size=16))
    check_laws(*performed(sequence, profile))


def check_laws(engine: Engine, edits: list[tuple[Timeline, TimelineDelta, Timeline]]) -> None:
    segments = list(engine.timeline)
    check_continuous(engine, segments)
    check_limits(engine, segments)
    check_target(engine)
    check_lines(engine, segments)
    replayed = engine.book.initial
    for before, delta, after in edits:
        check_edit(before, delta, after)
        replayed = replayed.apply(delta)
        assert replayed == after
    assert replayed == engine.timeline


@examples(60)
@given(steps)
def test_undo_gives_back_the_timeline_to_the_bit(sequence: list[tuple[object, bool]]) -> None:
    engine, edits = performed(sequence)
    for before, _, _ in reversed(list(edits)):
        engine.undo()
        assert engine.timeline == before
    assert engine.timeline == engine.book.initial
    with pytest.raises(Exception, match="no motion to undo"):
        engine.undo()


@examples(60)
@given(steps, st.lists(st.integers(-3, 3), max_size=8))
def test_redo_gives_back_the_timeline_and_the_clock_to_the_bit(
    sequence: list[tuple[object, bool]], walk: list[int]
) -> None:
    engine, edits = performed(sequence)
    states = [(before, step.clock) for (before, _, _), step in zip(edits, engine.book.history.done, strict=True)]
    states.append((engine.timeline, engine.now))
    place = len(states) - 1
    for stride in walk:
        for _ in range(abs(stride)):
            if not 0 <= place + (1 if stride > 0 else -1) < len(states):
                break
            place += 1 if stride > 0 else -1
            (engine.redo if stride > 0 else engine.undo)()
        timeline, clock = states[place]
        assert engine.timeline == timeline
        assert repr(list(engine.timeline)) == repr(list(timeline))
        assert engine.now == clock
    replayed = engine.book.initial
    for delta in engine.book.deltas:
        replayed = replayed.apply(delta)
    assert replayed == engine.timeline


def test_a_line_out_of_a_motion_at_full_speed_asks_no_joint_for_too_much() -> None:
    engine = Engine(MODEL)
    turned = tuple(map(radians, (40.9, -102.4, -6.3, 124.3, -46.8, 48.3)))
    line = PoseTarget(from_oat(0.2807, 0.6017, -0.1336, *map(radians, (119.7, 89.9, -28.2))))
    engine.perform(Move(PoseTarget(from_oat(0.2077, 0.3958, 0.0921, *map(radians, (111.8, 63.2, 24.1)))), False))
    engine.perform(Move(JointTarget(turned), straight=False))
    engine.perform(Move(line, straight=True, stamp=Stamp(2.577)))
    check_continuous(engine, engine.timeline)
    check_limits(engine, engine.timeline)


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
