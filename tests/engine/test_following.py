"""Tests of the samples of a line: neighbours explain what lies between them."""

from __future__ import annotations

from itertools import pairwise
from math import inf
from random import Random

import pytest

from vrs_cli.engine.following import FIRST_INTERVALS, Follower, Sample, _extrapolation, seeds_of
from vrs_cli.errors import MotionError
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.joints import NONE
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import IDENTITY, position, translation
from vrs_cli.trajectory.segment import CartesianPath

SHORTEST = 2.0**-9  # of a stretch: nearer samples are as near as they get


@pytest.mark.parametrize("slow", [1.0, 50.0], ids=["fast", "slow"])
def test_neighbours_differ_by_little_that_their_velocities_do_not_explain(slow: float) -> None:
    """Joints differ by at most 0.15 rad, and by 0.002 rad beyond their mean velocity, also on a slow line, where rates
    say nothing.
    """
    model, random, seen = load_robot("puma560"), Random(2), 0
    arm = arm_for(model)
    for _ in range(40):
        rows = list(zip(model.lower, model.upper, strict=True))
        start = tuple(low + random.uniform(0.2, 0.8) * (high - low) for low, high in rows)
        pose = arm.forward(start)
        way = ((p, random.gauss(0.0, 0.15) / slow) for p in position(pose))
        path = CartesianPath(tuple(way), pose, (), arm.configuration(start), (start,), slow)  # type: ignore[arg-type]
        follower = Follower(arm, path.configuration, IDENTITY)
        try:
            samples = follower.samples(path, slow, start)
        except MotionError:
            continue
        assert len(samples) > FIRST_INTERVALS
        for a, b in pairwise(samples):
            if b.s - a.s > SHORTEST * slow:
                changes = [q - p for p, q in zip(a.joints, b.joints, strict=True)]
                means = [0.5 * (b.s - a.s) * (v + w) for v, w in zip(a.velocity, b.velocity, strict=True)]
                assert max(map(abs, changes)) <= 0.15
                assert max(abs(c - mean) for c, mean in zip(changes, means, strict=True)) <= 0.002
                seen += 1
    assert seen > 100


def test_an_easy_line_has_no_more_samples_than_it_is_asked_for() -> None:
    """On a centimetre in a second the joints hardly turn, and almost evenly."""
    model = load_robot("puma560")
    arm, start = arm_for(model), (0.2, -0.9, 2.6, 0.3, 0.8, 0.1)
    x, y, z = position(arm.forward(start))
    path = CartesianPath(((x, 0.01), (y,), (z,)), arm.forward(start), (), arm.configuration(start), (start,), 1.0)
    for steps in (FIRST_INTERVALS, 3):
        samples = Follower(arm, path.configuration, IDENTITY).samples(path, 1.0, start, steps)
        assert [sample.s for sample in samples] == pytest.approx([k / steps for k in range(steps + 1)])


def test_a_seed_is_next_to_the_joints_of_its_instant() -> None:
    samples = [Sample(s, (2.0 * s, -s * s), (2.0, -2.0 * s)) for s in (0.0, 0.1, 0.15, 0.4, 0.7, 0.8, 1.0)]
    seeds = seeds_of(samples, 2.0, 0.1)
    assert len(seeds) > 20
    for k, seed in enumerate(seeds):
        s = k / (len(seeds) - 1)
        assert seed in [sample.joints for sample in samples]
        assert abs(seed[0] - 2.0 * s) <= 2.0 * 0.15, "half of the widest gap, at this velocity"


def test_where_a_line_is_refused_anyway_speed_takes_few_samples() -> None:
    """The line passes a wrist that is straight to within three tenths of a milliradian in one second, and is sampled
    closely.
    """
    model = load_robot("ur5e")
    arm, middle = arm_for(model), (0.2, -1.2, 1.6, -0.5, 3e-4, 0.1)
    pose = arm.forward(middle)
    x, y, z = position(pose)
    path = CartesianPath(((x - 0.1, 0.2), (y,), (z - 0.1, 0.2)), pose, (), arm.configuration(middle), (middle,), 1.0)
    marks = sorted(0.5 + side * 2.0**-k for side in (-1, 1) for k in range(2, 16))
    counts = []
    for slowest in (1.0, inf):
        follower = Follower(arm, path.configuration, IDENTITY, slowest=slowest)
        counts.append(len(follower.samples(path, 1.0, middle, marks=marks)))
    assert 2 * counts[0] < counts[1]


def test_the_refusal_of_a_kink_names_the_joint_that_turns_most_and_the_place() -> None:
    model = load_robot("puma560")
    arm, start = arm_for(model), (0.2, -0.9, 2.6, 0.3, 0.8, 0.1)
    x, y, z = position(arm.forward(start))
    for way in ((0.05, 0.0, 0.0), (0.0, 0.05, 0.0), (0.0, 0.0, -0.05)):
        line = tuple((p, v) for p, v in zip((x, y, z), way, strict=True))
        path = CartesianPath(line, arm.forward(start), (), arm.configuration(start), (start,), 1.0)  # type: ignore[arg-type]
        follower = Follower(arm, path.configuration, IDENTITY)
        joints = follower.joints(path, 1.0, start)
        assert joints is not None
        turned = [abs(b - a) for a, b in zip(start, joints, strict=True)]
        refusal = follower.refuse_kink(path, 0.0, 1.0, start)
        assert refusal.joint == turned.index(max(turned)) + 1
        assert f"joint {refusal.joint} would have to change its speed in no time" in str(refusal)
        assert refusal.place == pytest.approx((x, y, z))


@pytest.mark.parametrize("count", [1, 2, 3])
def test_joints_are_expected_where_an_even_acceleration_leads(count: int) -> None:
    """From one sample only the velocity is used."""
    q, v, a = (0.3, -1.0), (0.5, 0.2), (-0.4, 2.0)

    def at(s: float) -> tuple[tuple[float, ...], tuple[float, ...]]:
        rows = list(zip(q, v, a, strict=True))
        return tuple(x + s * (w + 0.5 * s * b) for x, w, b in rows), tuple(w + s * b for _, w, b in rows)

    samples = [Sample(s, *at(s)) for s in (0.1, 0.25, 0.3)[:count]]
    last = samples[-1]
    even = tuple(x + 0.2 * w for x, w in zip(last.joints, last.velocity, strict=True))
    ahead = _extrapolation(len(last.joints))(samples, last.s + 0.2)
    assert ahead == pytest.approx(at(last.s + 0.2)[0] if count > 1 else even)


def test_the_singular_measure_is_that_of_the_tip_of_the_tool() -> None:
    model = load_robot("so100")  # turns its tool as little as possible, so the place of the tip counts
    arm, tool, q = arm_for(model), translation(0.0, 0.05, 0.2), (0.0, -1.5, 1.5, 1.5, 0.0)
    solved, bare = (min(one.singularity(q)) for one in (arm.for_tool(tool), arm))
    assert solved < 0.5 < bare
    assert Follower(arm, NONE, tool)._measure(q) == solved
