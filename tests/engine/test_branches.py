"""Tests of branches: tried beside main, merged to the bit or planned again, dropped; what listeners hear."""

from __future__ import annotations

from math import radians

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.engine.paper import Paper
from tests.examples import examples
from vrs_cli.engine.branches import MAIN, Branches
from vrs_cli.engine.engine import Engine
from vrs_cli.errors import MotionError, UsageError
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.trajectory.timeline import Timeline, TimelineDelta
from vrs_cli.values.commands import (
    JointOffsetTarget,
    JointTarget,
    Move,
    PoseTarget,
    SetMonitorSpeed,
    SetParameter,
    Stamp,
)

MODEL = load_robot("puma560")


def drive(joint: int, degrees: float, at: float | None = None) -> Move:
    stamp = None if at is None else Stamp(at)
    return Move(JointOffsetTarget(joint, radians(degrees)), straight=False, stamp=stamp, text=f"DRIVE {joint}")


def go(*degrees: float, at: float | None = None) -> Move:
    """Move to joints, the same on any timeline."""
    stamp = None if at is None else Stamp(at)
    return Move(JointTarget(tuple(map(radians, degrees))), straight=False, stamp=stamp, text="MOVE")


@pytest.fixture
def branches() -> Branches:
    engine = Engine(MODEL)
    engine.perform(drive(1, 60))
    engine.perform(drive(2, 10))
    return Branches(engine)


def bits(timeline: Timeline) -> str:
    """Return times and paths to the last bit, without the numbers of motions."""
    return repr([(s.start, s.finish, s.path, s.phase) for s in timeline])


def heard(engine: Engine) -> list[TimelineDelta]:
    """Record what the journal of the present book is given from here on."""
    engine.book.journal = paper = Paper(engine.book, engine.timeline.version)
    return paper.lines


# --- trying --------------------------------------------------------------------------------------------------


def test_a_branch_begins_as_what_is_there_and_leaves_main_alone(branches: Branches) -> None:
    engine = branches.engine
    main, clock, told = engine.timeline, engine.now, heard(engine)
    branches.make("trial")
    assert (engine.timeline, engine.now) == (main, clock)
    engine.perform(drive(3, -20, at=0.5))
    engine.perform(drive(4, 30))
    engine.perform(SetMonitorSpeed(50.0))
    tried, later = engine.timeline, engine.now
    branches.change_over(MAIN)
    assert engine.timeline is main
    assert (engine.now, engine.settings.monitor_speed) == (clock, 100.0)
    assert len(engine.book.records()) == 2
    branches.change_over("TRIAL")
    assert engine.timeline is tried
    assert (engine.now, engine.settings.monitor_speed) == (later, 50.0)
    assert told == []


def test_each_branch_has_its_own_undo_and_redo(branches: Branches) -> None:
    engine = branches.engine
    engine.undo()
    branches.make("trial")
    engine.redo()
    engine.undo()
    engine.undo()
    branches.change_over(MAIN)
    assert len(engine.book.records()) == 1
    engine.redo()
    assert len(engine.book.records()) == 2


def test_a_branch_shares_the_rows_of_main() -> None:
    engine = Engine(MODEL)
    for _ in range(500):
        engine.perform(drive(1, 5))
        engine.perform(drive(1, -5))
    branches = Branches(engine)
    branches.make("trial")
    engine.perform(drive(2, 10))
    ours = {id(block.row) for block in engine.timeline.blocks(0.0, engine.end)}
    theirs = {id(block.row) for block in branches.book(MAIN).timeline.blocks(0.0, engine.end)}
    assert len(ours - theirs) <= 1


def test_names_are_told_and_refused(branches: Branches) -> None:
    branches.make("Trial")
    assert branches.names == (MAIN, "Trial")
    assert branches.present == "Trial"
    with pytest.raises(UsageError, match="there is a branch trial already"):
        branches.make("trial")
    with pytest.raises(UsageError, match="there are main, Trial"):
        branches.change_over("nosuch")
    with pytest.raises(UsageError, match="main cannot be deleted"):
        branches.drop("MAIN")
    with pytest.raises(UsageError, match="main cannot be merged into itself"):
        branches.merge("main")
    branches.drop("trial")
    assert (branches.names, branches.present) == ((MAIN,), MAIN)
    assert len(branches.engine.book.records()) == 2


