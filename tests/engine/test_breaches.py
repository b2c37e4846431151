"""Tests of the laws of a timeline: each is broken once, by a segment that keeps all others."""

from __future__ import annotations

import re
from math import degrees, pi, radians
from random import Random

import numpy as np
import pytest
from msgspec import structs

from tests.files.trajectories import STAND, initial, planned, puma
from vrs_cli.engine.breaches import breaches, on_lines
from vrs_cli.engine.engine import Engine
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.transform import at_position
from vrs_cli.trajectory.segment import CartesianPath, JointPath, Phase, Segment
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.commands import Motion, MotionKind, Move, PoseTarget, SetParameter, Start

ARM = arm_for(puma())
MOVE = Motion(1, MotionKind.JOINT, Start.AT, goal=STAND)


def of_joint_1(*pieces: tuple[float, tuple[float, ...]], gap: float = 0.0, phase: Phase = Phase.CRUISE) -> list[str]:
    """Return the breaches of a timeline in which joint 1 follows these polynomials, each for some seconds."""
    segments, t = [initial()], 0.0
    for duration, polynomial in pieces:
        others = tuple((q,) + (0.0,) * (len(polynomial) - 1) for q in STAND[1:])
        segments.append(Segment(t, t + duration, JointPath((polynomial, *others)), phase, MOVE))
        t += duration + gap
    return [breach.what for breach in breaches(ARM, Timeline(segments))]


def test_there_and_back_is_sound() -> None:
    assert of_joint_1((0.5, (0.0, 0.0, 1.0)), (0.5, (0.25, 1.0, -1.0))) == []
    assert of_joint_1((0.5, (0.0, 0.0, 1.5, -1.0)), (0.5, (0.25, 0.75, 0.0, -1.0))) == []


@pytest.mark.parametrize(
    ("pieces", "told"),
    [
        ([(1.0, (0.1,))], "joint 1 jumps by 5.7296 deg, 0.000 s"),
        ([(0.5, (0.0, 0.0, 1.0)), (0.5, (0.25, 0.9, -0.9))], "the velocity of joint 1 jumps by 5.7296 deg/s, 0.500 s"),
        ([(0.5, (0.0, 0.1))], "the velocity of joint 1 jumps by 5.7296 deg/s, 0.000 s"),
        ([(0.5, (0.0, 0.0, 0.1))], "joint 1 moves with 5.7296 deg/s at the end, 0.000 s"),
        ([(4.0, (0.0, 0.0, 0.75, -0.125))], "joint 1 is 69.1831 deg beyond its range, 0.000 s"),
        ([(1.0, (0.0, 0.0, 4.5, -3.0))], "joint 1 moves with 128.9155 deg/s, faster than it can, 0.000 s"),
        ([(0.25, (0.0, 0.0, 12.0, -32.0))], "joint 1 accelerates with 1375.0987 deg/s2, more than it can, 0.000 s"),
    ],
)
def test_what_is_wrong_is_told(pieces: list, told: str) -> None:
    assert any(what.startswith(told) for what in of_joint_1(*pieces)), of_joint_1(*pieces)


def test_how_far_a_joint_is_beyond_its_range_and_its_speed_is_what_looking_closely_shows() -> None:
    """Check any cubic, also one that turns back twice."""
    random, (lower, upper), most = Random(6), (puma().lower[0], puma().upper[0]), puma().max_velocity[0]
    told = 0
    for _ in range(25):
        lasting = random.uniform(1.0, 3.0)
        cubic = tuple(random.gauss(0.0, 4.0) / lasting**k for k in range(4))
        times = np.linspace(0.0, lasting, 5001)
        places = np.polyval(cubic[::-1], times)
        rates = np.abs(np.polyval([3.0 * cubic[3], 2.0 * cubic[2], cubic[1]], times))
        found = of_joint_1((lasting, cubic))
        for far, words in (
            (max(lower - places.min(), places.max() - upper), r"joint 1 is ([\d.]+) deg beyond"),
            (rates.max(), r"joint 1 moves with ([\d.]+) deg/s, faster"),
        ):
            is_too_far = far > (0.0 if "beyond" in words else most) + 1e-3
            sizes = [float(match[1]) for what in found if (match := re.search(words, what))]
            assert bool(sizes) == is_too_far
            assert not sizes or sizes[0] == pytest.approx(degrees(far), rel=1e-5)
            told += is_too_far
    assert told > 25


