"""Timers count the robot clock."""

from __future__ import annotations

import pytest

from vrs_cli.errors import IllegalValue
from vrs_cli.language.run.memory import Timers


def test_timers_count_from_what_they_were_set_to() -> None:
    timers = Timers()
    timers.set(1, -2.0, now=10.0)
    assert timers.read(1, now=13.0) == 1.0
    assert timers.read(2, now=13.0) == 13.0
    with pytest.raises(IllegalValue, match="timer 16"):
        timers.set(16, 0.0, now=0.0)