def test_real_time_has_one_course_of_events(branches: Branches, monkeypatch: pytest.MonkeyPatch) -> None:
    branches.make("trial")
    monkeypatch.setattr(Engine, "realtime", True, raising=False)
    for change in (branches.make, branches.change_over, branches.merge):
        with pytest.raises(UsageError, match="time is real"):
            change("other" if change == branches.make else "trial" if change == branches.merge else MAIN)
    assert branches.present == "trial"


# --- merging -------------------------------------------------------------------------------------------------


def test_merging_into_an_unchanged_main_gives_the_branch_to_the_bit(branches: Branches) -> None:
    engine, told = branches.engine, heard(branches.engine)
    branches.make("trial")
    engine.perform(drive(3, -20, at=0.5))
    engine.undo()
    engine.redo()
    engine.perform(drive(4, 30))
    tried, clock, deltas = engine.timeline, engine.now, list(engine.book.deltas)
    assert branches.merge("trial") == 0
    assert repr(list(engine.timeline)) == repr(list(tried))
    assert (engine.now, branches.present, branches.names) == (clock, MAIN, (MAIN,))
    assert told == deltas[2:] == engine.book.deltas[2:]
    engine.undo()
    engine.undo()
    assert len(engine.book.records()) == 2
    assert told == engine.book.deltas[2:]


def test_commands_that_a_branch_took_back_are_taken_back_on_main(branches: Branches) -> None:
    engine, told = branches.engine, heard(branches.engine)
    branches.make("trial")
    engine.undo()
    branches.merge("trial")
    assert [record.text for record in engine.book.records()] == ["DRIVE 1"]
    assert [delta.cause.value for delta in told] == ["undo"]


def test_merging_from_elsewhere_keeps_the_present_branch(branches: Branches) -> None:
    engine = branches.engine
    branches.make("one")
    engine.perform(drive(3, -20))
    branches.change_over(MAIN)
    branches.make("two")
    engine.perform(drive(4, 30))
    two = engine.timeline
    branches.merge("one")
    assert branches.present == MAIN
    branches.change_over("two")
    assert engine.timeline is two


def test_where_main_has_changed_the_commands_are_planned_again(branches: Branches) -> None:
    engine, told = branches.engine, heard(branches.engine)
    branches.make("trial")
    inserted, behind = go(0, -70, 70, 0, 0, 0, at=0.5), go(10, -90, 90, 20, 0, 0)
    engine.perform(inserted)
    engine.perform(behind)
    branches.change_over(MAIN)
    engine.perform(drive(5, 40))
    assert branches.merge("trial") == 2
    expected = Engine(MODEL)
    for move in (drive(1, 60), drive(2, 10), drive(5, 40), inserted, behind):
        expected.perform(move)
    assert bits(engine.timeline) == bits(expected.timeline)
    assert engine.now == engine.end == expected.now
    assert [record.number for record in engine.book.records()] == [1, 2, 3, 4, 5]
    replayed = engine.book.initial
    for delta in engine.book.deltas:
        replayed = replayed.apply(delta)
    assert replayed == engine.timeline
    assert told == engine.book.deltas[2:]


def test_what_is_relative_stays_so_when_it_is_planned_again(branches: Branches) -> None:
    engine = branches.engine
    branches.make("trial")
    engine.perform(drive(3, -20))
    branches.change_over(MAIN)
    engine.perform(drive(3, -30))
    branches.merge("trial")
    assert engine.position().joints[2] == pytest.approx(radians(40))


def test_a_branch_of_a_branch_is_merged_with_both(branches: Branches) -> None:
    engine = branches.engine
    branches.make("one")
    engine.perform(drive(3, -20))
    branches.make("two")
    engine.perform(drive(4, 30))
    branches.change_over(MAIN)
    engine.perform(drive(6, 5))
    assert branches.merge("two") == 2
    assert [record.text for record in engine.book.records()] == ["DRIVE 1", "DRIVE 2", "DRIVE 6", "DRIVE 3", "DRIVE 4"]
    assert branches.names == (MAIN, "one")


def test_an_override_stays_one_when_it_is_planned_again(branches: Branches) -> None:
    engine = branches.engine
    branches.make("trial")
    engine.perform(SetParameter("INSERT", "OFF"))
    engine.perform(drive(3, -20, at=0.5))
    branches.change_over(MAIN)
    engine.perform(drive(6, 5))
    branches.merge("trial")
    assert [record.end is None for record in engine.book.records()] == [False, True, True, False]
    assert engine.settings.parameter("INSERT") == "ON"


