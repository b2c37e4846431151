"""Measured reports in trajectory files: saved, written while they come, cut anywhere, moved, and taken up again."""

from __future__ import annotations

from math import sin
from pathlib import Path

import pytest

from tests.files.test_past import Robot
from tests.files.trajectories import initial, puma
from tests.laws.windows import small_parts
from vrs_cli.engine.engine import Engine
from vrs_cli.errors import FileDamaged
from vrs_cli.files import journal
from vrs_cli.files.trajectory_file import read_trajectory, write_trajectory
from vrs_cli.trajectory.measured import MeasuredRecord
from vrs_cli.values.measured import BodyMode, Report

STEP = 1.0 / 64.0


def reports(first: int, last: int) -> list[Report]:
    """Reports number `first` to before `last`, 64 a second."""
    made = []
    for k in range(first, last):
        rates = tuple(float(k % (joint + 2)) for joint in range(6))
        mode = BodyMode.STOPPED if k % 7 == 0 else BodyMode.FOLLOWS
        joints = tuple(sin(k * STEP + joint) for joint in range(6))
        made.append(Report(k * STEP, joints, rates if k % 3 else None, rates if k % 5 == 0 else None, mode))
    return made


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "day.vrst"


def robot(path: Path) -> Robot:
    return Robot(path, reach=None)


def test_what_is_saved_is_loaded_to_the_bit_whatever_its_order_of_arrival(path: Path) -> None:
    record = MeasuredRecord(6)
    wanted = reports(0, 3000)
    record.add([one for place in range(0, 3000, 2) for one in (wanted[place + 1], wanted[place])])
    write_trajectory(path, puma(), [initial()], [], measured=record.view)
    assert list(read_trajectory(path).measured) == wanted
    again = path.with_name("again.vrst")
    write_trajectory(again, puma(), [initial()], [], measured=read_trajectory(path).measured)
    assert list(read_trajectory(again).measured) == wanted


def test_a_journal_has_all_but_the_last_second_at_once_and_all_when_it_is_closed(path: Path) -> None:
    it = robot(path)
    for k in range(0, 640, 4):
        it.engine.measured.add(reports(k, k + 4))
        if not k % 64:
            it.move(1)
        written = len(read_trajectory(path).measured)
        assert written > k + 4 - 1.1 / STEP
    moved = it.engine.book.deltas
    it.end()
    found = read_trajectory(path)
    assert list(found.measured) == reports(0, 640)
    assert found.deltas == tuple(moved)
    assert it.told == []


def test_undo_and_branches_leave_the_record(path: Path) -> None:
    it = robot(path)
    it.move(2)
    it.engine.measured.add(reports(0, 200))
    seen = it.engine.measured.view
    it.engine.undo(2)
    assert it.engine.measured.view is seen
    it.end()
    assert read_trajectory(path).measured == seen


def test_a_journal_that_goes_on_has_the_reports_of_before(path: Path) -> None:
    for k in range(3):
        it = robot(path)
        assert list(it.engine.measured.view) == reports(0, 100 * k)
        it.engine.measured.add(reports(100 * k, 100 * k + 100))
        it.end()
    assert list(read_trajectory(path).measured) == reports(0, 300)


def test_a_file_that_is_cut_anywhere_has_the_reports_of_all_whole_lines(path: Path) -> None:
    it = robot(path)
    for k in range(0, 300, 3):
        it.engine.measured.add(reports(k, k + 3))
        it.move(1 if k % 100 == 0 else 0)
    it.end()
    data = path.read_bytes()
    ends = [place + 1 for place in range(len(data)) if data[place : place + 1] == b"\n"]
    whole = {end: len(read_trajectory(_cut(path, data, end)).measured) for end in ends}
    for size in range(ends[0], len(data), 331):
        before = max(end for end in ends if end <= size)
        found = read_trajectory(_cut(path, data, size))
        assert found.dropped_tail == (size > before)
        assert list(found.measured) == reports(0, whole[before])
    _cut(path, data, ends[-1] - 10)
    it = robot(path)  # goes on behind what is whole
    begin = len(it.engine.measured.view)
    it.engine.measured.add(reports(begin, 400))
    it.end()
    assert list(read_trajectory(path).measured) == reports(0, 400)


def _cut(path: Path, data: bytes, size: int) -> Path:
    path.write_bytes(data[:size])
    return path


def test_a_changed_block_is_found(path: Path) -> None:
    record = MeasuredRecord(6)
    record.add(reports(0, 100))
    write_trajectory(path, puma(), [initial()], [], measured=record.view)
    data = bytearray(path.read_bytes())
    place = data.index(b'"columns":') + 40
    data[place] ^= 1
    path.write_bytes(data)
    with pytest.raises(FileDamaged, match="line 2: its checksum"):
        read_trajectory(path)


@pytest.mark.parametrize("reach", [False, True])
def test_a_journal_that_is_removed_goes_on_elsewhere_with_all_reports(path: Path, reach: bool) -> None:
    with small_parts():
        it = Robot(path) if reach else robot(path)
        it.move(3)
        it.engine.measured.add(reports(0, 100))
        path.unlink()
        it.engine.measured.add(reports(100, 300))
        it.move(1)
        it.end()
        assert list(read_trajectory(path.with_name("day-2.vrst")).measured) == reports(0, 300)


@pytest.mark.parametrize("ended", [True, False])
def test_a_restart_from_a_checkpoint_has_all_reports(path: Path, ended: bool) -> None:
    """Reports from before the last checkpoint and after it. `ended`: else the process was killed."""
    with small_parts():
        it = Robot(path)
        it.move(1)
        it.engine.measured.add(reports(0, 80))  # lines of reports that follow each other
        it.engine.measured.add(reports(80, 160))
        for k in range(160, 600, 20):
            it.engine.measured.add(reports(k, k + 20))
            it.move(2)
        if ended:
            it.end()
        left = path.with_name("left.vrst")  # as a process that is killed leaves its file
        left.write_bytes(path.read_bytes())
        written = list(read_trajectory(left).measured)
        again = Robot(left)
        assert again.from_checkpoint
        seen = again.engine.measured.view
        assert list(seen) == written == reports(0, len(written))
        assert len(written) == 600 if ended else len(written) > 500
        for t in (0.5, 1.3, 2.2, 6.0):  # the checkpoint is far behind 2.2 s
            assert seen.joints_at(t) is not None
        again.engine.measured.add(reports(len(written), 700))
        again.move(1)
        again.end()
        if not ended:
            it.end()
    assert list(read_trajectory(left).measured) == reports(0, 700)


def test_reports_wait_while_the_disk_is_full(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    it = robot(path)
    it.move(1)

    def full(*_given: object, **_more: object) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as disk:
        disk.setattr(journal.GrowingFile, "add", full)
        for k in range(0, 400, 10):
            it.engine.measured.add(reports(k, k + 10))
    assert len(it.told) == 1
    assert "the measured reports wait in memory" in it.told[0]
    it.move(1)
    it.engine.measured.add(reports(400, 1200))
    it.end()
    found = read_trajectory(path)
    assert list(found.measured) == reports(0, 1200)
    assert len(found.deltas) == 2


def test_a_fresh_journal_of_a_robot_begins_with_its_reports(path: Path) -> None:
    engine = Engine(puma())
    engine.measured.add(reports(0, 50))
    file = journal.keep_journal(journal.take(path), engine)
    engine.measured.add(reports(50, 60))
    file.close()
    assert list(read_trajectory(path).measured) == reports(0, 60)
