"""The simulated arm of `vrs body --mujoco`, the PUMA 560: how many times as fast as real time it follows random motions
with its controller at 1 kHz, and how far it is off. Needs mujoco-core.
"""

from __future__ import annotations

from time import process_time
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from benchmarks.engine import MODEL, wandering
from vrs_cli.engine.engine import Engine
from vrs_cli.engine.position import joint_state_at, positions_at
from vrs_cli.kinematics.arrays import Floats
from vrs_cli.values.measured import Report

if TYPE_CHECKING:
    from vrs_cli.bodies.mujoco_arm import MujocoArm

SECONDS = 60.0  # of the robot's clock
MOTIONS = 60
ROUNDS = 3


class Following(NamedTuple):
    """An engine, what a body reported that follows its timeline, and the time that took the processor [s]."""

    engine: Engine
    reports: list[Report]
    seconds: float


def followed() -> Following:
    """Let an arm follow random motions for SECONDS."""
    from vrs_cli.bodies.mujoco_arm import MujocoArm  # MuJoCo is an extra

    return _follow(wandering(MOTIONS), MujocoArm(MODEL))


def _follow(engine: Engine, arm: MujocoArm) -> Following:
    assert engine.end > SECONDS
    begun = process_time()
    reports = arm.advance(SECONDS, lambda t: joint_state_at(engine.arm, engine.timeline, t))
    return Following(engine, reports, process_time() - begun)


def errors(it: Following) -> Floats:
    """Return how far the joints were off at each report, (N, n) [rad]."""
    planned = positions_at(it.engine.arm, it.engine.timeline, np.array([one.t for one in it.reports])).joints
    return np.abs(np.array([one.joints for one in it.reports]) - planned)


def times_real_time() -> float:
    return SECONDS / min(followed().seconds for _ in range(ROUNDS))


def main() -> None:
    off = np.degrees(errors(followed()))
    print(f"the simulated PUMA 560: {times_real_time():.1f} times as fast as real time")
    print(f"off by {np.sqrt((off**2).mean()):.4f} deg (rms of all joints), {off.max():.4f} deg at most")


if __name__ == "__main__":
    main()
