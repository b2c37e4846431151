"""The timeline at the prompt."""

from __future__ import annotations

import pytest

from tests.interfaces.monitor.people import at, last
from tests.interfaces.terminals import RecordingTerminal
from vrs_cli.errors import IllegalJoint, UsageError
from vrs_cli.interfaces import replies


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
