"""Random streams of targets, as `vrs lab steer` feeds them: none is an error, and no joint leaves its range.

`python -m tests.laws.streams COUNT [FIRST] [ROBOT ...]` shares so many streams among the robots, and prints the seed of
every stream that broke the law; status 1 then.
"""

from __future__ import annotations

import traceback
from collections.abc import Sequence
from contextlib import suppress
from itertools import cycle
from math import radians
from random import Random

from tests.by_hand import command
from vrs_cli.engine.engine import Engine
from vrs_cli.errors import MotionError
from vrs_cli.interfaces.streams import Steering
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.joints import Joints, put_inside
from vrs_cli.kinematics.model import PROFILES, RobotModel
from vrs_cli.kinematics.robot_file import load_robot, robot_names
from vrs_cli.trajectory.segment import stay_inside
from vrs_cli.values.commands import SetParameter

GAPS = (0.005, 0.01, 0.02, 0.05, 0.1, 0.25, 0.4, 0.5)  # [s] between targets
BEYOND = radians(5.0)  # of a range, that a target may lie outside


def check_stream(arm: RobotArm, seed: int) -> int:
    """The number of targets of a stream that kept the law."""
    random, model = Random(seed), arm.model
    here = put_inside(_target(random, model), model.lower, model.upper)
    engine = Engine(model, start=random.choice((None, here, here)))
    engine.perform(SetParameter("PROFILE", random.choice(("LSPB", *PROFILES))))
    steering = Steering(engine, speed=random.choice((1.0, 1.0, 0.3, 0.01)))
    jumps, walk = random.choice((0.1, 1.0)), random.choice((0.0, 0.01, 0.1))
    poses, gap = random.random() < 0.01, random.choice(GAPS)
    t, targets = random.choice((0.0, 0.0, gap)), random.randint(2, 8)
    for _ in range(targets):
        with suppress(MotionError):  # of a pose out of reach
            steering.to(arm.forward(here) if poses else here, t)
        if random.random() < 0.2:
            gap = random.choice(GAPS)
        t += gap * random.choice((1.0, 1.0, 1.0, random.uniform(0.3, 1.0)))
        here = _target(random, model) if random.random() < jumps else _beside(random, model, here, walk)
    steering.finish()
    assert stay_inside(engine.timeline, model.lower, model.upper)
    return targets


def _target(random: Random, model: RobotModel) -> Joints:
    """Anywhere, often at the end of a range or a little beyond it."""
    rows = zip(model.lower, model.upper, strict=True)
    return tuple([random.choice((low, high, high + BEYOND, *_between(random, low, high))) for low, high in rows])


def _between(random: Random, low: float, high: float) -> tuple[float, float, float]:
    return random.uniform(low, high), random.uniform(low, high), min(max(0.0, low), high)


def _beside(random: Random, model: RobotModel, here: Joints, walk: float) -> Joints:
    rows = zip(here, model.lower, model.upper, strict=True)
    return tuple([q + random.gauss(0.0, walk) * (high - low) for q, low, high in rows])


def main(count: int, first: int = 0, robots: Sequence[RobotModel] = ()) -> int:
    arms = [arm_for(model) for model in robots or map(load_robot, robot_names())]
    targets, faults = 0, 0
    for seed, arm in zip(range(first, first + count), cycle(arms)):
        try:
            targets += check_stream(arm, seed)
        except Exception:
            faults += 1
            print(f"--- {arm.model.name}, seed {seed}\n{traceback.format_exc()}", flush=True)
    print(f"{count} streams of {targets} targets, {faults} faults", flush=True)
    return 1 if faults else 0


if __name__ == "__main__":
    command(main)
