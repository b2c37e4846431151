"""Seven joints with a spherical shoulder: solutions for each value of joint 7, and the best of them."""

from __future__ import annotations

from math import hypot, pi
from random import Random

import numpy as np
import pytest

from tests.kinematics.seven_joints import seven_joints
from vrs_cli.errors import LocationOutOfRange, LocationTooFar
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.numeric.arm import NumericArm
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.spherical_shoulder.arm import SphericalShoulderArm
from vrs_cli.kinematics.transform import compose, rotation_x, rotation_y, translation

MODELS = {
    "panda": load_robot("panda"),
    "iiwa14": load_robot("iiwa14"),
    "fr3": seven_joints("fr3"),
    "xarm7": seven_joints("xarm7"),
}
POSES, FEW = 2000, 60


@pytest.fixture(params=MODELS)
def arm(request: pytest.FixtureRequest) -> SphericalShoulderArm:
    arm = arm_for(MODELS[request.param])
    assert isinstance(arm, SphericalShoulderArm)
    return arm


def random_joints(arm: SphericalShoulderArm, count: int, seed: int) -> list[Joints]:
    random, model = Random(seed), arm.model
    return [tuple(map(random.uniform, model.lower, model.upper)) for _ in range(count)]


def turns_off(a: Joints, b: Joints) -> float:
    """How far joints are from each other at most, apart from full turns."""
    return max(abs((x - y + pi) % (2.0 * pi) - pi) for x, y in zip(a, b, strict=True))


def test_joints_are_among_the_solutions_for_their_joint_7_and_all_lead_to_the_pose(arm: SphericalShoulderArm) -> None:
    for q in random_joints(arm, POSES, 1):
        T = arm.forward(q)
        found = arm.branches_at(T, q[6])
        assert len(found) in (2, 4, 6, 8)
        assert min(turns_off(other, q) for other in found) < 1e-4  # digits are lost where two branches nearly meet
        for other in found:
            assert other[6] == q[6]
            assert arm.forward(other) == pytest.approx(T, abs=1e-11)


def test_each_solution_is_continuous_in_the_pose_and_joint_7(arm: SphericalShoulderArm) -> None:
    smooth, step = 0, 1e-7
    for q in random_joints(arm, POSES, 2):
        T = arm.forward(q)
        beside = compose(T, compose(translation(step, -step, step), rotation_x(step)))
        before, after = arm.branches_at(T, q[6]), arm.branches_at(beside, q[6] + step)
        smooth += len(before) == len(after) and max(map(turns_off, before, after)) < 1e-3
    assert smooth > 0.98 * POSES  # at the others two branches nearly meet


def test_select_is_within_the_limits_and_not_slower_than_the_search(arm: SphericalShoulderArm) -> None:
    begin, *goals = random_joints(arm, FEW, 3)
    search, times = NumericArm(arm.model), [0.0, 0.0]
    for q in goals:
        T = arm.forward(q)
        found = arm.select(T, begin)
        assert arm.limits_ok(found)
        assert arm.forward(found) == pytest.approx(T, abs=1e-9)
        assert arm.select(T, begin) == found
        times[0] += arm.shortest_time(begin, found)
        times[1] += arm.shortest_time(begin, search.select(T, begin))
    assert times[0] < 0.95 * times[1]


def test_arrays_have_the_solutions_of_single_poses(arm: SphericalShoulderArm) -> None:
    T = [arm.forward(q) for q in random_joints(arm, FEW, 6)]
    T.append(compose(translation(3.0, 0.0, 0.0), T[0]))
    found, inside = arm.batch.inverse(np.reshape(T, (-1, 3, 4)))
    assert inside[:, 0].tolist() == [True] * FEW + [False]
    assert found[:-1, 0].tolist() == [list(arm.branches(pose)[0] or ()) for pose in T[:-1]]


def test_a_near_pose_needs_a_short_motion(arm: SphericalShoulderArm) -> None:
    random = Random(4)
    for q in random_joints(arm, FEW, 5):
        goal = arm._inside(tuple(x + random.uniform(-0.05, 0.05) for x in q), q)
        if goal is not None:
            found = arm.select(arm.forward(goal), q)
            assert arm.shortest_time(q, found) < 4.0 * arm.shortest_time(q, goal)


def test_a_singular_pose_is_found_from_near_joints(arm: SphericalShoulderArm) -> None:
    begin = arm.model.poses["ready"]
    q = (begin[0], -arm.links[1].theta, *begin[2:])  # axes 1 and 3 are one
    T, near = arm.forward(q), tuple(x + 0.02 for x in q)
    assert arm.forward(arm.select(T, near)) == pytest.approx(T, abs=1e-8)


def test_what_no_joints_reach_is_refused(arm: SphericalShoulderArm) -> None:
    begin = arm.model.poses["ready"]
    T = arm.forward(begin)
    with pytest.raises(LocationTooFar):
        arm.select(compose(translation(3.0, 0.0, 0.0), T), begin)
    first, _, third, fourth, fifth, *_ = arm.links
    reach = hypot(third.d, third.a) + hypot(fifth.d, fourth.a)
    out = compose(translation(reach - 0.01, 0.0, first.d), rotation_y(-0.5 * pi))
    assert not arm.beyond(out)  # but the wrist is
    with pytest.raises(LocationOutOfRange):
        arm.select(out, begin)


@pytest.mark.parametrize("name", ["sawyer", "gen3"])
def test_arms_whose_axes_do_not_meet_are_searched(name: str) -> None:
    assert type(arm_for(seven_joints(name))) is NumericArm
