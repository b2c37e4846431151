"""Programs started, stopped and gone on with."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.interfaces.monitor.people import PART, Person, at, last, loaded
from tests.interfaces.terminals import RecordingTerminal
from vrs_cli.interfaces.dialogue import Running
from vrs_cli.interfaces.monitor.programs import emergency_stop
from vrs_cli.language.words.values import Kind
from vrs_cli.values import replies, results


def test_execute_alone_runs_the_first_program_of_a_file(folder: Path) -> None:
    (folder / "new.v2").write_text(".PROGRAM second\nTYPE 1\n.END\n.PROGRAM another\nTYPE 2\n.END\n")
    session = at(RecordingTerminal(), "LOAD new", "EXECUTE", "EXECUTE another", "EXECUTE")
    assert session.terminal.typed.split() == ["1", "2", "2"]  # type: ignore[attr-defined]


def test_execute_tells_how_it_went() -> None:
    session = loaded(Person())
    session.perform("EXECUTE other")
    assert last(session, results.Message).text == "Program completed"
    session.load_text(".PROGRAM p\nPAUSE\nq = nothing\nHALT\n.END\n")
    endings = []
    for line in ("EXECUTE p", "PROCEED", "PROCEED"):
        session.perform(line)
        stopped = last(session, results.ProgramStopped)
        endings.append(
            (stopped.what.split("*")[1] if "*" in stopped.what else stopped.what, stopped.step, stopped.tone)
        )
    note, error = results.Tone.NOTE, results.Tone.ERROR
    assert endings == [("(PAUSED)", 1, note), ("Undefined value", 2, error), ("(HALTED)", 3, note)]


def test_retry_does_the_failed_step_again() -> None:
    session = at(RecordingTerminal())
    session.load_text(".PROGRAM p\nq = nothing\n.END\n")
    session.perform("EXECUTE p")
    session.perform("nothing = 4")
    session.perform("RETRY")
    assert last(session, results.Message).text == "Program completed"
    assert dict(session.environment.variables(Kind.REAL))["q"] == 4.0


def test_arguments_go_by_reference() -> None:
    session = at(RecordingTerminal())
    session.load_text(".PROGRAM add(a, b)\na = a + b\n.END\n")
    session.perform("total = 5")
    session.perform("EXECUTE add(total, 2), 3")
    assert dict(session.environment.variables(Kind.REAL))["total"] == 11.0


def test_whoever_watches_sees_progress() -> None:
    person = Person("")
    session = at(person, PART)
    session.load_text(".PROGRAM p\nMOVE part\nREADY\n.END\n")
    session.perform("EXECUTE p")
    assert person.progressed[-1] == Running(session.engine.now)


def test_the_emergency_stop_tells_of_the_motion_and_of_each_task() -> None:
    session = at(RecordingTerminal(), "DRIVE 1, 60 AT 5")
    session.load_text(".PROGRAM wait\nWAIT SIG(1001)\n.END\n")
    session.converse(emergency_stop(session))
    assert last(session, results.Message).text == "The motion is stopped"
    for task in (3, 5):
        session.perform(f"EXECUTE {task} wait")
    before = len(session.terminal.replies)  # type: ignore[attr-defined]
    session.converse(emergency_stop(session))
    assert not any(session.tasks.running)
    stopped = session.terminal.replies[before:]  # type: ignore[attr-defined]
    assert [(one.what, one.program) for one in stopped] == [("(ABORTED)", "wait")] * 2


def test_abort_stops_motion_that_is_scheduled() -> None:
    session = at(RecordingTerminal(), "DRIVE 1, 60 AT 5", "ABORT")
    stopped, _ = session.terminal.replies[-2:]  # type: ignore[attr-defined]
    assert stopped.text == "The motion is stopped"
    (dropped,) = last(session, replies.Displaced).displacement.dropped
    assert dropped.text == "DRIVE 1, 60 AT 5"
    assert session.engine.position(100.0).joints[0] == pytest.approx(0.0)
    session.perform("ABORT")
    assert last(session, results.Message).text == "Nothing is running"
