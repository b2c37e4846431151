"""The law of taught places, on a few poses of a few arms; `python -m tests.laws.taught_places` has more."""

from __future__ import annotations

from pathlib import Path
from random import Random

import numpy as np
import pytest

from tests.kinematics.random_arms import draw_arm
from tests.laws.taught_places import check_way_back, refused
from tests.robots import KINDS
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.robot_file import load_robot

SHORT = Path(__file__).parents[1] / "kinematics" / "urdf" / "short.urdf"
CAUGHT = ((-70.8, 20.2, 146.4, 103.9, 2.9), (-18.7, 35.0, 54.9, 132.3, -59.1), (-66.2, 92.8, 116.3, 122.2, 183.9))
NEARLY = (-132.68, 105.57, -70.99, -34.52, -237.15)  # which other joints, sooner there, miss by 3e-4 rad
SINGULAR = (-40.552521, 19.888211, -163.773385, -118.635869, 4.128425)  # of an SO-100: 4e-5 of the largest freedom


@pytest.mark.parametrize("seed", range(4))
def test_a_random_arm_goes_back_to_taught_places(seed: int, tmp_path: Path) -> None:
    drawn = draw_arm(Random(seed), 4 + seed % 4)
    assert not list(refused(drawn.model(tmp_path), drawn.forward, 2, Random(seed)))


@pytest.mark.parametrize("robot", KINDS)
def test_a_robot_goes_back_to_taught_places(robot: str) -> None:
    model = load_robot(robot)
    forward = arm_for(model).forward
    assert not list(refused(model, lambda q: np.reshape(forward(q), (3, 4)), 10, Random(560)))


@pytest.mark.parametrize("degrees", [*CAUGHT, NEARLY])
def test_places_around_which_searches_are_caught_by_limits(degrees: tuple[float, ...]) -> None:
    arm = arm_for(load_robot(SHORT))
    check_way_back(arm, arm.model.units.read(degrees), lambda q: np.reshape(arm.forward(q), (3, 4)))


def test_a_place_whose_joints_are_singular_though_all_of_them_count(tmp_path: Path) -> None:
    drawn = draw_arm(Random(1), 5)
    joints = (2.2768874262576273, 0.6536612479044743, -7.256873831988552, -3.1410338753896645, -0.7425280071047976)
    check_way_back(arm_for(drawn.model(tmp_path)), joints, drawn.forward)


def test_a_place_whose_joints_are_singular() -> None:
    arm = arm_for(load_robot("so100"))
    check_way_back(arm, arm.model.units.read(SINGULAR), lambda q: np.reshape(arm.forward(q), (3, 4)))
