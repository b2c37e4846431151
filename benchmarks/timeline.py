"""The timeline from a thousand to a million segments: `python -m benchmarks.timeline [SEGMENTS ...]`.

Each operation is done at many places drawn at random, so that what is measured is not what the processor's cache
remembers of the last one. Times are CPU times; the bar is the ratio to a thousand segments.
"""

from __future__ import annotations

import gc
import random
import sys
from collections.abc import Callable, Iterator
from time import process_time

from msgspec import structs

from benchmarks.engine import wandering
from vrs_cli.engine.planner import plan
from vrs_cli.engine.position import joints_at
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.trajectory.instant import on_grid
from vrs_cli.trajectory.segment import JointPath, Segment
from vrs_cli.trajectory.timeline import Cause, Timeline, TimelineDelta
from vrs_cli.values.commands import Motion, MotionKind, Start

SIZES = (1_000, 10_000, 100_000, 1_000_000)
PATTERN = 300  # motions that are planned; longer timelines repeat them
PLACES = 400
ROUNDS = 9
WEAR = 2_000  # edits at random places that leave their cuts in a timeline
BAR = 1.5
MOTION = Motion(1, MotionKind.JOINT, Start.AT)


def tiled(count: int) -> tuple[RobotArm, Timeline]:
    """A timeline of so many segments: planned motions again and again, each with paths of its own in memory."""
    engine = wandering(PATTERN)
    pattern, period = list(engine.timeline)[1:], engine.end
    segments = [engine.timeline[0]]
    while len(segments) < count:
        for segment in pattern[: count - len(segments)]:
            segments.append(own(segment.shift_by(period * ((len(segments) - 1) // len(pattern)))))
    return engine.arm, Timeline(segments)


def own(segment: Segment) -> Segment:
    """The same with numbers of its own."""
    assert isinstance(segment.path, JointPath)
    rows = tuple(tuple([c + 0.0 if c else 0.0 for c in row]) for row in segment.path.coefficients)
    return structs.replace(segment, path=JointPath(rows))


def deltas(timeline: Timeline, source: random.Random) -> Iterator[tuple[str, TimelineDelta]]:
    """One of each edit that the timeline knows, at a place drawn at random."""
    keep = source.randrange(1, len(timeline) - 4)
    some = tuple(timeline[index] for index in range(keep, keep + 3))
    base = TimelineDelta(timeline.version, Cause.COMMAND, MOTION, 0.0, some[0].start, some[0].start, keep, 0, 0.0, ())
    yield "insert", structs.replace(base, drop=3, shift=on_grid(0.5), segments=some)
    yield "truncate", structs.replace(base, cut=some[0].start - 0.01, drop=len(timeline) - keep)
    yield "shift the rest", structs.replace(base, shift=on_grid(1.0))


def appended(timeline: Timeline, times: int) -> Timeline:
    """One motion after another put at the end, as steering does."""
    some = tuple(timeline[index] for index in (1, 2, 3))
    for _ in range(times):
        end = timeline.end
        segments = tuple(segment.shift_by(end - some[0].start) for segment in some)
        timeline = timeline.apply(
            TimelineDelta(
                timeline.version, Cause.COMMAND, some[0].motion, end, end, end, len(timeline), 0, 0.0, segments
            )
        )
    return timeline


def worn(timeline: Timeline, source: random.Random) -> Timeline:
    """After many inserts at random places, each of which shifts what is behind it."""
    for _ in range(WEAR):
        timeline = timeline.apply(dict(deltas(timeline, source))["insert"])
    return timeline


def cpu(work: Callable[[], object]) -> float:
    start = process_time()
    work()
    return process_time() - start


def each(works: list[Callable[[], object]]) -> float:
    """Time of one of them [s]: the least of some rounds, the others were disturbed."""

    def all_of_them() -> None:
        for work in works:
            work()

    return min(cpu(all_of_them) for _ in range(ROUNDS)) / len(works)


def rows(count: int) -> dict[str, float]:
    """Seconds of one operation on a timeline of `count` segments."""
    arm, timeline = tiled(count)
    source = random.Random(count)
    works: dict[str, list[Callable[[], object]]] = {}
    for _ in range(PLACES):
        for name, delta in deltas(timeline, source):
            works.setdefault(name, []).append(lambda delta=delta: timeline.apply(delta))
        t = on_grid(source.uniform(0.0, timeline.end))
        works.setdefault("query", []).append(lambda t=t: joints_at(arm, timeline, t))
        motion = structs.replace(timeline[timeline.index_at(t)].motion, number=10**9)
        insertion = lambda t=t, motion=motion: timeline.apply(plan(arm, timeline, motion, t, t))  # noqa: E731
        works.setdefault("plan and insert", []).append(insertion)
    old = worn(timeline, source)
    for _ in range(PLACES):
        delta = dict(deltas(old, source))["insert"]
        works.setdefault("insert, worn", []).append(lambda delta=delta: old.apply(delta))
        t = on_grid(source.uniform(0.0, old.end))
        works.setdefault("query, worn", []).append(lambda t=t: joints_at(arm, old, t))
    gc.collect()
    gc.freeze()  # a million segments would be walked again and again, which is not what is measured
    try:
        append = each([lambda: appended(timeline, PLACES)]) / PLACES
        return {"append": append, **{name: each(some) for name, some in works.items()}}
    finally:
        gc.unfreeze()


def main(sizes: tuple[int, ...] = SIZES) -> None:
    least: dict[str, float] = {}
    for count in sizes:
        for name, seconds in rows(count).items():
            ratio = seconds / least.setdefault(name, seconds)
            print(
                f"{name:20} {count:9,} segments {seconds * 1e6:10.2f} us   ratio {ratio:5.2f}   (bar {BAR})", flush=True
            )


if __name__ == "__main__":
    main(tuple(map(int, sys.argv[1:])) or SIZES)
