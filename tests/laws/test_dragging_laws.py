"""A tool that is dragged anyhow, beyond its reach and through singularities: no limit is exceeded, nothing jumps, the
elbow stays, what is said to hold it does, and it goes on from wherever it is held.
"""

from __future__ import annotations

from math import pi, sin
from pathlib import Path
from random import Random

import pytest

from tests.examples import some
from tests.laws.drags import TICK, Hand, flange_of
from vrs_cli.engine.engine import Engine
from vrs_cli.interfaces.dragging import Dragging
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.nearest import Aim, Miss
from vrs_cli.kinematics.robot_file import load_robot, robot_names

URDF = Path(__file__).parent.parent / "kinematics" / "urdf"
SOME = some(4) // 2  # seeds
RMS = Miss(0.004, 0.015)  # [m, rad] of a tool that follows a hand inside its reach
PULSE = 0.5  # [Hz] of the fastest joint of a hand


@pytest.mark.parametrize("seed", range(1, 1 + SOME))
@pytest.mark.parametrize("name", [*robot_names(), "crooked.urdf", "seven.urdf"])
def test_a_tool_that_is_dragged_anyhow_keeps_the_laws(name: str, seed: int) -> None:
    model = load_robot(URDF / name if name.endswith(".urdf") else name)
    hand = Hand(seed, model, ("LSPB", "SCURVE")[seed % 2])
    hand.drag(3.0)
    hand.settle()


@pytest.mark.parametrize("name", robot_names())
def test_inside_its_reach_it_follows_a_hand(name: str) -> None:
    rms = follow(load_robot(name), 1, 5.0)
    assert rms.within(*RMS), rms


def follow(model: RobotModel, seed: int, seconds: float) -> Miss:
    """Wishes on a smooth way through joints of one configuration: the root of the mean squared miss."""
    arm, source = arm_for(model), Random(seed)
    ranges = list(zip(model.lower, model.upper, strict=True))
    while True:
        middle = tuple(low + (high - low) * source.uniform(0.3, 0.7) for low, high in ranges)
        if min(arm.singularity(middle)) > 0.4:
            break
    sizes = [min(0.12 * (high - low), 0.17) for low, high in ranges]
    beats = [(source.uniform(0.2, PULSE), source.uniform(0.0, 6.0)) for _ in ranges]
    engine = Engine(model, start=middle)
    dragging, misses = Dragging(engine), list[Miss]()
    while engine.now < seconds:
        t = engine.now
        grown = min(1.0, t / 2.0)
        q = tuple(x + grown * a * sin(2.0 * pi * f * t + p) for x, a, (f, p) in zip(middle, sizes, beats, strict=True))
        wish = engine.world_pose(q)
        assert not dragging.to(wish).holds
        misses.append(Aim(arm, flange_of(engine, wish)).miss(engine.position().joints))
        engine.clock.advance(t + TICK)
    mean = [sum(x * x for x in column) / len(misses) for column in zip(*misses, strict=True)]
    return Miss(mean[0] ** 0.5, mean[1] ** 0.5)
