"""Random straight lines out of any state of motion, many of them next to a straight wrist: harder than a session.

`python -m tests.laws.lines ROBOT SEEDS [FIRST]` prints the seed of every line that breaks a law; status 1 then.
"""

from __future__ import annotations

import traceback
from collections.abc import Callable
from random import Random

from tests.by_hand import command
from tests.laws.motion_laws import check_continuous, check_limits
from vrs_cli.engine.engine import Engine
from vrs_cli.engine.problem import Here, NoRoomToStop, Problem
from vrs_cli.engine.single_motion import plan_motion
from vrs_cli.errors import MotionError
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.joints import Joints, Profile
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.trajectory.state import JointState
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.commands import Motion, MotionKind, Start

WRIST = 4  # joint 5 by its index: the arm is singular where it is 0, unless its wrist is another


def random_problem(arm: RobotArm, seed: int) -> Problem:
    """A straight line to plan, from any state of motion."""
    random, model = Random(seed), arm.model
    profile = random.choice((Profile.LSPB, Profile.SCURVE, Profile.SCURVE))
    state = _state(random, model, profile)
    pose = arm.forward(_goal(random, model, state.joints))
    speed = random.uniform(0.2, 1.0)
    rate = random.uniform(0.4, 1.0)
    motion = Motion(
        1, MotionKind.STRAIGHT, Start.AT, pose=pose, speed=speed, rotation=speed, acceleration=rate, profile=profile
    )
    return Problem(arm, Here(state), motion, 0.0)


def check_line(model: RobotModel, seed: int) -> bool:
    """Every law for one line; whether it is possible."""
    engine = Engine(model)
    try:
        segments = plan_motion(random_problem(engine.arm, seed))
    except (MotionError, NoRoomToStop):
        return False
    engine.book.timeline = Timeline(segments)
    check_continuous(engine, segments)
    check_limits(engine, segments)
    return True


def _state(random: Random, model: RobotModel, profile: Profile) -> JointState:
    """Anywhere, as often as not with a wrist that is nearly straight; at rest or in motion."""
    q = [low + random.uniform(0.15, 0.85) * (high - low) for low, high in zip(model.lower, model.upper, strict=True)]
    if len(q) > WRIST and random.random() < 0.5:
        q[WRIST] = _bent(random)
    if random.random() < 0.4:
        return JointState(tuple(q), (0.0,) * len(q))
    velocity = tuple(random.uniform(-0.6, 0.6) * most for most in model.max_velocity)
    acceleration = tuple(random.uniform(-0.6, 0.6) * most for most in model.max_acceleration)
    smoothly = profile is Profile.SCURVE and random.random() < 0.7
    return JointState(tuple(q), velocity, acceleration if smoothly else ())


def _goal(random: Random, model: RobotModel, start: Joints) -> Joints:
    rows = zip(start, model.lower, model.upper, strict=True)
    q = [min(max(at + random.gauss(0.0, 0.08) * (high - low), low), high) for at, low, high in rows]
    if len(q) > WRIST and random.random() < 0.25:
        q[WRIST] = _bent(random)
    return tuple(q)


def _bent(random: Random) -> float:
    """How far a wrist is bent that is nearly straight [rad]."""
    return float(random.choice((-1.0, 1.0)) * 10.0 ** random.uniform(-3.0, -0.7))


def main(robot: RobotModel, seeds: int, first: int = 0) -> int:
    return 1 if count_faults(robot, check_line, range(first, first + seeds)) else 0


def count_faults(model: RobotModel, check: Callable[[RobotModel, int], bool], seeds: range) -> int:
    """Check a line for each seed, and tell of each fault. `check`: whether the line was possible."""
    done = faults = 0
    for seed in seeds:
        try:
            done += check(model, seed)
        except Exception:
            faults += 1
            print(f"--- {model.name}, seed {seed}\n{traceback.format_exc()}", flush=True)
    print(f"{model.name}: {done} lines of {len(seeds)}, {faults} faults", flush=True)
    return faults


if __name__ == "__main__":
    command(main)
