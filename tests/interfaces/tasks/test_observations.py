"""What programs read of signals stands on the timeline, and is compared with it after an edit."""

from __future__ import annotations

import pytest

from tests.interfaces.programs import load, value
from tests.interfaces.session.test_survey import surveyed
from vrs_cli.files.cell_file import parse_cell
from vrs_cli.interfaces.session.session import Session
from vrs_cli.interfaces.tasks.observations import untrue
from vrs_cli.values.events import Event
from vrs_cli.values.replies import Message, NoLongerTrue, TimelineTable
from vrs_cli.values.results import Untrue


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
    (one,) = session.told_untrue
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
