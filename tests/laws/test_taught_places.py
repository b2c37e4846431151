"""The law of taught places, on a few poses of a few arms; `python -m tests.laws.taught_places` has more."""

from __future__ import annotations

from math import pi
from pathlib import Path
from random import Random

import numpy as np
import pytest
from msgspec import structs

from tests.kinematics.random_arms import draw_arm
from tests.laws.motion_laws import check_lines
from tests.laws.taught_places import check_way_back, refused
from tests.robots import KINDS
from vrs_cli.engine.engine import Engine
from vrs_cli.errors import LocationOutOfRange
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.model import ArmTask, axis_of, frame
from vrs_cli.kinematics.model_data import from_dict
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import (
    IDENTITY,
    along,
    angle_between,
    at_position,
    compose,
    distance,
    from_oat,
    position,
    rotation_x,
    translation,
    vector_difference,
)
from vrs_cli.values.commands import Move, PoseTarget

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


PLANES = {  # T_base_plane: the plane Y Z, the plane Z X, and one that lies along no axis
    "YZ": frame((0.0, 1.0, 0.0), (1.0, 0.0, 0.0), (0.1, 0.2, 0.3)),
    "ZX": frame((0.0, 0.0, 1.0), (0.0, 1.0, 0.0), (0.0, -0.2, 0.0)),
    "oblique": from_oat(0.1, 0.2, 0.3, 0.5, 1.1, -0.4),
}
HANDS = (IDENTITY, rotation_x(pi / 2), from_oat(0.0, 0.0, 0.0, 0.3, 0.8, 0.2))  # T_last_flange


@pytest.mark.parametrize("hand", range(len(HANDS)))
@pytest.mark.parametrize("plane", PLANES)
@pytest.mark.parametrize("robot", ["planar2", "planar3"])
def test_a_planar_arm_goes_back_in_the_plane_in_which_it_moves(robot: str, plane: str, hand: int) -> None:
    model = structs.replace(load_robot(robot), base=PLANES[plane], flange=HANDS[hand])
    arm, random = arm_for(model), Random(7)
    for _ in range(10):
        q = tuple(map(random.uniform, model.lower, model.upper))
        T = arm.forward(q)
        found = arm.forward(arm.select(T, model.poses["ready"], arm.configuration(q)))
        assert distance(found, T) < 1e-9
        if model.task is ArmTask.PLANE:
            assert angle_between(found, T) < 1e-7
        with pytest.raises(LocationOutOfRange, match="plane"):
            arm.check_task(at_position(T, *along(position(T), axis_of(PLANES[plane]).direction, 0.01)))


@pytest.mark.parametrize("plane", PLANES)
@pytest.mark.parametrize("robot", ["planar2", "planar3"])
def test_a_line_of_a_planar_arm_stays_in_its_plane(robot: str, plane: str) -> None:
    model = structs.replace(load_robot(robot), base=PLANES[plane])
    engine = Engine(model, start=tuple(x + 0.5 for x in model.poses["ready"]))
    here, there = engine.position().T_world_tool, compose(PLANES[plane], translation(0.02, 0.05, 0.0))
    goal = at_position(here, *along(position(here), vector_difference(position(there), position(PLANES[plane])), 1.0))
    engine.perform(Move(PoseTarget(goal), straight=True))
    assert distance(engine.position(engine.end).T_world_tool, goal) < 1e-8
    check_lines(engine, list(engine.timeline))


def test_an_arm_of_which_one_joint_does_not_move_the_flange_goes_back() -> None:
    """The file ends at the axis of joint 2, whose turn does not count."""
    two = load_robot("planar2")
    links = (two.links[0], structs.replace(two.links[1], a=0.0))
    model = structs.replace(two, links=links, base=PLANES["YZ"], lower=(-6.0, -6.0), upper=(6.0, 6.0))
    assert not list(refused(model, lambda q: np.reshape(arm_for(model).forward(q), (3, 4)), 20, Random(1)))


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


ROLLING = {  # an arm of four joints, the last of which rolls: in many places its tool can stand in a pose in two ways
    "name": "rolling",
    "title": "rolling",
    "joints": [
        {"a": a, "d": 0.0, "alpha": alpha, "theta": theta, "lower": lower, "upper": upper}
        | {"max_velocity": 1.57, "max_acceleration": 5.2, "max_jerk": 52.0}
        for a, alpha, theta, lower, upper in (
            (0.0, 1.5707963267948966, 0.0, -2.97, 2.97),
            (0.35355339059327373, 0.0, 1.7126933813990606, -1.48, 1.48),
            (0.0, 1.5707963267948966, 2.999695598985629, -1.658, 1.309),
            (0.0, 0.0, 0.0, -2.79, 2.79),
        )
    ],
    "flange": [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.4],
    "task": "steady",
    "tool": {"linear_speed": 0.5, "linear_acceleration": 1.7, "linear_jerk": 17.0}
    | {"angular_speed": 1.6, "angular_acceleration": 5.2, "angular_jerk": 52.0},
    "poses": {"ready": [0.0] * 4, "nest": [0.0] * 4},
}


@pytest.mark.parametrize(
    "joints",
    [
        (-2.6841846719766305, 0.8356898380574709, -1.6041833344121563, -0.1379777037400145),
        (-2.362329614966096, 0.615788141575575, -1.52728258854153, 0.2230330357892183),
        (-0.4270871246875867, 1.2695743437930442, -1.4643694604621833, 0.7430922237548665),
    ],
)
def test_most_searches_may_agree_on_a_turn_that_is_not_the_least(joints: tuple[float, ...]) -> None:
    arm = arm_for(from_dict(ROLLING))
    check_way_back(arm, joints, lambda q: np.reshape(arm.forward(q), (3, 4)))
