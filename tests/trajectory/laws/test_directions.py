"""Tests that space has no preferred direction: a straight motion that is turned as a whole takes the same times."""

from __future__ import annotations

from random import Random

import pytest

from tests.trajectory.laws.test_straight_states import LIMITS, moving
from vrs_cli.kinematics.joints import Profile
from vrs_cli.kinematics.transform import (
    IDENTITY,
    Transform,
    angle_between,
    at_position,
    compose,
    position,
    rotate,
    rotation_about,
    scaled_vector,
    translation,
    unit,
)
from vrs_cli.trajectory.laws.law import LAWS, NoTimes
from vrs_cli.trajectory.polynomial import value
from vrs_cli.trajectory.segment import ToolStretch
from vrs_cli.trajectory.state import ToolState

LAWS_OF_ALL = pytest.mark.parametrize("profile", list(Profile))
DIRECTIONS = [
    unit((x, y, z)) for x in (-1.0, 0.0, 1.0) for y in (-1.0, 0.0, 1.0) for z in (-1.0, 0.0, 1.0) if x or y or z
]
TURNS = (((0.0, 0.0, 1.0), 1.5707963267948966), ((1.0, 0.0, 0.0), 3.141592653589793), ((0.48, 0.64, -0.6), 1.1))


def turned(R: Transform, state: ToolState) -> ToolState:
    return ToolState(
        compose(R, state.pose),
        *(rotate(R, v) for v in (state.velocity, state.spin, state.acceleration, state.spin_rate)),
        state.guides,
    )


def pose(stretch: ToolStretch, s: float) -> Transform:
    R = stretch.orientation
    for axis, angle in stretch.turns:
        R = compose(R, rotation_about(axis, value(angle, s)))
    return at_position(R, *(value(a, s) for a in stretch.position))


def check_turned(R: Transform, stretches: list[ToolStretch], others: list[ToolStretch]) -> None:
    assert [one.phase for one in others] == [one.phase for one in stretches]
    assert [one.duration for one in others] == pytest.approx([one.duration for one in stretches], abs=1e-5)
    for one, other in zip(stretches, others, strict=True):
        for part in (0.0, 0.3, 1.0):
            wanted, found = compose(R, pose(one, part * one.duration)), pose(other, part * other.duration)
            assert position(found) == pytest.approx(position(wanted), abs=1e-5)
            assert angle_between(found, wanted) < 1e-5


@LAWS_OF_ALL
@pytest.mark.parametrize(("axis", "angle"), TURNS)
def test_a_line_that_is_turned_as_a_whole_takes_the_same_times(
    profile: Profile, axis: tuple[float, float, float], angle: float
) -> None:
    random, law, R, made = Random(5), LAWS[profile], rotation_about(axis, angle), 0
    for _ in range(6):
        begin = moving(random, law.smooth)
        way = compose(translation(*(random.uniform(-0.4, 0.4) for _ in "XYZ")), rotation_about((0.0, 0.6, 0.8), 0.7))
        goal = compose(begin.pose, way)
        try:
            stretches = law.straight_motion(begin, goal, LIMITS)
        except NoTimes:
            continue
        made += 1
        check_turned(R, stretches, law.straight_motion(turned(R, begin), compose(R, goal), LIMITS))
        check_turned(R, law.straight_stop(begin, LIMITS), law.straight_stop(turned(R, begin), LIMITS))
    assert made > 3


@LAWS_OF_ALL
@pytest.mark.parametrize("fast", [0.0, 0.2])
def test_a_line_out_of_rest_or_motion_along_it_takes_as_long_in_every_direction(profile: Profile, fast: float) -> None:
    law, found = LAWS[profile], list[list[float]]()
    for along in DIRECTIONS:
        begin = ToolState(IDENTITY, scaled_vector(along, fast), (0.0, 0.0, 0.0))
        stretches = law.straight_motion(begin, translation(*scaled_vector(along, 0.3)), LIMITS)
        found.append([one.duration for one in stretches])
        middle = position(pose(stretches[0], 0.5 * stretches[0].duration))
        assert unit(middle) == pytest.approx(along, abs=1e-9)
    assert all(one == pytest.approx(found[0], abs=1e-6) for one in found)
    assert sum(found[0]) > 0.5
