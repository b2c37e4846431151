"""Tests of g: one time and many times against each other, and rates against finite differences."""

from __future__ import annotations

from math import radians

import numpy as np
import pytest
from msgspec import structs

from vrs_cli.engine.engine import Engine
from vrs_cli.engine.position import joints_at, joints_over, places_at, position_at, positions_at
from vrs_cli.errors import PathWithoutJoints
from vrs_cli.kinematics.joints import Profile
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import compose, rotation_about, translation
from vrs_cli.trajectory.segment import CartesianPath
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.commands import (
    HAND,
    Break,
    Delay,
    JointTarget,
    Move,
    OperateHand,
    PoseTarget,
    SetBase,
    SetParameter,
    SetTool,
)


@pytest.fixture(scope="module", params=list(Profile.__members__))
def engine(request: pytest.FixtureRequest) -> Engine:
    """Make an engine with joint and straight motions, blended and not, a delay, the hand, a tool and a base."""
    engine = Engine(load_robot("puma560"))
    engine.perform(SetParameter("PROFILE", request.param))
    table = JointTarget(tuple(map(radians, (0, -45, 180, 0, 45, 0))))
    engine.perform(Move(table, straight=False))
    pose = engine.position().T_world_tool
    aside = PoseTarget(pose._replace(py=pose.py + 0.2))
    below = PoseTarget(pose._replace(py=pose.py + 0.2, pz=pose.pz - 0.1))
    for target, straight in ((aside, True), (below, True), (table, False)):
        engine.perform(Move(target, straight), program=True)
    engine.perform(Break())
    engine.perform(OperateHand(1.0, immediate=True))
    engine.perform(Delay(0.4))
    engine.perform(SetTool(translation(0.0, 0.02, 0.1)))
    engine.perform(SetBase(translation(0.1, 0.0, 0.0)))
    engine.perform(Move(JointTarget(tuple(map(radians, (10, -60, 150, 10, 30, -40)))), straight=False))
    return engine


def test_many_times_agree_with_one_time(engine: Engine) -> None:
    times = np.linspace(-1.0, engine.end + 1.0, 700)
    np.random.default_rng(3).shuffle(times)
    many = positions_at(engine.arm, engine.timeline, times)
    for row, t in enumerate(times):
        one = position_at(engine.arm, engine.timeline, float(t))
        assert many.joints[row] == pytest.approx(one.joints, abs=1e-12)
        assert many.velocity[row] == pytest.approx(one.velocity, abs=1e-9)
        assert many.acceleration[row] == pytest.approx(one.acceleration, abs=1e-7)
        assert many.T_world_tool[row].ravel() == pytest.approx(one.T_world_tool, abs=1e-12)
        assert many.hand[row] == one.hand
        assert joints_at(engine.arm, engine.timeline, float(t)) == one.joints


STARTS = {  # joints [deg] from which lines go both ways
    "puma560": (10, -50, 120, 20, 40, -30),
    "ur5e": (20, -70, 100, -60, -80, 30),
    "irb120": (15, 20, 10, 30, 50, -20),
    "xarm6": (10, -20, -40, 20, 60, 30),
}


def a_line(robot: str) -> Engine:
    """Make a line to a place beside the arm, turned about one axis and then about another."""
    engine = Engine(load_robot(robot))
    engine.perform(Move(JointTarget(tuple(map(radians, STARTS[robot]))), straight=False))
    engine.perform(SetTool(translation(0.01, 0.02, 0.1)))
    pose = engine.destination(engine.end).T_world_tool
    for axis, turn, y in (((0.6, 0.0, 0.8), 0.3, 0.02), ((0.0, 1.0, 0.0), -0.2, -0.02)):
        aside = compose(pose._replace(py=pose.py + y), rotation_about(axis, turn))
        engine.perform(Move(PoseTarget(aside), straight=True), program=True)
    return engine


@pytest.mark.parametrize("robot", STARTS)
def test_rates_along_lines_are_those_of_one_time(robot: str) -> None:
    engine = a_line(robot)
    times = np.linspace(0.0, engine.end, 150)
    many = positions_at(engine.arm, engine.timeline, times)
    for row, t in enumerate(times):
        one = position_at(engine.arm, engine.timeline, float(t))
        assert many.velocity[row] == pytest.approx(one.velocity, abs=1e-9)
        assert many.acceleration[row] == pytest.approx(one.acceleration, abs=1e-7)


