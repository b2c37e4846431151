"""What was typed comes back after a shell was killed."""

from __future__ import annotations

from pathlib import Path
from random import Random

import pytest

from tests.interfaces.monitor.people import Person
from vrs_cli.files.recovery import left_files, recovery_files
from vrs_cli.interfaces.conversation.conversation import Conversation
from vrs_cli.interfaces.dialogue import at_once
from vrs_cli.interfaces.editor.buffer import ProgramBuffer
from vrs_cli.interfaces.editor.editors import ScreenDraft
from vrs_cli.interfaces.session.session import Session
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.repl.local_robot import RecoveryWriter
from vrs_cli.values.acts import ReadDraft


class Shell:
    """A conversation whose recovery files are in a folder."""

    def __init__(self, folder: Path, *, sure: bool = True, robot: str = "puma560") -> None:
        self.terminal = Person(sure=sure)
        self.conversation = Conversation(Session(self.terminal, load_robot(robot)))
        self.writer = RecoveryWriter(self.conversation, folder, self.terminal)

    def take(self, *lines: str) -> None:
        for line in lines:
            self.conversation.perform(self.conversation.lines(line))
            self.writer.keep()
        self.writer._recovery.wait()

    def kill(self) -> None:
        """What the system does to the lock."""
        held = self.writer._recovery._held
        if held is not None:
            held.release()

    @property
    def memory(self) -> object:
        environment = self.conversation.session.environment
        return {key: len(one.program.steps) for key, one in environment.programs.items()}, environment.values()


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path / "recovery"


def recovered(folder: Path, *, sure: bool = True) -> Shell:
    shell = Shell(folder, sure=sure)
    shell.writer.offer()
    return shell


LINES = (
    "n = 5",
    "n = n+1",
    '$s = "a b"',
    "SET part = TRANS(500,150,-100,90,90,0)",
    "SET row[2] = TRANS(1,2,3)",
    "HERE #p",
    "a[1,2] = PI",
    ".PROGRAM p(x)\nTYPE x\nn = 7\n.END",
    ".PROGRAM q\nMOVEE x\n.END",
    "DELETEP p",
    "DELETER n",
    "ZERO",
    "STORE everything",
    "LOAD everything",
    "EDIT p",
    "READY",
    "E",
    "wrong line",
    "EXECUTE p(1)",
)


@pytest.mark.parametrize("seed", range(6))
def test_whatever_is_typed_comes_back(folder: Path, seed: int) -> None:
    random = Random(seed)
    typed = [random.choice(LINES) for _ in range(25)]
    shell = Shell(folder)
    shell.terminal.changes = [""] * len(typed)
    shell.take(*typed, *(["E"] if shell.conversation.in_program else []))
    if shell.conversation.in_program:
        shell.take("E")
    shell.kill()
    unstored = shell.conversation.session.unstored
    if unstored.programs() or unstored.items():
        assert recovered(folder).memory == shell.memory, typed
    else:
        assert left_files(folder) == []


def test_a_program_that_is_being_typed_comes_back(folder: Path) -> None:
    shell = Shell(folder)
    shell.take(".PROGRAM long", "x = 1", "FOR i = 1 TO 3")
    shell.kill()
    again = recovered(folder)
    assert [len(one.program.steps) for one in again.conversation.session.environment.programs.values()] == [2]


def test_a_program_that_is_being_edited_comes_back_as_it_was_last(folder: Path) -> None:
    shell = Shell(folder)
    shell.take(".PROGRAM p\nx = 1\n.END", "EDIT p", "x = 2", "x = 3")
    shell.kill()
    again = recovered(folder)
    again.take("EXECUTE p")
    assert dict(again.conversation.session.environment.values())[("x", None)] == 3.0


def test_a_program_on_the_screen_comes_back_as_its_lines_were_left(folder: Path) -> None:
    shell = Shell(folder)
    draft = ScreenDraft(shell.conversation.session, ProgramBuffer(".PROGRAM p()"))
    at_once(draft.do(ReadDraft(".PROGRAM p()\n    x = 1\n    MOVEE")))
    shell.take("")
    shell.kill()
    again = recovered(folder)
    assert [len(one.program.steps) for one in again.conversation.session.environment.programs.values()] == [2]
    at_once(draft.do(ReadDraft(draft.text)))
    assert shell.conversation.unfinished_text == ""


def test_what_is_stored_needs_no_file(folder: Path) -> None:
    shell = Shell(folder)
    shell.take("HERE #p", "n = 1")
    assert len(recovery_files(folder)) == 1
    shell.take("STORE all")
    assert recovery_files(folder) == []


def test_who_only_looks_writes_nothing(folder: Path) -> None:
    shell = Shell(folder)
    shell.take("WHERE", "LISTR 2*PI", "DRIVE 1, 10", "wrong")
    assert not folder.exists()


def test_a_line_that_changes_nothing_writes_nothing(folder: Path) -> None:
    shell = Shell(folder)
    shell.take("n = 1")
    (file,) = recovery_files(folder)
    file.write_text("as it is")
    shell.take("WHERE", "LISTR n", "n = 1")
    assert file.read_text() == "as it is"


def test_a_memory_that_takes_long_to_write_is_written_now_and_then(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shell = Shell(folder)
    now, worked = iter([0.0, 1.0, 1.9, 2.1]), iter([0.0, 0.2, 0.2, 0.4])
    shell.writer._clock = lambda: next(now)
    monkeypatch.setattr("vrs_cli.repl.local_robot.time.process_time", lambda: next(worked))
    texts = []
    for number in range(4):
        shell.take(f"n = {number}")
        texts.append(recovery_files(folder)[0].read_text().split()[-2])
    assert texts == ["0", "0", "0", "3"]


def test_what_came_back_is_kept_again(folder: Path) -> None:
    shell = Shell(folder)
    shell.take("n = 1")
    shell.kill()
    again = recovered(folder)
    again.kill()
    assert recovered(folder).memory == shell.memory
    assert len(recovery_files(folder)) == 1


def test_it_is_said_when_another_robot_was_held(folder: Path) -> None:
    shell = Shell(folder, robot="kr10")
    shell.take("SET p = TRANS(1,2,3)")
    shell.kill()
    again = recovered(folder)
    (asked,) = again.terminal.asked
    assert ", robot kr10: 1 location. Load (Y/N)?" in asked
    assert again.memory == shell.memory
    again.kill()
    assert "robot" not in recovered(folder).terminal.asked[0]


def test_what_is_declined_is_not_asked_again_and_can_be_loaded(folder: Path) -> None:
    shell = Shell(folder)
    shell.take("n = 1")
    shell.kill()
    other = recovered(folder, sure=False)
    assert other.terminal.asked == [question for question in other.terminal.asked if "1 real. Load (Y/N)?" in question]
    (said,) = [reply.text for reply in other.terminal.replies]  # type: ignore[union-attr]
    assert recovered(folder).terminal.asked == []
    other.take(said.removeprefix("Not loaded; ").removesuffix(" brings it back"))
    assert other.memory == shell.memory
