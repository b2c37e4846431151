"""Tests of motions of arms with four and five joints. For many more lines: `python -m tests.laws.short_arms`."""

from __future__ import annotations

from math import radians
from random import Random

import numpy as np
import pytest
from msgspec import structs

from tests.kinematics.short_arms import forward, random_arm, turn_between
from tests.laws.short_arms import TOOLS, check_way, lines_there_and_back, middling
from vrs_cli.engine.engine import Engine
from vrs_cli.errors import MotionError
from vrs_cli.kinematics.model import PROFILES, ArmTask
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import IDENTITY, Transform, at_position, compose, from_oat, position, rotation_about
from vrs_cli.values.commands import Move, PoseTarget, SetSpeed


@pytest.mark.parametrize(("seed", "joints", "profile", "tool"), [(6, 4, "SCURVE", TOOLS[1]), (7, 5, "LSPB", TOOLS[0])])
def test_lines_there_and_back_keep_the_laws(seed: int, joints: int, profile: str, tool: Transform) -> None:
    assert lines_there_and_back(seed, joints, profile, tool)


def test_move_takes_the_turn_that_is_nearest_of_all() -> None:
    """Compare with a grid of all joints that bring the tip there."""
    model = random_arm(3, 4)
    engine = Engine(model)
    wish = compose(engine.arm.forward(model.poses["nest"]), rotation_about((0.6, 0.8, 0.0), 0.7))
    found = engine.arm.select(wish, model.poses["ready"])
    R = np.reshape(wish, (3, 4))[:, :3]
    turned = turn_between(forward(model, np.array(found))[:3, :3], R)
    random, others = Random(1), list[float]()
    for _ in range(12):
        begin = middling(model, random)
        q = engine.arm.branch_joints(wish, engine.arm.ways[0], begin)
        if q is not None and engine.arm.limits_ok(q):
            others.append(turn_between(forward(model, np.array(q))[:3, :3], R))
    assert others
    assert turned <= min(others) + 1e-3


@pytest.mark.parametrize("profile", PROFILES)
def test_a_line_past_which_the_least_turn_folds_is_refused(profile: str) -> None:
    """On the way the least turn ends, and another begins elsewhere: between two samples, if there are few."""
    model = structs.replace(load_robot("so100"), profile=profile)
    engine = Engine(model, start=model.units.read((-77.9416, 62.4172, -157.9228, -73.3012, -72.6401)))
    engine.perform(SetSpeed(20))
    goal = from_oat(-0.0599927, 0.2014840, 0.4454282, *map(radians, (-167.9416, -30.7650, 72.6401)))
    with pytest.raises(MotionError):
        engine.perform(Move(PoseTarget(goal), straight=True))


@pytest.mark.parametrize("profile", ["LSPB", "SCURVE"])
def test_a_line_at_whose_end_a_range_turns_the_tool_turns_it_on_the_way(profile: str) -> None:
    """The tool goes up from a table, pointing down, until joint 4 comes to its end."""
    model = structs.replace(load_robot("so100"), profile=profile)
    start = model.units.read((-90.0, 135.86, -121.17, 55.74, 90.0))
    engine = Engine(model, start=start)
    table = engine.position().T_world_tool
    x, y, z = position(table)
    above = at_position(table, x, y, z + 0.06)
    ends = []
    for goal in (above, table):
        begin = engine.end
        engine.perform(Move(PoseTarget(goal), straight=True))
        check_way(engine, IDENTITY, begin, goal)
        ends.append(engine.position(engine.end).joints)
    assert ends[0][3] == pytest.approx(model.upper[3], abs=1e-9)
    assert ends[1] == pytest.approx(start, abs=1e-8)  # a way that closes


def test_what_an_arm_cannot_do_is_said_with_the_task_that_would() -> None:
    model = random_arm(3, 5)
    T = Engine(model).arm.forward(model.poses["ready"])
    turned = compose(at_position(T, T.px, T.py, T.pz), rotation_about((1.0, 0.0, 0.0), 0.3))
    strict = Engine(structs.replace(model, task=ArmTask.POSE))
    with pytest.raises(MotionError, match="give the arm the task 'steady'"):
        strict.perform(Move(PoseTarget(turned), straight=False))
    with pytest.raises(MotionError, match="give the arm the task 'steady': 5 joints cannot turn the tool every way"):
        strict.perform(Move(PoseTarget(turned), straight=True))
    Engine(model).perform(Move(PoseTarget(turned), straight=False))
