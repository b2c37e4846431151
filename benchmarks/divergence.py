"""What it costs to watch a body: the time of the processor for a report of the simulated PUMA 560, which follows random
motions. Needs mujoco-core.
"""

from __future__ import annotations

from benchmarks.body import ROUNDS, Following, followed
from benchmarks.timeline import cpu
from vrs_cli.twin.divergence import DivergenceWatch


def watched(it: Following) -> int:
    """Give all reports to a watch; return how many alarms it raised."""
    watch, timeline = DivergenceWatch(it.engine.arm), it.engine.timeline
    return sum(watch.take(timeline, report) is not None for report in it.reports)


def report_time(it: Following) -> float:
    """Return microseconds of a report."""
    return 1e6 * min(cpu(lambda: watched(it)) for _ in range(ROUNDS)) / len(it.reports)


def main() -> None:
    it = followed()
    took = report_time(it)
    count, false = len(it.reports), watched(it)
    print(f"{count} reports, {false} false alarms; a report {took:.0f} us, {took / 1e2:.1f} % of a core at 100 Hz")


if __name__ == "__main__":
    main()
