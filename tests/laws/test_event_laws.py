"""The laws of dated events, for a few random sessions; `python -m tests.laws.long_events 10000` tries many."""

from pathlib import Path

import pytest

from tests.laws.event_sessions import session


@pytest.mark.parametrize("seed", range(12))
def test_events_keep_their_laws_in_a_random_session(seed: int, tmp_path: Path) -> None:
    session(seed, 30, tmp_path / "session.vrst" if seed < 4 else None)
