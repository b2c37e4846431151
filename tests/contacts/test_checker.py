"""The first contact of a motion: laws on random motions among random things, and what does not count."""

from __future__ import annotations

from math import pi
from random import Random

import pytest

pytest.importorskip("mujoco")

from tests.contacts.cases import Case, cases, looked_at_all
from vrs_cli.contacts.checker import SLOTS, Checker, touching_at_rest
from vrs_cli.contacts.sweep import HeldPart, Stage
from vrs_cli.engine.engine import Engine
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import IDENTITY, Transform, at_position, translation
from vrs_cli.values.commands import JointTarget, Move, PoseTarget
from vrs_cli.values.scene import BoxShape, CellScene, Fixture, ScenePart, Shape, SphereShape

GREY = (0.5, 0.5, 0.5)
PLANAR = "planar2"
EXACT = 1e-3  # [s]
HAND_LONG = 0.108  # [m]


@pytest.mark.parametrize("robot", ["puma560", "cobra600"])
def test_first_contact_is_that_of_a_look_at_all_poses(robot: str) -> None:
    hits = 0
    for case in cases(Random(12), 8, robot, motions=4):
        found = case.found()
        assert looked_at_all(case).agrees(found)
        hits += found is not None
    assert hits


def driven(scene: CellScene, goal: tuple[float, ...], clearance: float = 0.0, held: HeldPart | None = None) -> Case:
    """The PUMA goes from READY to joints, among things that all stand."""
    engine = Engine(load_robot("puma560"))
    engine.perform(Move(JointTarget(goal), False))
    standing = {one.name: one.T_world_part for one in scene.parts if held is None or one.name != held.name}
    stage = Stage(0.0, engine.end, engine.frames, standing, held, ([0.0], [0.0]))
    return Case(Checker(engine.arm, scene, clearance), engine.timeline, stage)


def fixture(shape: Shape, T: Transform) -> CellScene:
    return CellScene(fixtures=(Fixture("box", shape, T, GREY),))


TURNED = (1.0, -1.5707963267948966, 1.5707963267948966, 0.0, 1.2, 0.0)
WALL = fixture(BoxShape((0.05, 0.05, 0.05)), translation(0.0, 0.2, 0.95))


def test_contact_tells_time_pair_place_depth_and_what_is_needed() -> None:
    engine = Engine(load_robot("puma560"))
    down = (0.0, -0.4, 1.2, 0.0, 0.5, 0.0)
    engine.perform(Move(JointTarget(down), False))
    tip = engine.position(engine.end).T_world_tool
    scene = fixture(BoxShape((0.2, 0.2, 0.2)), translation(tip.px, tip.py, tip.pz))
    found = driven(scene, down).found()
    assert found is not None
    assert {found.first, found.second} == {"hand", "box"}
    assert 0.0 < found.t < engine.end
    assert all(abs(x - centre) < 0.11 for x, centre in zip(found.place, (tip.px, tip.py, tip.pz), strict=True))
    assert found.depth > 0.05
    assert found.needed == pytest.approx(found.depth)
    assert found.describe().startswith(f"hand touches box at {found.t:.3f} s near X ")


def test_clearance_counts_what_comes_near() -> None:
    scene = fixture(SphereShape(0.05), translation(0.0, 0.0, 1.2))
    goal = (0.4, -1.5707963267948966, 1.5707963267948966, 0.0, 0.0, 0.0)
    assert driven(scene, goal).found() is None
    checker = driven(scene, goal, clearance=0.3)
    assert checker.found() is None  # nearer from the beginning on: that is excused


def test_clearance_is_kept_by_what_comes_nearer() -> None:
    for clearance in (0.0, 0.02, 0.1):
        engine = Engine(load_robot("puma560"))
        goal = (0.0, -1.0, 1.5707963267948966, 0.0, 0.0, 0.0)
        engine.perform(Move(JointTarget(goal), False))
        tip = engine.position(engine.end).T_world_tool
        scene = fixture(SphereShape(0.02), translation(tip.px, tip.py, tip.pz + 0.2))
        found = driven(scene, goal, clearance).found()
        assert (found is None) == (clearance < 0.1)
        if found is not None:
            assert found.depth == 0.0
            assert 0.0 < found.needed <= 0.1
            assert "too near" in found.describe()


