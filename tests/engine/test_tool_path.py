"""The way of the tool as lines: never farther from g than is allowed, and with few points."""

from __future__ import annotations

from itertools import pairwise
from math import hypot, radians
from random import Random

import pytest

from vrs_cli.engine.commands import Delay, JointTarget, Move, PoseTarget, SetBase, SetParameter, SetTool, Stamp
from vrs_cli.engine.engine import Engine
from vrs_cli.engine.position import position_at
from vrs_cli.engine.tool_path import ToolLine, distance_from_line, tool_lines
from vrs_cli.kinematics.profile import Profile
from vrs_cli.kinematics.robot_file import load_robot, robot_names
from vrs_cli.kinematics.transform import Vector, position, translation
from vrs_cli.trajectory.segment import Phase

DENSE = 40  # looks a line


def wandering(name: str, profile: str, seed: int) -> Engine:
    """Motions that cut each other, a pause, a tool and a base."""
    engine, random = Engine(load_robot(name)), Random(seed)
    engine.perform(SetParameter("PROFILE", profile))
    if name.startswith("puma"):
        engine.perform(SetTool(translation(0.02, 0.0, 0.1)))
        engine.perform(SetBase(translation(0.1, 0.2, 0.0)))
    ranges = list(zip(engine.model.lower, engine.model.upper, strict=True))
    for k in range(8):
        goal = tuple(random.uniform(0.5 * low, 0.5 * high) for low, high in ranges)
        engine.perform(Move(JointTarget(goal), straight=False, stamp=Stamp(0.35 * k)))
    engine.perform(Delay(0.4))
    return engine


def tip(engine: Engine, t: float) -> Vector:
    return position(position_at(engine.arm, engine.timeline, t).T_world_tool)


def farthest(engine: Engine, line: ToolLine) -> float:
    """How far g goes from a line [m]."""
    times = (line.begin + (line.end - line.begin) * k / DENSE for k in range(DENSE + 1))
    pairs = list(pairwise(line.points))
    return max(min(distance_from_line(tip(engine, t), a, b) for a, b in pairs) for t in times)


@pytest.mark.parametrize("profile", Profile.__members__)
@pytest.mark.parametrize("name", robot_names())
def test_g_is_never_farther_from_the_lines_than_is_allowed(name: str, profile: str) -> None:
    engine = wandering(name, profile, seed=3)
    for error in (0.0005, 0.005):
        lines = list(tool_lines(engine.arm, engine.timeline, 0.0, engine.end, error))
        assert len(lines) > 8
        assert max(farthest(engine, line) for line in lines) <= error


def test_a_straight_line_has_two_points_a_segment_however_long_it_takes() -> None:
    engine = Engine(load_robot("puma560"))
    engine.perform(Move(JointTarget(tuple(map(radians, (0, -45, 180, 0, 45, 0)))), straight=False))
    start, pose = engine.end, engine.position(engine.end).T_world_tool
    engine.perform(Move(PoseTarget(pose._replace(py=pose.py + 0.2)), straight=True, speed=0.01))
    lines = list(tool_lines(engine.arm, engine.timeline, start, engine.end, 0.0005))
    assert [line.phase for line in lines] == [Phase.ACCELERATE, Phase.CRUISE, Phase.DECELERATE]
    assert [len(line.points) for line in lines] == [2, 2, 2]


def test_points_come_with_the_curve_and_not_with_time() -> None:
    counts = []
    for speed in (1.0, 0.05):
        engine = Engine(load_robot("planar2"))
        engine.perform(Move(JointTarget((radians(-100.0), radians(60.0))), straight=False, speed=speed))
        counts.append(sum(len(line.points) for line in tool_lines(engine.arm, engine.timeline, 0.0, 99.0, 0.0005)))
    assert counts[0] == pytest.approx(counts[1], abs=12)
    assert max(counts) < 60


def test_lines_go_from_one_time_to_another() -> None:
    engine = wandering("puma560", "LSPB", seed=5)
    whole = list(tool_lines(engine.arm, engine.timeline, 0.0, engine.end, 0.001))
    first, last = whole[3].begin + 0.01, whole[9].end - 0.01
    part = list(tool_lines(engine.arm, engine.timeline, first, last, 0.001))
    assert [line.motion for line in part] == [line.motion for line in whole[3:10]]
    assert (part[0].begin, part[-1].end) == (first, last)
    assert part[0].points[0] == pytest.approx(tip(engine, first), abs=1e-9)
    assert part[-1].points[-1] == pytest.approx(tip(engine, last), abs=1e-9)
    assert part[1:-1] == whole[4:9]
    assert not list(tool_lines(engine.arm, engine.timeline, last, first, 0.001))


def test_standing_still_leaves_no_line() -> None:
    engine = wandering("puma560", "LSPB", seed=5)
    assert all(line.phase is not Phase.REST for line in tool_lines(engine.arm, engine.timeline, 0.0, 99.0, 0.001))
    assert not list(tool_lines(engine.arm, engine.timeline, engine.end + 1.0, engine.end + 2.0, 0.001))


def test_distances_are_from_the_ends_too() -> None:
    a, b = (0.0, 0.0, 0.0), (1.0, 0.0, 0.0)
    assert distance_from_line((0.5, 3.0, 4.0), a, b) == pytest.approx(5.0)
    assert distance_from_line((-1.0, 1.0, 0.0), a, b) == pytest.approx(hypot(1.0, 1.0))
    assert distance_from_line((0.0, 2.0, 0.0), a, a) == pytest.approx(2.0)
