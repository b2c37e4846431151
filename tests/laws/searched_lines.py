"""Random lines of arms without a closed form: no joint jumps, and joints lead to every place.

`python -m tests.laws.searched_lines LINES ROBOT...` tries so many lines of each robot, and prints the seed of each
that breaks a law, and how many were possible. A robot is a name or a file: those with four and five joints are the
hardest (`docs/robots.md` names packages that have some). Status 1 where a law is broken.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot
from random import Random

import numpy as np

from tests.by_hand import command
from tests.laws.lines import count_faults
from vrs_cli.engine.breaches import on_lines
from vrs_cli.engine.position import joints_over
from vrs_cli.engine.problem import Here, Problem
from vrs_cli.engine.single_motion import plan_motion
from vrs_cli.errors import MotionError
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.joints import Joints, Profile
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.transform import Transform, at_position, compose, position, rotation_about
from vrs_cli.trajectory.state import JointState
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.commands import Motion, MotionKind, Start

READINGS = 2000  # of a line at least
STEP = 1e-3  # [s] between two readings at most
FASTER = 1.01  # times its limit: what no joint is
JUMP = 1e-4  # [rad, m] beyond that


def check_line(model: RobotModel, seed: int) -> bool:
    """Every law for one line; whether it is possible."""
    arm, random = arm_for(model), Random(seed)
    begin = _anywhere(model, random)
    motion = Motion(
        1,
        MotionKind.STRAIGHT,
        Start.AT,
        pose=_end(arm, begin, random),
        profile=random.choice(list(Profile)),
        speed=random.choice((1.0, 0.5, 0.2, 0.05)),
    )
    try:
        segments = plan_motion(Problem(arm, Here(JointState(begin, (0.0,) * len(begin))), motion, 0.0))
    except MotionError:
        return False
    timeline = Timeline(segments)
    times = np.linspace(0.0, timeline.end, max(READINGS, int(timeline.end / STEP)))
    ways = np.abs(np.diff(joints_over(arm, timeline, times), axis=0))
    beyond = ways - FASTER * times[1] * np.array(model.max_velocity)
    assert beyond.max() < JUMP, f"a joint jumps by {ways.max()} rad"
    told = [breach.what for breach in on_lines(arm, timeline)]
    assert not told, told
    return True


def _anywhere(model: RobotModel, random: Random) -> Joints:
    return tuple(random.uniform(low, high) for low, high in zip(model.lower, model.upper, strict=True))


def _end(arm: RobotArm, begin: Joints, random: Random) -> Transform:
    """Of joints near by, of any, or beside where the tool is, turned or not."""
    model, kind = arm.model, random.random()
    if kind < 0.3:
        return arm.forward(_anywhere(model, random))
    if kind < 0.7:
        part = 10.0 ** random.uniform(-2.5, -0.5)
        rows = zip(begin, model.lower, model.upper, strict=True)
        near = [min(max(q + random.gauss(0.0, part) * (high - low), low), high) for q, low, high in rows]
        return arm.forward(tuple(near))
    pose, way, size = arm.forward(begin), _direction(random), random.choice((0.02, 0.05, 0.1, 0.2))
    there = at_position(pose, *(p + size * w for p, w in zip(position(pose), way, strict=True)))
    return compose(there, rotation_about(_direction(random), random.choice((0.0, random.uniform(-1.0, 1.0)))))


def _direction(random: Random) -> tuple[float, float, float]:
    x, y, z = (random.gauss(0.0, 1.0) for _ in range(3))
    size = hypot(x, y, z)
    return x / size, y / size, z / size


def main(lines: int, robots: Sequence[RobotModel]) -> int:
    return 1 if sum([count_faults(model, check_line, range(lines)) for model in robots]) else 0


if __name__ == "__main__":
    command(main)
