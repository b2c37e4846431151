"""Readings of signals on the timeline, compared after an edit; waits that nothing can end."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.engine.wall import ManualWall
from tests.interfaces.programs import load, value
from tests.interfaces.session.test_survey import surveyed
from tests.interfaces.terminals import RecordingTerminal
from vrs_cli.__main__ import main
from vrs_cli.errors import EndlessWait
from vrs_cli.files.cell_file import parse_cell
from vrs_cli.files.timed_lines import parse_signals
from vrs_cli.interfaces.session.session import Session
from vrs_cli.interfaces.tasks.limits import Limits
from vrs_cli.interfaces.tasks.observations import untrue
from vrs_cli.language.run.memory import TICK
from vrs_cli.values.commands import Event
from vrs_cli.values.replies import NoLongerTrue, TimelineTable
from vrs_cli.values.results import Message, RunOutcome, RunResult, Untrue


def observed(session: Session) -> list[tuple[float, int, float, bool]]:
    """The observations: time, signal, state, and whether it changed at that instant."""
    events = [event for event in session.engine.timeline.events if event.observed]
    assert all(event.tied for event in events)
    return [(round(event.time, 6), event.channel, event.value, event.duration == 0.0) for event in events]


def test_a_wait_sees_a_dated_output_at_its_time(session: Session) -> None:
    load(session, "SIGNAL 1 AT 0.5", "WAIT SIG(1)", "t = TIME()", "SIGNAL -1 IN 0.25", "WAIT SIG(-1)", "u = TIME()")
    session.execute("main")
    assert (value(session, "t"), value(session, "u")) == pytest.approx((0.5, 0.75), abs=1e-8)
    assert observed(session) == [(0.0, 1, 0.0, False), (0.5, 1, 1.0, True), (0.5, 1, 1.0, True), (0.75, 1, 0.0, True)]


def test_a_reaction_sees_a_dated_output_at_its_time(session: Session) -> None:
    load(session, "REACTI 1, halt", "SIGNAL 1 AT 0.4", "DRIVE 1, 90, 20", "BREAK")
    load(session, "t = TIME()", name="halt")
    session.execute("main")
    assert value(session, "t") == pytest.approx(0.4, abs=1e-8)
    assert session.engine.end < 1.0, "REACTI brakes"
    assert observed(session) == [(0.4, 1, 1.0, True)]


def test_a_loop_that_polls_records_changes_and_not_looks(session: Session) -> None:
    load(
        session,
        "SIGNAL 1 AT 2",
        "n = 0",
        "WHILE NOT SIG(1) DO",
        "n = n+1",
        "WAIT",
        "END",
        "IF BITS(1, 2) == 1 THEN",
        "END",
    )
    session.execute("main")
    looks = value(session, "n")
    assert isinstance(looks, float)
    assert looks > 50.0
    assert [one[1:3] for one in observed(session)] == [(1, 0.0), (1, 1.0), (1, 1.0), (2, 0.0)]


def test_each_command_makes_a_look_worth_recording_again(session: Session) -> None:
    load(session, "FOR i = 1 TO 3", "IF SIG(-1) THEN", "DRIVE 1, 5", "END", "END")
    session.execute("main")
    assert [one[1:3] for one in observed(session)] == [(1, 0.0)] * 3


def test_what_nobody_but_the_prompt_reads_is_not_recorded(session: Session) -> None:
    session.perform("LISTR SIG(1)")
    session.perform("WAIT SIG(-1)")
    load(session, "SIGNAL 2001", "WAIT SIG(2001)")
    session.execute("main")
    assert observed(session) == []


def waited(session: Session) -> None:
    """A program that goes on when output 1 comes on, at 1 s."""
    load(session, "SIGNAL 1 AT 1", "WAIT SIG(1)", "DRIVE 1, 30", name="main")
    session.execute("main")


def told(session: Session, *lines: str) -> list[Untrue]:
    replies = session.terminal.replies  # type: ignore[attr-defined]
    before = len(replies)
    for line in lines:
        session.perform(line)
    return [one for reply in replies[before:] if isinstance(reply, NoLongerTrue) for one in reply.readings]


def test_an_edit_that_makes_a_reading_untrue_says_so_once(session: Session) -> None:
    waited(session)
    assert told(session, "SIGNAL 2 AT 0.5") == []
    (one,) = told(session, "SIGNAL 1 AT 0.5", "SIGNAL 3 AT 0.6")
    assert (one.signal, one.on, one.changed, one.time) == (1, True, True, pytest.approx(1.0, abs=1e-9))
    assert (one.place, one.command) == ("main step 2: WAIT SIG(1)", "DRIVE 1, 30")
    session.perform("TIMELINE")
    table = session.terminal.replies[-1]  # type: ignore[attr-defined]
    assert isinstance(table, TimelineTable)
    assert table.untrue == (one,)
    assert told(session, "UNDO 2") == []
    assert list(untrue(session.engine.book, session.environment.signals)) == []
    assert len(told(session, "SIGNAL 1 AT 0.9")) == 1, "it is told again after it was true"


def test_what_was_told_is_not_told_again_after_a_later_edit(session: Session) -> None:
    waited(session)
    assert len(told(session, "SIGNAL 1 AT 0.5")) == 1
    assert told(session, "SIGNAL 3 AT 9", "SIGNAL 4 AT 0.25") == []
    (one,) = session.warned_untrue
    assert surveyed(session).untrue == (one,)
    session.perform("UNDO 3")
    assert surveyed(session).untrue == ()


def test_an_input_of_the_cell_may_change_after_a_look_at_the_same_instant(session: Session) -> None:
    session.driver.surround(parse_cell("[[follow]]\nwhen = 1\nset = 1001"))
    load(session, "IF SIG(-1001) THEN", "SIGNAL 1", "END", "WAIT SIG(1001)", "DRIVE 1, 5")
    session.execute("main")
    assert [one[1:3] for one in observed(session)] == [(1001, 0.0), (1001, 1.0)]
    assert list(untrue(session.engine.book, session.environment.signals)) == []


def test_a_state_that_did_not_change_then_is_compared_alone(session: Session) -> None:
    load(session, "SIGNAL 1", "WAIT.EVENT , 1", "WAIT SIG(1)", "DRIVE 1, 30")
    session.execute("main")
    assert told(session, "SIGNAL -1 AT 0.5", "SIGNAL 1 AT 0.75") != []
    assert list(untrue(session.engine.book, session.environment.signals)) == []
    (one,) = told(session, "SIGNAL -1 AT 0.875")
    assert (one.on, one.changed) == (True, False)


@pytest.mark.parametrize(
    "lines",
    [
        ("WAIT SIG(-1)", "SIGNAL 1", "DRIVE 1, 5"),
        ("SIGNAL 1", "WAIT SIG(1)", "SIGNAL -1", "DRIVE 1, 5"),
        ("SIGNAL 1", "WAIT.EVENT , 0.5", "SIGNAL -1", "SIGNAL 1", "WAIT SIG(1)", "DRIVE 1, 5"),
        ("SIGNAL 1", "IF SIG(1) THEN", "SIGNAL -1", "IF SIG(-1) THEN", "SIGNAL 1", "END", "END", "DRIVE 1, 5"),
    ],
)
def test_what_changes_after_a_look_at_the_same_instant_does_not_make_it_untrue(
    session: Session, lines: tuple[str, ...]
) -> None:
    load(session, *lines)
    session.execute("main")
    assert observed(session)
    assert list(untrue(session.engine.book, session.environment.signals)) == []
    assert told(session, "SIGNAL 5 AT 0.1", "DRIVE 2, 5 AT 0.05") == []


def test_an_event_is_not_confused_with_an_observation(session: Session) -> None:
    load(session, "WAIT SIG(-1)", "SIGNAL 1")
    session.execute("main")
    *_, last = session.engine.timeline.events
    assert (last.channel, last.observed, session.engine.timeline.value_at(1, session.engine.now)) == (1, False, 1.0)
    assert isinstance(last, Event)
    assert not any(isinstance(one, Message) and "no longer" in one.text for one in session.terminal.replies)  # type: ignore[attr-defined]


def message(result: RunResult) -> str:
    assert result.fault is not None
    return result.fault.message


@pytest.mark.parametrize(
    ("condition", "told"),
    [
        ("SIG(1001)", "SIG(1001), which nothing here turns on (SIGNAL 1001, then RETRY)"),
        ("SIG(-1001)", "SIG(-1001), which nothing here turns off (SIGNAL -1001, then RETRY)"),
        ("3", "3, which nothing here turns on (SIGNAL 1003, then RETRY)"),
        ("SIG(2001, 2002)", "SIG(2001, 2002), which nothing here makes true (change that, then RETRY)"),
        ("x > 5 AND STATE(2) == 2", "x > 5 AND STATE(2) == 2, which nothing here makes true (change that, then RETRY)"),
    ],
)
def test_it_says_what_it_waits_for(session: Session, condition: str, told: str) -> None:
    session.perform("x = 1")
    session.perform("SIGNAL 1001" if "-1001" in condition else "SIGNAL -1001")
    load(session, "DRIVE 1, 20", f"WAIT {condition}")
    result = session.execute("main")
    assert message(result) == f"*Endless wait* waits for {told}"
    assert 0.0 <= session.engine.now - session.engine.end <= TICK


def test_after_signal_retry_goes_on(session: Session) -> None:
    load(session, "WAIT SIG(1001)", "x = 1")
    assert session.execute("main").outcome is RunOutcome.FAILED
    session.perform("SIGNAL 1001")
    session.perform("RETRY")
    assert value(session, "x") == 1.0


def test_a_line_of_the_prompt_stops_too(session: Session) -> None:
    with pytest.raises(EndlessWait, match=r"SIG\(1001\), which nothing here turns on \(SIGNAL 1001 first\)"):
        session.perform("WAIT SIG(1001)")
    assert session.engine.now == 0.0


@pytest.mark.parametrize(
    "wait", ["WAIT TIMER(1) > 100", "WAIT TIME > 100", "WAIT SIG(1001) OR TIMER(1) > 100", "WAIT.EVENT , 100"]
)
def test_what_time_ends_is_waited_for(session: Session, wait: str) -> None:
    load(session, "TIMER 1 = 0", wait, "x = 1")
    assert session.execute("main").fault is None
    assert session.engine.now == pytest.approx(100.0, abs=0.06)


def test_an_input_that_comes_and_a_task_that_may_turn_it_on_are_waited_for(session: Session) -> None:
    load(session, "WAIT SIG(1001)", "WAIT SIG(2001)", "t = TIME()")
    load(session, "WAIT.EVENT , 300", "SIGNAL 2001", name="other")
    session.driver.inputs = parse_signals("200, 1001, ON")
    session.perform("PCEXECUTE other")
    assert session.execute("main").fault is None
    assert value(session, "t") == pytest.approx(300.0)


def test_an_arm_that_moves_may_end_it(session: Session) -> None:
    load(session, "DRIVE 1, 90, 10", "WAIT STATE(2) == 2", "x = 1")
    assert session.execute("main").fault is None


def test_tasks_that_wait_for_each_other_wait_in_vain(session: Session) -> None:
    load(session, "WAIT SIG(2001)", "SIGNAL 2002")
    load(session, "WAIT SIG(2002)", "SIGNAL 2001", name="other")
    session.perform("PCEXECUTE other")
    assert "waits for SIG(2001), which nothing here turns on" in message(session.execute("main"))


@pytest.mark.parametrize(
    ("steps", "told"), [(("WAIT.EVENT",), "its event, which no task here sets"), (("DETACH", "ATTACH"), "the robot")]
)
def test_an_event_and_the_robot(session: Session, steps: tuple[str, ...], told: str) -> None:
    load(session, "ATTACH", "WAIT SIG(2001)", name="other")
    load(session, "EXECUTE 1 other", *steps[:1], "WAIT.EVENT , 1", *steps[1:])
    result = session.execute("main")
    assert f"*Endless wait* waits for {told}" in message(result)
    assert session.engine.now <= 1.0


def test_reacte_does_not_mend_it(session: Session) -> None:
    load(session, "REACTE again", "WAIT SIG(1001)")
    load(session, "n = 1", name="again")
    assert "*Endless wait*" in message(session.execute("main"))


def test_in_real_time_somebody_may_come(terminal: RecordingTerminal) -> None:
    wall = ManualWall()
    session = Session(terminal, clock=wall.clock())
    load(session, "WAIT SIG(1001)")
    assert "60 s" in message(session.execute("main", limits=Limits(max_time=60.0)))
    assert wall.seconds >= 60.0


def test_vrs_run_names_the_option_that_helps(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "cell.v2").write_text(".PROGRAM p\nWAIT SIG(1001)\n.END\n")
    assert main(["run", str(tmp_path / "cell.v2")]) == 1
    told = capsys.readouterr().err
    assert "waits for SIG(1001), which nothing here turns on (--signals FILE says when inputs change)" in told
