"""Reports of a measured robot as columns of plain numbers, side by side in memory.

A report of n joints takes 8 n bytes for positions, 4 n for velocities and 4 n for efforts where it has them, and 9
bytes for its time and mode.
"""

from __future__ import annotations

from array import array
from bisect import bisect_left
from math import nan
from typing import TYPE_CHECKING, NamedTuple

from vrs_cli.kinematics.joints import Joints
from vrs_cli.values.measured import BodyMode, Report

if TYPE_CHECKING:
    from vrs_cli.kinematics.arrays import Floats, Rows, Singles

CHUNK = 2048  # reports
MAX_NUMBER = 1e6  # of a report [rad, m, rad/s, m/s, N m, N]: what is greater is no measurement
MODES = tuple(BodyMode)
MODE, VELOCITY, EFFORT = 3, 4, 8  # bits of a flag: the place of its mode in MODES; whether it has these


class ReportArrays(NamedTuple):
    """N reports of n joints in order of time: times (N,) [s], joints (N, n) [rad, m], velocity (N, n) [rad/s, m/s] and
    effort (N, n) [N m, N], which are NaN where a report has none, and the places (N,) of modes in MODES.
    """

    times: Floats
    joints: Floats
    velocity: Singles
    effort: Singles
    modes: Rows


class ReportColumns:
    """Up to `room` reports of n joints, side by side in memory. A row is never changed once it is there, so readers may
    read the first rows while others are appended.
    """

    __slots__ = ("begin", "count", "efforts", "end", "flags", "joint_count", "positions", "times", "velocities")

    def __init__(self, joint_count: int, room: int = CHUNK) -> None:
        self.joint_count, self.count = joint_count, 0
        self.begin = self.end = nan  # times of the first and of the last report [s]
        self.times, self.flags = array("d", bytes(8 * room)), bytearray(room)
        self.positions = array("d", bytes(8 * room * joint_count))
        self.velocities: array[float] | None = None
        self.efforts: array[float] | None = None

    @property
    def full(self) -> bool:
        """Whether there is no room for another report."""
        return self.count == len(self.flags)

    def put(self, report: Report) -> None:
        """Append a report that is later than all that are here."""
        place, n = self.count, self.joint_count
        row = slice(place * n, place * n + n)
        flag = MODES.index(report.mode)
        self.times[place] = report.t
        self.positions[row] = array("d", report.joints)
        if report.velocity is not None:
            flag |= VELOCITY
            self.velocities = self.velocities or self._empty()
            self.velocities[row] = array("f", report.velocity)
        if report.effort is not None:
            flag |= EFFORT
            self.efforts = self.efforts or self._empty()
            self.efforts[row] = array("f", report.effort)
        self.flags[place] = flag
        if not place:
            self.begin = report.t
        self.end = report.t
        self.count = place + 1

    def _empty(self) -> array[float]:
        """Return a column of zeros for all reports."""
        return array("f", bytes(4 * len(self.positions)))

    def with_report(self, report: Report) -> ReportColumns:
        """Return columns that also have a report which is earlier than the last one here; no report has its time."""
        place = bisect_left(self.times, report.t, 0, self.count)
        made = ReportColumns(self.joint_count, max(len(self.flags), self.count + 1))
        made.extend(self, 0, place)
        made.put(report)
        made.extend(self, place, self.count)
        return made

    def extend(self, other: ReportColumns, first: int, last: int) -> None:
        """Append the reports from `first` to before `last` of other columns; all are later, and there is room."""
        if first >= last:
            return
        place, n = self.count, self.joint_count
        count = last - first
        rows, theirs = slice(place * n, (place + count) * n), slice(first * n, last * n)
        self.times[place : place + count] = other.times[first:last]
        self.positions[rows] = other.positions[theirs]
        if other.velocities is not None:
            self.velocities = self.velocities or self._empty()
            self.velocities[rows] = other.velocities[theirs]
        if other.efforts is not None:
            self.efforts = self.efforts or self._empty()
            self.efforts[rows] = other.efforts[theirs]
        self.flags[place : place + count] = other.flags[first:last]
        if not place:
            self.begin = other.times[first]
        self.end = other.times[last - 1]
        self.count = place + count

    def joints(self, place: int) -> Joints:
        """Return the joints of the report at a place."""
        n = self.joint_count
        return tuple(self.positions[place * n : place * n + n])

    def velocity(self, place: int) -> Joints | None:
        """Return the velocity of the report at a place; None if it has none."""
        return self._row(self.velocities, place) if self.flags[place] & VELOCITY else None

    def _row(self, column: array[float] | None, place: int) -> Joints | None:
        """Return the numbers of the report at a place in a column; None if there is no such column."""
        n = self.joint_count
        return None if column is None else tuple(column[place * n : place * n + n])

    def report(self, place: int) -> Report:
        """Return the report at a place."""
        effort = self._row(self.efforts, place) if self.flags[place] & EFFORT else None
        mode = MODES[self.flags[place] & MODE]
        return Report(self.times[place], self.joints(place), self.velocity(place), effort, mode)

    def arrays(self, first: int, last: int) -> ReportArrays:
        """Return the reports from `first` to before `last` as arrays, which must not be changed."""
        import numpy as np

        n = self.joint_count
        flags = np.frombuffer(bytes(self.flags[first:last]), np.uint8)

        def column_array(column: array[float] | None, bit: int) -> Singles:
            made = np.full((last - first, n), nan, np.float32)
            if column is not None:
                having = (flags & bit) != 0
                made[having] = np.frombuffer(column, np.float32).reshape(-1, n)[first:last][having]
            return made

        return ReportArrays(
            np.frombuffer(self.times)[first:last],
            np.frombuffer(self.positions).reshape(-1, n)[first:last],
            column_array(self.velocities, VELOCITY),
            column_array(self.efforts, EFFORT),
            (flags & MODE).astype(np.intp),
        )
