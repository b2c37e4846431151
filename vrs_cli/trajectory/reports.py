"""Store the reports of the real or simulated arm as columns of plain numbers, contiguous in memory.

A report of n joints takes 8 n bytes for positions, 4 n for velocities (if any), 4 n for efforts (if any), and 9 bytes
for its time and mode.
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

CHUNK_REPORTS = 2048  # number of reports for which columns have room by default
MAX_NUMBER = 1e6  # maximum size of a number in a report [rad, m, rad/s, m/s, N m, N]; a larger one is an error
MODES = tuple(BodyMode)
MODE, VELOCITY, EFFORT = 3, 4, 8  # bits of a flag: index of the mode in MODES; whether there are velocities, efforts


class ReportArrays(NamedTuple):
    """N reports of n joints in order of time: times (N,) [s], joints (N, n) [rad, m], velocity (N, n) [rad/s, m/s] and
    effort (N, n) [N m, N], which are NaN where a report has none, and the indices (N,) of their modes in MODES.
    """

    times: Floats
    joints: Floats
    velocity: Singles
    effort: Singles
    modes: Rows


class ReportColumns:
    """Up to `room` reports of n joints, contiguous in memory. A stored report never changes, so readers may read the
    stored reports while others are appended.
    """

    __slots__ = ("begin", "count", "end", "flags", "joint_count", "positions", "rates", "times")

    def __init__(self, joint_count: int, room: int = CHUNK_REPORTS) -> None:
        self.joint_count, self.count = joint_count, 0
        self.begin = self.end = nan  # times of the first and of the last report [s]
        # not `array("d", bytes(...))`: the bytes would leave holes in the memory between the columns
        self.times, self.positions = array("d", [0.0]) * room, array("d", [0.0]) * (room * joint_count)
        self.flags = bytearray(room)
        self.rates: dict[int, array[float]] = {}  # keys VELOCITY and EFFORT; a column exists once a report has values

    @property
    def full(self) -> bool:
        return self.count == len(self.flags)

    def put(self, report: Report) -> None:
        """Append a report that is later than all reports in the columns."""
        place, n = self.count, self.joint_count
        row = slice(place * n, place * n + n)
        flag = MODES.index(report.mode)
        self.times[place] = report.t
        self.positions[row] = array("d", report.joints)
        for bit, numbers in ((VELOCITY, report.velocity), (EFFORT, report.effort)):
            if numbers is not None:
                flag |= bit
                self._column(bit)[row] = array("f", numbers)
        self.flags[place] = flag
        if not place:
            self.begin = report.t
        self.end = report.t
        self.count = place + 1

    def _column(self, bit: int) -> array[float]:
        """Return the column of velocities or efforts (`bit`: VELOCITY or EFFORT). It is made for the first report that
        has such values.
        """
        if bit not in self.rates:
            self.rates[bit] = array("f", [0.0]) * len(self.positions)
        return self.rates[bit]

    def with_report(self, report: Report) -> ReportColumns:
        """Return a copy with an additional report, which is earlier than the last report and has a time that no other
        report has.
        """
        place = bisect_left(self.times, report.t, 0, self.count)
        made = ReportColumns(self.joint_count, max(len(self.flags), self.count + 1))
        made.extend(self, 0, place)
        made.put(report)
        made.extend(self, place, self.count)
        return made

    def extend(self, other: ReportColumns, first: int, last: int) -> None:
        """Append the reports from `first` up to, but not including, `last` of other columns. They must be later than
        the reports here, and there must be room for them.
        """
        if first >= last:
            return
        place, n = self.count, self.joint_count
        count = last - first
        rows, theirs = slice(place * n, (place + count) * n), slice(first * n, last * n)
        self.times[place : place + count] = other.times[first:last]
        self.positions[rows] = other.positions[theirs]
        for bit, column in other.rates.items():
            self._column(bit)[rows] = column[theirs]
        self.flags[place : place + count] = other.flags[first:last]
        if not place:
            self.begin = other.times[first]
        self.end = other.times[last - 1]
        self.count = place + count

    def joints(self, place: int) -> Joints:
        n = self.joint_count
        return tuple(self.positions[place * n : place * n + n])

    def velocity(self, place: int) -> Joints | None:
        return self._row(VELOCITY, place)

    def _row(self, bit: int, place: int) -> Joints | None:
        n = self.joint_count
        return tuple(self.rates[bit][place * n : place * n + n]) if self.flags[place] & bit else None

    def report(self, place: int) -> Report:
        mode = MODES[self.flags[place] & MODE]
        return Report(self.times[place], self.joints(place), self.velocity(place), self._row(EFFORT, place), mode)

    def arrays(self, first: int, last: int) -> ReportArrays:
        """Return the reports from `first` up to, but not including, `last` as arrays, which the caller must not
        change.
        """
        import numpy as np

        n = self.joint_count
        flags = np.frombuffer(bytes(self.flags[first:last]), np.uint8)

        def column_array(bit: int) -> Singles:
            made = np.full((last - first, n), nan, np.float32)
            if bit in self.rates:
                having = (flags & bit) != 0
                made[having] = np.frombuffer(self.rates[bit], np.float32).reshape(-1, n)[first:last][having]
            return made

        return ReportArrays(
            np.frombuffer(self.times)[first:last],
            np.frombuffer(self.positions).reshape(-1, n)[first:last],
            column_array(VELOCITY),
            column_array(EFFORT),
            (flags & MODE).astype(np.intp),
        )
