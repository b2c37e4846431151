"""The chronicle: nothing is answered before it is on the disk, and nothing happens that cannot be."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from tests.interfaces.terminals import RecordingTerminal
from vrs_cli.errors import FileError, LimitReached
from vrs_cli.files.journal import keep_journal, take_up
from vrs_cli.files.past import GrowingFile
from vrs_cli.files.store import store
from vrs_cli.files.trajectory_file import read_trajectory
from vrs_cli.interfaces.dialogue import Work
from vrs_cli.interfaces.session.session import Session
from vrs_cli.language.text.ast import Program
from vrs_cli.net import durable_log
from vrs_cli.net.durable_log import WAITS, Audit, DurableLog, MemoryFile
from vrs_cli.values.diagnostics import Severity


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


LINES = (
    "n = 1/3",
    "row[3,4] = -1e-9",
    '$s = "a ; part 00000000"',
    "SET here = TRANS(1/3, -2.5, 1e3, 10, 20, 30)",
    "SET #p = #PPOINT(1, 2, 3, 4, 5, 6)",
    "DO SPEED 30 ALWAYS",
    "SPEED 40",
    "PARAMETER CAUSALITY = ABORT",
)
PROGRAM = ".PROGRAM p(a)\n; what it does\nMOVE here\nTYPE a\n.END\n"


def opened(path: Path) -> tuple[Session, MemoryFile]:
    session = Session(RecordingTerminal())
    memory = MemoryFile(session, path)
    assert not memory.bring_back()
    return session, memory


def carry_out(session: Session, memory: MemoryFile, *lines: str) -> None:
    for line in lines:
        session.perform(line)
        memory.note()
        memory.write()


def held(session: Session) -> object:
    """Locations as files have them: to 1e-9 mm."""
    return store(session.environment), session.engine.settings


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "cell1.v2"


def test_a_program_that_is_not_finished_is_loaded_back_without_a_word(path: Path) -> None:
    session, memory = opened(path)
    session.load_text(".PROGRAM p\nIF a THEN\nMOVEE b\n.END\n")
    carry_out(session, memory, "n = 1")
    again, _ = opened(path)
    assert held(again) == held(session)
    path.write_text(".PROGRAM p\nIF a THEN\n.END\n.REALS\n3x 4\n.END\n")
    found = MemoryFile(Session(RecordingTerminal()), path).bring_back()
    assert [(one.span.line, one.severity) for one in found] == [(5, Severity.ERROR), (4, Severity.WARNING)]


def test_what_was_changed_is_there_again(path: Path) -> None:
    session, memory = opened(path)
    carry_out(session, memory, *LINES)
    session.load_text(PROGRAM)
    carry_out(session, memory, "n = n + 1")
    again, _ = opened(path)
    assert held(again) == held(session)


def test_what_was_deleted_is_not(path: Path) -> None:
    session, memory = opened(path)
    session.load_text(PROGRAM)
    carry_out(session, memory, "n = 1", "m = 2", "DELETER n", "DELETEP p")
    again, _ = opened(path)
    assert held(again) == held(session)
    assert not again.programs


def test_it_grows_by_what_has_changed(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    session, memory = opened(path)
    session.load_text(".REALS\n" + "".join(f"x{n} {n}\n" for n in range(100)) + ".END\n")
    carry_out(session, memory, "x1 = 7")
    before = path.stat().st_size
    carry_out(session, memory, "x2 = 7", "WHERE", "TYPE x2")
    assert path.stat().st_size - before < 100
    monkeypatch.setattr("vrs_cli.net.durable_log.SLACK", 500)
    sizes = set()
    for n in range(120):
        session.environment.reference("x3").assign(float(n))
        memory.note()
        memory.write()
        sizes.add(path.stat().st_size)
    assert max(sizes) < 2.2 * min(sizes) + 500, "what is out of date is left out in time"
    again, _ = opened(path)
    assert held(again) == held(session)


def test_a_last_part_that_is_cut_short_is_left_out_at_every_byte(path: Path) -> None:
    session, memory = opened(path)
    carry_out(session, memory, "n = 1")
    whole = path.read_bytes()
    carry_out(session, memory, "n = 22", "m = 33")
    longer = path.read_bytes()
    middle = longer.index(b"; part", len(whole)) + len("; part 00000000\n")
    for cut in range(len(whole), len(longer)):
        path.write_bytes(longer[:cut])
        again, _ = opened(path)
        values = {key: value for (key, _), value in again.environment.values().items()}
        assert values == ({"n": 1.0} if cut < middle else {"n": 22.0}), cut


def test_a_part_that_was_changed_ends_what_is_taken(path: Path) -> None:
    session, memory = opened(path)
    carry_out(session, memory, "n = 1", "n = 2", "n = 3")
    path.write_bytes(re.sub(rb"(n\s+)2\b", rb"\g<1>9", path.read_bytes()))
    again, _ = opened(path)
    assert again.environment.values() == {("n", None): 1.0}


def test_a_disk_that_takes_nothing(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    session, memory = opened(path)
    carry_out(session, memory, "n = 1")

    def full(*_data: object, **_how: object) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as broken:
        broken.setattr(GrowingFile, "add", full)
        with pytest.raises(FileError, match="no space left"):
            carry_out(session, memory, "n = 2")
        assert "no space left" in memory.failing
        assert WAITS in memory.failing
    carry_out(session, memory, "m = 3")
    assert not memory.failing
    again, _ = opened(path)
    assert held(again) == held(session), "also what could not be written before"


def test_it_is_a_program_file_that_load_reads(path: Path) -> None:
    session, memory = opened(path)
    session.load_text(PROGRAM)
    carry_out(session, memory, *LINES)
    reader = Session(terminal := RecordingTerminal())
    reader.perform(f"LOAD {path}")
    assert store(reader.environment) == store(session.environment)
    assert [str(getattr(reply, "text", reply)) for reply in terminal.replies] == [f"{path} loaded: p"]


def test_a_long_program_is_printed_by_another_thread_and_others_write_meanwhile(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("vrs_cli.net.durable_log.LONG_PROGRAM", 3)
    session, memory = opened(path)
    session.load_text(".PROGRAM long\nx = 0\n.END\n")
    carry_out(session, memory, "n = 1")
    session.load_text(".PROGRAM long\n" + "x = 1\n" * 9 + ".END\n.PROGRAM more\n" + "x = 2\n" * 9 + ".END\n")
    printing = memory.prepare()
    work = next(printing)
    with monkeypatch.context() as patch:
        patch.setattr("vrs_cli.net.durable_log.print_program", None)  # the robot's thread prints nothing
        carry_out(session, memory, "n = 2")
    between, _ = opened(path)
    assert list(between.programs) == ["long"]
    assert len(between.programs["long"].program.steps) == 1
    assert isinstance(work, Work)
    work.run()
    with pytest.raises(StopIteration):
        next(printing)
    assert memory.changed
    memory.write()
    again, _ = opened(path)
    assert held(again) == held(session)


def test_a_program_that_has_not_changed_is_printed_once(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    printed = list[str]()
    really = durable_log.print_program

    def print_program(program: Program) -> str:
        printed.append(program.name)
        return really(program)

    monkeypatch.setattr(durable_log, "print_program", print_program)
    session, memory = opened(path)
    session.load_text(".PROGRAM one\nx = 0\n.END\n")
    carry_out(session, memory, "n = 1")
    session.load_text(".PROGRAM two\nx = 0\n.END\n")
    carry_out(session, memory, "n = 2", "n = 3")
    assert printed == ["one", "two"]


MOVE = ("cell1", "ada", "10.0.0.7:51344", "MOVE part", "done")


def rows(path: Path) -> list[dict[str, str]]:
    return [json.loads(line) for line in path.read_text().splitlines()]


def audit(path: Path | None, told: list[str], most: int = 10_000) -> Audit:
    return Audit(path, lambda: 1_800_000_000.123, told.append, most)


def test_a_line_says_when_who_where_what_and_what_became_of_it(tmp_path: Path) -> None:
    path = tmp_path / "journal" / "audit.jsonl"
    audit(path, []).note(*MOVE)
    assert rows(path) == [
        {
            "when": "2027-01-15T08:00:00.123Z",
            "robot": "cell1",
            "who": "ada",
            "from": "10.0.0.7:51344",
            "what": "MOVE part",
            "result": "done",
        }
    ]


def test_it_is_there_at_once_and_goes_on_in_the_same_file(tmp_path: Path) -> None:
    path = tmp_path / "audit.jsonl"
    for _ in range(2):
        audit(path, []).note(*MOVE)
    assert len(rows(path)) == 2


def test_what_is_typed_cannot_forge_a_line(tmp_path: Path) -> None:
    path = tmp_path / "audit.jsonl"
    audit(path, []).note("cell1", "ada", "x", 'MOVE p"}\n{"who": "bob\x1b[2J', "done")
    assert len(rows(path)) == 1
    assert "\x1b" not in path.read_text()


def test_long_commands_are_cut_and_say_so(tmp_path: Path) -> None:
    path = tmp_path / "audit.jsonl"
    audit(path, []).note("cell1", "ada", "x", "y" * 5000, "done")
    assert rows(path)[0]["what"].endswith("yyy... (5000 characters)")
    assert path.stat().st_size < 2000


def test_a_stranger_cannot_fill_it_with_his_name(tmp_path: Path) -> None:
    path = tmp_path / "audit.jsonl"
    audit(path, []).note(30_000 * "r", 30_000 * "\0", "10.0.0.7:1", "(enter)", "refused")
    (row,) = rows(path)
    assert row["robot"] == 40 * "r"
    assert row["who"] == 40 * "\0"


def test_it_is_bounded(tmp_path: Path) -> None:
    path = tmp_path / "audit.jsonl"
    it = audit(path, [], most=1000)
    for number in range(100):
        it.note("cell1", "ada", "x", f"MOVE p{number}", "done")
    assert sorted(one.name for one in tmp_path.iterdir()) == ["audit.1.jsonl", "audit.jsonl"]
    assert all(one.stat().st_size <= 1000 for one in tmp_path.iterdir())
    kept = [row["what"] for one in ("audit.1.jsonl", "audit.jsonl") for row in rows(tmp_path / one)]
    assert kept == [f"MOVE p{number}" for number in range(100 - len(kept), 100)]


def test_what_cannot_be_written_is_told_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path, told = tmp_path / "audit.jsonl", list[str]()
    it = audit(path, told)

    def full(_handle: int, _data: bytes) -> int:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as broken:
        broken.setattr("vrs_cli.net.durable_log.os.write", full)
        it.note(*MOVE)
        it.note(*MOVE)
    assert len(told) == 1
    assert "no space left" in told[0]
    it.note(*MOVE)
    assert len(told) == 2
    assert len(rows(path)) == 1


def test_half_a_line_does_not_stay(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import os

    path, write = tmp_path / "audit.jsonl", os.write
    it = audit(path, [])
    with monkeypatch.context() as short:
        short.setattr("vrs_cli.net.durable_log.os.write", lambda handle, data: write(handle, data[:5]))
        it.note(*MOVE)
    it.note(*MOVE)
    assert len(rows(path)) == 1


def test_a_place_that_cannot_be_written_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(FileError):
        audit(tmp_path / "file" / "audit.jsonl", [])
    audit(None, []).note(*MOVE)
