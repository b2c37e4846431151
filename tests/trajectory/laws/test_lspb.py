"""Straight lines before their joints are known."""

from __future__ import annotations

import pytest

from vrs_cli.kinematics.transform import IDENTITY
from vrs_cli.trajectory.laws.lspb import straight_motion
from vrs_cli.trajectory.limits import ToolLimits
from vrs_cli.trajectory.state import ToolState

LIMITS = ToolLimits(speed=1.0, acceleration=4.0, spin=1.0, spin_acceleration=4.0)


def test_a_line_takes_no_longer_than_it_must_unless_told() -> None:
    """0.04 m at 4 m/s2 are a triangle of 2 sqrt(D / a)."""
    state, target = ToolState(IDENTITY, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)), IDENTITY._replace(px=0.04)
    assert sum(part.duration for part in straight_motion(state, target, LIMITS)) == pytest.approx(0.2, abs=1e-5)
    assert sum(part.duration for part in straight_motion(state, target, LIMITS, 0.7)) == pytest.approx(0.7, abs=1e-5)
