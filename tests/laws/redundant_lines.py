"""Straight lines of arms of seven joints beside a follower that integrates velocities, the usual way.

`python -m tests.laws.redundant_lines [LINES]` prints a row for each arm: how many random lines of 200 mm, from
anywhere, the follower and the planner can do, the greatest part of a limit of a joint that a planned line uses at 1
kHz, and what planning costs. Status 1 where the planner can do fewer lines, or a limit is exceeded.

The follower takes the pseudo-inverse of its own Jacobian at 400 places of a line, with a part of the gradient towards
the middle of the ranges in the null space (Liegeois 1977). It is asked for less than the planner: the tip goes at
50 mm/s, no acceleration is limited, and the best of several parts counts.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from math import hypot
from random import Random
from typing import NamedTuple

import numpy as np

from tests.by_hand import command
from tests.kinematics.seven_joints import ARMS, seven_joints
from vrs_cli.engine.engine import Engine
from vrs_cli.engine.position import positions_at
from vrs_cli.engine.problem import Here, Problem
from vrs_cli.engine.single_motion import plan_motion
from vrs_cli.errors import MotionError
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.joints import LIMIT_TOLERANCE, Joints, Profile
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.transform import Transform, at_position, position
from vrs_cli.trajectory.segment import Segment
from vrs_cli.trajectory.state import JointState
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.commands import Motion, MotionKind, Start

LINES = 60
WAY = 0.2  # [m]
INSIDE = 0.1  # of a range at both ends, in which no line begins
PARTS = (0.0, 0.5, 1.0, 2.0)  # of the gradient
STEPS = 400
SPEED = 0.05  # [m/s]
MISS = 1e-3  # [m] at the end of a line
KILOHERTZ = 1e-3  # [s]
LIMIT = 1.0005


class Line(NamedTuple):
    """Where it begins, and T_robot_flange at its end."""

    begin: Joints
    end: Transform


def random_lines(arm: RobotArm, count: int, seed: int = 7) -> Iterator[Line]:
    """From anywhere in the ranges, in any direction; the tool does not turn."""
    random, limits = Random(seed), list(zip(arm.model.lower, arm.model.upper, strict=True))
    for _ in range(count):
        q = tuple(low + random.uniform(INSIDE, 1.0 - INSIDE) * (high - low) for low, high in limits)
        way = [random.gauss(0.0, 1.0) for _ in range(3)]
        pose = arm.forward(q)
        yield Line(q, at_position(pose, *(x + WAY * d / hypot(*way) for x, d in zip(position(pose), way, strict=True))))


# --- the follower ------------------------------------------------------------------------------------------------


def followed(arm: RobotArm, line: Line, steps: int = STEPS) -> bool:
    """Whether the follower can do a line, with one part of the gradient or another."""
    return any(_followed(arm, line, part, steps) for part in PARTS)


def _followed(arm: RobotArm, line: Line, part: float, steps: int) -> bool:
    model, q, dt = arm.model, np.array(line.begin), WAY / SPEED / steps
    lower, upper, fastest = (np.array(row) for row in (model.lower, model.upper, model.max_velocity))
    ranges = upper - lower
    pose, end = _pose(arm, q), np.reshape(line.end, (3, 4))
    for k in range(1, steps + 1):
        here, J = _pose(arm, q), np.array(arm.jacobian(tuple(q)))
        missing = pose[:, 3] + (end[:, 3] - pose[:, 3]) * k / steps - here[:, 3]
        turn = 0.5 * np.cross(here[:, :3], pose[:, :3], axis=0).sum(axis=1)
        inverse = np.linalg.pinv(J, rcond=1e-4)
        inward = part * (0.5 * (lower + upper) - q) * (ranges.mean() / ranges) ** 2
        step = inverse @ np.concatenate((missing, turn)) + (inward - inverse @ (J @ inward)) * dt
        q = q + step
        if (np.abs(step) > fastest * dt).any() or (q < lower).any() or (q > upper).any():
            return False
    return bool(np.linalg.norm(_pose(arm, q)[:, 3] - end[:, 3]) < MISS)


def _pose(arm: RobotArm, q: np.ndarray) -> np.ndarray:
    return np.reshape(arm.forward(tuple(q.tolist())), (3, 4))


# --- the planner -------------------------------------------------------------------------------------------------


def planned(arm: RobotArm, line: Line, profile: Profile = Profile.LSPB) -> tuple[Segment, ...] | None:
    motion = Motion(1, MotionKind.STRAIGHT, Start.AT, pose=line.end, profile=profile)
    begin = Here(JointState(line.begin, (0.0,) * len(line.begin)))
    try:
        return plan_motion(Problem(arm, begin, motion, 0.0))
    except MotionError:
        return None


def largest_load(model: RobotModel, segments: tuple[Segment, ...], step: float = KILOHERTZ) -> float:
    """The greatest part of its limits that a joint uses, looked at in steps [s]: velocity, acceleration, with SCURVE
    jerk. Infinite where one leaves its range.
    """
    engine = Engine(model)
    engine.book.timeline = Timeline(segments)
    found = positions_at(engine.arm, engine.timeline, np.arange(0.0, engine.end, step))
    beyond = (found.joints < np.array(model.lower) - LIMIT_TOLERANCE) | (
        found.joints > np.array(model.upper) + LIMIT_TOLERANCE
    )
    if beyond.any():
        return np.inf
    loads = [
        np.abs(found.velocity / np.array(model.max_velocity)).max(),
        np.abs(found.acceleration / np.array(model.max_acceleration)).max(),
        np.abs(np.diff(found.joints, axis=0) / step / np.array(model.max_velocity)).max(),
    ]
    if segments[0].motion.profile is Profile.SCURVE:
        jerks = np.diff(found.acceleration, axis=0) / step
        loads.append(np.abs(jerks / np.array(model.max_jerk)).max())
    return float(max(loads))


def main(count: int = LINES) -> int:
    print("arm      lines  follower  planner  largest load  with SCURVE  ms a line  ms a refusal")
    worse = False
    for name in ARMS:
        model = seven_joints(name)
        arm = arm_for(model)
        lines = list(random_lines(arm, count))
        follower = sum([followed(arm, line) for line in lines])
        costs: dict[bool, list[float]] = {True: [0.0], False: [0.0]}
        loads, smooth = [0.0], [0.0]
        for line in lines:
            begun = time.process_time()
            segments = planned(arm, line)
            costs[segments is not None].append(1e3 * (time.process_time() - begun))
            if segments is not None:
                loads.append(largest_load(model, segments))
                gently = planned(arm, line, Profile.SCURVE)
                smooth.append(np.inf if gently is None else largest_load(model, gently))
        took, refused = (float(np.median(costs[done][1:] or [0.0])) for done in (True, False))
        row = len(loads) - 1, max(loads), max(smooth), took, refused
        print(f"{name:8} {count:5} {follower:9} {row[0]:8} {row[1]:13.4f} {row[2]:12.4f} {row[3]:10.1f} {row[4]:13.1f}")
        worse = worse or row[0] < follower or max(row[1:3]) > LIMIT
    return int(worse)


if __name__ == "__main__":
    command(main)
