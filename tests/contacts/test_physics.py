"""The model in MuJoCo: it stands as the kinematics say, and sees what is moved from slot to slot."""

from __future__ import annotations

from itertools import combinations_with_replacement
from math import cos, dist, pi, sin
from random import Random

import pytest

pytest.importorskip("mujoco")

from tests.contacts.cases import random_turn
from tests.robots import KINDS
from vrs_cli.contacts.physics import Physics, Standing
from vrs_cli.contacts.solids import Solid, SolidForm, solids_of_robot, solids_of_shape
from vrs_cli.kinematics.model import link_frames
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import (
    at_position,
    compose,
    inverse,
    position,
    rotation_about,
    rotation_z,
    translation,
)
from vrs_cli.values.scene import Beam, BoxShape, CylinderShape, MeshShape, SphereShape
from vrs_cli.world.solids import Solid as WorldSolid
from vrs_cli.world.solids import separation, solids_of

BALL = Solid(SolidForm.BALL, (0.05, 0.0, 0.0))
MARGIN = 0.03  # [m]
(BOX,) = solids_of_shape(BoxShape((0.1, 0.1, 0.1)))
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


def solids_beside() -> list[tuple[Solid, WorldSolid]]:
    """Return solids of each form, each with the same one for the world's own search for distances (GJK)."""
    wedge = ((0.0, 0.0, 0.0), (0.1, 0.0, 0.02), (0.0, 0.1, 0.0), (0.01, 0.0, 0.1), (0.05, 0.06, 0.08))
    shapes = (BoxShape((0.34, 0.34, 0.024)), CylinderShape(0.03, 0.2), SphereShape(0.05), MeshShape((wedge,), ""))
    found = [(solids_of_shape(shape)[0], solids_of(shape)[0]) for shape in shapes]
    rod = Solid(SolidForm.CAPSULE, (0.02, 0.1, 0.0)), solids_of(Beam((0.0, 0.0, -0.1), (0.0, 0.0, 0.1), 0.02))[0]
    return [*found, rod]


@pytest.mark.parametrize(("first", "second"), list(combinations_with_replacement(range(5), 2)))
def test_distances_are_those_of_another_method(first: int, second: int) -> None:
    """MuJoCo's own way to compare two boxes misses them where they have margins, or is millimetres off."""
    rng, model, solids = Random(7), load_robot("puma560"), solids_beside()
    (one, here), (other, there) = solids[first], solids[second]
    physics, flange = Physics(model, (), kinds=(one, other), slots=1, grips=1), link_frames(model, (0.0,) * 6)[-1]
    physics.margin(MARGIN)
    compared = 0
    for _ in range(400):
        places = [at_position(random_turn(rng), *(rng.uniform(-0.15, 0.15) for _ in range(3))) for _ in range(2)]
        T_flange_one, T_flange_other = places
        true = separation(here, compose(inverse(T_flange_other), T_flange_one), there).distance
        physics.fill([Standing(50, (other,), compose(flange, T_flange_other))], Standing(51, (one,), T_flange_one))
        near = [distance for _, distance in physics.near((0.0,) * 6)]
        if 1e-4 < true < MARGIN - 1e-4:
            compared += 1
            assert min(near) == pytest.approx(true, abs=2e-5)
        elif true > MARGIN:
            assert not near
        elif true == 0.0:
            assert min(near) < 1e-5
    assert compared > 20


@pytest.mark.parametrize("lean", [0.0, 1e-9, 1e-3])
def test_cylinders_on_end_touch_the_floor_as_deep_as_they_are(lean: float) -> None:
    """MuJoCo is wrong by up to the radius above a level plane, if only rounding turns the axis of the cylinder."""
    rng, model, (radius, half) = Random(5), load_robot("ur5e"), (0.037, 0.0235)
    rod = Solid(SolidForm.CYLINDER, (radius, half, 0.0))
    physics = Physics(model, (), floor=(7, -0.3), kinds=(rod,), grips=1)
    physics.margin(MARGIN)
    for _ in range(300):
        q = tuple(rng.uniform(low, high) for low, high in zip(model.lower, model.upper, strict=True))
        gap = rng.uniform(-0.02, 0.02)
        upright = compose(rotation_about((1.0, 0.0, 0.0), lean), rotation_z(rng.uniform(-pi, pi)))
        height = -0.3 + half * cos(lean) + radius * sin(lean) + gap
        there = at_position(upright, rng.uniform(-0.5, 0.5), rng.uniform(-0.5, 0.5), height)
        physics.fill([], Standing(50, (rod,), compose(inverse(link_frames(model, q)[-1]), there)))
        assert min(distance for _, distance in physics.near(q)) == pytest.approx(gap, abs=1e-5)


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
