"""The scheduler: several tasks at exact instants, reactions, inputs, bounds, and programs one step at a time."""

from __future__ import annotations

import pytest

from tests.interfaces.terminals import RecordingTerminal
from vrs_cli.errors import (
    FileDamaged,
    IllegalSignal,
    IllegalValue,
    ProgramInterlocked,
    TaskActive,
    TaskNotActive,
    TimeExhausted,
)
from vrs_cli.files.signal_file import parse_signals
from vrs_cli.interfaces.driver import WAIT_TICK, Bounds, Outcome
from vrs_cli.interfaces.replies import Message, ProgramStopped, RealTable
from vrs_cli.interfaces.session import Session
from vrs_cli.language.inputs import InputChange


@pytest.fixture
def terminal() -> RecordingTerminal:
    return RecordingTerminal()


@pytest.fixture
def session(terminal: RecordingTerminal) -> Session:
    return Session(terminal)


def load(session: Session, *lines: str, name: str = "main", parameters: str = "") -> None:
    found = session.load_text("\n".join([f".PROGRAM {name}({parameters})", *lines, ".END", ""]))
    assert not [one for one in found if one.severity.name == "ERROR"], found


def value(session: Session, name: str) -> object:
    return session.environment.reference(name).value()


# --- time ---


def test_two_tasks_shake_hands_at_exact_instants(session: Session) -> None:
    load(session, "WAIT.EVENT , 0.1", "SIGNAL 2001", "t1 = TIME()", "WAIT SIG(2002)", "t4 = TIME()")
    load(session, "WAIT SIG(2001)", "t2 = TIME()", "WAIT.EVENT , 0.05", "t3 = TIME()", "SIGNAL 2002", name="other")
    session.start(1, "other")
    result = session.execute("main")
    assert [value(session, f"t{k}") for k in (1, 2, 3, 4)] == pytest.approx([0.1, 0.1, 0.15, 0.15], abs=1e-9)
    assert result.ended == value(session, "t4")


def test_a_motion_is_the_same_with_a_task_beside_it() -> None:
    timelines = []
    for beside in (False, True):
        session = Session(RecordingTerminal())
        load(session, "DRIVE 1, 40, 100", "DRIVE 2, -20, 100", "SIGNAL 1", "DRIVE 3, 10, 50")
        load(session, "WHILE TRUE DO", "WAIT", "END", name="tick")
        if beside:
            session.start(1, "tick")
        session.execute("main")
        timelines.append(session.engine.timeline)
    assert timelines[0] == timelines[1]


def test_the_next_motion_is_asked_for_when_its_step_is_reached(session: Session) -> None:
    load(session, "DRIVE 1, 40, 100", "DRIVE 1, -40, 100")
    session.execute("main")
    assert [record.issued for record in session.engine.records()] == [0.0, 0.0]
    assert session.engine.records()[1].executed > 0.0


def test_a_wait_of_one_tick(session: Session) -> None:
    load(session, "WAIT", "t = TIME()")
    session.execute("main")
    assert value(session, "t") == WAIT_TICK


def test_time_goes_on_for_other_tasks_during_a_motion_of_the_prompt(session: Session) -> None:
    load(session, "WAIT.EVENT , 0.2", "t = TIME()", name="other")
    session.perform("PCEXECUTE other")
    session.perform("DRIVE 1, 30, 100")
    assert value(session, "t") == pytest.approx(0.2, abs=1e-9)


# --- reactions ---


def test_reacti_brakes_at_the_instant_of_the_change(session: Session) -> None:
    load(session, "REACTI 1001, seen", "DRIVE 1, 90, 100", "BREAK")
    load(session, "t = TIME()", name="seen")
    session.driver.inputs = parse_signals("0.5, 1001, ON")
    session.execute("main")
    assert value(session, "t") == 0.5
    brake = session.engine.records()[-1]
    assert (brake.text, brake.executed) == ("BRAKE", 0.5)
    assert session.engine.end < 1.2


@pytest.mark.parametrize("word", ["REACT", "REACTI"])
def test_a_reaction_during_the_last_motion_of_a_cycle_is_called(session: Session, word: str) -> None:
    load(session, f"{word} 1001, seen", "n = n+1", "DRIVE 1, 30, 25", "DRIVE 1, -30, 25")
    load(session, "t = TIME()", "seen = seen+1", name="seen")
    session.perform("n = 0")
    session.perform("seen = 0")
    session.driver.inputs = parse_signals("2.5, 1001, ON\n20, 1001, OFF\n")
    result = session.execute("main", cycles=3)
    assert (result.cycles, value(session, "n"), value(session, "seen")) == (3, 3.0, 1.0)
    first = 2.5 if word == "REACTI" else session.engine.records()[1].end
    assert value(session, "t") == pytest.approx(first)


