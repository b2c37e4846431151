"""Tests of the laws of all profiles: continuous from the start of a motion to rest at its target, within limits."""

from __future__ import annotations

from itertools import pairwise
from math import hypot
from random import Random

import pytest

from vrs_cli.kinematics.joints import Profile
from vrs_cli.kinematics.transform import IDENTITY, Transform, angle_between, compose, position, rotation_about
from vrs_cli.trajectory.instant import TICK
from vrs_cli.trajectory.laws.law import LAWS, NoTimes
from vrs_cli.trajectory.polynomial import value
from vrs_cli.trajectory.segment import JointPath, Phase, Segment, ToolStretch
from vrs_cli.trajectory.state import JointLimits, JointState, Target, ToolLimits, ToolState
from vrs_cli.values.commands import Motion, MotionKind, Start

LIMITS = JointLimits((1.4, 0.9), (4.8, 3.1), (48.0, 31.0), (1.4, 0.9), (-9.0, -9.0), (9.0, 9.0))
TOOL = ToolLimits(speed=0.5, acceleration=2.0, spin=1.0, spin_acceleration=4.0, jerk=20.0, spin_jerk=40.0)
STILL = (0.0, 0.0)
ROUNDING = 1.0 + 1e-5
PLACES = 40

LAWS_OF_ALL = pytest.mark.parametrize("profile", list(Profile))


def motion(profile: Profile) -> Motion:
    return Motion(1, MotionKind.JOINT, Start.AT, profile=profile)


def path(segment: Segment) -> JointPath:
    assert isinstance(segment.path, JointPath)
    return segment.path


def state(segment: Segment, s: float) -> JointState:
    there = path(segment)
    return JointState(there.joints(s), there.velocity(s), there.acceleration(s))


def check_kept(segments: tuple[Segment, ...], begin: JointState, *, smooth: bool) -> None:
    """Check that segments follow each other without a jump, from a state to rest, within the limits."""
    now = begin
    for segment in segments:
        assert segment.start % TICK == segment.finish % TICK == 0.0
        first = state(segment, 0.0)
        assert first.joints == pytest.approx(now.joints, abs=1e-9)
        assert first.velocity == pytest.approx(now.velocity, abs=1e-7)
        if smooth:
            assert first.acceleration == pytest.approx(now.acceleration or STILL, abs=1e-6)
        for k in range(PLACES + 1):
            there = state(segment, segment.duration * k / PLACES)
            for values, limits in ((there.velocity, LIMITS.peak), (there.acceleration, LIMITS.acceleration)):
                assert all(abs(x) <= most * ROUNDING for x, most in zip(values, limits, strict=True))
        now = state(segment, segment.duration)
    assert all(a.finish == b.start for a, b in pairwise(segments))
    assert now.velocity == pytest.approx(STILL, abs=1e-7)
    if smooth:
        assert now.acceleration == pytest.approx(STILL, abs=1e-6)


@LAWS_OF_ALL
def test_a_motion_from_rest_or_out_of_motion_keeps_the_limits_and_ends_on_its_target(profile: Profile) -> None:
    law, random, planned = LAWS[profile], Random(1), 0
    for k in range(60):
        begin = JointState((0.1, 0.2), STILL)
        if k % 3:
            velocity = tuple(random.uniform(-0.7, 0.7) * v for v in LIMITS.peak)
            gain = tuple(random.uniform(-0.5, 0.5) * a for a in LIMITS.acceleration) if law.smooth and k % 3 > 1 else ()
            begin = JointState((0.1, 0.2), velocity, gain)
        goal = (random.uniform(-3.0, 3.0), random.uniform(-3.0, 3.0))
        try:
            segments = law.joint_motion(begin, goal, LIMITS, 0.0, motion(profile), 0.0)
        except NoTimes:
            continue
        planned += 1
        check_kept(segments, begin, smooth=law.smooth)
        assert state(segments[-1], segments[-1].duration).joints == pytest.approx(goal, abs=1e-9)
    assert planned > 50


@LAWS_OF_ALL
def test_a_motion_lasts_as_long_as_it_is_told_and_no_time_where_nothing_is_to_do(profile: Profile) -> None:
    law, begin = LAWS[profile], JointState((0.1, 0.2), STILL)
    quick, slow = (law.joint_motion(begin, (1.0, 0.4), LIMITS, 1.0, motion(profile), least) for least in (0.0, 5.0))
    assert quick[0].start == slow[0].start == 1.0
    assert quick[-1].finish < 3.5
    assert 6.0 <= slow[-1].finish <= 6.001
    assert law.joint_motion(begin, begin.joints, LIMITS, 1.0, motion(profile), 0.0) == ()


