"""Tests that the laws still plan what was recorded when they got their version."""

from __future__ import annotations

import pytest

from tests.recording import check_recorded
from tests.trajectory.laws.recorded import CASES, RECORDED, lines
from vrs_cli.kinematics.joints import Profile

ROUNDING = 3e-7  # [s, rad, m]


@pytest.mark.parametrize(("profile", "what"), CASES)
def test_what_a_law_plans_is_what_was_recorded(profile: Profile, what: str) -> None:
    check_recorded(RECORDED, f"{profile.value} {what}", lines(profile, what), ROUNDING)
