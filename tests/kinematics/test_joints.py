"""Turns of a joint."""

from __future__ import annotations

import pickle
from math import inf, pi, radians
from random import Random

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.kinematics.words import (
    ARMS,
    EVERY,
    PUMA,
    STRAIGHT,
    check_words,
    model_of,
    points,
    reversed_axes,
    some_arms,
    some_joints,
)
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.joints import (
    ALL,
    LIMIT_TOLERANCE,
    Arm,
    Configuration,
    Elbow,
    JointKind,
    JointUnits,
    Wrist,
    joints_outside,
    largest_change,
    nearest_turn,
    turn_within,
)
from vrs_cli.kinematics.robot_file import load_robot

ANGLE = st.floats(-12.0, 12.0)


@given(ANGLE, ANGLE)
def test_the_nearest_turn_is_within_half_a_turn(angle: float, reference: float) -> None:
    turn = nearest_turn(angle, reference)
    assert abs(turn - reference) <= pi + 1e-12
    assert (turn - angle) / (2 * pi) == pytest.approx(round((turn - angle) / (2 * pi)), abs=1e-12)


@given(ANGLE, ANGLE, st.floats(-6.0, 0.0), st.floats(0.1, 6.0))
def test_the_turn_within_is_the_nearest_of_all_inside(
    angle: float, reference: float, lower: float, upper: float
) -> None:
    inside = [t for k in range(-6, 7) if lower <= (t := angle + 2 * pi * k) <= upper]
    turn = turn_within(angle, reference, lower, upper)
    if not inside:
        assert turn is None or min(turn - lower, upper - turn) < LIMIT_TOLERANCE
    else:
        assert turn is not None
        assert lower <= turn <= upper
        nearest = min(inside, key=lambda t: abs(t - reference))
        assert abs(turn - reference) == pytest.approx(abs(nearest - reference), abs=2 * LIMIT_TOLERANCE)


def test_joint_6_of_a_puma_has_two_turns_to_choose_from() -> None:
    low, high = radians(-266), radians(266)
    assert turn_within(radians(100), radians(-200), low, high) == pytest.approx(radians(-260))
    assert turn_within(radians(100), radians(50), low, high) == pytest.approx(radians(100))
    assert turn_within(radians(90), radians(-266), low, high) == pytest.approx(radians(90))  # -270 is outside


def test_rounding_at_a_limit_is_forgiven_and_set_right() -> None:
    assert turn_within(1.0 + 1e-12, 0.0, -1.0, 1.0) == 1.0
    assert turn_within(-1.0 - 1e-12, 0.0, -1.0, 1.0) == -1.0
    assert turn_within(1.0 + 1e-6, 0.0, -1.0, 1.0) is None


def test_joints_outside_counts_from_one() -> None:
    assert joints_outside((0.0, 2.0, -2.0), (-1.0,) * 3, (1.0,) * 3) == (2, 3)
    assert joints_outside((1.0 + 1e-12, 0.0, 0.0), (-1.0,) * 3, (1.0,) * 3) == ()


def test_largest_change() -> None:
    assert largest_change((0.0, 1.0), (0.5, -1.0)) == 2.0


def test_turns_are_shown_in_degrees_and_slides_in_millimetres_and_read_back() -> None:
    units = JointUnits((JointKind.REVOLUTE, JointKind.PRISMATIC))
    q, shown = (0.5 * pi, 0.25, -pi), (90.0, 250.0, -180.0)
    assert units.to_display(q[:2]) == shown[:2]
    assert units.read(shown[:2]) == q[:2]
    for joint, (x, number, unit) in enumerate(zip(q, shown, ("deg", "mm", "deg"), strict=True), 1):
        assert units.one_shown(joint, x) == number
        assert units.one_read(joint, number) == x
        assert units.unit(joint) == unit
        assert units.slides(joint) == (unit == "mm")
    assert not units.slides(0)
    assert units.json_units(2) == {"joint_units": ["deg", "mm"]}
    assert units.json_units(1) == {}


ARM = arm_for(load_robot("puma560"))


def test_the_eight_in_their_order() -> None:
    assert [str(c) for c in ALL] == [
        "RIGHTY ABOVE NOFLIP",
        "RIGHTY ABOVE FLIP",
        "RIGHTY BELOW NOFLIP",
        "RIGHTY BELOW FLIP",
        "LEFTY ABOVE NOFLIP",
        "LEFTY ABOVE FLIP",
        "LEFTY BELOW NOFLIP",
        "LEFTY BELOW FLIP",
    ]
    assert [c.index for c in ALL] == list(range(8))
    assert ALL[5].signs == (-1.0, 1.0, -1.0)


def test_equal_by_value_and_fit_for_pickle() -> None:
    c = Configuration.of(Arm.LEFTY, Elbow.BELOW, Wrist.FLIP)
    assert c == ALL[7]
    assert hash(c) == hash(ALL[7])
    assert pickle.loads(pickle.dumps(c)) == c


