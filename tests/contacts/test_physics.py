"""The model in MuJoCo: it stands as the kinematics say, and sees what is moved from slot to slot."""

from __future__ import annotations

from math import dist
from random import Random

import pytest

pytest.importorskip("mujoco")

from tests.robots import KINDS
from vrs_cli.contacts.physics import Physics, Standing
from vrs_cli.contacts.solids import Solid, SolidForm, solids_of_robot
from vrs_cli.kinematics.model import link_frames
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import position, translation

BALL = Solid(SolidForm.BALL, (0.05, 0.0, 0.0))
BOX = Solid(SolidForm.BOX, (0.05, 0.05, 0.05))
WEDGE = Solid(SolidForm.HULL, points=((0.0, 0.0, 0.0), (0.1, 0.0, 0.0), (0.0, 0.1, 0.0), (0.0, 0.0, 0.1)))


@pytest.mark.parametrize("robot", KINDS)
def test_links_stand_as_the_kinematics_say(robot: str) -> None:
    rng, model = Random(3), load_robot(robot)
    physics = Physics(model, solids_of_robot(model))
    for _ in range(20):
        q = tuple(rng.uniform(low, high) for low, high in zip(model.lower, model.upper, strict=True))
        physics.near(q)
        for i, T in enumerate(link_frames(model, q)):
            assert dist(physics.d.body(f"link{i}").xpos, position(T)) < 1e-9


@pytest.mark.parametrize("solid", [BALL, BOX, WEDGE])
def test_parts_in_slots_are_seen_where_they_are_put(solid: Solid) -> None:
    """Of parts that were put into a model which is compiled already, in the scene and in the hand."""
    model = load_robot("puma560")
    links, ready = solids_of_robot(model), model.poses["ready"]
    physics = Physics(model, links, kinds=(BALL, BOX, WEDGE), slots=2, grips=1)
    far, tip = translation(2.0, 0.0, 0.0), position(link_frames(model, ready)[-1])
    physics.margin(0.0)
    physics.fill([Standing(50, (BALL,), far), Standing(51, (solid,), far)])
    assert not physics.near(ready)
    physics.fill([Standing(50, (BALL,), far), Standing(51, (solid,), translation(*tip))])
    assert {physics.owners_of(key) for key, _ in physics.near(ready)} >= {(6, 51)}
    physics.fill([Standing(51, (BALL,), translation(tip[0] + 0.5, tip[1], tip[2]))], Standing(52, (solid,), far))
    assert not physics.near(ready)
    physics.fill([Standing(51, (BALL,), translation(tip[0] + 2.0, tip[1], tip[2]))], Standing(52, (solid,), far))
    assert {physics.owners_of(key) for key, _ in physics.near(ready)} == {(51, 52)}
    physics.fill([])
    assert not physics.near(ready)


def test_distances_are_those_between_the_solids() -> None:
    model = load_robot("puma560")
    physics = Physics(model, (), kinds=(BALL, BOX), slots=1, grips=1)
    tip = position(link_frames(model, model.poses["ready"])[-1])
    physics.margin(0.3)
    for gap in (0.2, 0.01, -0.01):
        there = translation(tip[0], tip[1], tip[2] + 0.1 + gap)
        physics.fill([Standing(50, (BOX,), there)], Standing(51, (BALL,), translation(0.0, 0.0, 0.0)))
        ((_, distance),) = physics.near(model.poses["ready"])
        assert distance == pytest.approx(gap, abs=1e-6)
