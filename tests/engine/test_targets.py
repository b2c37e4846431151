"""Tests of targets that depend on where the motion before ends: DRIVE, DEPART, ALIGN."""

from __future__ import annotations

from math import acos, dist, pi, radians

import pytest

from vrs_cli.engine.engine import Engine
from vrs_cli.engine.targets import align
from vrs_cli.errors import JointOutOfRange
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import (
    IDENTITY,
    Transform,
    angle_between,
    compose,
    dot,
    inverse,
    rotation_x,
    rotation_y,
    translation,
)
from vrs_cli.values.commands import (
    AlignedTarget,
    Break,
    JointOffsetTarget,
    JointTarget,
    Move,
    PoseTarget,
    SetBase,
    Stamp,
    Target,
    ToolOffsetTarget,
)

START: Joints = tuple(radians(q) for q in (10.0, -60.0, 70.0, 5.0, 40.0, 20.0))
ASIDE: Joints = tuple(radians(q) for q in (30.0, -70.0, 80.0, 0.0, 30.0, 0.0))


def close(a: Transform, b: Transform) -> bool:
    return max(abs(x - y) for x, y in zip(a, b, strict=True)) < 1e-9


def engine_at_start() -> Engine:
    return Engine(load_robot("puma560"), start=START)


def give(engine: Engine, target: Target, *, at: float | None = None, straight: bool = False) -> None:
    engine.perform(Move(target, straight, stamp=None if at is None else Stamp(at)))


def tip(engine: Engine, t: float) -> Transform:
    return engine.position(t).T_world_tool


@pytest.mark.parametrize("angle", [0.0, 10.0, 44.0, -44.0, 100.0, 180.0])
def test_align_turns_the_tool_to_the_nearest_axis(angle: float) -> None:
    T = compose(translation(0.1, 0.2, 0.3), rotation_x(radians(angle)))
    right_angles = round(angle / 90.0)
    assert close(align(T), compose(translation(0.1, 0.2, 0.3), rotation_x(radians(90.0 * right_angles))))


@pytest.mark.parametrize("angle", [1e-2, 1e-8, 5e-12])
def test_however_little_the_tool_is_tilted_align_takes_it_away(angle: float) -> None:
    assert abs(align(rotation_x(angle)).sz) < 2e-13 * (1.0 + angle)
    assert abs(align(rotation_x(angle)).ay) < 2e-13 * (1.0 + angle)


def test_drive_goes_on_from_where_an_inserted_motion_ends() -> None:
    engine = engine_at_start()
    give(engine, JointOffsetTarget(1, radians(40.0)), at=5.0)
    give(engine, JointTarget(ASIDE), at=1.0)
    assert engine.position(engine.end).joints == pytest.approx((radians(70.0), *ASIDE[1:]))


@pytest.mark.parametrize("straight", [False, True])
def test_depart_backs_off_from_where_an_inserted_motion_ends(straight: bool) -> None:
    engine = engine_at_start()
    back = translation(0.0, 0.0, -0.05)
    give(engine, ToolOffsetTarget(back), at=5.0, straight=straight)
    give(engine, JointTarget(ASIDE), at=1.0)
    assert close(tip(engine, engine.end), compose(tip(engine, 4.9), back))
    assert engine.position(4.9).joints == pytest.approx(ASIDE)


def test_align_keeps_the_place_that_an_inserted_motion_reached() -> None:
    engine = engine_at_start()
    engine.perform(SetBase(compose(translation(0.0, 0.0, 0.2), rotation_y(0.3))))
    give(engine, AlignedTarget(), at=5.0, straight=True)
    give(engine, JointTarget(ASIDE), at=1.0)
    assert close(tip(engine, engine.end), align(tip(engine, 4.9)))
    assert not close(tip(engine, engine.end), tip(engine, 4.9))


@pytest.mark.parametrize("axis", [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)])
def test_align_turns_the_shortest_way_to_the_nearest_of_six_axes(axis: tuple[int, int, int]) -> None:
    along = next(
        T
        for T in (IDENTITY, rotation_x(pi), *(turn(s * pi / 2) for turn in (rotation_x, rotation_y) for s in (1, -1)))
        if dist((T.ax, T.ay, T.az), axis) < 1e-9
    )
    tilted = compose(along, compose(rotation_x(0.3), rotation_y(-0.4)))
    aligned = align(tilted)
    assert (aligned.ax, aligned.ay, aligned.az) == pytest.approx(axis, abs=1e-12)
    assert angle_between(aligned, tilted) == pytest.approx(acos(dot((tilted.ax, tilted.ay, tilted.az), axis)))


def test_motions_that_follow_a_relative_one_are_planned_from_its_new_end() -> None:
    engine = engine_at_start()
    give(engine, JointOffsetTarget(1, radians(40.0)), at=5.0)
    give(engine, JointOffsetTarget(2, radians(-10.0)), at=10.0)
    give(engine, JointTarget(ASIDE), at=1.0)
    expected = (ASIDE[0] + radians(40.0), ASIDE[1] - radians(10.0), *ASIDE[2:])
    assert engine.position(engine.end).joints == pytest.approx(expected)


def test_a_relative_motion_that_would_leave_its_range_names_itself_and_nothing_changes() -> None:
    engine = engine_at_start()
    engine.perform(Move(JointOffsetTarget(1, radians(100.0)), False, stamp=Stamp(5.0), text="DRIVE 1, 100"))
    before = engine.timeline
    with pytest.raises(JointOutOfRange, match="DRIVE 1, 100, scheduled later"):
        give(engine, JointTarget((radians(80.0), *START[1:])), at=1.0)
    assert engine.timeline is before


def test_a_pose_is_where_it_is_whatever_comes_before() -> None:
    engine = engine_at_start()
    goal = compose(tip(engine, 0.0), translation(0.0, 0.0, -0.05))
    give(engine, PoseTarget(goal), at=5.0)
    give(engine, JointTarget(ASIDE), at=1.0)
    assert close(compose(inverse(goal), tip(engine, engine.end)), translation(0.0, 0.0, 0.0))


def test_a_straight_drive_goes_on_from_where_an_inserted_motion_ends() -> None:
    engine = engine_at_start()
    give(engine, JointOffsetTarget(1, radians(20.0)), at=5.0, straight=True)
    give(engine, JointTarget(ASIDE), at=1.0)
    assert engine.position(engine.end).joints == pytest.approx((radians(50.0), *ASIDE[1:]))


@pytest.mark.parametrize("stop", [False, True])
def test_a_move_keeps_the_arm_and_elbow_that_the_motion_before_ends_with(stop: bool) -> None:
    """They are not those of the arm while it still slows down, where a motion without BREAK begins."""
    engine = Engine(load_robot("irb120"))
    elbow_down = tuple(radians(q) for q in (86.8, -70.6, 41.0, 106.5, -13.3, -198.8))
    place = engine.world_pose(tuple(radians(q) for q in (83.9, -73.3, 40.6, 104.2, -13.3, 146.3)))
    engine.perform(Move(JointTarget(elbow_down), False), program=True)
    if stop:
        engine.perform(Break())
    engine.perform(Move(PoseTarget(place), False), program=True)
    assert str(engine.arm.configuration(engine.position(engine.end).joints)) == "RIGHTY BELOW FLIP"
