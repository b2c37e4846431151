"""Tests of the load of a line on the joints: from a few samples it is what very many samples show."""

from __future__ import annotations

from math import radians
from random import Random

import pytest
from msgspec import structs

from tests.examples import some
from vrs_cli.engine.following import Follower, Sample
from vrs_cli.engine.load import Load, StretchLoad, _first_peak
from vrs_cli.engine.problem import Here, Problem, state_at
from vrs_cli.engine.single_motion import plan_motion
from vrs_cli.errors import MotionError
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.joints import Joints, Profile, Singularity
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import IDENTITY, Transform, position
from vrs_cli.trajectory.laws.law import LAWS
from vrs_cli.trajectory.segment import CartesianPath, Segment
from vrs_cli.trajectory.state import JointState
from vrs_cli.values.commands import Motion, MotionKind, Start

MODEL = load_robot("puma560")
ARM = arm_for(MODEL)
STILL = (0.0,) * MODEL.joint_count
MIDDLE = tuple(map(radians, (0.0, -45.0, 180.0, 0.0, 45.0, 0.0)))
PLACES = 300  # of a stretch
FAR = 0.97  # of a limit: what asks for less need not be known better


def line(seed: int, profile: Profile) -> tuple[Segment, ...]:
    """Plan a line from rest that ends with a nearly straight wrist, if there is one."""
    source = Random(seed)
    start = tuple(
        low + source.uniform(0.2, 0.8) * (high - low) for low, high in zip(MODEL.lower, MODEL.upper, strict=True)
    )
    goal = [q + source.gauss(0.0, 0.15) for q in start]
    goal[4] = source.choice((-1.0, 1.0)) * 10.0 ** source.uniform(-2.5, -0.5)
    motion = Motion(1, MotionKind.STRAIGHT, Start.AT, pose=ARM.forward(tuple(goal)), profile=profile)
    try:
        return plan_motion(Problem(ARM, Here(JointState(start, STILL)), motion, 0.0))
    except MotionError:
        return ()


def asked(path: CartesianPath, duration: float, profile: Profile) -> Load:
    follower = Follower(ARM, path.configuration, IDENTITY)
    law = LAWS[profile]
    samples = follower.samples(path, duration, path.seeds[0], law.samples)
    load = StretchLoad(follower, path, samples)
    return load.smooth(STILL) if law.smooth else load.parabolic(STILL)


def greatest(path: CartesianPath, duration: float) -> tuple[float, float, float]:
    """Return velocity, acceleration and jerk of the joint nearest to its limit, as parts of the limits."""
    worst = [0.0, 0.0, 0.0]
    for k in range(PLACES):
        s = duration * (k + 0.5) / PLACES
        q = ARM.branch_joints(path.pose(s), path.configuration, path.seed(s))
        assert q is not None
        rate, change = path.twist_rates(s)
        velocity = ARM.joint_velocity(q, path.twist(s))
        acceleration = ARM.joint_acceleration(q, velocity, rate)
        jerk = ARM.joint_jerk(q, velocity, acceleration, change)
        limits = (MODEL.max_velocity, MODEL.max_acceleration, MODEL.max_jerk)
        for i, (rates, most) in enumerate(zip((velocity, acceleration, jerk), limits, strict=True)):
            worst[i] = max(worst[i], _part(rates, most))
    return worst[0], worst[1], worst[2]


def _part(rates: Joints, limits: Joints) -> float:
    return max(abs(rate) / most for rate, most in zip(rates, limits, strict=True))


@pytest.mark.parametrize("profile", [Profile.LSPB, Profile.SCURVE])
def test_no_peak_between_samples_is_missed(profile: Profile) -> None:
    near, lines = 0, some(40)
    for seed in range(lines):
        for segment in line(seed, profile):
            assert isinstance(segment.path, CartesianPath)
            load = asked(segment.path, segment.duration, profile)
            velocity, acceleration, jerk = greatest(segment.path, segment.duration)
            assert velocity <= max(load.velocity, FAR)
            assert acceleration <= max(load.acceleration, FAR)
            if profile is Profile.SCURVE:
                assert jerk <= max(load.jerk, FAR)
            near += max(load.velocity, load.acceleration, load.jerk) > FAR
            assert load.slowing <= 1.002, "what was planned is inside the limits"
    assert near > lines // 4


