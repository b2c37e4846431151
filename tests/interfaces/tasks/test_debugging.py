"""Programs one step at a time: steps, breakpoints, watches, the variables of a stopped program."""

from __future__ import annotations

import pytest

from tests.interfaces.programs import load, value
from tests.interfaces.terminals import RecordingTerminal
from vrs_cli.errors import IllegalValue
from vrs_cli.interfaces.session.session import Session
from vrs_cli.values.replies import RealTable
from vrs_cli.values.results import Message, ProgramStopped


def test_steps_into_and_over_a_call(session: Session) -> None:
    load(session, "a = 1", "CALL sub", "b = 2")
    load(session, "c = 3", "d = 4", name="sub")
    session.perform("PRIME main")
    places = []
    for word in ("SSTEP", "XSTEP", "XSTEP"):
        session.perform(word)
        assert session.task is not None
        places.append((session.task.program, session.task.step))
    assert places == [("main", 2), ("sub", 1), ("sub", 2)]
    session.perform("PRIME main")
    session.perform("NEXT")
    session.perform("NEXT")
    assert session.task is not None
    assert (session.task.program, session.task.step, value(session, "d")) == ("main", 3, 4.0)
    session.perform("PROCEED")
    assert value(session, "b") == 2.0


def test_a_breakpoint_stops_before_its_step(session: Session, terminal: RecordingTerminal) -> None:
    load(session, "x = 1", "x = 2", "x = 3")
    session.perform("BPT main, 2")
    session.perform("EXECUTE main")
    stopped = terminal.replies[-1]
    assert isinstance(stopped, ProgramStopped)
    assert (stopped.what, stopped.step, stopped.source, value(session, "x")) == ("(BREAKPOINT)", 2, "x = 2", 1.0)
    session.perform("BPT main")
    session.perform("PROCEED")
    assert value(session, "x") == 3.0


@pytest.mark.parametrize(("asked", "stops"), [(1, 3), (2, 3), (4, 5), (5, 5), (6, 7)])
def test_a_breakpoint_on_a_step_that_does_nothing_is_one_on_the_next(
    session: Session, terminal: RecordingTerminal, asked: int, stops: int
) -> None:
    load(session, "; first", "", "IF TRUE THEN", "; inside", "x = 1", "END", "y = 2", "; the end")
    session.perform(f"BPT main, {asked}")
    assert terminal.replies[-1] == Message(f"Breakpoint before step {stops} of main")
    session.perform("EXECUTE main")
    stopped = terminal.replies[-1]
    assert isinstance(stopped, ProgramStopped)
    assert (stopped.what, stopped.step) == ("(BREAKPOINT)", stops)
    with pytest.raises(IllegalValue, match="nothing is done"):
        session.perform("BPT main, 8")


def test_a_watch_stops_when_its_value_changes(session: Session, terminal: RecordingTerminal) -> None:
    load(session, "y = 1", "x = 5", "y = 2")
    session.perform("x = 4")
    session.perform("WATCH x")
    session.perform("EXECUTE main")
    stopped = terminal.replies[-1]
    assert isinstance(stopped, ProgramStopped)
    assert (stopped.what, stopped.step) == ("(WATCH) x is 5, was 4", 3)


def test_trace_prints_each_step(session: Session, terminal: RecordingTerminal) -> None:
    load(session, "x = 1", "y = 2")
    session.perform("ENABLE TRACE")
    session.perform("EXECUTE main")
    assert terminal.typed == "main 1: x = 1\nmain 2: y = 2\n"


OWN = """
.PROGRAM main()
    x = 1
    CALL inner(x)
.END
.PROGRAM inner(given)
    AUTO x, row[]
    x = 5
    row[2] = 8
    PAUSE
    x = 6
    given = 2
.END
"""


def test_the_variables_of_the_stopped_program_are_shown(session: Session, terminal: RecordingTerminal) -> None:
    session.load_text(OWN)
    session.perform("EXECUTE main")
    session.perform("LISTR x, row, given, x+1, row[2]")
    shown = terminal.replies[-1]
    assert isinstance(shown, RealTable)
    assert shown.rows == (
        ("x (inner)", 5.0),
        ("row[2] (inner)", 8.0),
        ("given (inner)", 1.0),
        ("x+1", 6.0),
        ("row[2]", 8.0),
    )
    assert value(session, "x") == 1.0


def test_a_watch_sees_the_variables_of_each_program(session: Session, terminal: RecordingTerminal) -> None:
    session.load_text(OWN)
    session.perform("x = 1")
    session.perform("WATCH x")
    session.perform("EXECUTE main")
    stops = []
    while isinstance(terminal.replies[-1], ProgramStopped):
        stops.append((terminal.replies[-1].what, terminal.replies[-1].step))
        session.perform("PROCEED")
    assert stops[0] == ("(WATCH) x is undefined, was 1", 2)
    assert ("(WATCH) x is 5, was undefined", 3) in stops
    assert ("(WATCH) x is 6, was 5", 6) in stops
