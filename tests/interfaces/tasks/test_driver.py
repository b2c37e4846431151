"""The scheduler: several tasks at exact instants, reactions, inputs, limits."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.interfaces.programs import load, value
from tests.interfaces.terminals import RecordingTerminal
from vrs_cli.errors import FileDamaged, IllegalSignal, LimitReached
from vrs_cli.files.opening import Folder
from vrs_cli.files.timed_lines import parse_signals
from vrs_cli.interfaces.session.session import Session
from vrs_cli.interfaces.tasks.limits import Limits
from vrs_cli.language.run.memory import TICK
from vrs_cli.language.run.signals import InputChange
from vrs_cli.values.results import RunOutcome

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
    assert [record.issued for record in session.engine.book.records()] == [0.0, 0.0]
    assert session.engine.book.records()[1].executed > 0.0


def test_what_follows_a_refused_motion_is_asked_for_when_that_was_refused(session: Session) -> None:
    load(session, "REACTE over", "DRIVE 1, 40, 100", "DRIVE 1, 400", "DRIVE 2, 5 IN 0.3", "BREAK")
    load(session, "t = TIME()", "RETURNE", name="over")
    session.execute("main")
    refused, last = value(session, "t"), session.engine.book.records()[-1]
    assert isinstance(refused, float)
    assert refused > 0.1, "it waited for its place on the timeline"
    assert (last.issued, last.executed) == pytest.approx((refused, refused + 0.3), abs=1e-8)


def test_a_wait_after_a_refused_motion_takes_its_time(session: Session) -> None:
    load(session, "REACTE over", "DRIVE 1, 40, 100", "DRIVE 1, 400", "t0 = TIME()", "WAIT.EVENT , 0.1", "t = TIME()-t0")
    load(session, "RETURNE", name="over")
    session.execute("main")
    assert value(session, "t") == pytest.approx(0.1, abs=1e-9)


def test_a_wait_of_one_tick(session: Session) -> None:
    load(session, "WAIT", "t = TIME()")
    session.execute("main")
    assert value(session, "t") == TICK


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
    brake = session.engine.book.records()[-1]
    assert (brake.text, brake.executed) == ("BRAKE", 0.5)
    assert session.engine.end < 1.2


@pytest.mark.parametrize("word", ["REACT", "REACTI"])
def test_reactions_that_are_due_at_once_come_one_after_the_other(session: Session, word: str) -> None:
    load(session, *(f"{word} {signal}, seen" for signal in (1001, 1002, 1003)), "WAIT SIG(1004)")
    load(session, "seen = seen+1", "t[seen] = TIME()", name="seen")
    session.perform("seen = 0")
    session.driver.inputs = parse_signals("0.5, 1001, ON\n0.5, 1002, ON\n0.5, 1003, ON\n3, 1004, ON")
    session.execute("main")
    assert [session.environment.reference("t", k).value() for k in (1, 2, 3)] == [0.5, 0.5, 0.5]


def test_reactions_that_call_each_other_without_end_let_time_go_on(session: Session) -> None:
    load(session, "REACT 2001, ping", "REACT 2002, pong", "SIGNAL 2001", "WAIT SIG(1004)")
    load(session, "REACT 2001, ping", "SIGNAL -2001, -2002, 2002", name="ping")
    load(session, "REACT 2002, pong", "SIGNAL -2001, -2002, 2001", name="pong")
    result = session.execute("main", limits=Limits(max_time=0.04))
    assert result.fault is not None
    assert result.fault.code == LimitReached.code


@pytest.mark.parametrize("word", ["REACT", "REACTI"])
def test_a_reaction_during_the_last_motion_of_a_cycle_is_called(session: Session, word: str) -> None:
    load(session, f"{word} 1001, seen", "n = n+1", "DRIVE 1, 30, 25", "DRIVE 1, -30, 25")
    load(session, "t = TIME()", "seen = seen+1", name="seen")
    session.perform("n = 0")
    session.perform("seen = 0")
    session.driver.inputs = parse_signals("2.5, 1001, ON\n20, 1001, OFF\n")
    result = session.execute("main", cycles=3)
    assert (result.cycles, value(session, "n"), value(session, "seen")) == (3, 3.0, 1.0)
    first = 2.5 if word == "REACTI" else session.engine.book.records()[1].end
    assert value(session, "t") == pytest.approx(first)


def test_a_signal_of_the_last_step_is_reacted_to(session: Session) -> None:
    load(session, "REACT 2001, seen", "CALL sets")
    load(session, "SIGNAL 2001", "STOP", name="sets")
    load(session, "seen = 1", name="seen")
    assert session.execute("main").outcome is RunOutcome.COMPLETED
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
    ticks = (session.engine.now - began) / TICK
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


# --- limits ---


def test_where_it_hung_is_said(session: Session) -> None:
    load(session, "x = 1", "WAIT TIMER(1) < 0")
    load(session, "WAIT SIG(1002)", name="other")
    session.start(1, "other")
    fault = session.execute("main", limits=Limits(max_time=5.0)).fault
    assert fault is not None
    assert "5 s of the robot's time: main step 2 waits at WAIT TIMER(1) < 0" in fault.message
    assert "; task 1, other step 1 waits" in fault.message
    assert (fault.program, fault.step) == ("main", 2)
    assert session.engine.now == 5.0


def test_what_helps_is_said_by_who_sets_the_limits(session: Session) -> None:
    load(session, "WHILE x == 0 DO", "END")
    session.perform("x = 0")
    for limits in (Limits(max_time=1.0), Limits(max_steps=100)):
        fault = session.execute("main", limits=limits).fault
        assert fault is not None
        assert "(SIGNAL sets an input that is waited for; RETRY lets a program go on)" in fault.message
    station = Session(RecordingTerminal(), advice="give more {}".format)
    load(station, "WHILE TRUE DO", "END")
    fault = station.execute("main", limits=Limits(max_time=1.0)).fault
    assert fault is not None
    assert "(give more max_time)" in fault.message


@pytest.mark.parametrize(("most", "outcome"), [(3, RunOutcome.COMPLETED), (2, RunOutcome.FAILED)])
def test_steps_are_counted_exactly(session: Session, most: int, outcome: RunOutcome) -> None:
    load(session, "x = 1", "x = 2", "x = 3")
    result = session.execute("main", limits=Limits(max_steps=most))
    assert result.outcome is outcome
    assert value(session, "x") == most


@pytest.mark.parametrize(
    ("step", "limits", "told"),
    [
        ("a[n] = n", Limits(max_elements=12_000), "arrays and strings hold "),
        ('$a[n] = "123"', Limits(max_elements=40_000), "arrays and strings hold "),
        ("CALL own", Limits(max_elements=30_000), "arrays and strings hold "),
        ("CALL kept", Limits(max_elements=12_000), "arrays and strings hold "),
        ('TYPE "123"', Limits(max_output=402), "the program wanted to type more than 402 bytes"),
        ('WRITE (17) "12"', Limits(max_disk=402), "the program wanted to write more than 402 bytes"),
    ],
)
def test_what_a_program_holds_types_and_writes_has_limits(
    tmp_path: Path, terminal: RecordingTerminal, step: str, limits: Limits, told: str
) -> None:
    """They end it at the same step, and REACTE does not mend that."""
    ended: list[tuple[object, int]] = []
    for name in ("one.txt", "two.txt"):
        session = Session(terminal, folder=Folder(tmp_path))
        opened = ("ATTACH (17)", f'FOPENW (17) "{name}"', "n = 0")
        load(session, "REACTE again", *opened, "WHILE TRUE DO", "n = n+1", step, "END")
        load(session, "n = 1", name="again")
        load(session, "AUTO b[]", "FOR i = 1 TO 20000", "b[i] = i", "END", "CALL own", name="own")
        load(session, "LOCAL c[]", "c[n] = n", name="kept")
        result = session.execute("main", limits=limits)
        assert result.outcome is RunOutcome.FAILED
        assert result.fault is not None
        assert result.fault.code == LimitReached.code
        assert told in result.fault.message
        ended.append((value(session, "n"), result.fault.step))
    assert ended[0] == ended[1]


@pytest.mark.parametrize("step", ["MOVE TRANS(0, 5000, 0)", "DETACH (5)", "x = SQRT(-1)"])
@pytest.mark.parametrize("limits", [Limits(max_steps=300), Limits(max_time=0.05)])
def test_a_step_that_is_mended_in_vain_for_ever_is_stopped(session: Session, step: str, limits: Limits) -> None:
    load(session, "REACTE again", step)
    load(session, "n = 1", name="again")
    result = session.execute("main", limits=limits)
    assert result.outcome is RunOutcome.FAILED
    assert result.fault is not None
    assert result.fault.code == LimitReached.code
