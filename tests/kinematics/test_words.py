"""The words of a configuration follow from where the joints are in space: not from the signs and zeros of a file."""

from __future__ import annotations

from math import inf, pi
from random import Random

import numpy as np
import pytest

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
from vrs_cli.kinematics.joints import Arm, Configuration, Elbow, Wrist

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
    q = arm.select(arm.forward(taught), (0.0,) * 6, Configuration(elbow=Elbow.ABOVE))
    assert arm.configuration(q).elbow is Elbow.ABOVE
    assert q == pytest.approx(taught, abs=1e-9)
