"""Tests of the tool's way as lines: never farther from g than allowed, and with few points."""

from __future__ import annotations

from itertools import pairwise, product
from math import cos, hypot, radians, sin
from random import Random

import pytest

from tests.engine.wall import ManualWall
from tests.robots import KINDS
from vrs_cli.engine.approximation import ToolLine, ToolPath, distance_from_line
from vrs_cli.engine.engine import Engine
from vrs_cli.engine.position import position_at
from vrs_cli.interfaces.streams import Steering
from vrs_cli.kinematics.joints import Profile
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import Vector, position, translation
from vrs_cli.trajectory.segment import Phase
from vrs_cli.values.commands import Delay, JointTarget, Move, PoseTarget, SetBase, SetParameter, SetTool, Stamp

WAYS = dict.fromkeys((*product(("puma560", "cobra600"), Profile.__members__), *product(KINDS, ("SCURVE",))))
DENSE = 20  # looks a line, and more where it is long


def wandering(name: str, profile: str, seed: int) -> Engine:
    """Make motions that cut each other, a pause, a tool and a base."""
    engine, random = Engine(load_robot(name)), Random(seed)
    engine.perform(SetParameter("PROFILE", profile))
    if name.startswith("puma"):
        engine.perform(SetTool(translation(0.02, 0.0, 0.1)))
        engine.perform(SetBase(translation(0.1, 0.2, 0.0)))
    ranges = list(zip(engine.model.lower, engine.model.upper, strict=True))
    for k in range(6):
        goal = tuple(min(max(random.uniform(0.5 * low, 0.5 * high), low), high) for low, high in ranges)
        engine.perform(Move(JointTarget(goal), straight=False, stamp=Stamp(0.35 * k)))
    engine.perform(Delay(0.4))
    return engine


def tip(engine: Engine, t: float) -> Vector:
    return position(position_at(engine.arm, engine.timeline, t).T_world_tool)


def farthest(engine: Engine, line: ToolLine) -> float:
    """Return how far g goes from a line [m]."""
    looks = DENSE + 2 * len(line.points)
    times = (line.begin + (line.end - line.begin) * k / looks for k in range(looks + 1))
    pairs = list(pairwise(line.points))
    return max(min(distance_from_line(tip(engine, t), a, b) for a, b in pairs) for t in times)


@pytest.mark.parametrize(("name", "profile"), WAYS)
def test_g_is_never_farther_from_the_lines_than_is_allowed(name: str, profile: str) -> None:
    engine = wandering(name, profile, seed=3)
    lines = ToolPath(engine.arm, error := 0.0005).lines(engine.timeline, 0.0, engine.end)
    assert len(lines) > 6
    assert max(farthest(engine, line) for line in lines) <= error


def test_a_straight_line_has_two_points_a_segment_however_long_it_takes() -> None:
    engine = Engine(load_robot("puma560"))
    engine.perform(Move(JointTarget(tuple(map(radians, (0, -45, 180, 0, 45, 0)))), straight=False))
    start, pose = engine.end, engine.position(engine.end).T_world_tool
    engine.perform(Move(PoseTarget(pose._replace(py=pose.py + 0.2)), straight=True, speed=0.01))
    lines = ToolPath(engine.arm, 0.0005).lines(engine.timeline, start, engine.end)
    assert [line.phase for line in lines] == [Phase.ACCELERATE, Phase.CRUISE, Phase.DECELERATE]
    assert [len(line.points) for line in lines] == [2, 2, 2]


def test_points_come_with_the_curve_and_not_with_time() -> None:
    counts = []
    for speed in (1.0, 0.05):
        engine = Engine(load_robot("planar2"))
        engine.perform(Move(JointTarget((radians(-100.0), radians(60.0))), straight=False, speed=speed))
        lines = ToolPath(engine.arm, 0.0005).lines(engine.timeline, 0.0, 99.0)
        counts.append(sum(len(line.points) for line in lines))
    assert counts[0] == pytest.approx(counts[1], abs=12)
    assert max(counts) < 60


