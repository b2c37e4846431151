"""Reports of a measured robot in every form: compressed columns of a trajectory file, rows of numbers in messages,
lines of text in CSV or JSON, and JSON messages of the rosbridge protocol.

`docs/trajectory-file.md` describes the columns. The bytes of a column are sorted by their place in the number: first
the first bytes of all its numbers, then all second bytes, and so on. So the bytes of signs and exponents, which hardly
change, are next to each other and compress well.

A set point has the time of the robot's clock [s], the joints, and their velocities [deg, deg/s; mm, mm/s if prismatic]:

    t,jt1,...,jtn,v1,...,vn,mode
    {"t": 2.5, "joints": [...], "velocity": [...], "mode": "follows"}

The mode is the order to the body (the real or simulated arm): `follows`, or `holds` for standing still. A report has
the same form. In CSV it has the time, the joints and, if known, the velocities. In JSON it has `joints` and optionally
`t` (default: now), `velocity`, `effort` [N m, N] and `mode` (`follows`, `holds`, `stopped`). A line that begins with
`{` is JSON.

vrs checks only the fields of a rosbridge message that it needs, and ignores unknown fields and operations, as the
protocol demands.
"""

from __future__ import annotations

import json
import sys
import zlib
from array import array
from collections.abc import Iterable, Iterator, Mapping, Sequence
from enum import Enum
from itertools import pairwise
from math import isfinite
from operator import lt
from typing import Annotated, Any

import msgspec

from vrs_cli.errors import FileDamaged, IllegalValue
from vrs_cli.kinematics.joints import JointUnits
from vrs_cli.trajectory.instant import LATEST
from vrs_cli.trajectory.reports import EFFORT, MAX_NUMBER, MODE, MODES, VELOCITY, ReportColumns
from vrs_cli.trajectory.state import JointState
from vrs_cli.values.measured import BodyMode, Report
from vrs_cli.values.numbers import count
from vrs_cli.wire.records import Joints, RecordError, StrictRecord, Time

MAX_RECORD_REPORTS = 1 << 16  # maximum number of reports in one record
COMPRESSION_LEVEL = 1  # the fastest level of zlib: higher levels take much longer and save little space


class ReportsRecord(StrictRecord, frozen=True):
    """Reports in compressed form. `reports`, `joints`: the numbers of reports and of joints. `columns`: times,
    positions, velocities and efforts (if any report has them), and flags."""

    reports: Annotated[int, msgspec.Meta(ge=1, le=MAX_RECORD_REPORTS)]
    joints: Annotated[int, msgspec.Meta(ge=1, le=64)]
    columns: bytes
    velocities: bool = False
    efforts: bool = False


def reports_record(columns: ReportColumns, first: int, last: int) -> ReportsRecord:
    """Convert the reports from `first` up to, but not including, `last` to a record. Equal reports give equal
    records."""
    n, flags = columns.joint_count, bytes(columns.flags[first:last])
    numbers = slice(first * n, last * n)
    rates = columns.rates.get(VELOCITY) if any(flag & VELOCITY for flag in flags) else None
    efforts = columns.rates.get(EFFORT) if any(flag & EFFORT for flag in flags) else None
    parts = [_planes(columns.times[first:last]), _planes(columns.positions[numbers])]
    parts += [_planes(column[numbers]) for column in (rates, efforts) if column is not None]
    data = zlib.compress(b"".join([*parts, flags]), COMPRESSION_LEVEL)
    return ReportsRecord(last - first, n, data, rates is not None, efforts is not None)


def columns_of(record: ReportsRecord, joint_count: int) -> ReportColumns:
    """Convert a record to reports. Raises RecordError for a record that `reports_record` cannot have made."""
    count, n = record.reports, record.joints
    if n != joint_count:
        raise RecordError(f"reports of {n} joints, the robot has {joint_count}")
    made = ReportColumns(n, count)
    sizes = [8 * count, 8 * count * n, 4 * count * n * record.velocities, 4 * count * n * record.efforts, count]
    data = _decompress(record.columns, sum(sizes))
    made.times, data = _column("d", data, sizes[0])
    made.positions, data = _column("d", data, sizes[1])
    if record.velocities:
        made.rates[VELOCITY], data = _column("f", data, sizes[2])
    if record.efforts:
        made.rates[EFFORT], data = _column("f", data, sizes[3])
    made.flags = bytearray(data)
    _check(made)
    made.count, made.begin, made.end = count, made.times[0], made.times[-1]
    return made


def _check(made: ReportColumns) -> None:
    """Raise RecordError if a number is too large or not finite, times do not increase, or a flag is unknown."""
    numbers = [made.positions, *made.rates.values()]
    for column, most in ((made.times, LATEST), *((column, MAX_NUMBER) for column in numbers)):
        if not isfinite(sum(column)) or max(column) > most or min(column) < -most:
            raise RecordError("a number of a report is too large, or none")
    if not all(map(lt, made.times, made.times[1:])):
        raise RecordError("the times of reports do not rise")
    if any(flag & ~(MODE | sum(made.rates)) or flag & MODE >= len(MODES) for flag in set(made.flags)):
        raise RecordError("a report with an unknown flag")


