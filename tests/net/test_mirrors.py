"""Mirrors in another process are the robot to the bit; `python -m tests.net.mirrors 100000` edits more."""

from __future__ import annotations

import pytest

from tests.examples import some
from tests.net.mirrors import compare


@pytest.mark.long
def test_mirrors_in_another_process_are_the_robot_to_the_bit() -> None:
    tally = compare(some(900), 4)
    assert tally.cuts == 4
    assert tally.changes > 50
    assert not tally.wrong
