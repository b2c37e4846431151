"""Eight threads at one robot agree with it in the end, whatever goes wrong meanwhile: `crowd.py`, a short run."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.interfaces.holders.crowd import Crowd


@pytest.mark.parametrize("together", [False, True])
def test_timeline_history_journal_and_mirrors_agree_to_the_bit(tmp_path: Path, together: bool) -> None:
    crowd = Crowd(seed=7, threads=8, lines=320, folder=tmp_path, together=together)
    crowd.run()
    assert crowd.done > 20
    assert crowd.faults > 0
    assert crowd.left > 0
