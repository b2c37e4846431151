"""Straight lines before their joints are known."""

from __future__ import annotations

import pytest

from vrs_cli.kinematics.transform import IDENTITY
from vrs_cli.trajectory.laws.lspb import straight_motion, straight_stop
from vrs_cli.trajectory.polynomial import value
from vrs_cli.trajectory.state import ToolLimits, ToolState

LIMITS = ToolLimits(speed=1.0, acceleration=4.0, spin=1.0, spin_acceleration=4.0)


def test_a_line_takes_no_longer_than_it_must_unless_told() -> None:
    """0.04 m at 4 m/s2 are a triangle of 2 sqrt(D / a)."""
    state, target = ToolState(IDENTITY, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)), IDENTITY._replace(px=0.04)
    assert sum(part.duration for part in straight_motion(state, target, LIMITS)) == pytest.approx(0.2, abs=1e-5)
    assert sum(part.duration for part in straight_motion(state, target, LIMITS, 0.7)) == pytest.approx(0.7, abs=1e-5)


@pytest.mark.parametrize(
    ("speed", "spin", "seconds"),
    [(0.5, 0.0, 0.125), (0.0, 0.6, 0.3), (0.5, 0.6, 0.3), (0.8, 0.1, 0.2)],
)
def test_a_tool_stops_as_soon_as_its_accelerations_allow(speed: float, spin: float, seconds: float) -> None:
    """At 4 m/s2 and 2 rad/s2: the slower of the two says how long it takes."""
    limits = LIMITS._replace(spin_acceleration=2.0)
    stop = straight_stop(ToolState(IDENTITY, (speed, 0.0, 0.0), (0.0, 0.0, spin)), limits)
    assert sum(part.duration for part in stop) == pytest.approx(seconds, abs=1e-5)
    moved = sum(value(part.position[0], part.duration) - part.position[0][0] for part in stop)
    assert moved == pytest.approx(0.5 * speed * seconds, abs=1e-5)
