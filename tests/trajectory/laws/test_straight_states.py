"""Tests of straight motions of all profiles from a tool that moves, turns and accelerates, with guides: continuous to
rest.
"""

from __future__ import annotations

from itertools import pairwise
from random import Random

import pytest

from vrs_cli.kinematics.joints import NONE, Profile
from vrs_cli.kinematics.transform import Transform, Vector, at_position, compose, rotation_about, translation
from vrs_cli.trajectory.laws.law import LAWS, NoTimes
from vrs_cli.trajectory.polynomial import derivative_at
from vrs_cli.trajectory.segment import CartesianPath, Guide, ToolStretch
from vrs_cli.trajectory.state import GuideState, ToolLimits, ToolState

TOOL = {"speed": 0.5, "acceleration": 2.0, "spin": 1.0, "spin_acceleration": 4.0, "jerk": 20.0, "spin_jerk": 40.0}
LIMITS = ToolLimits(**TOOL, guide=1.0, guide_acceleration=5.0, guide_jerk=50.0)
WEIGHTS = (1.0, 0.0)
MOTIONS = 12


def vector(random: Random, most: float) -> Vector:
    return random.uniform(-most, most), random.uniform(-most, most), random.uniform(-most, most)


def moving(random: Random, accelerates: bool) -> ToolState:
    a = 1.0 if accelerates else 0.0
    return ToolState(
        at_position(rotation_about((0.6, 0.0, 0.8), random.uniform(-2.0, 2.0)), *vector(random, 0.3)),
        vector(random, 0.1),
        vector(random, 0.2),
        vector(random, 0.4 * a),
        vector(random, 0.8 * a),
        tuple(GuideState(WEIGHTS, random.random(), random.random(), 0.1 * k, 0.2 * a * k) for k in (1, -2)),
    )


def state(stretch: ToolStretch, s: float) -> tuple[Transform, tuple[float, ...], tuple[float, ...]]:
    """Return pose, velocities and accelerations: of the tip, of the turning and of the guides."""
    guides = tuple(Guide(WEIGHTS, value) for value in stretch.guides)
    path = CartesianPath(stretch.position, stretch.orientation, stretch.turns, NONE, ((),), 1.0, guides)
    values, rates, bends = ([derivative_at(guide.value, s, order) for guide in guides] for order in (0, 1, 2))
    return path.pose(s), (*values, *path.twist(s), *rates), (*path.twist_rate(s), *bends)


def same(found: object, wanted: object, smooth: bool) -> bool:
    """Return whether two states are the same; accelerations count if the law is smooth."""
    assert isinstance(found, tuple)
    assert isinstance(wanted, tuple)
    pairs = zip(found, wanted, strict=True)
    return all(one == pytest.approx(other, abs=1e-6) for one, other in [*pairs][: 3 if smooth else 2])


@pytest.mark.parametrize("profile", list(Profile))
def test_a_straight_motion_goes_on_from_its_state_and_ends_at_rest(profile: Profile) -> None:
    random, law, made = Random(11), LAWS[profile], 0
    for _ in range(MOTIONS):
        begin = moving(random, law.smooth)
        way = compose(translation(*vector(random, 0.4)), rotation_about((0.0, 0.6, 0.8), random.uniform(-1.0, 1.0)))
        try:
            stretches = [one for one in law.straight_motion(begin, compose(begin.pose, way), LIMITS) if one.duration]
        except NoTimes:
            continue
        made += 1
        guides = begin.guides
        first = (
            begin.pose,
            (*(one.value for one in guides), *begin.velocity, *begin.spin, *(one.rate for one in guides)),
            (*begin.acceleration, *begin.spin_rate, *(one.acceleration for one in guides)),
        )
        still = (0.0,) * (6 + len(guides))
        last = compose(begin.pose, way), (*(one.end for one in guides), *still), still
        assert same(state(stretches[0], 0.0), first, law.smooth)
        for one, other in pairwise(stretches):
            assert same(state(one, one.duration), state(other, 0.0), law.smooth)
        assert same(state(stretches[-1], stretches[-1].duration), last, law.smooth)
    assert made > MOTIONS // 2


@pytest.mark.parametrize("profile", list(Profile))
def test_a_turn_takes_the_time_of_a_way_with_the_same_limits(profile: Profile) -> None:
    law, (slow, soft, smooth) = LAWS[profile], (0.3, 2.0, 30.0)
    limits = ToolLimits(slow, soft, slow, soft, smooth, smooth)
    begin = ToolState(translation(0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    for size in (0.001, 0.05, 0.4, 1.5):
        goals = translation(size, 0.0, 0.0), rotation_about((0.0, 1.0, 0.0), size)
        lasting, turning = (sum(one.duration for one in law.straight_motion(begin, goal, limits)) for goal in goals)
        assert lasting > size / slow
        assert turning == pytest.approx(lasting)