def test_rates_that_are_not_solved_at_once_are_found_one_by_one(monkeypatch: pytest.MonkeyPatch) -> None:
    engine = a_line("puma560")
    times = np.linspace(0.0, engine.end, 150)
    usual = positions_at(engine.arm, engine.timeline, times)

    def singular(*_arguments: object) -> None:
        raise np.linalg.LinAlgError

    monkeypatch.setattr(engine.arm.batch, "rates", singular, raising=True)
    alone = positions_at(engine.arm, engine.timeline, times)
    assert alone.velocity == pytest.approx(usual.velocity, abs=1e-9)
    assert alone.acceleration == pytest.approx(usual.acceleration, abs=1e-7)
    monkeypatch.setattr(engine.arm.batch, "rates", lambda q, *_rest: (q + 1e9, q + 1e9), raising=True)
    again = positions_at(engine.arm, engine.timeline, times)
    assert again.velocity.tobytes() == alone.velocity.tobytes()


def test_places_are_positions_without_the_rates(engine: Engine) -> None:
    times = np.random.default_rng(4).uniform(-1.0, engine.end + 1.0, 500)
    places, positions = (at(engine.arm, engine.timeline, times) for at in (places_at, positions_at))
    for name in ("times", "joints", "T_world_tool", "hand"):
        assert getattr(places, name).tobytes() == getattr(positions, name).tobytes(), name


def test_rates_are_the_derivatives(engine: Engine) -> None:
    h = 1e-5
    boundaries = np.array([s.start for s in engine.timeline] + [engine.end])
    for t in np.linspace(0.01, engine.end - 0.01, 211):
        if np.min(np.abs(boundaries - t)) < 2 * h:
            continue
        before, here, after = (position_at(engine.arm, engine.timeline, t + d) for d in (-h, 0.0, h))
        slope = (np.array(after.joints) - np.array(before.joints)) / (2 * h)
        bend = (np.array(after.velocity) - np.array(before.velocity)) / (2 * h)
        assert here.velocity == pytest.approx(slope, abs=1e-6)
        assert here.acceleration == pytest.approx(bend, abs=1e-4)


def test_stands_before_and_after(engine: Engine) -> None:
    before, after = engine.position(-5.0), engine.position(engine.end + 5.0)
    assert not before.moving
    assert not after.moving
    assert before.joints == pytest.approx(engine.model.poses["ready"])
    assert after.joints == engine.position(engine.end).joints
    assert set(after.velocity) == {0.0}


def test_hand_opens_when_told_to(engine: Engine) -> None:
    (opening,) = [event for event in engine.timeline.events if event.duration == pytest.approx(0.05)]
    assert (opening.channel, opening.value, opening.tied) == (HAND, 1.0, True)
    assert engine.position(opening.time - 1e-6).hand == 0.0
    assert engine.position(opening.time).hand == 1.0
    assert engine.position(engine.end).hand == 1.0


@pytest.mark.parametrize("ordered", [True, False])
def test_joints_over_many_times_are_those_of_each_time(engine: Engine, ordered: bool) -> None:
    times = np.linspace(-1.0, engine.end + 1.0, 700)
    if not ordered:
        np.random.default_rng(3).shuffle(times)
    many = joints_over(engine.arm, engine.timeline, times)
    for row, t in enumerate(times):
        assert many[row] == pytest.approx(joints_at(engine.arm, engine.timeline, float(t)), abs=1e-12)
    assert joints_over(engine.arm, engine.timeline, times[:0]).shape == (0, 6)


def test_a_line_where_the_arm_has_no_joints_is_told_and_not_made_up() -> None:
    """A damaged file may have such a line, or one of a version that planned such lines."""
    engine = Engine(load_robot("puma560"))
    engine.perform(Move(JointTarget(tuple(map(radians, (0, -45, 180, 0, 45, 0)))), straight=False))
    pose = engine.position().T_world_tool
    engine.perform(Move(PoseTarget(pose._replace(py=pose.py + 0.2)), straight=True, text="MOVES far"))
    *before, last = engine.timeline
    assert isinstance(last.path, CartesianPath)
    x, y, z = last.path.position
    away = structs.replace(last, path=structs.replace(last.path, position=((x[0] + 1.0, *x[1:]), y, z)))
    timeline = Timeline([*before, away])
    with pytest.raises(PathWithoutJoints, match=r"0\.010 s into MOVES far"):
        joints_at(engine.arm, timeline, away.start + 0.01)
    with pytest.raises(PathWithoutJoints, match="into MOVES far"):
        joints_over(engine.arm, timeline, np.linspace(0.0, away.finish, 50))