def test_a_joint_that_swings_out_of_its_range_and_back_is_seen() -> None:
    """The joint leaves its range between two ends that are inside."""
    upper = puma().upper[0]
    there = Segment(0.0, 4.0, still_but(1, (0.0, 0.0, 3 * upper / 16, -upper / 32)), Phase.CRUISE, MOVE)
    swing = Segment(4.0, 6.0, still_but(1, (upper, 0.1, -0.05, 0.0)), Phase.CRUISE, MOVE)
    told = [breach.what for breach in breaches(ARM, Timeline([initial(), there, swing]))]
    assert f"joint 1 is {0.05 * 180 / pi:.4f} deg beyond its range, 4.000 s" in told


def still_but(joint: int, polynomial: tuple[float, ...]) -> JointPath:
    rows = [(q, 0.0, 0.0, 0.0) for q in STAND]
    rows[joint - 1] = polynomial
    return JointPath(tuple(rows))


def test_the_robot_stands_in_gaps_and_rests() -> None:
    assert of_joint_1((0.5, (0.0, 0.0, 0.1)), (0.5, (0.025, 0.1, -0.1)), gap=0.25)[0].startswith(
        "joint 1 moves with 5.7296 deg/s next to a gap"
    )
    assert of_joint_1((1.0, (0.0, 0.0, 0.3, -0.2)), phase=Phase.REST) == [
        "joint 1 moves by 5.7296 deg while the robot stands, 0.000 s"
    ]


def test_a_stream_of_targets_may_break_off() -> None:
    steered = Segment(
        0.0, 0.5, still_but(1, (0.0, 0.0, 0.1, 0.0)), Phase.BLEND, structs.replace(MOVE, kind=MotionKind.STEERED)
    )
    assert not list(breaches(ARM, Timeline([initial(), steered])))


# --- straight lines ----------------------------------------------------------------------------------------


def with_line(**changes: object) -> Timeline:
    """Return a planned timeline in which the first straight line of some length is changed."""
    timeline = planned(6, seed=1)[0]
    segments = list(timeline)
    at = next(i for i, s in enumerate(segments) if isinstance(s.path, CartesianPath) and s.duration > 0.1)
    segments[at] = structs.replace(segments[at], path=structs.replace(segments[at].path, **changes))
    return Timeline(segments)


def test_planned_lines_are_sound() -> None:
    for seed in range(1, 5):
        timeline = planned(6, seed)[0]
        assert not list(breaches(ARM, timeline))
        assert not list(on_lines(ARM, timeline))


def test_a_line_out_of_reach_is_told() -> None:
    timeline = with_line(position=((2.0,), (0.0,), (0.0,)))
    assert any("leaves the reach of the arm" in breach.what for breach in breaches(ARM, timeline))
    assert any("leaves the reach of the arm" in breach.what for breach in on_lines(ARM, timeline))


def test_a_line_whose_seeds_turn_a_joint_about_is_told() -> None:
    timeline = planned(6, seed=1)[0]
    path = next(s.path for s in timeline if isinstance(s.path, CartesianPath) and s.duration > 0.1)
    turned = tuple((*q[:5], q[5] + 2.0 * pi) for q in path.seeds[1:])
    told = [breach.what for breach in breaches(ARM, with_line(seeds=(path.seeds[0], *turned)))]
    assert any("jump" in what for what in told)


@pytest.mark.parametrize(
    ("profile", "told"),
    [("LSPB", "times the acceleration"), ("SCURVE", "times the jerk"), ("QUINTIC", "times the acc")],
)
def test_a_line_that_is_too_fast_is_told(profile: str, told: str) -> None:
    """The planned line keeps all laws. The same line in less time does not, though each joint keeps its
    velocity limit.
    """
    engine = Engine(puma(), start=tuple(map(radians, (0.0, -45.0, 150.0, 0.0, 40.0, 0.0))))
    engine.perform(SetParameter("PROFILE", profile))
    here = engine.position().T_world_tool
    engine.perform(Move(PoseTarget(at_position(here, here.px, here.py + 0.02, here.pz)), straight=True))
    assert not list(on_lines(ARM, engine.timeline))
    faster = Timeline(tuple(sooner(segment, 2.6) for segment in engine.timeline))
    found = [breach.what for breach in on_lines(ARM, faster)]
    assert any(told in what for what in found)


def sooner(segment: Segment, factor: float) -> Segment:
    """Return the same way in less time."""
    path = segment.path
    if not isinstance(path, CartesianPath):
        return segment
    x, y, z = (tuple(c * factor**k for k, c in enumerate(row)) for row in path.position)
    path = structs.replace(path, position=(x, y, z), seed_interval=path.seed_interval / factor)
    return structs.replace(segment, start=segment.start / factor, finish=segment.finish / factor, path=path)
