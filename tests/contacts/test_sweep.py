"""How far bodies can come: no point of a body moves farther than its way says."""

from __future__ import annotations

from itertools import pairwise
from random import Random

import numpy as np
import pytest

from tests.contacts.cases import cases
from tests.contacts.test_watch import session_of
from vrs_cli.contacts.checker import Checker
from vrs_cli.contacts.physics import Ball, Bounds
from vrs_cli.contacts.sweep import Sweep, frames_over, levers, stages, sums_of
from vrs_cli.engine.position import joints_over
from vrs_cli.interfaces.session.session import Session
from vrs_cli.kinematics.model import link_frames
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.values.world import Contact
from vrs_cli.world.course import World

pytest.importorskip("mujoco")


CLOSE = 1e-9


@pytest.mark.parametrize("robot", ["puma560", "cobra600", "ur5e"])
def test_frames_are_those_of_the_kinematics(robot: str) -> None:
    model, rng = load_robot(robot), np.random.default_rng(2)
    q = rng.uniform(model.lower, model.upper, (5, model.joint_count))
    turns, places = frames_over(model, q)
    for row, joints in enumerate(q.tolist()):
        for i, T in enumerate(link_frames(model, tuple(joints))):
            rows = np.array(T).reshape(3, 4)
            assert abs(turns[i, row] - rows[:, :3]).max() < CLOSE
            assert abs(places[i, row] - rows[:, 3]).max() < CLOSE


@pytest.mark.parametrize("robot", ["puma560", "cobra600"])
def test_no_point_moves_farther_than_its_way(robot: str) -> None:
    rng = Random(4)
    for case in cases(rng, 4, robot):
        arm, stage = case.checker.arm, case.stage
        sweep = Sweep(arm, case.timeline, stage.begin, stage.end)
        last = arm.model.joint_count
        point = np.array([0.03, 0.02, 0.1])
        body = Bounds(last, Ball((0.0, 0.0, 0.05), float(np.linalg.norm(point - (0.0, 0.0, 0.05)))))
        times = np.linspace(stage.begin, stage.end, 2000)
        turns, places = frames_over(arm.model, joints_over(arm, case.timeline, times))
        absolute = turns[last] @ point + places[last]
        first = np.einsum("nji,nj->ni", turns[1], absolute - places[1])  # as link 1 sees it
        ways = sweep.ways([body])[0], sweep.way_between(np.array(levers(arm.model, body, 1)))
        for moving, way in zip((absolute, first), ways, strict=True):
            done = np.interp(times, sweep.times, sums_of(way))
            for a, b in pairwise(range(0, 2000, 7)):
                assert np.linalg.norm(moving[b] - moving[a]) <= done[b] - done[a] + CLOSE


def test_a_way_is_done_no_earlier_than_it_can_be() -> None:
    (case,) = cases(Random(6), 1)
    sweep = Sweep(case.checker.arm, case.timeline, case.stage.begin, case.stage.end)
    sums = sums_of(np.full(len(sweep.times) - 1, 0.01))
    t = sweep.reaches(sums, case.stage.begin, 0.005)
    assert sweep.times[0] < t < sweep.times[1]
    assert sweep.reaches(sums, case.stage.begin, 100.0) == sweep.times[-1]


pytest.importorskip("mujoco")


CELL = """
[[fixture]]
name = "table"
shape = "box"
size = [600, 600, 20]
at = [0, 600, -210]

[[part]]
name = "cube"
shape = "box"
size = [40, 40, 40]
at = [-100, 500, -180]

[[part]]
name = "other"
shape = "box"
size = [40, 40, 40]
at = [100, 700, -180]
"""
PICK = """.PROGRAM pick
TOOL TRANS(0, 0, 95, 90, -90, 0)
SET take = TRANS(-100, 500, {take}, 90, 90, 0)
SET put = TRANS({x}, {y}, {put}, 90, 90, 0)
{open}
MOVE TRANS(0, 500, 100, 90, 90, 0)
MOVE TRANS(-100, 500, -80, 90, 90, 0)
MOVES take
CLOSEI
DEPARTS 100
MOVE TRANS({x}, {y}, -80, 90, 90, 0)
MOVES put
OPENI
DEPARTS 100
.END
"""


