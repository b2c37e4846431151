"""The measured timeline, with reports at 100 Hz of six joints, positions and velocities: memory, and the time of a
report and of g.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice
from math import cos, sin
from random import Random
from typing import NamedTuple

import numpy as np

from benchmarks.peers.timing import each
from benchmarks.steering import memory
from benchmarks.timeline import cpu
from vrs_cli.trajectory.measured import MeasuredRecord
from vrs_cli.values.measured import Report

JOINTS, RATE, HOUR = 6, 100.0, 3600.0  # [Hz, s]
AT_ONCE = 5  # reports in one message
LOOKS, TOGETHER = 20_000, 200_000


class Costs(NamedTuple):
    """Bytes of a report; microseconds to add one, for g at one time after another, drawn at random, and for g at one of
    many times that are asked together.
    """

    bytes: float
    add: float
    look: float
    together: float


def reports(hour: int = 0) -> Iterator[tuple[Report, ...]]:
    """Yield reports of joints that swing for an hour, as many at once as come in a message."""
    count = round(HOUR * RATE)
    for first in range(hour * count, (hour + 1) * count, AT_ONCE):
        times = [k / RATE for k in range(first, first + AT_ONCE)]
        yield tuple(Report(t, (sin(t),) * JOINTS, (cos(t),) * JOINTS) for t in times)


def costs() -> Costs:
    record = MeasuredRecord(JOINTS)
    for hour in range(2):  # the second is measured: what Python takes for itself is there by then
        before = memory()
        for some in reports(hour):
            record.add(some)
    size = (memory() - before) / (HOUR * RATE)
    fresh, others = MeasuredRecord(JOINTS), list(islice(reports(), LOOKS // AT_ONCE))
    add = cpu(lambda: [fresh.add(some) for some in others]) / len(fresh)
    random, seen = Random(1), record.view
    times = [random.uniform(0.0, HOUR - 1.0) for _ in range(LOOKS)]
    many = np.array([random.uniform(0.0, HOUR - 1.0) for _ in range(TOGETHER)])
    together = min(cpu(lambda: seen.joints_over(many)) for _ in range(3)) / TOGETHER
    return Costs(size, 1e6 * add, each(seen.joints_at, times), 1e6 * together)


def main() -> None:
    it = costs()
    print(f"a report of {JOINTS} joints {it.bytes:.1f} bytes: {it.bytes / JOINTS:.2f} a joint (bar 16)")
    print(f"adding one {it.add:.2f} us, g at a time {it.look:.2f} us, at one of {TOGETHER} times {it.together:.3f} us")


if __name__ == "__main__":
    main()
