"""What a journal alone has: read back when somebody asks, copied where the file is lost, and where a restart begins."""

from __future__ import annotations

import errno
import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.laws.windows import small_parts
from vrs_cli.engine.book import WindowSize
from vrs_cli.engine.engine import Engine
from vrs_cli.errors import FileDamaged, FileError, UsageError
from vrs_cli.files.journal import Journal, keep_journal, take_up
from vrs_cli.files.past import GrowingFile
from vrs_cli.files.trajectory_file import read_trajectory, write_trajectory
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.values.commands import JointTarget, Move, OperateHand, SetChannels, Stamp

REACH = WindowSize(changes=16, segments=8, checkpoint=8)


class Robot:
    """A robot with a small window, whose joint 1 goes to and fro; `told`: what is said of its journal."""

    def __init__(self, path: Path, reach: WindowSize | None = REACH) -> None:
        self.engine, self.told = Engine(load_robot("puma560")), list[str]()
        taken = take_up(path, changes=None if reach is None else reach.changes)
        self.from_checkpoint = taken.resumed is not None
        self.journal: Journal = keep_journal(taken, self.engine, self.told.append, together=True, reach=reach)
        self.seen: dict[float, tuple[float, ...]] = {}  # where it was, as it was seen then

    def move(self, count: int) -> None:
        for _ in range(count):
            first, *others = self.engine.position().joints
            self.engine.perform(Move(JointTarget((0.3 if first <= 0.0 else -0.3, *others)), False))
            t = self.engine.now - 0.05
            self.seen[t] = self.engine.position(t).joints

    def check_past(self) -> None:
        for t, joints in self.seen.items():
            assert self.engine.position(t).joints == joints

    def in_memory(self) -> int:
        return sum(part.last - part.first for _, _, part in self.engine.timeline.parts() if not part.row.away)

    def end(self) -> None:
        self.journal.settle()
        self.journal.close()


@pytest.fixture(autouse=True)
def small() -> Iterator[None]:
    with small_parts():
        yield


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "day.vrst"


def test_old_times_are_the_same_to_the_bit_and_memory_does_not_grow(path: Path) -> None:
    robot = Robot(path)
    robot.move(100)
    assert robot.in_memory() < 50
    assert len(robot.engine.book.history.done) <= REACH.changes
    robot.check_past()
    assert len(robot.engine.book.all_records()()) == robot.engine.book.history.commands == 100
    recording = read_trajectory(path)
    assert recording.deltas == tuple(robot.engine.book.deltas)
    assert recording.timeline == robot.engine.timeline


def test_undo_goes_as_far_back_as_is_kept_and_says_so(path: Path) -> None:
    robot = Robot(path)
    robot.move(100)
    with pytest.raises(UsageError, match="at most UNDO 16"):
        robot.engine.undo(17)
    robot.engine.undo(8)  # which are changes, too
    robot.engine.redo(8)
    with pytest.raises(UsageError, match="there is no motion to undo"):
        robot.engine.undo()


@pytest.mark.parametrize("moves", [0, 3, 16, 17, 60, 61, 200])
def test_a_restart_reads_the_end_and_finds_all(path: Path, moves: int) -> None:
    robot = Robot(path)
    robot.move(moves)
    robot.end()
    again = Robot(path)
    assert again.from_checkpoint == (moves > 2 * REACH.changes)
    assert again.engine.timeline == read_trajectory(path).timeline
    assert again.engine.book.history.commands == moves
    again.seen = robot.seen
    again.check_past()
    again.move(20)
    again.check_past()
    again.end()
    assert len(read_trajectory(path).deltas) == moves + 20


def test_what_is_undone_before_a_checkpoint_may_be_redone_after_it(path: Path) -> None:
    robot = Robot(path, WindowSize(changes=200, segments=8, checkpoint=8))
    robot.move(30)
    for _ in range(11):
        robot.engine.undo()
    for _ in range(11):
        robot.engine.redo()
    robot.move(1)
    robot.end()
    again = Robot(path)
    assert again.from_checkpoint
    assert again.engine.timeline == read_trajectory(path).timeline
    assert again.engine.book.history.commands == 31


def test_a_file_of_before_is_taken_up_as_a_whole_and_has_checkpoints_then(path: Path) -> None:
    robot = Robot(path.with_name("other.vrst"), None)
    robot.move(100)
    recording = read_trajectory(path.with_name("other.vrst"))
    write_trajectory(path, recording.model, recording.initial, recording.deltas)
    first = Robot(path)
    assert not first.from_checkpoint
    assert first.in_memory() < 30
    first.move(20)
    first.end()
    second = Robot(path)
    assert second.from_checkpoint
    second.seen = robot.seen | first.seen
    second.check_past()
    assert len(tuple(second.engine.book.deltas)) == 120


