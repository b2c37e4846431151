"""The state of a world: values are taken back to any time."""

from __future__ import annotations

import pytest

from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import Transform, translation
from vrs_cli.values.scene import BoxShape, CellScene
from vrs_cli.values.world import BodyCrosses, PartComes, PartsGo
from vrs_cli.world.history import WorldHistory, below, floor_height, is_balanced
from vrs_cli.world.solids import Bounds, Solids, bounds, solids_of


def test_what_happened_at_a_time_and_later_is_taken_back() -> None:
    history = WorldHistory()
    for t in (0.0, 1.0, 2.0):
        history.now = t
        history.set("x", t)
        history.plan(t + 5.0, PartComes(int(t)))
        history.add("notes", (t, "FALL", "it falls"))
    copied = history.copy()
    history.back_to(1.0)
    assert (history.get("x"), history.now, len(history.rows("notes"))) == (0.0, 1.0, 1)
    assert [due.time for due in history.due] == [5.0]
    assert (copied.get("x"), len(copied.due), len(copied.rows("notes"))) == (2.0, 3, 3)
    history.back_to(0.0)
    assert history.get("x") is None
    assert history.due == ()


def test_what_is_due_is_taken_in_order_and_can_be_dropped() -> None:
    history = WorldHistory()
    history.now = 0.0
    history.plan(2.0, PartsGo(1))
    history.plan(1.0, BodyCrosses("hand", 0, inside=True, moved=True))
    history.plan(1.0, PartComes(2))
    history.plan(1.0, PartComes(1))
    assert [due.what for due in history.due] == [
        PartComes(2),
        PartComes(1),
        BodyCrosses("hand", 0, True, True),
        PartsGo(1),
    ]
    history.drop(lambda what: what.follows_arm)
    history.drop(lambda what: isinstance(what, PartsGo))
    assert history.take().what == PartComes(2)
    assert [due.what for due in history.due] == [PartComes(1)]


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
