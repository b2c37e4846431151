"""Trajectories in the formats of other programs. `EXPORTERS` lists them; each writes a stream in small pieces."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, ExitStack, nullcontext
from shutil import copyfileobj
from tempfile import TemporaryFile
from typing import IO, TYPE_CHECKING, BinaryIO
from zipfile import ZipFile

import numpy as np
from msgspec import Struct

from vrs_cli.engine.position import Places, Positions, places_at, positions_at
from vrs_cli.files.atomic import atomically
from vrs_cli.files.mcap_log import check_mcap, write_mcap
from vrs_cli.files.samples import CHUNK, NANOSECONDS, joint_names, nanoseconds, sample_times
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.joints import JointUnits
from vrs_cli.kinematics.transform_batch import to_oat_batch
from vrs_cli.trajectory.polynomial import Polynomial
from vrs_cli.trajectory.segment import CartesianPath, JointPath, Segment
from vrs_cli.trajectory.timeline import Timeline

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from vrs_cli.kinematics.arrays import Floats


DECIMALS = 9  # of degrees and millimetres
STANDARD_OUTPUT = "-"

TOOL_COLUMNS = ("x", "y", "z", "o", "a", "t_angle")


def _nothing_missing() -> None:
    """What most formats need is always there."""


class Exporter(Struct, frozen=True):
    """A format: what `--to` calls it, the ending of its files, and who writes it (stream, arm, timeline, number).

    The number is a rate [Hz], or the time [s] of what shows one moment.
    `check` raises UsageError where a package is missing; `usual`: the number for a timeline where none is given.
    """

    name: str
    suffix: str
    summary: str
    write: Callable[[BinaryIO, RobotArm, Timeline, float], None]
    check: Callable[[], None] = _nothing_missing
    usual: Callable[[Timeline], float] | None = None  # the rate of tables
    of_moment: bool = False


def export(
    exporter: Exporter, path: str, standard_output: BinaryIO, arm: RobotArm, timeline: Timeline, number: float
) -> None:
    """Write a file as a whole or not at all, or to `standard_output` when `path` is `-`. Raises FileError."""
    opened: AbstractContextManager[BinaryIO]
    opened = nullcontext(standard_output) if path == STANDARD_OUTPUT else atomically(path)
    with opened as stream:
        exporter.write(stream, arm, timeline, number)


# --- CSV -----------------------------------------------------------------------------------------------------


def write_csv(stream: BinaryIO, arm: RobotArm, timeline: Timeline, rate: float) -> None:
    """Columns t [s], jt1 ... jtn [deg, mm where a joint slides], x, y, z [mm], o, a, t_angle [deg].

    Rows as `sample_times`. Times are written to their last bit, so that they name the same instant when they are read
    back.
    """
    columns = ("t", *joint_names(arm), *TOOL_COLUMNS)
    stream.write(f"{','.join(columns)}\n".encode("ascii"))
    form = ",".join(["%r"] + [f"%.{DECIMALS}f"] * (len(columns) - 1)) + "\n"
    for times in sample_times(timeline, rate):
        rows = table(places_at(arm, timeline, times), arm.model.units)
        stream.write((form * len(rows) % tuple(rows.ravel().tolist())).encode("ascii"))


def table(places: Places, units: JointUnits) -> Floats:
    """(N, 1 + n + 6): t [s], joints [deg, mm], x, y, z [mm], o, a, t [deg]; degrees and millimetres are rounded."""
    T = places.T_world_tool
    columns = (shown_joints(places.joints, units), T[:, :, 3] * 1000.0, np.degrees(to_oat_batch(T)))
    shown = np.round(np.hstack(columns), DECIMALS) + 0.0  # there is no -0
    return np.hstack((places.times[:, None], shown))


def shown_joints(q: Floats, units: JointUnits) -> Floats:
    """(N, n): [rad, m] -> [deg, mm]; rates likewise."""
    slides = [units.slides(joint) for joint in range(1, q.shape[1] + 1)]
    return np.where(slides, q * 1000.0, np.degrees(q))


# --- JSON ----------------------------------------------------------------------------------------------------


def write_json(stream: BinaryIO, arm: RobotArm, timeline: Timeline, rate: float) -> None:
    """A list with an object for every sample, as `vrs where --json` tells a position."""
    n = arm.model.joint_count
    units = arm.model.units.told(n)
    before = "[\n  "
    for times in sample_times(timeline, rate):
        places = places_at(arm, timeline, times)
        for row, hand in zip(table(places, arm.model.units).tolist(), places.hand.tolist(), strict=True):
            t, *numbers = row
            joints, xyz, oat = numbers[:n], numbers[n : n + 3], numbers[n + 3 :]
            one = {"time": t, "joints_deg": joints, **units, "xyz_mm": xyz, "oat_deg": oat, "hand": hand}
            stream.write(f"{before}{json.dumps(one)}".encode("ascii"))
            before = ",\n  "
    stream.write(b"\n]\n")


# --- NumPy ---------------------------------------------------------------------------------------------------


def write_npz(stream: BinaryIO, arm: RobotArm, timeline: Timeline, rate: float) -> None:
    """Arrays in metres, radians and seconds: N samples, and the M segments themselves with their polynomials."""
    with TemporaryFile() as whole:  # an archive is other bytes where it cannot be gone back in: the same everywhere
        with ZipFile(whole, "w") as archive:
            _write_samples(archive, arm, timeline, rate)
            for name, array in _segments(arm.model.joint_count, list(timeline)).items():
                with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
                    np.lib.format.write_array(member, array, allow_pickle=False)
        whole.seek(0)
        copyfileobj(whole, stream)


def _write_samples(archive: ZipFile, arm: RobotArm, timeline: Timeline, rate: float) -> None:
    """Write an array after the other, as an archive wants them, though they are made together: by a file for each."""
    with ExitStack() as opened:
        files: dict[str, IO[bytes]] = {}
        for times in sample_times(timeline, rate):
            part = _samples(positions_at(arm, timeline, times))
            for name, array in part.items():
                if name not in files:
                    files[name] = opened.enter_context(TemporaryFile())
                files[name].write(array.tobytes())
        count = files["times"].tell() // times.itemsize
        for name, file in files.items():
            file.seek(0)
            header = {"descr": "<f8", "fortran_order": False, "shape": (count, *part[name].shape[1:])}
            with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
                np.lib.format.write_array_header_1_0(member, header)
                copyfileobj(file, member)


def _samples(here: Positions) -> dict[str, Floats]:
    return {
        "times": here.times,
        "joints": here.joints,
        "velocities": here.velocity,
        "accelerations": here.acceleration,
        "xyz": here.T_world_tool[:, :, 3],
        "oat": to_oat_batch(here.T_world_tool),
        "hand": here.hand,
    }


def _segments(joint_count: int, segments: list[Segment]) -> dict[str, NDArray[np.generic]]:
    """(M,) each; polynomials by ascending powers of t - t_s, NaN for a segment that is not of that space."""
    return {
        "segment_start": np.array([segment.start for segment in segments]),
        "segment_finish": np.array([segment.finish for segment in segments]),
        "segment_phase": np.array([segment.phase.value for segment in segments]),
        "segment_straight": np.array([isinstance(segment.path, CartesianPath) for segment in segments]),
        "segment_command": np.array([segment.motion.number for segment in segments]),
        "segment_text": np.array([segment.motion.text for segment in segments]),
        "segment_joints": _polynomials([_of(JointPath, segment) for segment in segments], joint_count),
        "segment_xyz": _polynomials([_of(CartesianPath, segment) for segment in segments], 3),
    }


def _of(space: type, segment: Segment) -> tuple[Polynomial, ...]:
    """The polynomials of a segment of that space: one a joint, or x, y, z of the tool tip; none for another."""
    path = segment.path
    if not isinstance(path, space):
        return ()
    return path.coefficients if isinstance(path, JointPath) else path.position


def _polynomials(rows: list[tuple[Polynomial, ...]], size: int) -> Floats:
    """(M, size, k): polynomials of fewer coefficients are filled with zeros, those that are missing with NaN."""
    longest = max((len(row[0]) for row in rows if row), default=1)
    result = np.zeros((len(rows), size, longest))
    for place, row in enumerate(rows):
        if row:
            result[place, :, : len(row[0])] = row
        else:
            result[place] = np.nan
    return result


# --- ROS 2 trajectory_msgs/JointTrajectory, as JSON ------------------------------------------------------------


def write_ros(stream: BinaryIO, arm: RobotArm, timeline: Timeline, rate: float) -> None:
    """One JointTrajectory: a point at each boundary of a segment and at each sample between. Radians and seconds."""
    header = {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": "world"}
    names = json.dumps(joint_names(arm))
    stream.write(f'{{\n"header": {json.dumps(header)},\n"joint_names": {names},\n"points": ['.encode("ascii"))
    edges = [edge for segment in timeline for edge in (segment.start, segment.finish)]
    times = np.unique(np.concatenate((*sample_times(timeline, rate), np.array(edges))))
    times = times[np.unique(np.round(times * NANOSECONDS), return_index=True)[1]]  # none twice to the nanosecond
    for first in range(0, len(times), CHUNK):
        positions = positions_at(arm, timeline, times[first : first + CHUNK])
        points = ",\n  ".join(_ros_points(positions, timeline.start))
        stream.write(f"{',' if first else ''}\n  {points}".encode("ascii"))
    stream.write(b"\n]\n}\n")


def _ros_points(positions: Positions, start: float) -> Iterator[str]:
    rows = zip(
        nanoseconds(positions.times - start),
        positions.joints.tolist(),
        positions.velocity.tolist(),
        positions.acceleration.tolist(),
        strict=True,
    )
    for ns, joints, velocities, accelerations in rows:
        sec, nanosec = divmod(ns, NANOSECONDS)
        point = {"positions": joints, "velocities": velocities, "accelerations": accelerations, "effort": []}
        yield json.dumps({**point, "time_from_start": {"sec": sec, "nanosec": nanosec}})


# --- the formats -----------------------------------------------------------------------------------------------


EXPORTERS: Mapping[str, Exporter] = {
    exporter.name: exporter
    for exporter in (
        Exporter("csv", ".csv", "a table of joints and tool positions, one row a sample", write_csv),
        Exporter("json", ".json", "a list of positions, one object a sample", write_json),
        Exporter("npz", ".npz", "NumPy arrays of samples, and of the segments with their polynomials", write_npz),
        Exporter("mcap", ".mcap", "messages of ROS 2 in a log for Foxglove and rosbag2", write_mcap, check_mcap),
        Exporter("ros", ".json", "a JointTrajectory of ROS 2 as JSON, boundaries of segments included", write_ros),
    )
}
