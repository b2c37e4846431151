"""Export trajectories in the formats of other programs. `EXPORTERS` lists the formats. Each exporter writes to a stream
in small pieces, so that long trajectories need little memory.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack, nullcontext
from itertools import pairwise
from math import ceil, isnan
from shutil import copyfileobj
from tempfile import TemporaryFile
from typing import IO, BinaryIO, NamedTuple
from zipfile import ZipFile

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from vrs_cli.engine import position
from vrs_cli.files.atomic import atomically
from vrs_cli.files.samples import CHUNK, NANOSECONDS, check_mcap, joint_names, nanoseconds, sample_times, write_mcap
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.arrays import Flags, Floats, to_oat_batch
from vrs_cli.kinematics.joints import Joints, JointUnits
from vrs_cli.trajectory.measured import MeasuredTimeline
from vrs_cli.trajectory.row import coefficients
from vrs_cli.trajectory.segment import CartesianPath, JointPath, Segment
from vrs_cli.trajectory.timeline import Timeline

DECIMALS = 9  # number of decimals in exported angles [deg] and lengths [mm]
STANDARD_OUTPUT = "-"
COPIED_AT_ONCE = 1 << 18  # [B] amount that is copied from a temporary file at a time

CUBIC = 3  # degree of the polynomials with which a controller interpolates positions and velocities
TOOL_COLUMNS = ("x", "y", "z", "o", "a", "t_angle")


class Exporter(Struct, frozen=True):
    """An export format: its name after `--to`, its file extension, and its writer, a function of stream, arm, timeline
    and a number.

    The number is a sampling rate [Hz], or for a picture the time that it shows [s]. `shows_cell`: whether `write` has a
    parameter `world` for the World around the robot. `tells_measured`: whether `write` has a parameter `measured` for
    the reports of the real arm. `check`: a function that raises UsageError if a package is missing. `usual`: a function
    of a timeline that returns the default number.
    """

    name: str
    suffix: str
    summary: str
    write: Callable[..., None]
    check: Callable[[], None] = lambda: None
    # default of the number [Hz or s]; None: the default sampling rate of tables
    usual: Callable[[Timeline], float] | None = None
    of_moment: bool = False
    shows_cell: bool = False
    tells_measured: bool = False


def export(
    exporter: Exporter, path: str, standard_output: BinaryIO, arm: RobotArm, timeline: Timeline, number: float
) -> None:
    """Export a timeline to a file, completely or not at all; to `standard_output` if `path` is `-`. `number`: see
    `Exporter`. Raises FileError.
    """
    opened: AbstractContextManager[BinaryIO]
    opened = nullcontext(standard_output) if path == STANDARD_OUTPUT else atomically(path)
    with opened as stream:
        exporter.write(stream, arm, timeline, number)


# --- CSV -----------------------------------------------------------------------------------------------------


def write_csv(
    stream: BinaryIO, arm: RobotArm, timeline: Timeline, rate: float, measured: MeasuredTimeline | None = None
) -> None:
    """Write a CSV table with the columns t [s], jt1 ... jtn [deg; mm for prismatic joints], x, y, z [mm], o, a, t_angle
    [deg], and a row at each of the `sample_times`. With `measured`, also write jt1_measured ... jtn_measured, empty
    where the measured joints are unknown. Times have all digits, so that they are read back exactly.
    """
    names = joint_names(arm.model.joint_count)
    columns = ("t", *names, *TOOL_COLUMNS)
    also = () if measured is None else tuple([f"{name}_measured" for name in names])
    stream.write(f"{','.join((*columns, *also))}\n".encode("ascii"))
    form = ",".join(["%r"] + [f"%.{DECIMALS}f"] * (len(columns) - 1 + len(also))) + "\n"
    for times in sample_times(timeline, rate):
        rows = table(position.places_at(arm, timeline, times), arm.model.units)
        if measured is not None:
            rows = np.hstack((rows, _shown_measured(measured, times, arm.model.units)))
        stream.write((form * len(rows) % tuple(rows.ravel().tolist())).replace("nan", "").encode("ascii"))


def table(places: position.PlaceArrays, units: JointUnits) -> Floats:
    """Return the columns of a CSV table (N, 1 + n + 6): t [s], joints [deg, mm], x, y, z [mm], o, a, t [deg]. All but
    the times are rounded to DECIMALS.
    """
    T = places.T_world_tool
    columns = (shown_joints(places.joints, units), T[:, :, 3] * 1000.0, np.degrees(to_oat_batch(T)))
    shown = np.round(np.hstack(columns), DECIMALS) + 0.0  # adding 0.0 turns -0.0 into 0.0
    return np.hstack((places.times[:, None], shown))


def _shown_measured(measured: MeasuredTimeline, times: Floats, units: JointUnits) -> Floats:
    """Return the measured joints (N, n) [deg, mm] at times (N,) [s], NaN where they are unknown."""
    return np.round(shown_joints(measured.joints_over(times), units), DECIMALS) + 0.0


def shown_joints(q: Floats, units: JointUnits) -> Floats:
    """Convert joints or their rates (N, n) from [rad, m] to [deg, mm]."""
    return np.where([units.slides(joint) for joint in range(1, q.shape[1] + 1)], q * 1000.0, np.degrees(q))


# --- JSON ----------------------------------------------------------------------------------------------------


def write_json(
    stream: BinaryIO, arm: RobotArm, timeline: Timeline, rate: float, measured: MeasuredTimeline | None = None
) -> None:
    """Write a JSON list with an object for each sample, which has the same keys as the output of `vrs where --json`.
    With `measured`, objects also have `measured_deg`, null where the measured joints are unknown.
    """
    n = arm.model.joint_count
    units = arm.model.units.json_units(n)
    before = "[\n  "
    for times in sample_times(timeline, rate):
        places = position.places_at(arm, timeline, times)
        seen = None if measured is None else _shown_measured(measured, times, arm.model.units).tolist()
        rows = zip(table(places, arm.model.units).tolist(), places.hand.tolist(), strict=True)
        for place, (row, hand) in enumerate(rows):
            t, *numbers = row
            joints, xyz, oat = numbers[:n], numbers[n : n + 3], numbers[n + 3 :]
            one = {"time": t, "joints_deg": joints, **units, "xyz_mm": xyz, "oat_deg": oat, "hand": hand}
            if seen is not None:
                one["measured_deg"] = None if isnan(seen[place][0]) else seen[place]
            stream.write(f"{before}{json.dumps(one)}".encode("ascii"))
            before = ",\n  "
    stream.write(b"\n]\n")


# --- NumPy ---------------------------------------------------------------------------------------------------


def write_npz(
    stream: BinaryIO, arm: RobotArm, timeline: Timeline, rate: float, measured: MeasuredTimeline | None = None
) -> None:
    """Write a NumPy archive of arrays in metres, radians and seconds: N samples, and the M segments with their
    polynomials. With `measured`, also write the R reports of the real arm: `measured_times` (R,), `measured_joints` and
    `measured_velocities` (R, n).
    """
    # a seekable file, because zipfile would write different bytes to a stream that is not seekable
    with TemporaryFile() as whole:
        with ZipFile(whole, "w") as archive:
            _write_samples(archive, arm, timeline, rate)
            arrays = _segments(list(timeline))
            if measured is not None:
                seen = measured.arrays()
                arrays |= {"measured_times": seen.times, "measured_joints": seen.joints}
                arrays["measured_velocities"] = seen.velocity
            for name, array in arrays.items():
                with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
                    np.lib.format.write_array(member, array, allow_pickle=False)
        whole.seek(0)
        copyfileobj(whole, stream, COPIED_AT_ONCE)


def _write_samples(archive: ZipFile, arm: RobotArm, timeline: Timeline, rate: float) -> None:
    """Compute the samples in chunks, collect each array in a temporary file, and then copy the arrays to the archive in
    its order.
    """
    with ExitStack() as opened:
        files: dict[str, IO[bytes]] = {}
        for times in sample_times(timeline, rate):
            here = position.positions_at(arm, timeline, times)
            part = {
                "times": here.times,
                "joints": here.joints,
                "velocities": here.velocity,
                "accelerations": here.acceleration,
                "xyz": here.T_world_tool[:, :, 3],
                "oat": to_oat_batch(here.T_world_tool),
                "hand": here.hand,
            }
            for name, array in part.items():
                if name not in files:
                    files[name] = opened.enter_context(TemporaryFile())
                files[name].write(np.ascontiguousarray(array).data)
        count = files["times"].tell() // times.itemsize
        for name, file in files.items():
            file.seek(0)
            header = {"descr": "<f8", "fortran_order": False, "shape": (count, *part[name].shape[1:])}
            with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
                np.lib.format.write_array_header_1_0(member, header)
                copyfileobj(file, member, COPIED_AT_ONCE)


def _segments(segments: list[Segment]) -> dict[str, NDArray[np.generic]]:
    """Return the arrays that describe the M segments. Polynomials have ascending powers of t - t_s, with t_s the start
    of the segment. Joint polynomials are NaN for segments that are planned as tool motions, and tool
    polynomials are NaN for segments that are planned as joint motions.
    """
    paths = [segment.path for segment in segments]
    joints = coefficients(paths)[0].transpose(1, 2, 0).copy()
    lines = {row: path.position for row, path in enumerate(paths) if isinstance(path, CartesianPath)}
    xyz = np.full((len(paths), 3, max((len(x) for x, _, _ in lines.values()), default=1)), np.nan)
    for row, polynomials in lines.items():
        joints[row], xyz[row] = np.nan, 0.0
        xyz[row, :, : len(polynomials[0])] = polynomials
    return {
        "segment_start": np.array([segment.start for segment in segments]),
        "segment_finish": np.array([segment.finish for segment in segments]),
        "segment_phase": np.array([segment.phase.value for segment in segments]),
        "segment_straight": np.array([row in lines for row in range(len(paths))]),
        "segment_command": np.array([segment.motion.number for segment in segments]),
        "segment_text": np.array([segment.motion.text for segment in segments]),
        "segment_joints": joints,
        "segment_xyz": xyz,
    }


# --- ROS 2 trajectory_msgs/JointTrajectory, as JSON ------------------------------------------------------------


LINE_RATE = 50.0  # [Hz] minimum rate of trajectory points on straight lines
EXACT = 3e-8  # [rad, m] maximum error of the controller's interpolation between points
HALVINGS = 20  # maximum number of times that an interval is halved because its error is too large
SAME = 1e-9  # accelerations count as equal within this absolute [rad/s2] and relative tolerance


class _Points(NamedTuple):
    """The times of trajectory points (N,) [s], sorted, and whether the acceleration is continuous at each."""

    times: Floats
    smooth: Flags


def write_ros(stream: BinaryIO, arm: RobotArm, timeline: Timeline, rate: float) -> None:
    """Write a ROS 2 JointTrajectory message in radians and seconds, as JSON. Its points are chosen so that the
    interpolation of a JointTrajectoryController reproduces the motion: it is cubic between points with velocities, and
    quintic between points that also have accelerations (ros2_controllers, trajectory.cpp). There is a point at each
    segment boundary, with accelerations if they are continuous there, and as many points between as needed. `rate`:
    rate of additional points [Hz]; 0 for none.
    """
    header = {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": "world"}
    names = json.dumps(joint_names(arm.model.joint_count))
    stream.write(f'{{\n"header": {json.dumps(header)},\n"joint_names": {names},\n"points": ['.encode("ascii"))
    before = "\n  "
    for points in _in_chunks(_ros_times(arm, timeline, rate), timeline.start):
        text = ",\n  ".join(
            _ros_points(position.positions_at(arm, timeline, points.times), points.smooth, timeline.start)
        )
        stream.write(f"{before}{text}".encode("ascii"))
        before = ",\n  "
    stream.write(b"\n]\n}\n")


class _Span(NamedTuple):
    """The interval of a segment, or an interval in which the robot is at rest (`segment` is None), with the
    accelerations [rad/s2] at its start and end.
    """

    begin: float
    end: float
    first: Joints
    last: Joints
    segment: Segment | None = None


def _spans(arm: RobotArm, timeline: Timeline) -> Iterator[_Span]:
    """Yield the spans of a timeline in order of time, and finally a span of length 0 at its end."""
    still, at = (0.0,) * arm.model.joint_count, timeline.start
    for segment in timeline:
        if segment.start > at:
            yield _Span(at, segment.start, still, still)
        if segment.finish > segment.start:
            yield _Span(segment.start, segment.finish, *position.accelerations_at_ends(arm, segment), segment)
        at = segment.finish
    yield _Span(at, at, still, still)


def _ros_times(arm: RobotArm, timeline: Timeline, rate: float) -> Iterator[_Points]:
    """Yield the trajectory points of each span, and finally the end point."""
    before = still = (0.0,) * arm.model.joint_count
    for span, following in pairwise(_spans(arm, timeline)):
        points = _between(timeline, rate, span, smooth=_same(before, span.first))
        yield _refine(arm, timeline, span, points, smooth_end=_same(span.last, following.first))
        before = span.last
    yield _Points(np.array([timeline.end]), np.array([_same(before, still)]))


def _same(a: Joints, b: Joints) -> bool:
    return all(abs(x - y) <= SAME * max(1.0, abs(x)) for x, y in zip(a, b, strict=True))


def _between(timeline: Timeline, rate: float, span: _Span, *, smooth: bool) -> _Points:
    """Return the points at the start of a span and at the sample times inside it. `smooth`: whether the acceleration is
    continuous at the start.
    """
    first, last = (ceil((t - timeline.start) * rate) for t in (span.begin, span.end))
    samples = timeline.start + np.arange(first, last) / (rate or 1.0)
    times = np.concatenate(([span.begin], samples[(samples > span.begin) & (samples < span.end)]))
    return _Points(times, np.concatenate(([smooth], np.ones(len(times) - 1, dtype=np.bool_))))


def _refine(arm: RobotArm, timeline: Timeline, span: _Span, points: _Points, *, smooth_end: bool) -> _Points:
    """Insert points into a span until the controller's interpolation is exact within EXACT. Joint polynomials up to
    degree 3 need none. `smooth_end`: whether the acceleration is continuous at the span's end.
    """
    segment = span.segment
    if segment is None or (isinstance(segment.path, JointPath) and segment.path.degree <= CUBIC):
        return points
    times, smooth = np.append(points.times, segment.finish), np.append(points.smooth, smooth_end)
    if not isinstance(segment.path, JointPath):
        count = ceil(segment.duration * LINE_RATE)
        grid = segment.start + segment.duration * np.arange(1, count) / count
        times, smooth = _with(times, smooth, np.setdiff1d(grid, times))
    for _ in range(HALVINGS):
        middles = 0.5 * (times[:-1] + times[1:])
        off = np.abs(
            _interpolate(position.positions_at(arm, timeline, times), smooth)
            - position.joints_over(arm, timeline, middles)
        )
        wrong = off.max(axis=1) > EXACT
        if not wrong.any():
            break
        times, smooth = _with(times, smooth, middles[wrong])
    return _Points(times[:-1], smooth[:-1])


def _with(times: Floats, smooth: Flags, more: Floats) -> tuple[Floats, Flags]:
    at = np.searchsorted(times, more)
    return np.insert(times, at, more), np.insert(smooth, at, True)


def _interpolate(at: position.PositionArrays, smooth: Flags) -> Floats:
    """Return the joints (N - 1, n) that a controller interpolates halfway between N points."""
    h = np.diff(at.times)[:, None]
    middle = 0.5 * (at.joints[:-1] + at.joints[1:])
    slower = h * (at.velocity[:-1] - at.velocity[1:])
    quintic = (smooth[:-1] & smooth[1:])[:, None]
    bent = 0.15625 * slower + h * h / 64.0 * (at.acceleration[:-1] + at.acceleration[1:])
    return middle + np.where(quintic, bent, 0.125 * slower)


def _in_chunks(parts: Iterator[_Points], start: float) -> Iterator[_Points]:
    """Join the points of many spans to large chunks, and leave out points at the same nanosecond as the
    previous point.
    """
    waiting, count, last = list[_Points](), 0, -1
    for part in parts:
        ns = nanoseconds(part.times - start)
        fresh = np.diff(ns, prepend=last) > 0
        waiting.append(_Points(part.times[fresh], part.smooth[fresh]))
        count, last = count + int(fresh.sum()), max(last, int(ns[-1]))
        if count >= CHUNK:
            yield _join(waiting)
            waiting, count = [], 0
    if count:
        yield _join(waiting)


def _join(parts: Sequence[_Points]) -> _Points:
    return _Points(np.concatenate([part.times for part in parts]), np.concatenate([part.smooth for part in parts]))


def _ros_points(positions: position.PositionArrays, smooth: Flags, start: float) -> Iterator[str]:
    rows = zip(
        nanoseconds(positions.times - start).tolist(),
        positions.joints.tolist(),
        positions.velocity.tolist(),
        positions.acceleration.tolist(),
        smooth.tolist(),
        strict=True,
    )
    for ns, joints, velocities, accelerations, given in rows:
        sec, nanosec = divmod(ns, NANOSECONDS)
        rates = {"velocities": velocities, "accelerations": accelerations if given else []}
        yield json.dumps(
            {"positions": joints, **rates, "effort": [], "time_from_start": {"sec": sec, "nanosec": nanosec}}
        )


# --- the formats -----------------------------------------------------------------------------------------------


EXPORTERS: Mapping[str, Exporter] = {
    exporter.name: exporter
    for exporter in (
        Exporter(
            "csv", ".csv", "a table of joints and tool positions, one row per sample", write_csv, tells_measured=True
        ),
        Exporter("json", ".json", "a list of positions, one object per sample", write_json, tells_measured=True),
        Exporter(
            "npz",
            ".npz",
            "NumPy arrays of samples, and of the segments with their polynomials",
            write_npz,
            tells_measured=True,
        ),
        Exporter(
            "mcap",
            ".mcap",
            "messages of ROS 2 in a log for Foxglove and rosbag2",
            write_mcap,
            check_mcap,
            shows_cell=True,
        ),
        Exporter(
            "ros",
            ".json",
            "a JointTrajectory of ROS 2 as JSON, which ROS controllers interpolate exactly; --rate adds points",
            write_ros,
            usual=lambda _timeline: 0.0,
        ),
    )
}
