"""Tests of tool limits that are lowered by factors."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec import structs

from vrs_cli.trajectory.state import ToolLimits

FACTOR = st.floats(0.1, 10.0)
LIMITS = ToolLimits(*(float(k) for k in range(1, 12)))
VELOCITIES = ("speed", "spin", "guide")
ACCELERATIONS = ("acceleration", "spin_acceleration", "guide_acceleration")
JERKS = ("jerk", "spin_jerk", "guide_jerk")


@given(FACTOR, FACTOR, FACTOR)
def test_all_limits_of_one_kind_are_divided_by_its_factor(velocity: float, acceleration: float, jerk: float) -> None:
    slowed = LIMITS.slow_down(velocity, acceleration, jerk)
    for names, factor in ((VELOCITIES, velocity), (ACCELERATIONS, acceleration), (JERKS, jerk)):
        for name in names:
            assert getattr(slowed, name) == pytest.approx(getattr(LIMITS, name) / factor)
    assert (slowed.blending, slowed.blending_jerk) == (LIMITS.blending, LIMITS.blending_jerk)


@given(FACTOR, FACTOR)
def test_blends_alone_are_slowed(acceleration: float, jerk: float) -> None:
    blended = LIMITS.ease_blend(acceleration, jerk)
    assert blended.blend_acceleration == pytest.approx(LIMITS.blend_acceleration / acceleration)
    assert blended.blend_spin_acceleration == pytest.approx(LIMITS.blend_spin_acceleration / acceleration)
    assert blended.blend_jerk == pytest.approx(LIMITS.blend_jerk / jerk)
    assert blended.blend_spin_jerk == pytest.approx(LIMITS.blend_spin_jerk / jerk)
    assert (
        structs.replace(blended.slow_down(1.0, 1.0), blending=LIMITS.blending, blending_jerk=LIMITS.blending_jerk)
        == LIMITS
    )