def _decompress(data: bytes, size: int) -> bytes:
    """Decompress data of a known size. Raises RecordError for any other size."""
    inflater = zlib.decompressobj()
    try:
        found = inflater.decompress(data, size + 1)
    except zlib.error as error:
        raise RecordError(f"the columns of reports cannot be read: {error}") from None
    if len(found) != size or not inflater.eof or inflater.unused_data:
        raise RecordError("the columns of reports have another size than they should")
    return found


def _planes(column: array[float]) -> bytes:
    """Return the bytes of a column sorted by their place in the number: the first bytes of all numbers, then all second
    bytes and so on; little-endian."""
    data, size = column.tobytes(), column.itemsize
    return b"".join([data[place::size] for place in _places(size)])


def _column(code: str, data: bytes, size: int) -> tuple[array[float], bytes]:
    """Return the column stored in the first `size` bytes, and the remaining bytes."""
    made: array[float] = array(code)
    count, whole = size // made.itemsize, bytearray(size)
    for number, place in enumerate(_places(made.itemsize)):
        whole[place :: made.itemsize] = data[number * count : (number + 1) * count]
    made.frombytes(whole)
    return made, data[size:]


def _places(size: int) -> range:
    return range(size) if sys.byteorder == "little" else range(size - 1, -1, -1)


MAX_MESSAGE_REPORTS = 2000  # maximum number of reports in one message
Rows = Annotated[tuple[Joints, ...], msgspec.Meta(max_length=MAX_MESSAGE_REPORTS)]


class ReportRows(msgspec.Struct, frozen=True, omit_defaults=True, kw_only=True):
    """Reports of one mode. `times` [s] of the robot's clock; `joints` [rad, m], `velocity` [rad/s, m/s] and `effort` [N
    m, N] have a row for each time.
    """

    times: Annotated[tuple[Time, ...], msgspec.Meta(min_length=1, max_length=MAX_MESSAGE_REPORTS)]
    joints: Rows
    velocity: Rows | None = None
    effort: Rows | None = None
    mode: BodyMode = BodyMode.FOLLOWS


def reports_of(rows: ReportRows, count: int) -> list[Report]:
    """Return the reports of a robot with `count` joints. Raises RecordError for rows of a wrong shape, or times that do
    not increase."""
    times, velocity, effort = rows.times, rows.velocity, rows.effort
    for name, table in (("joints", rows.joints), ("velocity", velocity), ("effort", effort)):
        if table is not None and (len(table) != len(times) or any(len(row) != count for row in table)):
            raise RecordError(f"{name} must have a row of {count} numbers for each of {len(times)} times")
    for before, after in pairwise(times):
        if after <= before:
            raise RecordError(f"times must rise, but {after:g} s comes after {before:g} s")
    none = (None,) * len(times)
    columns = zip(times, rows.joints, velocity or none, effort or none, strict=True)
    return [Report(t, joints, speed, force, rows.mode) for t, joints, speed, force in columns]


def row_parts(reports: Iterable[Report]) -> Iterator[list[Report]]:
    """Divide reports into lists that fit into one ReportRows each."""
    part: list[Report] = []
    for one in reports:
        if part and (len(part) == MAX_MESSAGE_REPORTS or one.t <= part[-1].t or _sort(one) != _sort(part[0])):
            yield part
            part = []
        part.append(one)
    if part:
        yield part


def _sort(report: Report) -> tuple[BodyMode, bool, bool]:
    return report.mode, report.velocity is None, report.effort is None


def row_fields(reports: Sequence[Report]) -> dict[str, Any]:
    """Return the fields of ReportRows for a list of `row_parts`."""
    first = reports[0]
    return {
        "times": tuple([one.t for one in reports]),
        "joints": tuple([one.joints for one in reports]),
        "velocity": None if first.velocity is None else tuple([one.velocity for one in reports]),
        "effort": None if first.effort is None else tuple([one.effort for one in reports]),
        "mode": first.mode,
    }


MAX_SHOWN = 60  # maximum number of characters shown of a wrong line


class LineFormat(Enum):
    """The format of set points."""

    CSV = "csv"
    JSON = "json"


class _ReportLine(msgspec.Struct, forbid_unknown_fields=True):
    joints: list[float]
    t: float | None = None
    velocity: list[float] | None = None
    effort: list[float] | None = None
    mode: BodyMode = BodyMode.FOLLOWS


_DECODER = msgspec.json.Decoder(_ReportLine)


def heading(joint_count: int) -> str:
    """Return the names of the columns of set points in CSV."""
    numbers = range(1, joint_count + 1)
    return ",".join(["t", *(f"jt{i}" for i in numbers), *(f"v{i}" for i in numbers), "mode"])


def setpoint_line(form: LineFormat, t: float, state: JointState, mode: BodyMode, units: JointUnits) -> str:
    """Write a set point as a line of text: joints and velocities of `state` [rad, m] at `t` [s]."""
    joints, velocity = (
        [round(value, 9) + 0.0 for value in units.to_display(row)] for row in (state.joints, state.velocity)
    )
    if form is LineFormat.JSON:
        return json.dumps({"t": round(t, 9), "joints": joints, "velocity": velocity, "mode": mode.value})
    return ",".join([f"{t:.9g}", *(f"{value:.9g}" for value in (*joints, *velocity)), mode.value])