def test_lines_are_those_between_two_times() -> None:
    engine = wandering("puma560", "LSPB", seed=5)
    path = ToolPath(engine.arm, 0.001)
    whole = path.lines(engine.timeline, 0.0, engine.end)
    assert path.lines(engine.timeline, whole[2].begin + 0.01, whole[6].end - 0.01) == whole[2:7]
    assert not path.lines(engine.timeline, 5.0, 4.0)
    assert not path.lines(engine.timeline, engine.end + 1.0, engine.end + 2.0)
    assert all(line.phase is not Phase.REST for line in whole)


def test_a_line_is_parted_where_the_tip_is() -> None:
    engine = wandering("puma560", "LSPB", seed=5)
    for line in ToolPath(engine.arm, 0.0001).lines(engine.timeline, 0.0, engine.end):
        t = 0.3 * line.begin + 0.7 * line.end
        past, planned = line.split_at(t, tip(engine, t))
        assert past[-1] == planned[0] == tip(engine, t)
        assert (*past[:-1], *planned[1:]) == line.points
        assert [past[0], planned[-1]] == [line.points[0], line.points[-1]]


def test_what_has_not_changed_is_not_looked_at_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """Add a motion far ahead, and shift everything after one motion: no other line is made again."""
    engine = Engine(load_robot("puma560"))
    for k in range(300):
        goal = JointTarget(tuple(map(radians, (40.0 if k % 2 else -40.0, -90, 90, 0, 0, 0))))
        engine.perform(Move(goal, straight=False, stamp=Stamp(3.0 * k)))
    path, made = ToolPath(engine.arm, 0.001), []
    before = path.lines(engine.timeline, 0.0, engine.end)
    forward = engine.arm.forward
    monkeypatch.setattr(engine.arm, "forward", lambda q: made.append(q) or forward(q))
    assert path.lines(engine.timeline, 0.0, engine.end) == before
    assert not made
    engine.perform(Move(JointTarget(tuple(map(radians, (0.0, -90, 90, 0, 0, 0)))), False, stamp=Stamp(engine.end + 5)))
    after = path.lines(engine.timeline, 0.0, engine.end)
    assert after[: len(before)] == before
    assert len(made) < 4000  # those of a block or two, of eight


def steered(seconds: float) -> Engine:
    """Let a hand draw circles, at 50 Hz."""
    engine = Engine(load_robot("puma560"), clock=ManualWall().clock())
    ready = engine.model.poses["ready"]
    steering = Steering(engine)
    for k in range(round(50 * seconds)):
        t = 0.02 * k
        steering.to((0.3 * sin(t), ready[1] + 0.3 * cos(t), *ready[2:]), t)
    return engine


def test_a_steered_way_has_few_points_and_is_near_g() -> None:
    engine = steered(20.0)
    assert len(engine.timeline) > 900
    lines = ToolPath(engine.arm, 0.002).lines(engine.timeline, 0.0, engine.end)
    assert sum(len(line.points) for line in lines) < 250
    assert max(farthest(engine, line) for line in lines) <= 0.002


def test_distances_are_from_the_ends_too() -> None:
    a, b = (0.0, 0.0, 0.0), (1.0, 0.0, 0.0)
    assert distance_from_line((0.5, 3.0, 4.0), a, b) == pytest.approx(5.0)
    assert distance_from_line((-1.0, 1.0, 0.0), a, b) == pytest.approx(hypot(1.0, 1.0))
    assert distance_from_line((0.0, 2.0, 0.0), a, a) == pytest.approx(2.0)


def test_a_line_is_parted_at_a_time_with_the_tip_on_both_sides() -> None:
    points = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 2.0, 0.0))
    motion = wandering("cobra600", "LSPB", 1).timeline[1].motion
    line, tip = ToolLine(motion, Phase.CRUISE, 5.0, (0.0, 1.0, 3.0), points), (0.5, 0.5, 0.5)
    assert (line.begin, line.end) == (5.0, 8.0)
    for t, passed in ((4.0, 0), (5.0, 0), (5.5, 1), (6.0, 1), (7.0, 2), (8.0, 2), (9.0, 3)):
        assert line.count_passed(t) == passed
        assert line.split_at(t, tip) == ((*points[:passed], tip), (tip, *points[passed:]))
