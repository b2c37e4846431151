"""EAIK: closed-form inverse kinematics in C++."""

from __future__ import annotations

from typing import Any

import numpy as np
from eaik.IK_DH import DhRobot

from benchmarks.peers.timing import at_once, each, serve


def measure(work: dict[str, Any]) -> dict[str, float]:
    """`alpha`, `a`, `d` of the links; `joints`, `poses` (4 x 4)."""
    robot = DhRobot(np.array(work["alpha"]), np.array(work["a"]), np.array(work["d"]))
    joints, poses = list(np.array(work["joints"])), list(np.array(work["poses"]))
    many = poses * 20
    return {
        "forward": each(robot.fwdKin, joints, rounds=5),
        "inverse": each(lambda pose: robot.IK(pose).Q, poses, rounds=5),
        "inverse many": at_once(lambda: robot.IK_batched(many, 1), len(many)),
    }


if __name__ == "__main__":
    serve(measure)
