"""A session whose journal cannot be written: nothing moves any more, and what moves stops."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.engine.paper import Paper
from tests.engine.wall import ManualWall
from tests.interfaces.terminals import RecordingTerminal
from vrs_cli.errors import FileError, FileOpened
from vrs_cli.files.journal import keep_journal, take_up
from vrs_cli.files.opening import Folder
from vrs_cli.files.trajectory_file import read_trajectory
from vrs_cli.interfaces.jog.jogger import Jogger
from vrs_cli.interfaces.session.session import Session
from vrs_cli.repl.player import JogPanel

MEDDLE = """.PROGRAM meddle()
    ATTACH (lun, 4) "DISK"
    FOPENA (lun) "day.vrst"
    TYPE IOSTAT(lun)
    FDELETE (lun) "link.vrst"
    TYPE IOSTAT(lun)
    FOPENR (lun) "day.vrst"
    TYPE IOSTAT(lun)
.END
"""
PROGRAM = """.PROGRAM tear()
    MOVE #PPOINT(0, -45, 180, 20, 45, 0)
    MOVE #PPOINT(90, -45, 180, 20, 45, 0)
    MOVE #PPOINT(0, -45, 180, 20, 45, 0)
.END
"""


def recorded(session: Session) -> Paper:
    session.engine.book.journal = paper = Paper(session.engine.book)
    return paper


def test_a_program_stops_where_a_motion_cannot_be_written_down_and_goes_on_when_it_can() -> None:
    session = Session(RecordingTerminal())
    session.load_text(PROGRAM)
    paper = recorded(session)
    record = paper.record

    def torn_after_one(deltas, *, happens=False) -> None:
        paper.torn = len(paper.lines) == 1
        record(deltas, happens=happens)

    paper.record = torn_after_one  # type: ignore[method-assign]
    result = session.execute("tear")
    assert result.fault is not None
    assert (result.fault.code, result.fault.step) == (FileError.code, 2)
    assert session.engine.now == session.engine.end
    paper.record = record  # type: ignore[method-assign]
    paper.torn = False
    assert session.converse(session.wait(session.resume(retry=True))).fault is None
    assert len(session.engine.book.records()) == 3
    assert paper.timeline() == session.engine.timeline


def test_abort_stops_the_arm_also_in_real_time() -> None:
    wall = ManualWall()
    session = Session(RecordingTerminal(), clock=wall.clock())
    paper = recorded(session)
    session.perform("DRIVE 1, 90, 20")
    end, paper.torn = session.engine.end, True
    wall.seconds += 0.5
    session.perform("ABORT")
    assert session.engine.end < end
    assert paper.owed == 1


def test_a_key_that_moves_nothing_says_why() -> None:
    session = Session(RecordingTerminal())
    panel, paper = JogPanel(Jogger(session)), recorded(session)
    before, paper.torn = session.engine.timeline, True
    panel.move(1.0)
    assert "no paper" in panel.look().said
    assert session.engine.timeline is before


@pytest.mark.parametrize(
    "line", ["DRIVE 2, 5", "DRIVE 2, 5 AT 0.1", "UNDO", "UNDO 2", "JOG 1, 5", "OPENI", "TOOL NULL"]
)
def test_a_line_that_cannot_be_written_down_is_refused(line: str) -> None:
    session = Session(RecordingTerminal())
    paper = recorded(session)
    for before in ("TOOL TRANS(0, 0, 100)", "DRIVE 1, 10", "DRIVE 1, 10"):
        session.perform(before)
    timeline, clock, paper.torn = session.engine.timeline, session.engine.now, True
    with pytest.raises(FileError, match="no paper"):
        session.perform(line)
    assert (session.engine.timeline, session.engine.now) == (timeline, clock)
    paper.torn = False
    session.perform(line)
    assert paper.timeline() == session.engine.timeline


def test_a_branch_is_written_when_it_is_merged_and_a_lost_file_holds_main_alone(tmp_path: Path) -> None:
    path, session, told = tmp_path / "day.vrst", Session(RecordingTerminal()), list[str]()
    journal = keep_journal(take_up(path), session.engine, told.append)
    session.perform("DRIVE 1, 10")
    session.perform("BRANCH trial")
    session.perform("DRIVE 2, 10")
    path.write_text("lost")
    session.perform("BRANCH main")
    session.perform("DRIVE 3, 10")
    assert len(told) == 1
    assert [delta.motion.text for delta in read_trajectory(journal.path).deltas] == ["DRIVE 1, 10", "DRIVE 3, 10"]
    session.perform("MERGE trial")
    journal.path.write_text("lost again")
    session.perform("BRANCH other")
    session.perform("DRIVE 4, 10")
    journal.close()
    texts = [delta.motion.text for delta in read_trajectory(journal.path).deltas]
    assert texts == ["DRIVE 1, 10", "DRIVE 3, 10", "DRIVE 2, 10"]
    assert (len(told), journal.path.name) == (2, "day-3.vrst")


@pytest.mark.parametrize(
    "line",
    [
        "SAVE day",
        "SAVE link.vrst",
        "STORE day.vrst",
        "FDELETE day.vrst",
        "FCOPY day.vrst = other.txt",
        "FRENAME day.vrst = other.txt",
        "FRENAME other.vrst = day.vrst",
    ],
)
def test_no_command_touches_a_file_that_is_being_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, line: str
) -> None:
    monkeypatch.chdir(tmp_path)
    journal = keep_journal(take_up(Path("day.vrst")), Session(RecordingTerminal()).engine)
    Path("link.vrst").symlink_to("day.vrst")
    Path("other.txt").write_text("other")
    session = Session(RecordingTerminal())
    session.perform("DISABLE INTERACTIVE")
    session.perform("SET a = NULL")
    with pytest.raises(FileOpened, match="is being written by"):
        session.perform(line)
    assert Path("other.txt").read_text() == "other"
    journal.close()
    session.perform(line)


def test_no_program_touches_its_own_journal(tmp_path: Path) -> None:
    session = Session(RecordingTerminal(), folder=Folder(tmp_path))
    journal = keep_journal(take_up(tmp_path / "day.vrst"), session.engine)
    (tmp_path / "link.vrst").symlink_to("day.vrst")
    session.load_text(MEDDLE)
    assert session.execute("meddle").typed == ("-506", "-506", " 1")
    assert journal.sound