def picked(
    *, take: float = -180.0, put: float = -179.0, x: float = 150.0, y: float = 500.0, open_hand: str = "OPENI"
) -> tuple[Session, list[tuple[str, Contact]]]:
    session = session_of(CELL)
    session.load_text(PICK.format(take=take, put=put, x=x, y=y, open=open_hand))
    assert session.execute("pick").fault is None
    return session, [*session.contacts.contacts]


def test_gripping_standing_and_leaving_are_no_contacts() -> None:
    _, contacts = picked()
    assert contacts == []


@pytest.mark.parametrize(
    ("where", "motion", "pair"),
    [
        ({"take": -190.0}, "MOVES take", {"hand", "table"}),
        ({"open_hand": "CLOSEI", "take": -150.0}, "MOVES take", {"hand", "cube"}),
        ({"open_hand": "CLOSEI"}, "MOVES take", {"hand", "cube"}),
        ({"x": 80.0, "y": 700.0}, "MOVES put", {"cube", "other"}),
        ({"put": -185.0}, "MOVES put", {"cube", "table"}),
    ],
)
def test_what_is_in_the_way_is_told(where: dict[str, float], motion: str, pair: set[str]) -> None:
    _, contacts = picked(**where)  # type: ignore[arg-type]
    assert (motion, pair) in [(text, {contact.first, contact.second}) for text, contact in contacts]


def test_parts_are_taken_and_put_down_whatever_the_clearance() -> None:
    session = session_of(CELL)
    session.perform("ENABLE COLLISION")
    session.perform("PARAMETER CLEARANCE = 5")
    session.load_text(PICK.format(take=-180.0, put=-179.0, x=150.0, y=500.0, open="OPENI"))
    assert session.execute("pick").fault is None


def test_stages_end_where_a_part_changes_what_it_does() -> None:
    session, _ = picked()
    engine = session.engine
    course = World(engine.arm, session.driver.cell).course(engine.timeline)
    found = list(stages(engine.timeline, course, 0.0, engine.end))
    assert [stage.held and stage.held.name for stage in found if stage.changed] in (
        ["cube", None],
        ["cube", None, None],
    )
    assert all("cube" not in stage.standing for stage in found if stage.held)
    assert {stage.end for stage in found[:-1]} == {stage.begin for stage in found[1:]}
    (before,) = [one for one, after in pairwise(found) if after.held and not one.held]
    assert before.gripped == {"cube"}
    for stage in found:
        times, values = stage.hand
        assert times == sorted(times)
        assert times[0] <= stage.begin
        assert set(values) <= {0.0, 1.0}


def test_hand_may_touch_what_it_takes_while_its_fingers_close() -> None:
    session, _ = picked()
    engine = session.engine
    course = World(engine.arm, session.driver.cell).course(engine.timeline)
    taken = next(t for t, name in course.moves(0.0, engine.end) if course.held_part(t) == name)
    *_, last = stages(engine.timeline, course, 0.0, taken - 0.01)
    assert last.gripped == {"cube"}


def test_hand_may_touch_what_it_takes_though_another_part_moves_meanwhile(monkeypatch: pytest.MonkeyPatch) -> None:
    session, _ = picked()
    engine = session.engine
    course = World(engine.arm, session.driver.cell).course(engine.timeline)
    moves = course.moves(0.0, engine.end)
    taken = next(t for t, name in moves if course.held_part(t) == name)
    monkeypatch.setattr(course, "moves", lambda *_: [(taken - 0.02, "other"), *moves])
    found = list(stages(engine.timeline, course, 0.0, engine.end))
    assert [stage.gripped for stage in found if stage.end <= taken] == [{"cube"}] * 2
    assert session.driver.cell.scene is not None
    assert Checker(engine.arm, session.driver.cell.scene).first_in(engine.timeline, found) is None
