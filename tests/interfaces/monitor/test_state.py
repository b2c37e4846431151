"""What is: STATUS, FREE."""

from __future__ import annotations

import pytest

from tests.interfaces.monitor.people import at, last, loaded
from tests.interfaces.terminals import RecordingTerminal
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
