"""First contacts: the model of a scene, and random motions among parts and fixtures, every other one with a part in the
hand. Needs mujoco-core.
"""

from __future__ import annotations

from random import Random
from statistics import mean
from typing import NamedTuple

from benchmarks.timeline import cpu
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.robot_file import load_robot

MOTIONS = 100
ROUNDS = 3


class Costs(NamedTuple):
    """Seconds of the processor: to make the model of a scene, and to check a motion."""

    scene: float
    motion: float


def costs() -> Costs:
    """Measure the PUMA: of each motion the least of some rounds."""
    from tests.contacts.cases import cases, random_scene  # MuJoCo is an extra
    from vrs_cli.contacts.checker import Checker

    arm, scene = arm_for(load_robot("puma560")), random_scene(Random(2))
    made = min(cpu(Checker(arm, scene).physics) for _ in range(ROUNDS))
    found = (min(cpu(case.found) for _ in range(ROUNDS)) for case in cases(Random(9), MOTIONS))
    return Costs(made, mean(found))


def main() -> None:
    made, motion = costs()
    print(f"model of a scene {1e3 * made:.1f} ms, first contact of a motion {1e3 * motion:.2f} ms")


if __name__ == "__main__":
    main()
