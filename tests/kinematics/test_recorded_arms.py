"""Arms compute what they computed when it was recorded, and refuse it with the same words."""

from __future__ import annotations

import pytest

from tests.kinematics.recorded import RECORDED, ROBOTS, lines
from tests.recording import check_recorded

ROUNDING = 3e-6


@pytest.mark.parametrize("robot", ROBOTS)
def test_what_an_arm_computes_is_what_was_recorded(robot: str) -> None:
    check_recorded(RECORDED, robot, lines(robot), ROUNDING)
