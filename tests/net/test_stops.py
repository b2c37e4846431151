"""Ctrl-X at a terminal stops the robot beside another client's work; `python -m tests.net.stops 3` tells how soon."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.net.stops import LOADS, measure

pytest.importorskip("pty")


@pytest.mark.long
def test_ctrl_x_stops_beside_each_load(tmp_path: Path) -> None:
    assert set(measure(1, 1000, tmp_path)) == set(LOADS)