def read_report(line: str, now: float, units: JointUnits, joint_count: int) -> Report:
    """Read a report; `now` [s] is its time if the line has none. Raises FileDamaged."""
    text = line.strip()
    if text.startswith("{"):
        try:
            one = _DECODER.decode(text)
        except msgspec.DecodeError as error:
            raise FileDamaged(f"{_quote(text)}: {error}", 'a report is {"t": s, "joints": [...]}') from None
        t = now if one.t is None else one.t
        return _report(t, one.joints, one.velocity, one.effort, one.mode, units, joint_count)
    fields = [field.strip() for field in text.split(",")]
    if len(fields) not in (1 + joint_count, 1 + 2 * joint_count):
        right = f"a report is the time and {count(joint_count, 'joint')}, and as many velocities if they are known"
        raise FileDamaged(f"{count(len(fields), 'field')} in {_quote(text)}", right)
    try:
        t, *numbers = map(float, fields)
    except ValueError:
        raise FileDamaged(f"{_quote(text)} holds what is no number", "a report is the time and the joints") from None
    joints, velocity = numbers[:joint_count], numbers[joint_count:] or None
    return _report(t, joints, velocity, None, BodyMode.FOLLOWS, units, joint_count)


def _report(
    t: float,
    joints: list[float],
    velocity: list[float] | None,
    effort: list[float] | None,
    mode: BodyMode,
    units: JointUnits,
    joint_count: int,
) -> Report:
    for name, row in (("joints", joints), ("velocity", velocity), ("effort", effort)):
        if row is not None and len(row) != joint_count:
            raise FileDamaged(f"{count(len(row), 'number')} of {name}", f"this robot has {count(joint_count, 'joint')}")
    if not all(map(isfinite, (t, *joints, *(velocity or ()), *(effort or ())))):
        raise FileDamaged("a number that is not finite", "each is a number as 12.5")
    speed = None if velocity is None else units.read(velocity)
    return Report(t, units.read(joints), speed, None if effort is None else tuple(effort), mode)


def _quote(text: str) -> str:
    return repr(text if len(text) <= MAX_SHOWN else text[:MAX_SHOWN] + "...")


class RosbridgeMessage(msgspec.Struct, frozen=True):
    """A message from a rosbridge server.

    `msg`: the message on a topic, or the text of a status message of this `level`; `values`: the answer of a service or
    action.
    """

    op: str
    id: str | None = None
    topic: str = ""
    msg: Any = None
    level: str = ""
    service: str = ""
    values: Any = None
    result: bool = True
    status: int | None = None


class RosTime(msgspec.Struct, frozen=True):
    """A builtin_interfaces/msg/Time."""

    sec: int
    nanosec: int

    @property
    def seconds(self) -> float:
        return self.sec + self.nanosec * 1e-9


class Header(msgspec.Struct, frozen=True):
    """The fields read from a std_msgs/msg/Header."""

    stamp: RosTime


class JointStates(msgspec.Struct, frozen=True):
    """A sensor_msgs/msg/JointState. JSON has no NaN; rosbridge writes null."""

    header: Header
    name: tuple[str, ...]
    position: tuple[float | None, ...]
    velocity: tuple[float | None, ...] = ()
    effort: tuple[float | None, ...] = ()

    def column(self, values: Sequence[float | None], names: Sequence[str]) -> tuple[float, ...] | None:
        """Return a column in the order of these names; None if a value is missing or not finite."""
        rows = dict(zip(self.name, values, strict=False))
        found = [rows.get(name) for name in names]
        return None if any(x is None or not isfinite(x) for x in found) else tuple(float(x or 0.0) for x in found)


class TimeAnswer(msgspec.Struct, frozen=True):
    """The answer of /rosapi/get_time."""

    time: RosTime


def read_message(text: str | bytes) -> RosbridgeMessage:
    """Read a message. Raises IllegalValue for invalid JSON."""
    try:
        return msgspec.convert(json.loads(text), RosbridgeMessage)
    except (ValueError, RecursionError) as error:
        raise IllegalValue(f"a message of rosbridge: {error}", "JSON with op") from None


def read_joint_states(message: RosbridgeMessage) -> JointStates:
    """Return the joint states that a topic published. Raises IllegalValue for any other content."""
    try:
        return msgspec.convert(message.msg, JointStates)
    except ValueError as error:
        raise IllegalValue(f"{message.topic}: {error}", "sensor_msgs/msg/JointState of ROS 2") from None


def read_time(message: RosbridgeMessage) -> float | None:
    """Return the time of ROS [s] in the answer of /rosapi/get_time; None if the call failed."""
    try:
        return msgspec.convert(message.values, TimeAnswer).time.seconds if message.result else None
    except ValueError:
        return None


def write_message(message: Mapping[str, Any]) -> str:
    """Return the JSON of a message."""
    return json.dumps(message, allow_nan=False, separators=(",", ":"))
