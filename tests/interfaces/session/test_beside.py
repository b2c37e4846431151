"""A prompt that lives: lines that are typed while a program runs in real time."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.engine.wall import ManualWall
from tests.interfaces.monitor.people import Person
from tests.interfaces.programs import load, value
from tests.interfaces.terminals import RecordingTerminal
from vrs_cli.errors import TaskActive, UsageError
from vrs_cli.interfaces.session.session import Session
from vrs_cli.interfaces.tasks.limits import Limits
from vrs_cli.language.words.instructions import INSTRUCTIONS
from vrs_cli.language.words.monitor import BESIDE, COMMANDS
from vrs_cli.values.questions import LineWanted
from vrs_cli.values.replies import Farewell
from vrs_cli.values.results import Message, ProgramStopped


@pytest.fixture
def wall() -> ManualWall:
    return ManualWall()


@pytest.fixture
def session(terminal: RecordingTerminal, wall: ManualWall) -> Session:
    session = Session(terminal, clock=wall.clock())
    session.user_state.lives = True
    return session


def later(session: Session, wall: ManualWall, seconds: float) -> None:
    """Time passes, and whoever drives looks."""
    wall.seconds += seconds
    session.settle()


def test_execute_gives_the_prompt_back_and_the_end_is_told(
    session: Session, terminal: RecordingTerminal, wall: ManualWall
) -> None:
    load(session, "DRIVE 1, 60, 50", "BREAK", 'TYPE "there"')
    session.perform("EXECUTE main")
    assert (session.running, terminal.replies, wall.slept) == (True, [], [])
    later(session, wall, 1.0)
    assert session.running
    later(session, wall, 5.0)
    assert not session.running
    assert terminal.typed == "there\n"
    assert terminal.replies == [Message("Program completed")]


def test_what_is_typed_acts_at_once(session: Session, terminal: RecordingTerminal, wall: ManualWall) -> None:
    load(session, "WAIT SIG(1001)", "DRIVE 1, 60, 50", "x = pace", "WAIT SIG(1002)")
    session.perform("pace = 0")
    session.perform("EXECUTE main")
    later(session, wall, 1.0)
    session.perform("pace = 7")
    session.perform("SPEED 20")
    session.perform("SIGNAL 1001")
    assert session.engine.end > 5.0, "it moves, and slowly"
    later(session, wall, 10.0)
    assert value(session, "x") == 7.0
    session.perform("ABORT")
    later(session, wall, 1.0)
    assert not session.running
    assert terminal.replies == [ProgramStopped("(ABORTED)", "main", 4)]


@pytest.mark.parametrize(
    "line", ["DRIVE 1, 10", "DO READY", "CALL main", "UNDO", "ZERO", "JOG 1, 5", "TOOL", "WAIT SIG(1)"]
)
def test_what_has_to_wait_is_refused_with_the_reason(session: Session, line: str) -> None:
    load(session, "WAIT SIG(1001)")
    session.perform("EXECUTE main")
    with pytest.raises(UsageError, match=r"has to wait until the program stops \(ABORT stops it\)"):
        session.perform(line)
    assert session.running


@pytest.mark.parametrize("line", ["EXECUTE main", "PROCEED", "PRIME main", "XSTEP"])
def test_a_second_program_is_refused(session: Session, line: str) -> None:
    load(session, "WAIT SIG(1001)")
    session.perform("EXECUTE main")
    with pytest.raises(TaskActive, match="task 0 runs main"):
        session.perform(line)


def test_the_words_that_go_beside_a_program_are_words() -> None:
    assert not BESIDE - {*COMMANDS, *INSTRUCTIONS}


def test_a_question_of_a_program_waits_while_another_task_goes_on(
    session: Session, terminal: RecordingTerminal, wall: ManualWall
) -> None:
    load(session, 'PROMPT "How many? ", n', "t = TIME()")
    load(session, "DO", "k = k+1", "WAIT.EVENT , 0.5", "UNTIL FALSE", name="other")
    session.perform("k = 0")
    session.perform("PCEXECUTE other")
    session.perform("EXECUTE main")
    later(session, wall, 2.25)
    ((_, asked),) = session.driver.questions()
    assert (asked.question.text, terminal.asked, value(session, "k")) == ("How many? ", [], 5.0)
    session.driver.answer(asked.number, "five")
    later(session, wall, 1.0)
    ((_, again),) = session.driver.questions()
    assert again.number > asked.number
    assert again.question.wrong.startswith("*Invalid number format* five")
    session.driver.answer(asked.number, "4")  # too late: that question is answered
    session.driver.answer(again.number, "5")
    later(session, wall, 1.0)
    assert (value(session, "n"), value(session, "t"), value(session, "k")) == (5.0, 3.25, 9.0)


def test_a_question_whose_program_is_stopped_needs_no_answer(session: Session, wall: ManualWall) -> None:
    load(session, 'PROMPT "How many? ", n')
    session.perform("EXECUTE main")
    dialogue = session.driver.ask()
    assert next(dialogue) == LineWanted("How many? ")
    assert not session.driver.has_withdrawn
    session.perform("ABORT")
    later(session, wall, 1.0)
    assert session.driver.has_withdrawn
    with pytest.raises(StopIteration):
        dialogue.send("5")
    assert not session.running


def test_the_limits_of_a_program_hold_though_nobody_waits_for_it(terminal: RecordingTerminal, wall: ManualWall) -> None:
    session = Session(terminal, clock=wall.clock(), limits=Limits(max_elements=5000))
    session.user_state.lives = True
    load(session, "FOR i = 1 TO 100000", "a[i] = i", "WAIT", "END")
    session.perform("EXECUTE main")
    later(session, wall, 1000.0)
    (stopped,) = terminal.replies
    assert isinstance(stopped, ProgramStopped)
    assert "arrays and strings hold" in stopped.what


def test_what_is_typed_beside_a_program_is_not_stored_and_what_that_computes_does_not_count(wall: ManualWall) -> None:
    session = Session(Person(), clock=wall.clock())
    session.user_state.lives = True
    load(session, "x = 1", "WAIT SIG(1001)", "y = 2")
    session.perform("EXECUTE main")
    session.perform("z = 3")
    session.perform("SIGNAL 1001")
    later(session, wall, 1.0)
    assert not session.running
    assert session.unstored.items() == [("z", None)]


def test_leaving_asks_while_a_program_runs(wall: ManualWall) -> None:
    person = Person(sure=False)
    session = Session(person, clock=wall.clock())
    session.user_state.lives = True
    load(session, "WAIT SIG(1001)")
    session.unstored.programs_stored(one.program for one in session.programs.values())
    session.perform("EXECUTE main")
    session.perform("EXIT")
    assert person.asked == ["Leave (Y/N)?"]
    session.perform("ABORT")
    later(session, wall, 1.0)
    session.perform("EXIT")
    assert person.replies[-1] == Farewell()


def test_in_a_file_of_commands_execute_is_waited_for(
    session: Session, terminal: RecordingTerminal, tmp_path: Path
) -> None:
    load(session, "DELAY 1", "BREAK", "x = 1")
    (tmp_path / "start.pc").write_text("EXECUTE main\nx = x+1\n")
    session.perform(f"COMMANDS {tmp_path}/start.pc")
    assert value(session, "x") == 2.0
    assert terminal.replies == [Message("Program completed")]
