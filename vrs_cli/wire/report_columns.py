"""Reports of a measured robot: as compressed columns of a trajectory file, and as rows of numbers in messages.

`docs/trajectory-file.md` describes the columns. The bytes of a column are sorted by their place in the number: first
the first bytes of all its numbers, then the second ones, and so on. So bytes of signs and exponents, which hardly
change, are next to each other and compress well.
"""

from __future__ import annotations

import sys
import zlib
from array import array
from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise
from math import isfinite
from operator import lt
from typing import Annotated, Any

import msgspec
from msgspec import Meta, Struct

from vrs_cli.trajectory.instant import LATEST
from vrs_cli.trajectory.reports import EFFORT, MAX_NUMBER, MODE, MODES, VELOCITY, ReportColumns
from vrs_cli.values.measured import BodyMode, Report
from vrs_cli.wire.records import Joints, RecordError, StrictRecord, Time

MAX_RECORD_REPORTS = 1 << 16  # maximum number of reports in one record
COMPRESSION_LEVEL = 1  # higher levels take much longer and gain little


class ReportsRecord(StrictRecord, frozen=True):
    """Reports of so many joints. `columns`: times, positions, velocities and efforts (if any report has them), and
    flags.
    """

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
    """Raise RecordError if a number is too large or not finite, times do not rise, or a flag is unknown."""
    numbers = [made.positions, *made.rates.values()]
    for column, most in ((made.times, LATEST), *((column, MAX_NUMBER) for column in numbers)):
        if not isfinite(sum(column)) or max(column) > most or min(column) < -most:
            raise RecordError("a number of a report is too large, or none")
    if not all(map(lt, made.times, made.times[1:])):
        raise RecordError("the times of reports do not rise")
    known = sum(made.rates)
    if any(flag & ~(MODE | known) or flag & MODE >= len(MODES) for flag in set(made.flags)):
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
    """Return the column of the first `size` bytes, and the other bytes."""
    made: array[float] = array(code)
    count, whole = size // made.itemsize, bytearray(size)
    for number, place in enumerate(_places(made.itemsize)):
        whole[place :: made.itemsize] = data[number * count : (number + 1) * count]
    made.frombytes(whole)
    return made, data[size:]


def _places(size: int) -> range:
    return range(size) if sys.byteorder == "little" else range(size - 1, -1, -1)


MAX_MESSAGE_REPORTS = 2000  # maximum number of reports in one message
Rows = Annotated[tuple[Joints, ...], Meta(max_length=MAX_MESSAGE_REPORTS)]


class ReportRows(Struct, frozen=True, omit_defaults=True, kw_only=True):
    """Reports of one mode. `times` [s] of the robot's clock; `joints` [rad, m], `velocity` [rad/s, m/s] and `effort` [N
    m, N] have a row for each time.
    """

    times: Annotated[tuple[Time, ...], Meta(min_length=1, max_length=MAX_MESSAGE_REPORTS)]
    joints: Rows
    velocity: Rows | None = None
    effort: Rows | None = None
    mode: BodyMode = BodyMode.FOLLOWS


def reports_of(rows: ReportRows, count: int) -> list[Report]:
    """Return the reports of a robot with `count` joints. Raises RecordError for rows of a wrong shape, or times that do
    not rise.
    """
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
