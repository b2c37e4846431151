"""Arms whose wrist has no common point, where the axes of joints 4 and 6 are parallel."""

from __future__ import annotations

from math import pi
from random import Random

import pytest

from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.robot_file import load_robot

POSES = 20


@pytest.mark.parametrize("name", ["ur5e"])
@pytest.mark.parametrize("wrist", [0.0, pi])
def test_all_branches_with_joint_6_in_the_middle_of_its_range_lead_to_the_flange(name: str, wrist: float) -> None:
    arm, random = arm_for(load_robot(name)), Random(8)
    middle = (arm.model.lower[5] + arm.model.upper[5]) / 2
    for _ in range(POSES):
        q = [random.uniform(-pi, pi) for _ in range(4)]
        q[2] = random.choice((-1.0, 1.0)) * random.uniform(0.3, 2.5)
        T = arm.forward((*q, wrist, middle))
        found = [branch for branch in arm.branches(T) if branch is not None]
        assert found
        for branch in found:
            assert arm.forward(branch) == pytest.approx(T, abs=1e-6)
