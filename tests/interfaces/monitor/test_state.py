"""What is: STATUS, FREE."""

from __future__ import annotations

import pytest

from tests.interfaces.monitor.people import at, last, loaded
from tests.interfaces.terminals import RecordingTerminal
from vrs_cli.errors import VrsError
from vrs_cli.interfaces.monitor.state import free_memory
from vrs_cli.values import replies


def test_status_shows_what_is_said_for_the_next_motion() -> None:
    def waiting(*lines: str) -> tuple[str, ...]:
        session = at(RecordingTerminal(), "READY", *lines, "STATUS")
        status = session.terminal.replies[-1]  # type: ignore[attr-defined]
        assert isinstance(status, replies.StatusReport)
        return status.next_motion

    assert waiting() == ()
    said = ("LEFTY", "RIGHTY", "FLIP", "DO SPEED 50", "CPOFF", "FINE", "DURATION 2", "OPEN")
    assert waiting(*said) == ("FLIP", "SPEED 50 %", "DURATION 2 s", "FINE", "CPOFF", "OPEN")
    assert waiting(*said, "DRIVE 1, 10") == ("FLIP",)
    assert waiting(*said, "READY") == ()


def test_status_follows_the_program() -> None:
    session = at(RecordingTerminal(), "STATUS")
    assert last(session, replies.StatusReport).progress is None
    session.load_text(".PROGRAM p\nTYPE 1\nPAUSE\n.END\n")
    session.perform("EXECUTE p, -1")
    session.perform("STATUS")
    assert last(session, replies.StatusReport).progress == replies.Progress("p", "paused", 2, 0, None)


def test_free_counts_what_is_there() -> None:
    session = loaded(RecordingTerminal())
    session.perform("FREE")
    report = last(session, replies.FreeReport)
    assert (report.programs, report.steps, report.variables, report.segments) == (4, 8, 4, 1)


def test_free_memory_is_a_percentage_or_unknown(monkeypatch: pytest.MonkeyPatch) -> None:
    share = free_memory()
    assert share is None or 0.0 <= share <= 100.0

    def unknown(_name: str) -> int:
        raise ValueError("unrecognized configuration name")

    monkeypatch.setattr("os.sysconf", unknown)
    assert free_memory() is None


# --- signals and times -----------------------------------------------------------------------------------------------


def test_signals_are_told_at_any_time() -> None:
    session = at(RecordingTerminal(), "SIGNAL 1", "SIGNAL -1, 1001 AT 2", "SIGNAL 2 IN 3", "SIGNAL 2001")

    def on(line: str) -> list[int]:
        session.perform(line)
        banks = last(session, replies.SignalTable).banks
        return [bank.first + place for bank in banks for place, state in enumerate(bank.states) if state]

    assert on("IO") == [1, 2001]
    assert [on(f"IO AT {t}") for t in (0, 1.5, 2, 3, 9)] == [[1], [1], [1001], [1001, 2], [1001, 2]]
    assert [on("IO 1 AT 3"), on("IO 0 AT 3"), on("IO 2")] == [[2], [1001], [2001]]
    session.perform("DRIVE 1, 90 AT 2")
    session.perform("STATUS AT 2.5")
    then = last(session, replies.StatusThen)
    assert (then.time, then.motion, then.on) == (2.5, "DRIVE 1, 90 AT 2", (1001,))
    session.perform("STATUS AT 1")
    assert last(session, replies.StatusThen).motion == ""


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("SIGNAL 1 AT -1", r"AT -1 \(times are 0 or more seconds\)"),
        ("SIGNAL 2001 AT 1", "2001 .internal signals are variables and have no times: SIGNAL 2001 sets it now"),
        ("SIGNAL 9999 AT 1", "signals are 1-512"),
        ("DO SIGNAL 1001 AT 1", "1001 .an input cannot be set by a program"),
        ("SIGNAL 1 AT 1 IN 2", "SIGNAL takes no IN here"),
        ("IO 2 AT 1", "internal signals are variables: IO 2 tells what they are now"),
        ("STATUS 1 AT 1", "STATUS AT t tells where the robot is then"),
        ("BITS 1, 2 = 3 AT 1", "BITS takes no AT here"),
    ],
)
def test_what_has_no_time_is_refused_with_the_way_out(line: str, message: str) -> None:
    with pytest.raises(VrsError, match=message):
        at(RecordingTerminal(), line)


def test_reset_at_a_time_turns_off_what_is_ever_on() -> None:
    session = at(RecordingTerminal(), "SIGNAL 1, 1001", "SIGNAL 2 AT 3", "RESET AT 2", "RESET IN 4")
    signals = session.environment.signals
    assert [signals.at(t) for t in (1.0, 2.0, 3.0, 4.0)] == [(1, 1001), (1001,), (2, 1001), (1001,)]


def test_undo_takes_signals_back_with_the_clock() -> None:
    session = at(RecordingTerminal(), "SIGNAL 1", "DRIVE 1, 10", "SIGNAL -1")
    signals, engine = session.environment.signals, session.engine
    end = engine.now
    assert signals.on == ()
    session.perform("UNDO")
    assert (signals.on, engine.now) == ((1,), end)
    session.perform("UNDO")
    assert (signals.on, engine.now) == ((1,), 0.0)
    session.perform("REDO 2")
    assert (signals.on, engine.now) == ((), end)
    session.perform("UNDO 3")
    assert (signals.on, engine.now) == ((), 0.0)