@pytest.mark.parametrize("when", ["gone", "replaced", "written by others"])
def test_a_journal_that_is_lost_goes_on_in_a_copy_that_has_the_past(path: Path, when: str) -> None:
    robot = Robot(path)
    robot.move(50)
    if when == "written by others":
        path.open("ab").write(b"{}\n")
    else:
        path.unlink()
    if when == "replaced":
        path.write_text("mine")
    robot.move(30)
    assert len(robot.told) == 1
    robot.check_past()
    fresh = path.with_name("day-2.vrst")
    assert robot.journal.path == fresh
    robot.end()
    again = Robot(fresh)
    assert again.from_checkpoint
    again.seen = robot.seen
    again.check_past()
    assert read_trajectory(fresh).timeline == again.engine.timeline


def test_where_the_past_is_destroyed_nothing_happens_but_stopping(path: Path) -> None:
    robot = Robot(path)
    robot.move(50)
    os.truncate(path, path.stat().st_size // 2)
    with pytest.raises(FileError, match="has been cut short"):
        robot.move(1)
    first, *others = robot.engine.position().joints
    assert robot.engine.position(robot.engine.now + 9.0).joints == (first, *others)
    robot.seen = dict(list(robot.seen.items())[25:35])
    with pytest.raises(FileError, match="cannot be read"):
        robot.check_past()


def test_what_is_damaged_is_not_shown(path: Path) -> None:
    robot = Robot(path)
    robot.move(60)
    robot.journal.settle()
    with path.open("r+b") as stream:
        stream.write(path.read_bytes().replace(b'{"row":[{"start"', b'{"row":[{"stert"'))
    with pytest.raises(FileError, match="cannot be read"):
        robot.check_past()
    with pytest.raises(FileDamaged, match="line"):
        read_trajectory(path)


def test_what_cannot_be_written_stays_in_memory(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    robot, add = Robot(path), GrowingFile.add

    def full(file: GrowingFile, data: bytes, *, durable: bool) -> None:
        if data.startswith((b'{"row":', b'{"checkpoint":')):
            raise OSError(errno.ENOSPC, "full")
        add(file, data, durable=durable)

    monkeypatch.setattr(GrowingFile, "add", full)
    robot.move(40)
    assert robot.in_memory() == len(robot.engine.timeline)
    robot.check_past()
    monkeypatch.undo()
    with small_parts():
        robot.move(80)
        assert robot.in_memory() < 40
        robot.check_past()
        assert read_trajectory(path).timeline == robot.engine.timeline


def test_a_checkpoint_that_was_not_written_to_its_end_is_left_out(path: Path) -> None:
    robot = Robot(path)
    robot.move(60)
    robot.end()
    data = path.read_bytes()
    last = data.rindex(b'\n{"checkpoint":') + 1
    for cut in (last + 5, last + 200, data.index(b"\n", last), len(data) - 3):
        path.write_bytes(data[:cut])
        again = Robot(path)
        assert again.engine.timeline == read_trajectory(path).timeline
        again.end()


def signals(robot: Robot, count: int) -> None:
    """Signals, inputs from outside and the hand between motions; what is undone comes again."""
    engine = robot.engine
    for number in range(count):
        changes = ((1 + number % 3, float(number & 1)),)
        stamp = Stamp(engine.now) if number % 4 == 1 else None
        engine.perform(SetChannels(changes, stamp, "" if number % 4 == 1 else "SIGNAL"))
        if number % 5 == 2:
            robot.move(1)
        if number % 7 == 3:
            engine.perform(OperateHand(float(number % 2), True, "HAND"))
        if number % 6 == 4:
            engine.undo(2)
            engine.redo(1)


@pytest.mark.parametrize("count", [5, 40, 150])
def test_a_restart_finds_the_events(path: Path, count: int) -> None:
    robot, whole = Robot(path), None
    for _ in range(3):
        signals(robot, count)
        events, hand = tuple(robot.engine.timeline.events), robot.engine.position().hand
        commands = robot.engine.book.history.commands
        robot.end()
        whole = read_trajectory(path)
        assert tuple(whole.timeline.events) == events
        robot = Robot(path)
        assert robot.from_checkpoint or count < 40
        assert (tuple(robot.engine.timeline.events), robot.engine.position().hand) == (events, hand)
        assert robot.engine.timeline == whole.timeline
        assert robot.engine.book.history.commands == commands
        assert tuple(robot.engine.book.deltas) == whole.deltas
