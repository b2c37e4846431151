"""Trajectories as tables for other programs. `EXPORTERS` lists the formats; each writes a stream in small pieces."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from math import ceil
from typing import TYPE_CHECKING, BinaryIO

import numpy as np

from vrs_cli.engine.position import Positions, positions_at
from vrs_cli.files.atomic import atomically
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.joints import JointUnits
from vrs_cli.kinematics.transform_batch import to_oat_batch
from vrs_cli.trajectory.timeline import Timeline

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]

CHUNK = 4096  # rows that are in memory at a time
DECIMALS = 9  # of degrees and millimetres
STANDARD_OUTPUT = "-"

TOOL_COLUMNS = ("x", "y", "z", "o", "a", "t_angle")


@dataclass(frozen=True, slots=True)
class Exporter:
    """A format: what `--to` calls it, the ending of its files, and who writes it (stream, arm, timeline, rate [Hz])."""

    name: str
    suffix: str
    summary: str
    write: Callable[[BinaryIO, RobotArm, Timeline, float], None]


def export(
    exporter: Exporter, path: str, standard_output: BinaryIO, arm: RobotArm, timeline: Timeline, rate: float
) -> None:
    """Write a file as a whole or not at all, or to `standard_output` when `path` is `-`. Raises FileError."""
    opened: AbstractContextManager[BinaryIO]
    opened = nullcontext(standard_output) if path == STANDARD_OUTPUT else atomically(path)
    with opened as stream:
        exporter.write(stream, arm, timeline, rate)


def sample_times(timeline: Timeline, rate: float) -> Iterator[Floats]:
    """start, start + 1/rate, ... and the exact end [s], in arrays of at most CHUNK + 1."""
    start, end = timeline.start, timeline.end
    count = ceil((end - start) * rate)
    for first in range(0, count, CHUNK):
        times = start + np.arange(first, min(first + CHUNK, count)) / rate
        yield times[times < end]
    yield np.array([end])


# --- CSV -----------------------------------------------------------------------------------------------------


def write_csv(stream: BinaryIO, arm: RobotArm, timeline: Timeline, rate: float) -> None:
    """Columns t [s], jt1 ... jtn [deg, mm where a joint slides], x, y, z [mm], o, a, t_angle [deg].

    Rows as `sample_times`. Times are written to their last bit, so that they name the same instant when they are read
    back.
    """
    joints = arm.model.joint_count
    stream.write(_line(",".join(("t", *(f"jt{i}" for i in range(1, joints + 1)), *TOOL_COLUMNS))))
    form = ",".join(["%r"] + [f"%.{DECIMALS}f"] * (joints + len(TOOL_COLUMNS)))
    for times in sample_times(timeline, rate):
        rows = table(positions_at(arm, timeline, times), arm.model.units)
        stream.write(b"".join(_line(form % tuple(row)) for row in rows.tolist()))


def table(positions: Positions, units: JointUnits) -> Floats:
    """(N, 1 + n + 6): t [s], joints [deg, mm], x, y, z [mm], o, a, t [deg]; degrees and millimetres are rounded."""
    T = positions.T_world_tool
    columns = (shown_joints(positions.joints, units), T[:, :, 3] * 1000.0, np.degrees(to_oat_batch(T)))
    shown = np.round(np.hstack(columns), DECIMALS) + 0.0  # there is no -0
    return np.hstack((positions.times[:, None], shown))


def shown_joints(q: Floats, units: JointUnits) -> Floats:
    """(N, n): [rad, m] -> [deg, mm]; rates likewise."""
    slides = [units.slides(joint) for joint in range(1, q.shape[1] + 1)]
    return np.where(slides, q * 1000.0, np.degrees(q))


def _line(text: str) -> bytes:
    return text.encode("ascii") + b"\n"


EXPORTERS: Mapping[str, Exporter] = {
    exporter.name: exporter
    for exporter in (Exporter("csv", ".csv", "a table of joints and tool positions, one row a sample", write_csv),)
}
