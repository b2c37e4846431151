"""Reports as records of a trajectory file: what is written is read back to the bit, what is not theirs is refused."""

from __future__ import annotations

import zlib
from array import array
from math import inf, nan

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.trajectory.test_measured import report_lists
from vrs_cli.trajectory.reports import VELOCITY, ReportColumns
from vrs_cli.values.measured import Report
from vrs_cli.wire.records import RecordError
from vrs_cli.wire.reports import ReportsRecord, columns_of, reports_record


def _columns(reports: list[Report]) -> ReportColumns:
    columns = ReportColumns(len(reports[0].joints), len(reports))
    for report in reports:
        columns.put(report)
    return columns


@given(report_lists(), st.data())
def test_reports_are_read_back_to_the_bit(reports: list[Report], data: st.DataObject) -> None:
    first = data.draw(st.integers(0, len(reports) - 1))
    last = data.draw(st.integers(first + 1, len(reports)))
    record = reports_record(_columns(reports), first, last)
    read = columns_of(msgspec.json.decode(msgspec.json.encode(record), type=ReportsRecord), 2)
    assert [read.report(place) for place in range(read.count)] == reports[first:last]
    assert (read.begin, read.end) == (reports[first].t, reports[last - 1].t)
    assert reports_record(read, 0, read.count) == record


def test_a_column_begins_with_the_first_bytes_of_all_its_numbers() -> None:
    record = reports_record(_columns([Report(1.0, (0.5,)), Report(2.0, (-0.25,))]), 0, 2)
    planes = bytes.fromhex("0000" * 6 + "f000" + "3f40") + bytes.fromhex("0000" * 6 + "e0d0" + "3fbf")
    assert zlib.decompress(record.columns) == planes + b"\0\0"


def _changed(**columns: array[float] | bytearray | dict[int, array[float]]) -> ReportsRecord:
    made = _columns([Report(0.0, (0.0,), (0.0,)), Report(0.5, (0.0,), (0.0,))])
    for name, column in columns.items():
        setattr(made, name, column)
    return reports_record(made, 0, 2)


@pytest.mark.parametrize(
    "record",
    [
        _changed(times=array("d", [0.5, 0.5])),
        _changed(times=array("d", [0.5, 0.0])),
        _changed(times=array("d", [0.0, nan])),
        _changed(times=array("d", [0.0, 1e9])),
        _changed(positions=array("d", [0.0, inf])),
        _changed(positions=array("d", [1e300, -1e300])),
        _changed(rates={VELOCITY: array("f", [0.0, -inf])}),
        _changed(flags=bytearray([3 | 4, 4])),
        _changed(flags=bytearray([16 | 4, 4])),
        msgspec.structs.replace(_changed(), reports=3),
        msgspec.structs.replace(_changed(), efforts=True),
        msgspec.structs.replace(_changed(), velocities=False),
        msgspec.structs.replace(_changed(), joints=2),
        msgspec.structs.replace(_changed(), columns=b""),
        msgspec.structs.replace(_changed(), columns=zlib.compress(bytes(10_000_000))),
        msgspec.structs.replace(_changed(), columns=_changed().columns[:-1]),
        msgspec.structs.replace(_changed(), columns=_changed().columns + b"\0"),
    ],
)
def test_what_is_no_record_of_reports_is_refused(record: ReportsRecord) -> None:
    with pytest.raises(RecordError):
        columns_of(record, 1)


def test_reports_of_another_robot_are_refused() -> None:
    with pytest.raises(RecordError, match="reports of 1 joints, the robot has 6"):
        columns_of(_changed(), 6)