def test_a_signal_of_the_last_step_is_reacted_to(session: Session) -> None:
    load(session, "REACT 2001, seen", "CALL sets")
    load(session, "SIGNAL 2001", "STOP", name="sets")
    load(session, "seen = 1", name="seen")
    assert session.execute("main").outcome is Outcome.COMPLETED
    assert value(session, "seen") == 1.0


def test_abort_lets_other_tasks_go_on_while_the_robot_brakes(session: Session) -> None:
    load(session, "DO", "n = n+1", "WAIT", "UNTIL FALSE", name="other")
    load(session, "DRIVE 1, 90, 100", "PAUSE")
    session.perform("n = 0")
    session.perform("PCEXECUTE other")
    session.perform("EXECUTE main")
    session.perform("DRIVE 1, -90, 100 IN 0")
    session.engine.clock.advance(session.engine.now + 0.3)
    session.settle()
    before, began = value(session, "n"), session.engine.now
    session.perform("ABORT")
    ticks = (session.engine.now - began) / WAIT_TICK
    assert ticks > 5
    assert value(session, "n") - before == pytest.approx(ticks, abs=1)


def test_react_waits_for_the_step_that_waits_for_the_robot(session: Session) -> None:
    load(session, "REACT 1001, seen", "DRIVE 1, 90, 100", "BREAK", "t2 = TIME()")
    load(session, "t = TIME()", name="seen")
    session.driver.inputs = parse_signals("0.5, 1001, ON")
    session.execute("main")
    assert value(session, "t") == value(session, "t2") == session.engine.end > 1.0


# --- inputs ---


def test_the_prompt_sets_inputs_and_programs_may_not(session: Session) -> None:
    load(session, "WAIT SIG(1001)", "x = 1", name="other")
    session.perform("PCEXECUTE other")
    session.perform("SIGNAL 1001")
    assert value(session, "x") == 1.0
    with pytest.raises(IllegalSignal):
        session.perform("DO SIGNAL 1002")


def test_a_file_of_signals() -> None:
    inputs = parse_signals("time, signal, state\n; morning\n2, 1002, off\n\n0.5, 1001, ON # a part\n")
    assert inputs.changes == (InputChange(0.5, 1001, True), InputChange(2.0, 1002, False))


@pytest.mark.parametrize("line", ["1, 1001", "soon, 1001, 1", "-1, 1001, 1", "1, 5, 1", "1, 1001, up", "1, x, 1"])
def test_a_wrong_line_of_signals_is_named(line: str) -> None:
    with pytest.raises(FileDamaged, match=r"cell\.csv:2: "):
        parse_signals(f"0, 1001, 1\n{line}\n", "cell.csv")


# --- bounds ---


def test_where_it_hung_is_said(session: Session) -> None:
    load(session, "x = 1", "WAIT SIG(1001)")
    load(session, "WAIT SIG(1002)", name="other")
    session.start(1, "other")
    fault = session.execute("main", bounds=Bounds(max_time=5.0)).fault
    assert fault is not None
    assert "5 s of the robot's time: main step 2 waits at WAIT SIG(1001); task 1, other step 1 waits" in fault.message
    assert (fault.program, fault.step) == ("main", 2)
    assert session.engine.now == 5.0


@pytest.mark.parametrize(("most", "outcome"), [(3, Outcome.COMPLETED), (2, Outcome.FAILED)])
def test_steps_are_counted_exactly(session: Session, most: int, outcome: Outcome) -> None:
    load(session, "x = 1", "x = 2", "x = 3")
    result = session.execute("main", bounds=Bounds(max_steps=most))
    assert result.outcome is outcome
    assert value(session, "x") == most


# --- one step at a time ---


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


# --- programs on a stack ---


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


def test_another_task_that_fails_is_told_and_does_not_stop_the_first(session: Session) -> None:
    load(session, "WAIT.EVENT , 1", "x = 1")
    load(session, "WAIT.EVENT , 0.5", "y = nothing", name="other")
    session.start(3, "other")
    result = session.execute("main")
    assert (result.outcome, value(session, "x")) == (Outcome.COMPLETED, 1.0)
    assert [(one.number, one.fault.program, one.fault.step) for one in result.beside] == [(3, "other", 2)]


@pytest.mark.parametrize("step", ["MOVE TRANS(0, 5000, 0)", "DETACH (5)", "x = SQRT(-1)"])
@pytest.mark.parametrize("bounds", [Bounds(max_steps=300), Bounds(max_time=0.05)])
def test_a_step_that_is_mended_in_vain_for_ever_is_stopped(session: Session, step: str, bounds: Bounds) -> None:
    load(session, "REACTE again", step)
    load(session, "n = 1", name="again")
    result = session.execute("main", bounds=bounds)
    assert result.outcome is Outcome.FAILED
    assert result.fault is not None
    assert result.fault.code == TimeExhausted.code


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
