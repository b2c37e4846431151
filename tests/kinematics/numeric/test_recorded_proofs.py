"""Ways of the joints are proved as far as when it was recorded: no bound of the proof has become another by chance."""

from __future__ import annotations

import pytest

from tests.kinematics.numeric.recorded import HALVINGS, RECORDED, ROBOTS, lines
from tests.recording import check_recorded


@pytest.mark.parametrize("robot", ROBOTS)
def test_ways_are_proved_as_far_as_was_recorded(robot: str) -> None:
    check_recorded(RECORDED, robot, lines(robot), 1.5 * 0.5**HALVINGS)
