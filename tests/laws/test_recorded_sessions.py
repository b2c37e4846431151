"""Random sessions go as they were recorded: no change of the code alone changes a motion or a message."""

from __future__ import annotations

import pytest

from tests.examples import quick
from tests.laws.recorded import RECORDED, SESSIONS, lines
from tests.recording import check_recorded

ROUNDING = 3e-6  # [s, rad, m]


@pytest.mark.parametrize(("robot", "seed"), quick(SESSIONS, lambda number, _session: number % 4 == 0))
def test_a_session_goes_as_it_was_recorded(robot: str, seed: int) -> None:
    check_recorded(RECORDED, f"{robot} {seed}", lines(robot, seed), ROUNDING)
