"""The tasks of a robot: what is on a stack, who is busy, who failed."""

from __future__ import annotations

import pytest

from tests.interfaces.programs import load, value
from tests.interfaces.terminals import RecordingTerminal
from vrs_cli.errors import FileError, ProgramInterlocked, TaskActive, TaskNotActive
from vrs_cli.interfaces.session.session import Session
from vrs_cli.interfaces.tasks.devices import Devices
from vrs_cli.language.run.effects import TaskState
from vrs_cli.values.replies import Reply
from vrs_cli.values.results import ProgramStopped, RunOutcome


def test_a_program_on_the_stack_is_left_alone_until_kill(session: Session) -> None:
    load(session, "PAUSE", "x = 1")
    load(session, "x = 2", name="other")
    session.execute("main")
    for line in ("DELETEP main", "RENAME new = main"):
        with pytest.raises(ProgramInterlocked, match="KILL"):
            session.perform(line)
    with pytest.raises(ProgramInterlocked):
        load(session, "x = 3")
    load(session, "x = 4", name="other")
    session.perform("KILL")
    load(session, "x = 3")
    session.execute("main")
    assert value(session, "x") == 3.0


def test_tasks_that_are_busy_or_not_there(session: Session) -> None:
    load(session, "WAIT SIG(1001)")
    session.perform("PCEXECUTE main")
    with pytest.raises(TaskActive):
        session.perform("EXECUTE 1 main")
    with pytest.raises(TaskActive):
        session.perform("KILL 1")
    session.perform("PCABORT")
    session.perform("PCPROCEED")
    with pytest.raises(TaskNotActive):
        session.perform("PCPROCEED")


@pytest.mark.parametrize("line", ["PRIME main", "EXECUTE main", "XSTEP main"])
def test_a_robot_program_that_runs_beside_is_not_replaced(session: Session, line: str) -> None:
    load(session, "DELAY 5", "x = 1")
    load(session, "EXECUTE 0 main", "WAIT DEFINED(x)", name="other")
    session.perform("PCEXECUTE other")
    with pytest.raises(TaskActive, match="task 0 runs main"):
        session.perform(line)
    assert session.task is not None
    assert session.task.state is TaskState.RUNNING


def test_a_refused_prime_leaves_the_task_that_was_there(session: Session, monkeypatch: pytest.MonkeyPatch) -> None:
    load(session, "x = 1")
    session.perform("EXECUTE main")

    def full(_devices: Devices, _number: int) -> None:
        raise FileError("the disk is full")

    monkeypatch.setattr(Devices, "release", full)
    with pytest.raises(FileError):
        session.perform("PRIME main")
    assert session.task is not None
    assert session.task.state is TaskState.COMPLETED


def test_another_task_that_fails_is_told_and_does_not_stop_the_first(session: Session) -> None:
    load(session, "WAIT.EVENT , 1", "x = 1")
    load(session, "WAIT.EVENT , 0.5", "y = nothing", name="other")
    session.start(3, "other")
    result = session.execute("main")
    assert (result.outcome, value(session, "x")) == (RunOutcome.COMPLETED, 1.0)
    assert [(one.number, one.fault.program, one.fault.step, one.at) for one in result.beside] == [(3, "other", 2, 0.5)]


def test_it_is_told_at_once_with_its_instant(session: Session) -> None:
    load(session, "WAIT.EVENT , 1", 'TYPE "later"')
    load(session, "WAIT.EVENT , 0.5", "y = nothing", name="other")
    session.start(3, "other")
    terminal = session.terminal
    assert isinstance(terminal, RecordingTerminal)
    told: list[tuple[float, str, str]] = []
    show = terminal.show

    def shown(reply: Reply) -> None:
        if isinstance(reply, ProgramStopped):
            told.append((session.engine.now, reply.what, terminal.typed))
        show(reply)

    terminal.show = shown  # type: ignore[method-assign]
    session.perform("EXECUTE main")
    assert told == [(0.5, "*Undefined value* nothing (nothing = ... gives it a value) [task 3 at 0.500 s]", "")]


def test_a_program_with_errors_fails_where_it_is_started(session: Session) -> None:
    session.load_text(".PROGRAM wrong\nx = )\n.END\n")
    load(session, "EXECUTE 1 wrong", "x = 1")
    result = session.execute("main")
    assert result.fault is not None
    assert (result.fault.message[:24], result.fault.step) == ("*Program not executable*", 1)
    session.perform("PROCEED")  # the session is well
    assert value(session, "x") == 1.0


def test_one_that_starts_itself_over_and_over_lets_time_go_on(session: Session) -> None:
    load(session, "EXECUTE main", "n = n+1")
    session.perform("n = 0")
    session.execute("main")
    for _ in range(2):
        session.perform("DELAY 0.05")
    assert 0 < value(session, "n") < 1000


def test_a_program_of_nothing_that_goes_round_takes_turns(session: Session) -> None:
    load(session, name="nothing")
    session.perform("PCEXECUTE nothing, -1")
    load(session, "DELAY 0.01", "x = 1")
    assert session.execute("main").fault is None
    assert value(session, "x") == 1.0