def test_words_beside() -> None:
    assert ALL[7].words_beside((ALL[0],)) == ("LEFTY", "BELOW", "FLIP")
    assert ALL[5].words_beside((ALL[0], ALL[1])) == ("LEFTY",)


@pytest.mark.parametrize(
    ("degrees", "expected"),
    [
        ((0, -90, 90, 0, 0, 0), "RIGHTY ABOVE NOFLIP"),  # READY
        ((0, 0, 0, 0, 0, 0), "LEFTY BELOW NOFLIP"),  # forearm up from the end of a level upper arm
        ((0, -200, -30, 0, 50, 0), "RIGHTY ABOVE NOFLIP"),  # NEST
        ((20, -60, 150, 10, -30, -40), "LEFTY ABOVE FLIP"),  # forearm hangs from a raised upper arm
        ((20, -60, 30, 10, 30, -40), "RIGHTY ABOVE NOFLIP"),  # forearm laid back over the shoulder
    ],
)
def test_configuration_of_joints(degrees: tuple[float, ...], expected: str) -> None:
    assert str(ARM.configuration(tuple(map(radians, degrees)))) == expected


@pytest.mark.parametrize("q2", range(-220, 45, 9))
def test_righty_is_where_joint_2_raises_the_wrist(q2: int) -> None:
    here = tuple(map(radians, (10, q2, 150, 0, 30, 0)))
    there = (*here[:1], here[1] + 1e-6, *here[2:])

    def wrist_height(q: tuple[float, ...]) -> float:
        T = ARM.forward(q)
        return T.pz - 0.05625 * T.az

    raises = wrist_height(there) > wrist_height(here)
    assert (ARM.configuration(here).arm is Arm.RIGHTY) == raises


ALL_WORDS = {"RIGHTY", "LEFTY", "ABOVE", "BELOW", "NOFLIP", "FLIP"}


@pytest.mark.parametrize("name", EVERY)
def test_words_follow_from_positions_alone(name: str) -> None:
    source, model = Random(name), model_of(name)
    seen = [check_words(name, model, some_joints(model, source)) for _ in range(30)]
    for other, random in some_arms(name):
        seen += [check_words(name, other, some_joints(other, random)) for _ in range(3)]
    assert {word.name for words in seen for word in words} == ALL_WORDS


@pytest.mark.parametrize("name", ARMS)
def test_every_way_is_found_under_its_words(name: str) -> None:
    for model, source in some_arms(name):
        arm: RobotArm = arm_for(model)
        for _ in range(2):
            T = arm.forward(some_joints(model, source))
            batch, _ = arm.batch.inverse(np.reshape(T, (1, 3, 4)))
            for way, q, row in zip(arm.ways, arm.branches(T), batch[0], strict=True):
                if q is None:
                    assert np.isnan(row).any()
                    continue
                assert arm.configuration(q) in (way, *arm.twins(q))
                assert row == pytest.approx(q, abs=1e-9)
                one = arm.branch_joints(T, way, q)
                assert one == pytest.approx(q, abs=1e-9)
                (many,) = arm.batch.inverse_branch(np.reshape(T, (1, 3, 4)), way, np.array([q]))
                assert many == pytest.approx(q, abs=1e-9)


@pytest.mark.parametrize("name", EVERY)
def test_the_arm_is_out_of_the_axis_of_joint_1_on_the_side_of_its_word(name: str) -> None:
    for model, source in [(model_of(name), Random(name)), *some_arms(name)]:
        arm = arm_for(model)
        for q in (some_joints(model, source) for _ in range(5)):
            if (out := arm.outward(q)) != inf:
                assert arm.configuration(q).arm is (Arm.RIGHTY if out < 0.0 else Arm.LEFTY)


def test_a_wrist_is_judged_by_joint_5() -> None:
    for signs in ((1.0,) * 6, (-1.0,) * 6):
        arm = arm_for(reversed_axes(PUMA, signs))
        assert arm.configuration((0.3, -1.0, 1.0, 0.2, 0.5, 0.0)).wrist is Wrist.NOFLIP
        assert arm.configuration((0.3, -1.0, 1.0, 0.2, -0.5, 0.0)).wrist is Wrist.FLIP


def test_an_arm_goes_back_to_where_it_was_taught_by_its_words() -> None:
    """With joint 1 pointing down, as on many arms, an elbow that is up was called BELOW."""
    model = reversed_axes(STRAIGHT, (-1.0, 1.0, 1.0, -1.0, 1.0, -1.0))
    arm = arm_for(model)
    taught = (0.4, -pi / 3, pi, 0.1, 0.6, 0.2)
    at = points(model, taught)
    assert at.elbow[2] > max(at.shoulder[2], at.wrist[2])
    q = arm.select(arm.forward(taught), (0.0,) * 6, Configuration.of(elbow=Elbow.ABOVE))
    assert arm.configuration(q).elbow is Elbow.ABOVE
    assert q == pytest.approx(taught, abs=1e-9)
