"""Lines of random arms of four and five joints: the place exact, the tool as steady as can be, all limits kept.

A long run: `python -m tests.laws.short_arms SEEDS [FIRST]`. Prints how many lines were possible.
"""

from __future__ import annotations

from itertools import product
from random import Random

import numpy as np
import pytest
from msgspec import structs

from tests.by_hand import command
from tests.kinematics.short_arms import Array, forward, random_arm
from vrs_cli.engine.engine import Engine
from vrs_cli.engine.position import joints_over
from vrs_cli.errors import MotionError
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.transform import (
    IDENTITY,
    Transform,
    at_position,
    compose,
    position,
    rotation_about,
    translation,
)
from vrs_cli.values.commands import Move, PoseTarget, SetTool

STEP = 1e-3  # [s]
HONEST = 1.001  # of a velocity limit, by differences of positions
TOOLS = (IDENTITY, translation(0.03, 0.0, 0.08))


def middling(model: RobotModel, random: Random) -> Joints:
    return tuple(
        low + random.uniform(0.25, 0.75) * (high - low) for low, high in zip(model.lower, model.upper, strict=True)
    )


def beside(T: Transform, random: Random) -> Transform:
    """A pose 20 to 80 mm away, turned or not."""
    way = np.array([random.gauss(0.0, 1.0) for _ in range(3)])
    x, y, z = np.array(position(T)) + way / np.linalg.norm(way) * random.choice((0.02, 0.05, 0.08))
    return compose(at_position(T, x, y, z), rotation_about((0.0, 0.0, 1.0), random.choice((0.0, 0.0, 0.2))))


def tips(model: RobotModel, joints: Array, tool: Transform) -> Array:
    lever = np.array(position(tool))
    poses = [forward(model, q) for q in joints]
    return np.array([T[:3, :3] @ lever + T[:3, 3] for T in poses])


def check_way(engine: Engine, tool: Transform, begin: float, goal: Transform) -> None:
    """At 1 kHz, from joints and kinematics that are not those of the robot."""
    model = engine.model
    times = np.append(np.arange(begin, engine.end, STEP), engine.end)
    joints = joints_over(engine.arm, engine.timeline, times)
    velocity = np.diff(joints, axis=0)[:-1] / STEP
    assert (np.abs(velocity) <= np.array(model.max_velocity) * HONEST).all()
    assert (np.abs(np.diff(velocity, axis=0)) / STEP <= np.array(model.max_acceleration) * 1.02).all()
    assert (joints >= np.array(model.lower) - 1e-9).all()
    assert (joints <= np.array(model.upper) + 1e-9).all()
    places = tips(model, joints[::40], tool)
    way = np.array(position(goal)) - places[0]
    along = (places - places[0]) @ way / (way @ way)
    assert np.abs(places - places[0] - along[:, None] * way).max() < 1e-8
    assert (np.diff(along) > -1e-9).all()
    assert tips(model, joints[-1:], tool)[0] == pytest.approx(position(goal), abs=1e-8)


def lines_there_and_back(seed: int, joints: int, profile: str, tool: Transform) -> bool:
    """Whether a random line was possible; then it kept every law."""
    random, model = Random(seed), structs.replace(random_arm(seed, joints), profile=profile)
    start = middling(model, random)
    engine = Engine(model, start=start)
    engine.perform(SetTool(tool))
    T = compose(engine.arm.forward(start), tool)
    goal = beside(T, random)
    for pose in (goal, T):
        begin = engine.end
        try:
            engine.perform(Move(PoseTarget(pose), straight=True))
        except MotionError:
            return False
        check_way(engine, tool, begin, pose)
    assert engine.position(engine.end).joints == pytest.approx(start, abs=1e-8)  # a way that closes
    return True


def main(seeds: int, first: int = 1) -> None:
    kinds = product(range(first, first + seeds), (4, 5), ("LSPB", "SCURVE", "QUINTIC"), TOOLS)
    done = [lines_there_and_back(*kind) for kind in kinds]
    print(f"{sum(done)} of {len(done)} lines there and back were possible, and kept every law")


if __name__ == "__main__":
    command(main)
