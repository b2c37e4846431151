"""BODY: which client is the robot's body, and what became of its reports."""

from __future__ import annotations

import pytest

from tests.interfaces.terminals import RecordingTerminal
from vrs_cli.errors import RequestRefused, RoleWanted, UsageError, VrsError
from vrs_cli.interfaces.session.session import Session
from vrs_cli.interfaces.station.body import ClockSeen
from vrs_cli.language.words.word import Role
from vrs_cli.render.text import plain_text
from vrs_cli.values.measured import BodyMode, Report
from vrs_cli.values.replies import BodyReport

STILL = (0.0,) * 6


@pytest.fixture
def terminal() -> RecordingTerminal:
    return RecordingTerminal()


@pytest.fixture
def session(terminal: RecordingTerminal) -> Session:
    return Session(terminal)


def said(session: Session, terminal: RecordingTerminal, line: str) -> str:
    session.perform(line)
    reply = terminal.replies[-1]
    return plain_text(reply)


def test_a_robot_without_a_body_says_so(session: Session, terminal: RecordingTerminal) -> None:
    assert "No client is the body" in said(session, terminal, "BODY")


def test_body_shows_who_it_is_its_reports_and_its_clock(session: Session, terminal: RecordingTerminal) -> None:
    body = session.body
    body.embody("arm")
    body.take([Report(0.0, STILL), Report(0.1, STILL)], 3, "arm")
    body.take([Report(0.05, STILL, mode=BodyMode.STOPPED)], 1, "arm")
    body.clock = ClockSeen(-0.004, 20e-6, 0.3)
    body.command(BodyMode.HOLDS, 1.0)
    shown = said(session, terminal, "BODY")
    assert isinstance(terminal.replies[-1], BodyReport)
    assert "arm follows; it is told to hold still" in shown
    assert "the last of 0.100 s" in shown
    assert "2 lost, 0 late, 0 duplicate, 1 reordered" in shown
    assert "4.000 ms behind, drift 20.0 us in a second" in shown
    assert "300.000 ms" in shown
    assert "arm is the body no longer" in said(session, terminal, "BODY RELEASE")
    assert "none any more" in said(session, terminal, "BODY")


def test_only_a_supervisor_releases_a_body_that_there_is(session: Session) -> None:
    def refused(kind: type[VrsError], line: str, why: str) -> None:
        with pytest.raises(kind, match=why):
            session.perform(line)

    refused(RequestRefused, "BODY RELEASE", "no client is the body")
    refused(UsageError, "BODY GOES", "BODY, BODY RELEASE, BODY OFF, BODY WARN")
    session.body.embody("arm")
    session.user_state.role = Role.DESIGNER | Role.OBSERVER
    refused(RoleWanted, "BODY RELEASE", "BODY RELEASE is for a supervisor")
    session.perform("BODY")
    assert session.body.name == "arm"
