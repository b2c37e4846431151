"""Parts in times of their own: on target, at rest, all at once, inside all limits, and about as soon as can be."""

from __future__ import annotations

from random import Random

import pytest

from tests.laws.motion_laws import check_continuous
from vrs_cli.engine.engine import Engine
from vrs_cli.engine.one_motion import plan_motion
from vrs_cli.engine.problem import Here, Problem
from vrs_cli.kinematics.joints import largest_change
from vrs_cli.kinematics.profile import Profile
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.trajectory.laws.scurve_pieces import state_after
from vrs_cli.trajectory.laws.scurve_separate import course_pieces, together
from vrs_cli.trajectory.laws.scurve_times import Part
from vrs_cli.trajectory.segment import JointPath
from vrs_cli.trajectory.state import JointState
from vrs_cli.values.motion import Kind, Motion, Start

MODEL = load_robot("puma560")

INTERRUPTIONS = [  # joints, velocities, accelerations, goal [rad ...]; Ruckig's time [s]
    (
        (2.413324, -3.137888, 1.943293, -1.67655, -0.121252, -3.631626),
        (-1.040191, -0.046902, -1.152337, 0.607623, -0.465982, 3.684458),
        (-2.497074, -0.112593, -2.76629, 1.458656, -1.118632, 8.844882),
        (1.413227, -2.907914, 1.125793, -0.853502, -0.527856, -2.880475),
    ),
    (
        (2.457933, -0.00252, 1.96965, 2.12902, -1.440018, 2.417193),
        (-0.54703, -0.87695, -0.211734, -0.575475, -0.110339, 1.149405),
        (-1.265725, -2.029099, -0.489913, -1.331542, -0.255304, 2.65951),
        (1.551055, 0.038898, 1.756028, 1.96369, -0.783514, 1.480711),
    ),
    (
        (-1.120422, -0.082455, 0.941041, 1.288387, -0.619172, -1.077009),
        (1.333428, 0.093838, 0.968784, 0.57367, 0.650313, 1.572562),
        (3.051933, 0.214776, 2.217341, 1.313008, 1.488428, 3.59926),
        (-1.222437, -0.652178, 0.705392, 0.477004, -0.365431, -1.550025),
    ),
]
RUCKIG = (0.9143, 1.0798, 1.1058)  # [s] for these, version 0.15 with the limits of the robot
NEAR = 1.06


@pytest.mark.parametrize(("state", "ruckig"), list(zip(INTERRUPTIONS, RUCKIG, strict=True)))
def test_an_interruption_is_about_as_quick_as_can_be(state: tuple[tuple[float, ...], ...], ruckig: float) -> None:
    joints, velocity, acceleration, goal = state
    engine = Engine(MODEL)
    motion = Motion(1, Kind.JOINT, Start.AT, goal=goal, profile=Profile.SCURVE)
    segments = plan_motion(Problem(engine.arm, Here(JointState(joints, velocity, acceleration)), motion, 0.0))
    assert segments[-1].finish < NEAR * ruckig
    check_continuous(engine, segments)
    last = segments[-1]
    assert isinstance(last.path, JointPath)
    assert largest_change(last.path.joints(last.duration), goal) < 1e-9
    assert max(map(abs, last.path.velocity(last.duration))) < 1e-9


def _part(source: Random) -> Part:
    """A part in the middle of a motion that keeps its limits: what is left of its acceleration does not carry it above
    its greatest velocity.
    """
    acceleration, jerk = source.uniform(1.0, 10.0), source.uniform(10.0, 100.0)
    velocity = source.uniform(4.0, 20.0) * 0.5 * acceleration * acceleration / jerk
    a = acceleration * source.choice((0.0, 1.0, -1.0, 1.5, -1.5, source.uniform(-1.0, 1.0)))  # ACCEL may be lower now
    room = velocity - 0.5 * a * a / jerk
    v = source.choice((0.0, room, -room, source.uniform(-room, room)))
    way = source.choice((0.0, 1e-9, 1e-4, 0.1, 1.0, 5.0)) * source.uniform(-1.0, 1.0)
    return Part(way, v, a, velocity, acceleration, jerk, velocity)


def test_parts_arrive_together_inside_their_limits() -> None:
    source = Random(8)
    for _ in range(150):
        parts = [_part(source) for _ in range(source.randint(1, 6))]
        least = source.choice((0.0, 0.0, 3.0))
        courses = together(parts, least)
        wholes = {course.total for course in courses if not course.stops_at_once}
        assert len(wholes) <= 1
        assert min(wholes, default=least) >= least
        for part, course in zip(parts, courses, strict=True):
            _check(part, course_pieces(part, course))


def _check(part: Part, pieces: tuple[tuple[float, float], ...]) -> None:
    q, v, a = 0.0, part.velocity, part.acceleration
    for duration, jerk in pieces:
        assert abs(jerk) <= part.max_jerk * (1.0 + 1e-5)
        for share in (0.25, 0.5, 0.75, 1.0):
            _, speed, rate = state_after(q, v, a, share * duration, jerk)
            assert abs(speed) <= part.peak * (1.0 + 1e-5)
            assert abs(rate) <= max(part.max_acceleration, abs(part.acceleration)) * (1.0 + 1e-5)
        q, v, a = state_after(q, v, a, duration, jerk)
    assert abs(q - part.displacement) <= 1e-9
    assert abs(v) <= 1e-9
    assert abs(a) <= 1e-6
