"""What became of scheduled motions when others came and went."""

from __future__ import annotations

from math import radians

from vrs_cli.engine.displacement import MOST, displacement
from vrs_cli.engine.engine import Engine
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.values.commands import Move, SetDuration, SetParameter, Stamp
from vrs_cli.values.motion import JointTarget
from vrs_cli.values.results import Displacement

MODEL = load_robot("puma560")


def to(angle: float, at: float | None, text: str = "MOVE") -> Move:
    joints = (radians(angle), radians(-90.0), radians(90.0), 0.0, 0.0, 0.0)
    return Move(JointTarget(joints), False, stamp=None if at is None else Stamp(at), text=text)


def scheduled(*times: float) -> Engine:
    engine = Engine(MODEL)
    engine.perform(to(60.0, 0.0))
    for number, at in enumerate(times):
        engine.perform(to(60.0 - 10.0 * (number % 2 + 1), at))
    return engine


def spliced(engine: Engine, lasting: float, at: float = 0.6, angle: float = 60.0) -> Displacement | None:
    """What becomes of the others when a motion comes for a time, and lasts so long."""
    before = engine.timeline
    engine.perform(SetDuration(lasting))
    engine.perform(to(angle, at))
    return displacement(engine.book, before)


def test_all_that_begin_later_are_told_with_the_time_that_was_asked() -> None:
    found = spliced(scheduled(4.0, 6.0, 20.0), 3.928)
    assert found is not None
    assert [one.asked for one in found.later] == [4.0, 6.0, 20.0]
    assert {round(one.later, 3) for one in found.later} == {0.528}
    assert (found.earlier, found.dropped, found.more) == ((), (), False)


def test_undo_tells_that_they_begin_earlier_again_and_redo_that_they_begin_later() -> None:
    engine = scheduled(4.0, 6.0)
    spliced(engine, 3.928)
    for change, sign in ((engine.undo, -1.0), (engine.redo, 1.0)):
        before = engine.timeline
        change()
        found = displacement(engine.book, before)
        assert found is not None
        assert [round(sign * one.later, 3) for one in (*found.later, *found.earlier)] == [0.528, 0.528]
        assert not found.dropped


def test_a_second_splice_counts_from_where_a_motion_began_last() -> None:
    engine = scheduled(4.0)
    spliced(engine, 3.928)
    found = spliced(engine, 4.4)
    assert found is not None
    assert [(one.asked, round(one.before, 3), round(one.later, 3)) for one in found.later] == [(4.0, 4.528, 0.472)]


def test_a_motion_that_fits_into_a_gap_moves_nothing() -> None:
    assert spliced(scheduled(4.0, 6.0), 1.0) is None
    engine = scheduled(4.0)
    before = engine.timeline
    engine.perform(to(0.0, None), program=True)
    assert displacement(engine.book, before) is None


def test_what_is_dropped_is_told_too_and_what_gives_way() -> None:
    engine = scheduled(4.0, 6.0, 8.0)
    found = spliced(engine, 1.0, at=6.0)
    assert found is not None
    assert [one.asked for one in found.dropped] == [6.0]
    engine.perform(SetParameter("INSERT", "OFF"))
    found = spliced(engine, 1.0)
    assert found is not None
    assert [one.asked for one in found.dropped] == [4.0, 6.0, 8.0]
    assert not found.later


def test_of_very_many_the_first_are_told() -> None:
    found = spliced(scheduled(*(4.0 + 2.0 * k for k in range(MOST + 20))), 3.928)
    assert found is not None
    assert (len(found.later), found.more) == (MOST, True)


def test_what_was_never_at_its_own_time_is_told_by_its_text() -> None:
    engine = scheduled()
    engine.perform(to(0.0, None, text="MOVE home"), program=True)
    found = spliced(engine, 3.0)
    assert found is not None
    assert [(one.text, one.asked) for one in found.later] == [("MOVE home", None)]


def test_a_motion_that_came_meanwhile_counts_from_the_time_that_it_was_given() -> None:
    engine = Engine(MODEL)
    before = engine.timeline
    engine.perform(to(60.0, 0.0))
    engine.perform(to(50.0, 4.0))
    assert displacement(engine.book, before) is None
    assert spliced(engine, 3.928) == displacement(engine.book, before)
    found = displacement(engine.book, before)
    assert found is not None
    assert [(one.asked, round(one.later, 3)) for one in found.later] == [(4.0, 0.528)]
