"""Formulas that are written out for an arm: the product of its links, whatever their lengths are."""

from __future__ import annotations

import random
from math import pi
from random import Random

import pytest
from msgspec import structs

from vrs_cli.errors import StraightLineSingular
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.compiled import formulas
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.model import Link, link_transform
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import IDENTITY, Transform, compose, from_oat, translation

ROUND = (0.0, 1.0, -1.0, 0.1, 10.0, -10.0, 2.0)  # [m] what could be written shorter, or be taken for nothing


@pytest.mark.parametrize("seed", range(20))
def test_the_product_of_links_of_round_lengths(seed: int) -> None:
    random = Random(seed)
    links = tuple(
        Link(random.choice(ROUND), random.choice(ROUND), random.choice((0.0, pi / 2, -pi / 2, pi, 0.3)))
        for _ in range(4)
    )
    base, flange = translation(*random.choices(ROUND, k=3)), translation(*random.choices(ROUND, k=3))
    q = tuple(random.uniform(-3.0, 3.0) for _ in links)
    expected = compose(IDENTITY, base)
    for link, angle in zip(links, q, strict=True):
        expected = compose(expected, link_transform(link, angle))
    assert formulas(links, base, flange).forward(q) == pytest.approx(compose(expected, flange), abs=1e-13)


def test_the_rounding_of_a_right_angle_is_taken_away() -> None:
    """Half a turn about x, as a sine and a cosine give it."""
    almost = 1.0 - 2.0**-53
    base = IDENTITY._replace(nx=almost, sy=-almost, az=-almost, ay=1.2e-16, sz=1.2e-16)
    exact = IDENTITY._replace(sy=-1.0, az=-1.0)
    assert formulas((Link(0.0, 0.0, 0.0),), base, IDENTITY).forward((0.0,)) == exact


PUMA = load_robot("puma560")
ARM = arm_for(PUMA)
PEDESTAL = arm_for(structs.replace(PUMA, name="pedestal", links=(Link(0.15, 0.5, -pi / 2), *PUMA.links[1:])))
READY = PUMA.poses["ready"]
TOOL = from_oat(0.03, -0.05, 0.12, 0.4, 0.5, 0.6)


def rates(source: random.Random) -> Joints:
    return tuple(source.uniform(-2.0, 2.0) for _ in range(6))


def on_way(t: float, *derivatives: Joints) -> Joints:
    """Joints of which these, from the value on, are the derivatives at time 0."""
    powers = (1.0, t, t * t / 2.0, t**3 / 6.0)
    return tuple(sum(a * b for a, b in zip(powers, row, strict=False)) for row in zip(*derivatives, strict=True))


@pytest.mark.parametrize("arm", [ARM, PEDESTAL, *map(arm_for, map(load_robot, ("ur5e", "irb120", "cobra600")))])
@pytest.mark.parametrize("tool", [IDENTITY, TOOL])
def test_they_give_the_tool_its_acceleration_and_jerk(arm: RobotArm, tool: Transform) -> None:
    source, h, tried = random.Random(1), 1e-3, 0
    for _ in range(40):
        q = tuple(map(source.uniform, arm.model.lower, arm.model.upper))
        if min(arm.singularity(q)) < 0.1:
            continue
        tried += 1
        ways = [q, *(rates(source)[: len(q)] for _ in range(3))]
        before, now, after = (arm.twist(on_way(t, *ways), on_way(t, *ways[1:]), tool) for t in (-h, 0.0, h))
        acceleration = tuple((b - a) / (2.0 * h) for a, b in zip(before, after, strict=True))
        jerk = tuple((a + b - 2.0 * m) / (h * h) for a, m, b in zip(before, now, after, strict=True))
        assert arm.joint_acceleration(q, ways[1], acceleration, tool) == pytest.approx(ways[2], abs=2e-3)
        assert arm.joint_jerk(q, ways[1], ways[2], jerk, tool) == pytest.approx(ways[3], abs=2e-3)
    assert tried > 10


def test_a_lost_direction_is_refused_as_for_velocities() -> None:
    still = (0.0,) * 6
    down = ARM.joint_acceleration(READY, still, (0.0, 0.0, -1.0, 0.0, 0.0, 0.0))
    assert down == pytest.approx(ARM.joint_velocity(READY, (0.0, 0.0, -1.0, 0.0, 0.0, 0.0)))
    with pytest.raises(StraightLineSingular, match="wrist"):
        ARM.joint_acceleration(READY, still, (0.0, 0.0, 0.0, 0.5, 0.0, 0.0))
    with pytest.raises(StraightLineSingular, match="wrist"):
        ARM.joint_jerk(READY, still, still, (0.0, 0.0, 0.0, 0.5, 0.0, 0.0))