def test_a_joint_that_begins_at_its_greatest_velocity_does_not_go_beyond_it_before_it_slows_down() -> None:
    """Joint 1 would exceed it by a part in fifteen thousand between the first two samples of the line."""
    rows = (
        (0.5364333591111787, -1.4311698434783597),
        (-2.254457745248211, 0.014799122483738023),
        (0.03341765641342818, -0.057376683463492374),
        (0.9757694483858513, -0.11629405985202515),
        (0.6935979861883039, 1.9454247547172487),
        (2.5129161967792797, 0.26990077925367656),
    )
    q, qd = zip(*rows, strict=True)
    goal = Transform(
        *(-0.3940462615721391, -0.8258670857436178, -0.403325055540026, -0.6377839133125948),
        *(0.2533011408407909, -0.5194195805263585, 0.8161138593447458, 0.26948993016569606),
        *(-0.8834965058163926, 0.2194239185940437, 0.41386841889549797, 0.10018837610983539),
    )
    motion = Motion(1, MotionKind.STRAIGHT, Start.AT, pose=goal, speed=0.6824392266758237, profile=Profile.SCURVE)
    segments = plan_motion(Problem(ARM, Here(JointState(q, qd, STILL)), motion, 0.0))
    for segment in segments:
        for k in range(PLACES):
            velocity = state_at(ARM, segment, segment.duration * (k + 0.5) / PLACES).joints.velocity
            assert all(abs(v) <= most * (1.0 + 1e-5) for v, most in zip(velocity, MODEL.max_velocity, strict=True))


@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_the_greatest_velocity_of_a_parabola_before_the_second_sample(sense: float) -> None:
    """v = 1 + 0.6 t - t^2 for a second is greatest at 0.3 s, where it is 1.09; the mean rate is -0.4."""
    assert _first_peak(sense, sense * 0.6, sense * -0.4, 1.0) == pytest.approx(sense * 1.09)
    assert _first_peak(sense, sense * -0.1, sense * -0.2, 1.0) == sense, "it slows down from the start"


@pytest.mark.parametrize("limit", [0.1, 10.0])
def test_a_joint_near_its_limit_is_looked_at_closely_however_small_that_is(limit: float) -> None:
    """A joint that is not near its limit is not sampled closely, however large its values."""
    model = structs.replace(MODEL, max_velocity=tuple(limit for _ in MODEL.max_velocity))
    x, y, z = position(ARM.forward(MIDDLE))
    path = CartesianPath(((x,), (y, 0.1), (z,)), ARM.forward(MIDDLE), (), ARM.configuration(MIDDLE), (MIDDLE,), 1.0)
    follower = Follower(arm_for(model), path.configuration, IDENTITY)
    load = StretchLoad(follower, path, follower.samples(path, 1.0, MIDDLE))
    for part, looked_at in ((0.97, 1), (0.9, 0)):
        columns = [(0.0,) * len(load.samples) for _ in MIDDLE]
        columns[3] = (0.0, part * limit, *columns[3][2:])
        assert len(list(load._peaks(columns, 1.0))) == looked_at


@pytest.mark.parametrize(("part", "bend", "bent"), [(0.95, 0.003, False), (0.95, 0.03, True), (0.5, 0.03, False)])
def test_an_acceleration_near_its_limit_is_looked_at_again_where_it_is_bent_by_a_hundredth(
    part: float, bend: float, *, bent: bool
) -> None:
    """The mean of joint 2 between two samples is less than at both, so a parabola bends by `bend` of it."""
    path = CartesianPath(((0.0,), (0.0,), (0.0,)), IDENTITY, (), ARM.configuration(MIDDLE), (MIDDLE,), 1.0)
    load = StretchLoad(Follower(ARM, path.configuration, IDENTITY), path, [])
    at_both = (0.0, part * MODEL.max_acceleration[1], 0.0, 0.0, 0.0, 0.0)
    after = tuple(0.1 * a * (1.0 - bend / 1.5) for a in at_both)
    a, b = Sample(0.0, MIDDLE, STILL), Sample(0.1, MIDDLE, after)
    assert load._bent(a, b, at_both, at_both) == bent


def test_the_jerk_of_a_calm_line_is_not_looked_at_but_near_a_boundary_and_a_singular_pose(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """On 20 mm in 4 s no rate comes near a limit. A line that passes close to a boundary is sampled all the same, and
    so is one that begins in a singular pose.
    """
    x, y, z = position(ARM.forward(MIDDLE))
    path = CartesianPath(((x,), (y, 0.005), (z,)), ARM.forward(MIDDLE), (), ARM.configuration(MIDDLE), (MIDDLE,), 4.0)
    follower = Follower(ARM, path.configuration, IDENTITY)
    samples = follower.samples(path, 4.0, MIDDLE)
    assert StretchLoad(follower, path, samples).smooth(STILL).jerk == 0.0
    assert 0.0 < StretchLoad(follower, path, samples, closely=True).smooth(STILL).jerk < 0.1
    first, measured = samples[0]._replace(velocity=STILL), ARM.singularity
    singular = Singularity(1.0, 1.0, 0.0)
    monkeypatch.setattr(ARM, "singularity", lambda q: singular if q == first.joints else measured(q))
    follower = Follower(ARM, path.configuration, IDENTITY)  # a follower computes the measure of a pose once
    assert 0.0 < StretchLoad(follower, path, [first, *samples[1:]]).smooth(STILL).jerk < 0.1
