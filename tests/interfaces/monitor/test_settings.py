"""Settings shown."""

from __future__ import annotations

from tests.interfaces.monitor.people import at
from tests.interfaces.terminals import RecordingTerminal


def test_settings_are_shown_by_name_or_all() -> None:
    session = at(RecordingTerminal(), "DIS CP", "SWITCH CP, POW", "SWITCH", "PARAMETER HAND")
    shown, everything, hand = (reply.rows for reply in session.terminal.replies)  # type: ignore[attr-defined]
    assert [(row.name, row.value) for row in shown] == [("CP", "OFF"), ("POWER", "ON")]
    assert len(everything) == len(session.engine.settings.switches)
    assert [(row.name, row.value) for row in hand] == [("HAND.TIME", "0.05 s")]
