"""A place that was taught can always be gone back to: from READY, by MOVE, with the words it was taught under.

`python -m tests.laws.taught_places POSES ARMS [FILE ...]` draws so many poses of each of so many random arms (seeded,
4 to 7 joints, with kinematics of their own), and of the robots of the files; it prints what is refused.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory
from time import process_time

import numpy as np
from numpy.typing import NDArray

from tests.by_hand import command
from tests.kinematics.random_arms import draw_arm
from vrs_cli.errors import MotionError
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.model import ALL_PARTS, ArmTask, RobotModel
from vrs_cli.kinematics.transform import Transform

PLACE = 2e-4  # [m, 1] of an arm of few joints, which is there when two decimals of a degree tell no difference
FULL = 1e-8  # of all others
FEWEST, MOST = 4, 7  # joints
COUNTING = {
    ArmTask.POINTING: (2, 3),
    ArmTask.POSITION: (3,),
    ArmTask.POINT: (3,),
}  # columns of a pose; of other tasks all

Forward = Callable[[Joints], NDArray[np.float64]]


def refused(
    model: RobotModel, forward: Forward, poses: int, source: Random
) -> Iterator[tuple[Joints, MotionError | AssertionError]]:
    """What a MOVE back to each of so many poses says, where it is refused or leads elsewhere."""
    arm = arm_for(model)
    for _ in range(poses):
        q = tuple(source.uniform(low, high) for low, high in zip(model.lower, model.upper, strict=True))
        try:
            check_way_back(arm, q, forward)
        except (MotionError, AssertionError) as error:
            yield q, error


def check_way_back(arm: RobotArm, q: Joints, forward: Forward) -> None:
    """Raises MotionError for a place that is refused."""
    place, words = forward(q), arm.configuration(q)
    T = Transform(*place.ravel().tolist())
    found = arm.select(T, arm.model.poses["ready"], words)
    assert arm.limits_ok(found)
    counting = list(COUNTING.get(arm.model.task, range(4)))
    missed = np.abs(forward(found) - place)[:, counting].max()
    assert missed < (FULL if len(q) >= ALL_PARTS else PLACE), (q, found, missed)
    assert arm.configuration(found) in (words, *arm.twins(found))


def main(poses: int, arms: int, robots: Sequence[RobotModel] = ()) -> None:
    for model in robots:
        own = arm_for(model).forward
        _show(model.name, model, lambda q, own=own: np.reshape(own(q), (3, 4)), poses)
    for seed in range(arms):
        drawn = draw_arm(Random(seed), FEWEST + seed % (MOST - FEWEST + 1))
        with TemporaryDirectory() as folder:
            _show(f"arm {seed}", drawn.model(Path(folder)), drawn.forward, poses)


def _show(name: str, model: RobotModel, forward: Forward, poses: int) -> None:
    begin = process_time()
    found = list(refused(model, forward, poses, Random(560)))
    cost = 1000 * (process_time() - begin) / poses
    method = arm_for(model).method
    print(
        f"{name}: {model.joint_count} joints, {method}: {len(found)} of {poses} refused, {cost:.1f} ms each", flush=True
    )
    for q, error in found[:3]:
        print("   ", q, error, flush=True)


if __name__ == "__main__":
    command(main)
