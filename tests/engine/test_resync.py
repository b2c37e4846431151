"""Tests of RESYNC: the timeline goes to measured joints and on to its goal, as one command that keeps every law."""

from __future__ import annotations

from random import Random

import pytest

from tests.laws.motion_laws import check_continuous, check_edit, check_limits, edited
from vrs_cli.engine.breaches import breaches, on_lines
from vrs_cli.engine.engine import Engine
from vrs_cli.engine.position import finish_after, joints_at
from vrs_cli.errors import MotionError, PowerOff
from vrs_cli.kinematics.joints import Joints, Profile, largest_change, put_inside
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import translation
from vrs_cli.trajectory.segment import CartesianPath
from vrs_cli.values.commands import JointTarget, Move, PoseTarget, SetParameter, SetSwitch, Stamp, ToolOffsetTarget

SMALL = 1e-9  # [rad]


def near(engine: Engine, joints: Joints, random: Random, share: float) -> Joints:
    model = engine.model
    ways = [random.uniform(-share, share) * (high - low) for low, high in zip(model.lower, model.upper, strict=True)]
    inner = [low + 0.05 for low in model.lower], [high - 0.05 for high in model.upper]
    return put_inside(tuple([q + way for q, way in zip(joints, ways, strict=True)]), *map(tuple, inner))


def session(seed: int, profile: str = "LSPB", robot: str = "puma560") -> tuple[Engine, Random]:
    """Make a robot in real time whose timeline has motions of all kinds, with the clock somewhere in them."""
    engine, random = Engine(load_robot(robot)), Random(seed)
    engine.clock.realtime = True
    engine.perform(SetParameter("PROFILE", profile))
    t = 0.0
    for _ in range(4):
        there = near(engine, engine.destination(engine.end).joints, random, 0.1)
        t = engine.end + random.choice((0.0, 0.3))
        for straight in (random.random() < 0.5, False):
            target = PoseTarget(engine.world_pose(there)) if straight else JointTarget(there)
            try:
                engine.perform(Move(target, straight, speed=random.uniform(0.3, 1.0), stamp=Stamp(t), text="MOVE a"))
                break
            except MotionError:
                continue
    engine.clock.set(random.uniform(0.0, 1.1 * engine.end))
    return engine, random


@pytest.mark.parametrize("profile", [one.value for one in Profile])
@pytest.mark.parametrize("seed", range(6))
def test_goes_to_the_measured_joints_and_on_to_the_goal_inside_all_limits(seed: int, profile: str) -> None:
    engine, random = session(seed, profile)
    before, now = engine.timeline, engine.now
    goal = joints_at(engine.arm, before, finish_after(before, now))
    measured = near(engine, joints_at(engine.arm, before, now), random, 0.05)
    report = engine.resync(measured)
    delta, after = engine.book.deltas[-1], engine.timeline
    check_edit(before, delta, after)
    check_continuous(engine, edited(delta, after))
    check_limits(engine, edited(delta, after))
    assert not [*breaches(engine.arm, after), *on_lines(engine.arm, after)]
    assert largest_change(joints_at(engine.arm, after, report.until), measured) < SMALL
    assert not any(engine.position(report.until).velocity)
    own = [segment for segment in after if segment.motion.number == delta.motion.number]
    assert largest_change(joints_at(engine.arm, after, own[-1].finish), goal) < 1e-6
    final = [joints_at(engine.arm, timeline, timeline.end) for timeline in (before, after)]
    assert largest_change(*final) < 1e-6


def test_it_stops_at_the_measured_joints() -> None:
    engine, random = session(3)
    measured = near(engine, engine.position().joints, random, 0.1)
    report = engine.resync(measured, stops=True)
    assert engine.end == report.until
    assert report.goal == ""
    assert largest_change(engine.position(engine.end).joints, measured) < SMALL


def test_it_stands_until_the_body_has_heard_of_it() -> None:
    engine, random = session(4)
    measured, leaves = near(engine, engine.position().joints, random, 0.02), engine.now + 5.0
    report = engine.resync(measured, leaves=leaves)
    assert report.until < leaves
    assert engine.position(leaves).joints == engine.position(report.until).joints
    assert any(engine.position(leaves + 0.1).velocity)


def test_joints_measured_outside_their_ranges_are_put_inside() -> None:
    engine, _ = session(5)
    engine.resync(tuple([q + 0.01 for q in engine.model.upper]), stops=True)
    assert engine.position(engine.end).joints == pytest.approx(engine.model.upper)


def test_a_straight_line_goes_on_as_one() -> None:
    engine = Engine(load_robot("puma560"))
    engine.clock.realtime = True
    engine.perform(Move(ToolOffsetTarget(translation(0.0, 0.0, -0.1)), straight=True, text="DEPART 100"))
    target = engine.destination(engine.end).T_world_tool
    engine.clock.set(0.5 * engine.end)
    q = engine.position().joints
    report = engine.resync((q[0] + 0.1, *q[1:]))
    assert report.goal == "DEPART 100"
    assert isinstance(engine.timeline[-1].path, CartesianPath)
    assert engine.destination(engine.end).T_world_tool == pytest.approx(target, abs=1e-9)


def test_a_line_that_is_out_of_reach_from_there_becomes_a_joint_motion() -> None:
    engine = Engine(load_robot("puma560"))
    engine.clock.realtime = True
    engine.perform(Move(ToolOffsetTarget(translation(0.0, 0.0, -0.1)), straight=True, text="DEPART 100"))
    goal = engine.destination(engine.end).joints
    engine.clock.set(0.5 * engine.end)
    q = engine.position().joints
    engine.resync((q[0] + 2.5, *q[1:5], q[5] + 3.0))
    assert engine.destination(engine.end).joints == pytest.approx(goal, abs=1e-9)


def test_undo_takes_it_back_in_virtual_time() -> None:
    engine = Engine(load_robot("puma560"))
    before = engine.timeline
    engine.resync(tuple([q + 0.1 for q in engine.position().joints]))
    assert engine.now == engine.end > 0.0
    assert engine.undo() == ("RESYNC",)
    assert [*engine.timeline] == [*before]


def test_no_power_leaves_it_a_stop() -> None:
    engine, _ = session(1)
    engine.perform(SetSwitch("POWER", on=False))
    with pytest.raises(PowerOff):
        engine.resync(engine.position().joints)
    engine.resync(engine.position().joints, stops=True)
