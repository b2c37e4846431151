"""Arms of seven joints follow as many straight lines as an integrating follower does, inside all limits."""

from __future__ import annotations

import pytest

from tests.kinematics.seven_joints import ARMS, seven_joints
from tests.laws.redundant_lines import LIMIT, followed, largest_load, planned, random_lines
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.joints import Profile

FEW, STEPS = 2, 25  # the long run takes many and fine ones
STEP = 0.02  # [s]


@pytest.mark.parametrize("name", ARMS)
def test_no_line_is_refused_that_the_follower_can_do(name: str) -> None:
    arm = arm_for(seven_joints(name))
    lines = list(random_lines(arm, FEW))
    done = [planned(arm, line) for line in lines]
    assert sum(segments is not None for segments in done) >= sum(followed(arm, line, STEPS) for line in lines) > 0


@pytest.mark.parametrize("profile", Profile)
def test_limits_are_kept(profile: Profile) -> None:
    model = seven_joints("panda")
    arm = arm_for(model)
    _, line = random_lines(arm, 2)
    segments = planned(arm, line, profile)
    assert segments is not None
    assert 0.3 < largest_load(model, segments, STEP) <= LIMIT


def test_the_same_line_is_planned_the_same_way() -> None:
    arm = arm_for(seven_joints("iiwa"))
    (line,) = random_lines(arm, 1)
    assert planned(arm, line) == planned(arm_for(seven_joints("iiwa")), line) is not None
