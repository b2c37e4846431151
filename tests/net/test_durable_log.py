"""The chronicle: nothing is answered before it is on the disk, and nothing happens that cannot be."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.interfaces.terminals import RecordingTerminal
from vrs_cli.errors import FileError, LimitReached
from vrs_cli.files.continuing import keep_journal
from vrs_cli.files.growing import GrowingFile
from vrs_cli.files.journal import take_up
from vrs_cli.files.trajectory_file import read_trajectory
from vrs_cli.interfaces.session.session import Session
from vrs_cli.net.durable_log import DurableLog
from vrs_cli.net.memory import MemoryFile


def kept(folder: Path, most: int = 1000) -> tuple[Session, DurableLog]:
    session = Session(RecordingTerminal())
    journal = keep_journal(take_up(folder / "cell1.vrst"), session.engine, together=True)
    memory = MemoryFile(session, folder / "cell1.v2")
    memory.bring_back()
    durable_log = session.engine.book.journal = DurableLog(lambda: len(session.engine.timeline), most, journal, memory)
    return session, durable_log


def test_motions_and_memory_go_to_the_disk_with_one_settling(tmp_path: Path) -> None:
    session, durable_log = kept(tmp_path)
    assert not durable_log.unsettled
    session.perform("DRIVE 1, 10, 50")
    session.perform("n = 3")
    durable_log.note()
    assert durable_log.unsettled
    durable_log.settle()
    assert not durable_log.unsettled
    assert "n" in (tmp_path / "cell1.v2").read_text()
    assert len(read_trajectory(tmp_path / "cell1.vrst").deltas) == 1


def test_a_timeline_that_is_too_long_is_not_made_longer(tmp_path: Path) -> None:
    session, _ = kept(tmp_path, most=20)
    session.perform("DRIVE 1, 5, 50")
    each = len(session.engine.timeline) - 1
    for _ in range(19 // each - 1):
        session.perform("DRIVE 1, 5, 50")
    with pytest.raises(LimitReached, match="20 segments"):
        session.perform("DRIVE 1, 5, 50")
    assert len(session.engine.timeline) == 19 // each * each + 1
    session.perform("UNDO")
    session.perform("DRIVE 2, 5, 50")


def test_braking_is_no_matter_of_limits(tmp_path: Path) -> None:
    session, _ = kept(tmp_path, most=20)
    session.perform("DRIVE 1, 90, 10 AT 0.5")
    full = session.engine.book.journal = DurableLog(lambda: 1, 1)
    assert not full.unsettled
    session.abort()
    assert session.engine.end < 5.0


def test_what_could_not_be_written_is_tried_before_the_next_command(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    session, durable_log = kept(tmp_path)

    def full(*_data: object, **_how: object) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as broken:
        broken.setattr(GrowingFile, "add", full)
        broken.setattr("vrs_cli.files.atomic.create_beside", full)
        session.perform("n = 3")
        durable_log.note()
        for act in (durable_log.settle, durable_log.check, durable_log.check):
            with pytest.raises(FileError):
                act()
        assert not durable_log.unsettled, "the robot does not try without end"
    durable_log.check()
    assert "n" in (tmp_path / "cell1.v2").read_text()
    durable_log.check()