def test_the_clock_of_a_branch_is_not_left_behind(branches: Branches) -> None:
    engine = branches.engine
    branches.make("trial")
    engine.clock.advance(engine.now + 10.0)
    engine.perform(drive(3, -20, at=engine.now))
    engine.clock.advance(later := engine.end)
    branches.change_over(MAIN)
    engine.perform(drive(6, 5))
    branches.merge("trial")
    assert engine.now == later


def test_a_merge_that_cannot_be_changes_nothing(branches: Branches) -> None:
    engine, told = branches.engine, heard(branches.engine)
    branches.make("trial")
    engine.undo()
    branches.change_over(MAIN)
    engine.perform(drive(3, 5))
    main, count = engine.timeline, len(told)
    with pytest.raises(UsageError, match="trial has undone commands of main, which has changed since"):
        branches.merge("trial")
    assert engine.timeline is main
    branches.drop("trial")
    branches.make("line")
    pose = engine.position().T_world_tool
    down = PoseTarget(pose._replace(pz=pose.pz - 0.1))
    engine.perform(Move(down, straight=True, text="MOVES down", stamp=Stamp(9.0)))
    branches.change_over(MAIN)
    engine.perform(Move(JointTarget(tuple(map(radians, (0, 40, -40, 0, -90, 0)))), straight=False))
    main, count = engine.timeline, len(told)
    with pytest.raises(MotionError, match="when MOVES down of line is planned again on main"):
        branches.merge("line")
    assert engine.timeline is main
    assert len(told) == count
    assert branches.names == (MAIN, "line")


# --- laws ----------------------------------------------------------------------------------------------------

moves = st.builds(drive, st.integers(1, 6), st.floats(-20.0, 20.0), st.none() | st.floats(0.0, 4.0))
acts = st.lists(moves | st.sampled_from(["undo", "redo", "BRANCH a", "BRANCH b", "BRANCH main", "MERGE"]), max_size=14)


def act(branches: Branches, what: Move | str) -> None:
    engine = branches.engine
    if isinstance(what, Move):
        engine.perform(what)
    elif what.startswith("BRANCH "):
        name = what.removeprefix("BRANCH ")
        (branches.change_over if name in branches else branches.make)(name)
    elif what == "MERGE":
        branches.merge(branches.present)
    else:
        (engine.undo if what == "undo" else engine.redo)()


@examples(80)
@given(acts)
def test_what_is_written_down_is_main_whatever_is_tried(sequence: list[Move | str]) -> None:
    engine = Engine(MODEL)
    branches, told = Branches(engine), heard(engine)
    for what in sequence:
        main = branches.book(MAIN).timeline
        try:
            act(branches, what)
        except (UsageError, MotionError):
            assert branches.book(MAIN).timeline == main, "what is refused changes nothing"
        for name in branches.names:
            book = branches.book(name)
            replayed = book.initial
            for delta in book.deltas:
                replayed = replayed.apply(delta)
            assert repr(list(replayed)) == repr(list(book.timeline))
        assert told == list(branches.book(MAIN).deltas)
        if what != "MERGE" and branches.present != "main":
            assert branches.book(MAIN).timeline == main


def test_a_branch_is_seen_by_who_made_it(branches: Branches) -> None:
    branches.who = "ann"
    branches.make("trial")
    branches.change_over(MAIN)
    branches.who = "bob"
    assert branches.names == (MAIN,)
    assert "trial" not in branches
    for act in (branches.change_over, branches.merge, branches.drop, branches.book):
        with pytest.raises(UsageError, match="there is no branch trial"):
            act("trial")
    branches.make("trial")
    branches.engine.perform(go(0, -90, 90, 0, 0, 0))
    branches.merge("trial")
    branches.who = "ann"
    assert branches.names == (MAIN, "trial")
    assert len(branches.book("trial").history.done) < len(branches.book(MAIN).history.done)


def test_who_is_served_meanwhile_stays_on_the_branch_that_something_runs_on(branches: Branches) -> None:
    branches.make("trial")
    tried = branches.engine.timeline
    branches.engine.perform(drive(1, -20))
    after = branches.engine.timeline
    branches.serve("another", stay=True)
    assert branches.engine.timeline is after
    branches.serve("another")
    assert branches.engine.timeline is not after
    assert branches.engine.timeline == tried