def test_held_part_touches_where_the_hand_does_not() -> None:
    goal = (0.0, -1.0, 1.5707963267948966, 0.0, 0.0, 0.0)
    engine = Engine(load_robot("puma560"))
    engine.perform(Move(JointTarget(goal), False))
    tip = engine.position(engine.end).T_world_tool
    parts = (ScenePart("rod", BoxShape((0.02, 0.02, 0.5)), translation(5.0, 5.0, 5.0), GREY, 1.0),)
    box = Fixture("box", BoxShape((0.05, 0.05, 0.05)), translation(tip.px, tip.py, tip.pz + 0.3), GREY)
    scene = CellScene(parts, (box,))
    assert driven(scene, goal).found() is None
    found = driven(scene, goal, held=HeldPart("rod", translation(0.0, 0.0, 0.25))).found()
    assert found is not None
    assert {found.first, found.second} == {"rod", "box"}


def test_more_parts_than_slots_are_compared() -> None:
    """All are in the room of the arm; the last of them alone is in its way."""
    goal = (0.0, -0.3, 0.9, 0.0, 0.0, 0.0)
    places = [translation(0.02 * (k % 10) - 0.1, 0.3 + 0.02 * (k // 10), 0.6) for k in range(SLOTS + 8)]
    places.append(arm_for(load_robot("puma560")).forward(goal))
    parts = tuple(ScenePart(f"p{k}", SphereShape(0.01), T, GREY, 1.0) for k, T in enumerate(places))
    here, alone = driven(CellScene(parts), goal).found(), driven(CellScene(parts[-1:]), goal).found()
    assert here is not None
    assert alone is not None
    assert parts[-1].name in {here.first, here.second}
    assert abs(here.t - alone.t) <= EXACT


def test_named_poses_touch_nothing() -> None:
    for robot in ("puma560", "puma260", "so100"):
        pairs = touching_at_rest(load_robot(robot))
        assert (robot == "puma560") == (not pairs)


def bounced(lift: float, *, held: bool) -> Case:
    """The hand, or a rod in it, touches a wall in front, goes back, and then into the wall."""
    engine = Engine(load_robot("puma560"))
    engine.perform(Move(JointTarget((0.0, -0.4, 1.2, 0.0, pi / 2 - 0.8, 0.0)), False))
    begin, T = engine.end, engine.position(engine.end).T_world_tool
    for x in (-lift, 0.01):
        engine.perform(Move(PoseTarget(at_position(T, T.px + x, T.py, T.pz)), True))
    rod = ScenePart("rod", BoxShape((0.02, 0.02, 0.2)), IDENTITY, GREY, 1.0)
    far = T.px + 0.01 + (0.2 if held else HAND_LONG)
    wall = Fixture("wall", BoxShape((0.02, 0.1, 0.1)), translation(far, T.py, T.pz), GREY)
    in_hand = HeldPart("rod", translation(0.0, 0.0, 0.1)) if held else None
    stage = Stage(begin, engine.end, engine.frames, {}, in_hand, ([begin], [0.0]))
    return Case(Checker(engine.arm, CellScene((rod,), (wall,))), engine.timeline, stage)


@pytest.mark.parametrize("held", [False, True])
@pytest.mark.parametrize("lift", [0.0007, 0.001, 0.002, 0.004])
def test_second_touch_counts_however_short_the_time_apart(lift: float, held: bool) -> None:
    case = bounced(lift, held=held)
    found = case.found()
    assert found is not None
    assert (found.first, found.second) == ("rod" if held else "hand", "wall")
    assert looked_at_all(case).agrees(found)


@pytest.mark.parametrize("held", [False, True])
def test_thing_that_does_not_come_apart_goes_on_being_excused(held: bool) -> None:
    assert bounced(0.0003, held=held).found() is None
