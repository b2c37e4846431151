"""Reports of a body as rows of numbers, for messages."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise
from typing import Annotated, Any

from msgspec import Meta, Struct

from vrs_cli.values.measured import BodyMode, Report
from vrs_cli.wire.records import Joints, RecordError, Time

MAX_REPORTS = 2000  # of one message
Rows = Annotated[tuple[Joints, ...], Meta(max_length=MAX_REPORTS)]


class ReportRows(Struct, frozen=True, omit_defaults=True, kw_only=True):
    """Reports of one mode. `times` [s]: by the robot's clock; `joints` [rad, m], `velocity` [rad/s, m/s] and `effort`
    [N m, N] have a row for each time.
    """

    times: Annotated[tuple[Time, ...], Meta(min_length=1, max_length=MAX_REPORTS)]
    joints: Rows
    velocity: Rows | None = None
    effort: Rows | None = None
    mode: BodyMode = BodyMode.FOLLOWS


def reports_of(rows: ReportRows, count: int) -> list[Report]:
    """Return the reports of a robot with `count` joints. Raises RecordError for a table of another shape, and for times
    that do not rise.
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
    """Divide reports into runs that one ReportRows can hold each."""
    part: list[Report] = []
    for one in reports:
        if part and (len(part) == MAX_REPORTS or one.t <= part[-1].t or _sort(one) != _sort(part[0])):
            yield part
            part = []
        part.append(one)
    if part:
        yield part


def _sort(report: Report) -> tuple[BodyMode, bool, bool]:
    return report.mode, report.velocity is None, report.effort is None


def columns_of(reports: Sequence[Report]) -> dict[str, Any]:
    """Return the fields of ReportRows for a run of `row_parts`."""
    first = reports[0]
    return {
        "times": tuple([one.t for one in reports]),
        "joints": tuple([one.joints for one in reports]),
        "velocity": None if first.velocity is None else tuple([one.velocity for one in reports]),
        "effort": None if first.effort is None else tuple([one.effort for one in reports]),
        "mode": first.mode,
    }
