"""What carries a body, and the height of the floor."""

from __future__ import annotations

import pytest

from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import Transform, translation
from vrs_cli.values.world import BoxShape, CellScene
from vrs_cli.world.history import below, floor_height, is_balanced
from vrs_cli.world.solids import Bounds, Solids, bounds, solids_of

BLOCK = solids_of(BoxShape((0.1, 0.1, 0.1)))


def at(x: float, z: float, name: str = "block") -> tuple[str, Solids, Transform, Bounds]:
    T = translation(x, 0.0, z)
    return name, BLOCK, T, bounds(BLOCK, T)


def test_the_highest_body_below_carries_and_bodies_of_one_height_do_so_together() -> None:
    T = translation(0.0, 0.0, 1.0)
    assert below(BLOCK, T, [], 0.0) == (pytest.approx(0.95), ("floor",))
    found = below(BLOCK, T, [at(0.06, 0.5, "a"), at(-0.06, 0.5, "b"), at(0.0, 0.2, "c"), at(0.0, 2.0, "d")], 0.0)
    assert found == (pytest.approx(0.4), ("a", "b"))
    assert below(BLOCK, T, [at(0.101, 0.95, "beside")], 0.0).on == ("floor",)
    assert below(BLOCK, T, [at(0.0, 0.903, "pressed")], 0.0) == (0.0, ("pressed",))


def test_a_body_is_balanced_above_what_carries_it_or_between() -> None:
    T = translation(0.0, 0.0, 0.1)
    assert is_balanced(BLOCK, T, [at(0.04, 0.0)[1:]])
    assert not is_balanced(BLOCK, T, [at(0.06, 0.0)[1:]])
    assert is_balanced(BLOCK, T, [at(0.06, 0.0)[1:], at(-0.06, 0.0)[1:]])


def test_the_floor_is_what_the_robot_stands_on() -> None:
    puma = load_robot("puma560")
    assert floor_height(CellScene(), puma) == pytest.approx(-0.66, abs=0.01)
    assert floor_height(CellScene(floor=-1.0), puma) == -1.0
    assert floor_height(CellScene(), load_robot("cobra600")) == pytest.approx(0.0)