@LAWS_OF_ALL
def test_the_first_way_of_braking_keeps_the_limits(profile: Profile) -> None:
    law, random = LAWS[profile], Random(2)
    for _ in range(20):
        begin = JointState((0.1, 0.2), (random.uniform(-1.3, 1.3), random.uniform(-0.8, 0.8)))
        first = next(iter(law.joint_stops(begin, LIMITS, 0.0, motion(profile))))
        check_kept(first, begin, smooth=False)


@LAWS_OF_ALL
def test_a_tick_of_steering_ends_at_rest(profile: Profile) -> None:
    law, begin = LAWS[profile], JointState((0.1, 0.2), (0.3, -0.2), STILL)
    target = Target((0.4, 0.1), STILL)
    segments = law.steer(begin, target, LIMITS, LIMITS, 1.0 / 64.0, 0.0, motion(profile), lambda: None)
    check_kept(segments, begin, smooth=law.smooth)
    assert segments[0].phase is Phase.BLEND


# --- straight lines ------------------------------------------------------------------------------------------------


def pose(stretch: ToolStretch, s: float) -> Transform:

    R = stretch.orientation
    for axis, angle in stretch.turns:
        R = compose(R, rotation_about(axis, value(angle, s)))
    x, y, z = (value(a, s) for a in stretch.position)
    return R._replace(px=x, py=y, pz=z)


def speeds(stretch: ToolStretch, s: float) -> tuple[float, float]:
    """Return the velocity of the tip by differences, and how fast the tool turns [m/s, rad/s]."""
    a, b = pose(stretch, s - 1e-6), pose(stretch, s + 1e-6)
    return hypot(b.px - a.px, b.py - a.py, b.pz - a.pz) / 2e-6, angle_between(a, b) / 2e-6


TARGET = compose(IDENTITY._replace(px=0.3, py=-0.2, pz=0.1), rotation_about((0.0, 0.6, 0.8), 0.7))
BEGINNINGS = {
    "from rest": ToolState(IDENTITY, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
    "out of motion": ToolState(IDENTITY, (0.1, 0.2, 0.0), (0.3, 0.0, -0.2)),
    "nothing but a turn": ToolState(IDENTITY._replace(px=0.3, py=-0.2, pz=0.1), (0.0, 0.0, 0.0), (0.2, 0.0, 0.0)),
}


@LAWS_OF_ALL
@pytest.mark.parametrize("begin", BEGINNINGS.values(), ids=BEGINNINGS)
def test_a_line_goes_to_its_target_without_a_jump(profile: Profile, begin: ToolState) -> None:
    stretches = LAWS[profile].straight_motion(begin, TARGET, TOOL, 0.0)
    now = begin.pose
    for stretch in stretches:
        for have, want in zip(position(pose(stretch, 0.0)), position(now), strict=True):
            assert have == pytest.approx(want, abs=1e-9)
        assert angle_between(pose(stretch, 0.0), now) <= 1e-7
        now = pose(stretch, stretch.duration)
        for k in range(PLACES):
            tip, spin = speeds(stretch, stretch.duration * (k + 0.5) / PLACES)
            assert tip <= TOOL.speed * 1.001
            assert spin <= TOOL.spin * 1.001
    assert position(now) == pytest.approx(position(TARGET), abs=1e-9)
    assert angle_between(now, TARGET) <= 1e-7
    assert speeds(stretches[0], 1e-6) == pytest.approx((hypot(*begin.velocity), hypot(*begin.spin)), abs=1e-3)
    assert speeds(stretches[-1], stretches[-1].duration - 1e-6) == pytest.approx((0.0, 0.0), abs=1e-3)


@LAWS_OF_ALL
def test_a_tool_that_moves_comes_to_rest_on_its_line(profile: Profile) -> None:
    begin = BEGINNINGS["out of motion"]
    stretches = LAWS[profile].straight_stop(begin, TOOL)
    end = pose(stretches[-1], stretches[-1].duration)
    assert end.py == pytest.approx(2.0 * end.px)
    assert speeds(stretches[-1], stretches[-1].duration - 1e-6) == pytest.approx((0.0, 0.0), abs=1e-3)


@LAWS_OF_ALL
def test_a_profile_says_what_it_is(profile: Profile) -> None:
    assert profile.value == profile.name.lower()
    assert profile.summary
