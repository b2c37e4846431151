"""The samples of an export: their times, and the names of the joints."""

from __future__ import annotations

from collections.abc import Iterator
from math import ceil

import numpy as np

from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.arrays import Floats
from vrs_cli.trajectory.timeline import Timeline

CHUNK = 4096  # rows that are in memory at a time
NANOSECONDS = 1_000_000_000  # in a second


def sample_times(timeline: Timeline, rate: float) -> Iterator[Floats]:
    """start, start + 1/rate, ... and the exact end [s], in arrays of at most CHUNK + 1."""
    start, end = timeline.start, timeline.end
    count = ceil((end - start) * rate)
    for first in range(0, count, CHUNK):
        times = start + np.arange(first, min(first + CHUNK, count)) / rate
        yield times[times < end]
    yield np.array([end])


def joint_names(arm: RobotArm) -> list[str]:
    """jt1, jt2, ..."""
    return [f"jt{i}" for i in range(1, arm.model.joint_count + 1)]


def nanoseconds(times: Floats) -> list[int]:
    """(N,) [s] as whole nanoseconds."""
    return [round(t * NANOSECONDS) for t in times.tolist()]
