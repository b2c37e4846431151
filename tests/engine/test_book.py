"""Tests of the book: every change is written before it takes place, and only braking takes place without
being written.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from math import radians
from types import SimpleNamespace
from typing import Any

import pytest

from tests.engine.paper import Paper
from tests.engine.wall import ManualWall
from vrs_cli.engine.book import MAX_MOTIONS_COMPARED, ROW_LENGTH, MemoryWindow, WindowSize, displacement
from vrs_cli.engine.branches import Branches
from vrs_cli.engine.engine import Engine
from vrs_cli.errors import FileError
from vrs_cli.interfaces.streams import Steering
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import translation
from vrs_cli.trajectory.row import Row
from vrs_cli.trajectory.timeline import Timeline, TimelineDelta
from vrs_cli.values.commands import (
    Brake,
    Delay,
    JointOffsetTarget,
    JointTarget,
    Move,
    OperateHand,
    SetBase,
    SetDuration,
    SetParameter,
    SetTool,
    Stamp,
)
from vrs_cli.values.results import Displacement

MODEL = load_robot("puma560")


@pytest.fixture
def engine() -> Engine:
    engine = Engine(load_robot("puma560"))
    engine.book.journal = Paper(engine.book)
    for joint in (1, 2, 3):
        engine.perform(drive(joint, 20.0))
    engine.undo()
    return engine


def paper(engine: Engine) -> Paper:
    assert isinstance(engine.book.journal, Paper)
    return engine.book.journal


def drive(joint: int, degrees: float, at: float | None = None) -> Move:
    stamp = None if at is None else Stamp(at)
    return Move(JointOffsetTarget(joint, radians(degrees)), straight=False, stamp=stamp)


def state(engine: Engine) -> object:
    """Return everything that a command may change."""
    left = engine.bookmark()
    book = left.book.copy()
    return (
        book.timeline,
        book.timeline.version,
        tuple(book.deltas),
        tuple(book.history.done),
        tuple(book.history.undone),
        book.number,
        left.clock,
        left.settings,
    )


def steer(engine: Engine) -> None:
    ready = engine.model.poses["ready"]
    Steering(engine).to((0.2, *ready[1:]), engine.now + 0.01)


CHANGES: dict[str, Callable[[Engine], object]] = {
    "motion": lambda engine: engine.perform(drive(4, 10.0)),
    "motion at a time": lambda engine: engine.perform(drive(4, 10.0, at=0.1)),
    "motion of a program": lambda engine: engine.begin(drive(4, 10.0), program=True),
    "delay": lambda engine: engine.perform(Delay(1.0)),
    "hand": lambda engine: engine.perform(OperateHand(1.0, immediate=True)),
    "tool": lambda engine: engine.perform(SetTool(translation(0.0, 0.0, 0.1))),
    "base": lambda engine: engine.perform(SetBase(translation(0.0, 0.0, 0.1))),
    "undo": lambda engine: engine.undo(),
    "undo 2": lambda engine: engine.undo(2),
    "redo": lambda engine: engine.redo(),
    "redirect": lambda engine: engine.redirect((0.1, *engine.model.poses["ready"][1:])),
    "steer": steer,
}


@pytest.mark.parametrize("change", CHANGES.values(), ids=CHANGES)
def test_what_cannot_be_written_down_does_not_happen(engine: Engine, change: Callable[[Engine], object]) -> None:
    before, clock = state(engine), engine.now
    paper(engine).torn = True
    with pytest.raises(FileError, match="no paper"):
        change(engine)
    engine.clock.set(clock)  # a stream waits for the time of its target
    assert state(engine) == before
    paper(engine).torn = False
    change(engine)
    assert state(engine) != before
    assert paper(engine).timeline() == engine.timeline


@pytest.mark.parametrize("stop", [Engine.stop, lambda engine: engine.perform(Brake())], ids=["stop", "BRAKE"])
def test_the_robot_brakes_whether_that_can_be_written_down_or_not(engine: Engine, stop: Callable) -> None:
    engine.perform(drive(1, -60.0, at=engine.now))
    end, paper(engine).torn = engine.end, True
    engine.clock.advance(engine.now + 0.1)
    stop(engine)
    assert engine.now < engine.end < end
    assert paper(engine).owed == 1
    assert paper(engine).timeline() == engine.timeline


@pytest.mark.parametrize("stop", [Engine.stop, lambda engine: engine.perform(Brake())], ids=["stop", "BRAKE"])
def test_the_robot_brakes_whatever_goes_wrong_with_the_writing(engine: Engine, stop: Callable) -> None:
    """The listener that should hear of the failure may be gone."""
    engine.perform(drive(1, -60.0, at=engine.now))
    end, sheet, events = engine.end, paper(engine), engine.events.subscribe()
    engine.clock.advance(engine.now + 0.1)

    def gone(deltas: Sequence[TimelineDelta], *, happens: bool = False) -> None:  # noqa: ARG001 (as a journal has it)
        raise BrokenPipeError

    sheet.record = gone  # type: ignore[method-assign]
    with pytest.raises(BrokenPipeError):
        stop(engine)
    assert engine.now < engine.end < end
    assert engine.book.history.done[-1].delta == engine.book.deltas[-1] == events.take_all()[-1]


def test_undo_of_several_is_written_as_a_whole(engine: Engine) -> None:
    before, written = engine.timeline, len(paper(engine).lines)
    engine.redo()
    engine.undo(3)
    assert (engine.book.history.commands, len(paper(engine).lines)) == (0, written + 4)
    engine.redo(2)
    assert (engine.timeline, paper(engine).timeline()) == (before, before)


@pytest.mark.parametrize("changed", [False, True], ids=["carried on", "planned again"])
def test_a_merge_that_cannot_be_written_down_changes_nothing(engine: Engine, changed: bool) -> None:
    branches, sheet = Branches(engine), paper(engine)
    branches.make("trial")
    engine.perform(drive(5, 10.0))
    engine.perform(drive(6, 10.0))
    if changed:
        branches.change_over("main")
        engine.perform(drive(4, 10.0))
        branches.change_over("trial")
    main, trial, written = list(branches.book("main").deltas), state(engine), len(sheet.lines)
    sheet.torn = True
    with pytest.raises(FileError):
        branches.merge("trial")
    assert (branches.present, list(branches.book("main").deltas), len(sheet.lines)) == ("trial", main, written)
    assert state(engine) == trial
    sheet.torn = False
    branches.merge("trial")
    assert sheet.timeline() == engine.timeline


def test_a_command_that_is_refused_does_not_end_a_stream_of_targets(engine: Engine) -> None:
    ready, steering, begin = engine.model.poses["ready"], Steering(engine), engine.now
    for k in range(3):
        steering.to((0.01 * k, *ready[1:]), begin + 0.02 * k)
    stream, paper(engine).torn = engine.book.stream, True
    with pytest.raises(FileError):
        engine.perform(drive(4, 10.0, at=engine.now))
    paper(engine).torn = False
    steering.to((0.04, *ready[1:]), begin + 0.06)
    assert stream is not None
    assert engine.book.deltas[-1].motion is stream


def test_in_real_time_too() -> None:
    wall = ManualWall()
    live = Engine(load_robot("puma560"), clock=wall.clock())
    live.book.journal = Paper(live.book)
    live.perform(drive(1, 60.0))
    before, paper(live).torn = live.timeline, True
    with pytest.raises(FileError):
        live.perform(drive(2, 10.0))
    assert live.timeline is before
    wall.seconds += 0.2
    live.stop()
    assert live.end < before.end
    assert paper(live).timeline() == live.timeline


class Store:
    """Keeps rows, and counts what it keeps after each change."""

    def __init__(self) -> None:
        self.segments, self.checkpoints = [0], 0

    def keep_row(self, row: Row) -> Store:
        self.segments[-1] += len(row)
        return self

    def keep_checkpoint(self, timeline: Timeline, commands: int, number: int) -> bool:
        assert all(part.row.stored_at is not None for _, _, part in timeline.parts())
        assert commands == number == timeline.version
        self.checkpoints += 1
        return True

    def read(self) -> Row:
        raise AssertionError("nobody looks at old times")

    def read_deltas(self, first: int, last: int) -> Sequence[TimelineDelta]:
        raise AssertionError(f"nobody asks for changes {first} to {last}")


def test_little_leaves_memory_after_one_change_and_as_much_as_comes() -> None:
    engine, store = Engine(load_robot("puma560")), Store()
    engine.book.keep_short(MemoryWindow(store, WindowSize(changes=200, segments=300, checkpoint=400)))
    goals = [JointTarget((angle, *engine.position().joints[1:])) for angle in (0.3, -0.3)]
    for number in range(900):  # each cuts the one before it off where that slows down
        engine.perform(Move(goals[number % 2], False), program=True)
        store.segments.append(0)
    assert max(store.segments) <= 2 * ROW_LENGTH + 10
    in_memory = sum(len(part.row) for _, _, part in engine.timeline.parts() if not part.row.away)
    assert in_memory <= 300 + 2 * ROW_LENGTH
    assert len(engine.timeline) > 1500
    assert (store.checkpoints, len(engine.book.history.done)) == (2, 200)


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
    """Return what becomes of other motions when a motion of some duration comes at a time."""
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
    found = spliced(scheduled(*(4.0 + 2.0 * k for k in range(MAX_MOTIONS_COMPARED + 20))), 3.928)
    assert found is not None
    assert (len(found.later), found.more) == (MAX_MOTIONS_COMPARED, True)


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


class Length:
    """A row of that many segments."""

    def __init__(self, length: int) -> None:
        self.length, self.closed = length, False

    def __len__(self) -> int:
        return self.length

    def close(self) -> None:
        self.closed = True


class Rows:
    """Rows one after the other, each whole."""

    def __init__(self, rows: Sequence[Length]) -> None:
        self.rows, self.version, self.event_count = rows, 0, 0

    def __len__(self) -> int:
        return sum(map(len, self.rows))

    def event_parts(self, _first: int) -> Iterator[Any]:
        return iter(())

    def parts(self, _first: int) -> Iterator[tuple[int, None, Any]]:
        index = 0
        for row in self.rows:
            yield index, None, SimpleNamespace(row=row, count=len(row))
            index += len(row)


def test_the_last_row_may_grow_to_a_full_one_and_those_before_it_to_half_of_one() -> None:
    """So no row becomes far longer by new segments, or by a smaller row that joins it."""
    for last in (ROW_LENGTH - 1, ROW_LENGTH):
        rows = [Length(ROW_LENGTH // 2 - 1), Length(ROW_LENGTH // 2), Length(last)]
        window = MemoryWindow(Store(), WindowSize(changes=200, segments=10**6, checkpoint=10**6))
        window.let_go(Rows(rows), (), 0, 0)  # type: ignore[arg-type]
        assert [row.closed for row in rows] == [False, True, last == ROW_LENGTH]
