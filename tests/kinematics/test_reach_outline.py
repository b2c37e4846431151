"""The boundary of the reach: all places of the tip are inside it, and it is not much larger than they are."""

from __future__ import annotations

from math import hypot
from random import Random

import pytest

from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.reach_outline import CELLS, Sections, outline
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import moved_point

TIP = (0.0, 0.0, 0.1)


def inside(sections: Sections, far: float, z: float) -> bool:
    """Whether a way outwards crosses the outline an odd number of times."""
    (x1, z1), (x2, z2) = (sections[:, end, :2].T for end in (0, 1))
    spans = (z1 > z) != (z2 > z)
    x1, z1, x2, z2 = x1[spans], z1[spans], x2[spans], z2[spans]
    return bool((x1 + (z - z1) / (z2 - z1) * (x2 - x1) > far).sum() % 2)


@pytest.mark.parametrize("name", ["puma560", "ur5e", "irb120", "cobra600"])
def test_the_tip_is_inside_whatever_the_joints(name: str) -> None:
    arm, random = arm_for(load_robot(name)), Random(4)
    model = arm.model
    configuration = arm.configuration(model.poses["ready"])
    sections, missed, looked = outline(arm, configuration, TIP), 0, 0
    while looked < 300:
        q = (0.0, *map(random.uniform, model.lower[1:], model.upper[1:]))
        if arm.configuration(q) == configuration:
            x, y, z = moved_point(arm.forward(q), TIP)
            looked, missed = looked + 1, missed + (not inside(sections, hypot(x, y), z))
    assert missed <= 3, "a place that few poses reach may be missed"


@pytest.mark.parametrize(("name", "most"), [("cobra600", 0.6), ("planar2", 0.5), ("puma560", 0.95)])
def test_it_is_hardly_larger_than_the_arm_is_long(name: str, most: float) -> None:
    arm = arm_for(load_robot(name))
    sections = outline(arm, arm.configuration(arm.model.poses["ready"]), (0.0, 0.0, 0.0))
    farthest = sections[..., 0].max()
    assert most * 0.97 < farthest < most * (1.0 + 1.0 / CELLS)
