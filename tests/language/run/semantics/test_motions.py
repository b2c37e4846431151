"""Motions: what each asks for."""

from __future__ import annotations

from math import pi, radians

import pytest

from tests.language.run.semantics.asked import DOWN, PART, close, move, only
from tests.language.running import run_lines
from vrs_cli.errors import IllegalJoint, IllegalValue
from vrs_cli.kinematics.transform import compose, from_oat, rotation_z, translation
from vrs_cli.values.commands import (
    AlignedTarget,
    Break,
    Delay,
    JointOffsetTarget,
    JointTarget,
    Move,
    NamedTarget,
    PoseTarget,
    Stamp,
    ToolOffsetTarget,
)


@pytest.mark.parametrize(
    ("line", "straight", "hand"),
    [
        ("MOVE part", False, None),
        ("MOVES part", True, None),
        ("MOVET part, 1", False, 1.0),
        ("MOVET part, TRUE", False, 1.0),
        ("MOVEST part, 0", True, 0.0),
        ("MOVET part, -5", False, 0.0),
    ],
)
def test_moves_to_a_transformation(line: str, straight: bool, hand: float | None) -> None:
    request = move(PART, line)
    assert isinstance(request.target, PoseTarget)
    assert close(request.target.T_world_tool, DOWN)
    assert (request.straight, request.hand, request.speed, request.stamp) == (straight, hand, None, None)
    assert request.text == line


def test_moves_to_a_precision_point() -> None:
    assert move("MOVE #PPOINT(0, -90, 90)").target == JointTarget((0.0, radians(-90), radians(90), 0.0, 0.0, 0.0))


def test_compounds_multiply_from_left_to_right() -> None:
    request = move("SET a = TRANS(100)", "SET b = RZ(90)", "SET c = TRANS(10)", "MOVE a:b:c")
    assert isinstance(request.target, PoseTarget)
    expected = compose(compose(translation(0.1, 0, 0), rotation_z(pi / 2)), translation(0.01, 0, 0))
    assert close(request.target.T_world_tool, expected)


@pytest.mark.parametrize(("line", "z"), [("APPRO part, 50", -0.05), ("APPRO part, -20", -0.12)])
def test_approach_is_back_along_the_tool(line: str, z: float) -> None:
    request = move(PART, line)
    assert isinstance(request.target, PoseTarget)
    assert not request.straight
    assert close(request.target.T_world_tool, from_oat(0.5, 0.15, z, pi / 2, pi / 2, 0.0))


def test_straight_approach_and_departure() -> None:
    assert move(PART, "APPROS part, 50").straight
    assert move("DEPARTS 30").straight
    assert move("DEPART 30") == Move(ToolOffsetTarget(translation(0, 0, -0.03)), False, text="DEPART 30")


def test_drive_turns_one_joint() -> None:
    assert move("DRIVE 2, -30") == Move(JointOffsetTarget(2, radians(-30)), False, text="DRIVE 2, -30")
    assert move("DRIVE 6, 10, 25").speed == 0.25


@pytest.mark.parametrize(("number", "joint"), [("0.5", 1), ("1.49", 1), ("5.5", 6), ("6.49", 6)])
def test_the_joint_of_drive_is_rounded(number: str, joint: int) -> None:
    assert move(f"DRIVE {number}, 10").target == JointOffsetTarget(joint, radians(10))


@pytest.mark.parametrize("number", ["0", "0.49", "6.5", "7", "-1", "1E9"])
def test_drive_has_no_joint_beyond_the_first_and_the_last(number: str) -> None:
    assert isinstance(run_lines(f"DRIVE {number}, 10").error, IllegalJoint)


@pytest.mark.parametrize("speed", ["0", "-1", "100.1"])
def test_drive_has_no_speed_beyond_the_robots(speed: str) -> None:
    assert isinstance(run_lines(f"DRIVE 1, 10, {speed}").error, IllegalValue)
    assert move("DRIVE 1, 10, 100").speed == 1.0


def test_named_poses() -> None:
    assert move("READY").target == NamedTarget("ready")
    assert move("NEST").target == NamedTarget("nest")


@pytest.mark.parametrize(
    ("line", "stamp"),
    [
        ("MOVE part AT 3", Stamp(3.0)),
        ("MOVES part AT 1+1", Stamp(2.0)),
        ("APPRO part, 50 IN 0.5", Stamp(0.5, relative=True)),
        ("DEPART 50 AT 0", Stamp(0.0)),
        ("DRIVE 1, 10 IN 2", Stamp(2.0, relative=True)),
        ("READY AT 9", Stamp(9.0)),
    ],
)
def test_time_stamps(line: str, stamp: Stamp) -> None:
    assert move(PART, line).stamp == stamp


def test_align_is_worked_out_where_the_last_motion_ends() -> None:
    assert move("ALIGN") == Move(AlignedTarget(), True, text="ALIGN")


def test_delay_and_break() -> None:
    assert only("DELAY 0.5") == Delay(0.5, "DELAY 0.5")
    assert only("BREAK") == Break()
