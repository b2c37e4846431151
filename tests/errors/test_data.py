"""Errors keep the numbers that their sentences are made of."""

from __future__ import annotations

from math import pi, radians

import pytest

from vrs_cli.engine.engine import Engine
from vrs_cli.engine.settings import MONITOR_SPEED
from vrs_cli.errors import IllegalValue, JointOutOfRange, LocationTooFar, MotionError
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import position, translation
from vrs_cli.language.run.operations import message
from vrs_cli.values.commands import JointTarget, Move, PoseTarget

PUMA = load_robot("puma560")


def test_a_joint_out_of_range_says_which_by_how_much_and_where_the_range_ends() -> None:
    engine = Engine(PUMA)
    with pytest.raises(JointOutOfRange) as caught:
        engine.begin(Move(JointTarget((0.0, -1.0, pi, 0.0, 0.0, radians(300))), straight=False), program=False)
    error = caught.value
    assert (error.joint, error.value) == (6, radians(300))
    assert (error.lower, error.upper) == (PUMA.lower[5], PUMA.upper[5])
    assert error.title == "Joint 6 out of range"


def test_a_location_too_far_says_how_far_it_is_and_how_far_the_arm_reaches() -> None:
    with pytest.raises(LocationTooFar) as caught:
        arm_for(PUMA).select(translation(0.6, 1.2, 0.0), PUMA.poses["ready"])
    error = caught.value
    assert error.value is not None
    assert error.upper is not None
    assert error.value > error.upper > 0.8
    assert error.beyond == error.value - error.upper


def test_a_straight_line_says_where_it_leaves_the_range_of_a_joint() -> None:
    engine = Engine(PUMA)
    bent = tuple(map(radians, (0.0, -90.0, 180.0, 0.0, 45.0, 0.0)))
    engine.begin(Move(JointTarget(bent), straight=False), program=False)
    engine.clock.advance(engine.end)
    x, y, z = position(engine.position().T_world_tool)
    with pytest.raises(MotionError) as caught:
        engine.begin(Move(PoseTarget(translation(x, y + 2.0, z)), straight=True), program=False)
    assert caught.value.place is not None


def test_a_number_out_of_its_bounds() -> None:
    with pytest.raises(IllegalValue) as caught:
        MONITOR_SPEED.check(1000.0)
    error = caught.value
    assert (error.value, error.lower, error.upper) == (1000.0, MONITOR_SPEED.least, MONITOR_SPEED.most)


def test_other_words_for_an_error_keep_its_numbers() -> None:
    first = JointOutOfRange("would be 9", "less", joint=3, value=9.0, lower=0.0, upper=1.0, place=(1.0, 2.0, 3.0))
    other = first.reworded(f"again: {first.detail}")
    assert str(other) == "*Joint 3 out of range* again: would be 9 (less)"
    assert str(first) == "*Joint 3 out of range* would be 9 (less)"
    assert vars(other) == {**vars(first), "detail": "again: would be 9"}


def test_a_code_alone_names_no_joint() -> None:
    assert message(JointOutOfRange.code) == "Joint out of range"
