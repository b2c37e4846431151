"""The timeline at the prompt."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.interfaces.monitor.people import at, last
from tests.interfaces.terminals import RecordingTerminal
from vrs_cli.errors import IllegalJoint, UsageError
from vrs_cli.values import replies


def test_undo_takes_the_clock_back() -> None:
    session = at(RecordingTerminal(), "DRIVE 1, 60", "UNDO")
    assert last(session, replies.Message).text == "DRIVE 1, 60 is undone; the clock is at 0.000 s"
    assert session.engine.now == 0.0
    with pytest.raises(UsageError, match="no motion to undo"):
        session.perform("UNDO")


@pytest.mark.parametrize("line", ["PLOT banana", "PLOT 7", "PLOT X, 1"])
def test_a_plot_that_cannot_be_is_refused_also_before_the_first_motion(line: str) -> None:
    with pytest.raises((UsageError, IllegalJoint)):
        at(RecordingTerminal(), line)


LATER = (
    "MOVE #PPOINT(60, -90, 90, 0, 0, 0) AT 0",
    "MOVE #PPOINT(60, -60, 90, 0, 0, 0) AT 4",
    "MOVE #PPOINT(30, -60, 90, 0, 0, 0) AT 6",
)
SPLICE = ("DURATION 3.928", "MOVE #PPOINT(60, -90, 90, 0, 0, 0) AT 0.6")


def displaced(terminal: RecordingTerminal) -> list[replies.Displaced]:
    return [reply for reply in terminal.replies if isinstance(reply, replies.Displaced)]


def test_the_answer_to_a_motion_says_what_begins_later() -> None:
    terminal = RecordingTerminal()
    session = at(terminal, *LATER, *SPLICE)
    assert [one.asked for one in displaced(terminal)[-1].displacement.later] == [4.0, 6.0]
    session.perform("UNDO")
    assert [one.asked for one in displaced(terminal)[-1].displacement.earlier] == [4.0, 6.0]
    assert [(record.asked, record.executed) for record in session.engine.book.records()[1:]] == [(4.0, 4.0), (6.0, 6.0)]
    session.perform("REDO")
    assert session.engine.book.records()[1].displaced
    assert len(displaced(terminal)) == 3


def test_a_merge_says_what_it_moves_and_a_change_of_branch_says_nothing() -> None:
    terminal = RecordingTerminal()
    session = at(terminal, *LATER, "BRANCH trial", *SPLICE)
    assert len(displaced(terminal)) == 1
    session.perform("BRANCH main")
    session.perform("BRANCH trial")
    assert len(displaced(terminal)) == 1
    session.perform("MERGE")
    assert [one.asked for one in displaced(terminal)[-1].displacement.later] == [4.0, 6.0]


def test_a_command_file_says_it_once(tmp_path: Path) -> None:
    commands = tmp_path / "later.v2"
    commands.write_text("\n".join(SPLICE) + "\n")
    terminal = RecordingTerminal()
    at(terminal, *LATER, f"COMMANDS {commands}")
    assert len(displaced(terminal)) == 1


def test_abort_says_what_it_drops() -> None:
    terminal = RecordingTerminal()
    at(terminal, *LATER, "ABORT")
    assert [one.asked for one in displaced(terminal)[-1].displacement.dropped][-2:] == [4.0, 6.0]
