"""The boundary and the outermost points of the reach: no place of the tip is outside, or much nearer."""

from __future__ import annotations

from math import cos, hypot, radians, sin
from random import Random

import numpy as np
import pytest

from tests.examples import some
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.reach_outline import CELLS, Sections, outermost, outline
from vrs_cli.kinematics.robot_file import load_robot, robot_names
from vrs_cli.kinematics.transform import Vector, moved_point

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


NOWHERE = (0.0, 0.0, 0.0)
POSES = some(4000)


def directions() -> np.ndarray:
    """(288, 3): level ones, and those in a plane that stands."""
    angles = [radians(2.5 * k) for k in range(144)]
    return np.array([(cos(a), sin(a), 0.0) for a in angles] + [(cos(a), 0.0, sin(a)) for a in angles])


@pytest.mark.parametrize("tip", [NOWHERE, (0.05, 0.0, 0.15)], ids=["flange", "tool"])
@pytest.mark.parametrize("name", robot_names())
def test_no_pose_is_farther_out_seen_from_above_and_from_the_side(name: str, tip: Vector) -> None:
    model = load_robot(name)
    arm, points = arm_for(model), np.array(outermost(model, tip))
    q = np.random.default_rng(8).uniform(model.lower, model.upper, (POSES, model.joint_count))
    T = arm.batch.forward(q)
    tips, u = T[..., :3] @ tip + T[..., 3], directions()
    beyond = (u @ tips.T).max(axis=1) - (u @ points.T).max(axis=1)
    assert beyond.max() <= 0.002 * np.linalg.norm(points, axis=1).max()


@pytest.mark.parametrize("name", ["puma560", "ur5e"])
def test_the_outline_is_symmetric_if_joint_1_turns_to_both_sides(name: str) -> None:
    """The lowest and the highest poses are equally far out on both sides, so that the outline has straight edges."""
    points = np.array(outermost(load_robot(name), (0.05, 0.0, 0.15)))
    u = directions()[144:]
    one, other = ((ways @ points.T).max(axis=1) for ways in (u, u * (-1.0, 1.0, 1.0)))
    assert abs(one - other).max() <= 0.0025 * np.linalg.norm(points, axis=1).max()


def test_a_scara_reaches_as_far_as_both_arms_are_long_and_down_as_its_quill_slides() -> None:
    points = outermost(load_robot("cobra600"), NOWHERE)
    assert max(hypot(x, y) for x, y, _ in points) == pytest.approx(0.600)
    assert (min(p[2] for p in points), max(p[2] for p in points)) == pytest.approx((0.177, 0.387))


def test_joints_stay_in_their_ranges() -> None:
    """The arm of a SCARA does not turn behind itself: that is not in its reach."""
    model = load_robot("cobra600")
    behind = min(x for x, _, _ in outermost(model, NOWHERE))
    assert -0.600 < behind < -0.3
