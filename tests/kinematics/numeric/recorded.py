"""How far apart samples may be that are proved to be of one branch: `python -m tests.kinematics.numeric.recorded`.

`recorded_proofs.txt` has for each arm and each of some ways of the joints the greatest part of it that is proved in one
piece, and in several. The theorem gives bounds, so a part may become greater by a better proof, and never by chance.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from random import Random

import numpy as np

from tests.by_hand import command
from tests.recording import numbers, write_record
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.numeric.batch import Continuation, Cubic, Gaps
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import translation

RECORDED = Path(__file__).with_name("recorded_proofs.txt")
URDF = Path(__file__).parents[1] / "urdf"
ROBOTS = ("crooked.urdf", "gantry.urdf", "seven.urdf", "five.urdf", "short.urdf", "so100", "panda")
PIECES = (1, 2, 8, 64)
WAYS = 4
HALVINGS = 14
TOOL = translation(0.0, 0.0, 0.05)


def lines(robot: str) -> Iterator[str]:
    arm = arm_for(load_robot(URDF / robot if robot.endswith(".urdf") else robot)).for_tool(TOOL)
    random, middle = Random(robot), np.array([arm.model.lower, arm.model.upper]).mean(axis=0)
    for _ in range(WAYS):
        q = middle + np.array([random.uniform(-0.7, 0.7) for _ in middle])
        way = np.array([random.uniform(-0.5, 0.5) for _ in middle])
        bent = np.array([random.uniform(-0.1, 0.1) for _ in middle])
        bounds = [random.uniform(0.0, 0.1) for _ in range(6)]
        proved = of_closed(arm, q, way, bent, bounds) if isinstance(arm.continuation, Continuation) else None
        proved = proved or of_steady(arm, q, way, bounds)
        yield numbers(most(proved, pieces) for pieces in PIECES)


def most(proved: Callable[[float, int], bool], pieces: int) -> float:
    """The greatest part of a way that is proved in so many pieces."""
    low, high = 0.0, 1.0
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if proved(middle, pieces) else (low, middle)
    return low


def of_closed(
    arm: RobotArm, q: np.ndarray, way: np.ndarray, bent: np.ndarray, bounds: list[float]
) -> Callable[[float, int], bool]:
    proof, weights = arm.continuation, np.eye(len(q))[list(arm.still_joints)]
    assert isinstance(proof, Continuation)

    def proved(part: float, pieces: int) -> bool:
        begin, go, bend = q[None], part * way[None], part * part * bent[None]
        turn = np.array([[bound * part ** (k + 1) for k, bound in enumerate(bounds[:4])]])
        place, guide = (np.array([bound * part**4]) for bound in bounds[4:])
        gaps = Gaps(Cubic(begin, begin + go, go + bend, go - bend), place, turn, guide * len(weights), weights)
        return bool(proof.prove(gaps, pieces)[0])

    return proved


def of_steady(arm: RobotArm, q: np.ndarray, way: np.ndarray, bounds: list[float]) -> Callable[[float, int], bool]:
    from vrs_cli.kinematics.numeric.steady.batch import SteadyContinuation, SteadyGaps

    proof = arm.continuation
    assert isinstance(proof, SteadyContinuation)

    def proved(part: float, pieces: int) -> bool:
        begin, end = q[None], q[None] + part * way[None]
        turn = np.array([[bound * part ** (k + 1) for k, bound in enumerate(bounds[:4])]])
        twists = np.array([[arm.twist(tuple(one), tuple(part * way), TOOL) for one in (begin[0], end[0])]])
        place = np.array([bounds[4] * part**4])

        def poses(_which: np.ndarray, parts: np.ndarray) -> np.ndarray:
            return arm.batch.forward(begin + parts[:, None] * (end - begin)).reshape(1, len(parts), 3, 4)

        return bool(proof.prove(SteadyGaps(np.arange(1), begin, end, twists, place, turn, poses), pieces)[0])

    return proved


def main() -> None:
    write_record(RECORDED, {robot: lines(robot) for robot in ROBOTS})


if __name__ == "__main__":
    command(main)
