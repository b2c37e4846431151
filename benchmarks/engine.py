"""Planner f and position g: `python -m benchmarks.engine`. scipy's PPoly reads the same timeline, where installed."""

from __future__ import annotations

import random
from collections.abc import Callable
from statistics import median
from time import perf_counter

from vrs_cli.engine.commands import JointTarget, Move, PoseTarget
from vrs_cli.engine.engine import Engine
from vrs_cli.engine.planner import plan
from vrs_cli.engine.position import joints_at, joints_over, positions_at
from vrs_cli.kinematics.model import load_robot
from vrs_cli.trajectory.segment import JointPath
from vrs_cli.trajectory.timeline import Timeline

REPEATS = 9


def timed(work: Callable[[], object], count: int) -> float:
    """Median time of one of `count` calls [s]."""
    times = []
    for _ in range(REPEATS):
        start = perf_counter()
        for _ in range(count):
            work()
        times.append((perf_counter() - start) / count)
    return median(times)


def wandering(motions: int, seed: int = 1) -> Engine:
    """An engine with a timeline of so many joint-interpolated motions, three segments each."""
    model = load_robot("puma560")
    engine, source = Engine(model), random.Random(seed)
    for _ in range(motions):
        goal = tuple(source.uniform(low, high) for low, high in zip(model.lower, model.upper, strict=True))
        engine.perform(Move(JointTarget(goal), straight=False))
    return engine


def ppoly(timeline: Timeline) -> Callable[[float], object] | None:
    """The same joint-space timeline in scipy's piecewise polynomials."""
    try:
        import numpy as np
        from scipy.interpolate import PPoly
    except ImportError:
        return None
    segments = [s for s in timeline if s.duration and isinstance(s.path, JointPath)]
    coefficients = np.zeros((3, len(segments), len(segments[0].path.coefficients)))  # type: ignore[union-attr]
    for k, segment in enumerate(segments):
        assert isinstance(segment.path, JointPath)
        for joint, a in enumerate(segment.path.coefficients):
            for power, value in enumerate(a):
                coefficients[2 - power, k, joint] = value
    return PPoly(coefficients, [*(s.start for s in segments), segments[-1].finish])


def row(what: str, seconds: float, bar: str, peer: str = "") -> None:
    print(f"{what:48} {seconds * 1e6:10.2f} us   {bar:26} {peer}")


def main() -> None:
    engine = wandering(3400)
    arm, timeline = engine.arm, engine.timeline
    source = random.Random(2)
    times = [source.uniform(0.0, engine.end) for _ in range(1000)]
    print(f"timeline of {len(timeline)} segments, {engine.end:.0f} s; medians of {REPEATS}")

    scalar = timed(lambda: [joints_at(arm, timeline, t) for t in times], 1) / len(times)
    peer = ppoly(timeline)
    beside = "scipy is not installed"
    if peer is not None:
        read = peer
        theirs = timed(lambda: [read(t) for t in times], 1) / len(times)
        beside = f"scipy PPoly {theirs * 1e6:.2f} us, ratio {scalar / theirs:.2f}"
    row("g, one time, joint space", scalar, "at most 2 us", beside)

    import numpy as np

    many = np.sort(np.array([source.uniform(0.0, engine.end) for _ in range(100_000)]))
    array = timed(lambda: positions_at(arm, timeline, many), 1) / len(many)
    beside = ""
    if peer is not None:
        read_array: Callable[..., object] = peer
        theirs = timed(lambda: read_array(many), 1) / len(many)
        beside = f"scipy PPoly (joints only) {theirs * 1e6:.3f} us, ratio {array / theirs:.1f}"
    row("g, 100,000 sorted times, all of it, per time", array, "", beside)
    joints = timed(lambda: joints_over(arm, timeline, many), 1) / len(many)
    beside = "" if peer is None else f"scipy PPoly {theirs * 1e6:.3f} us, ratio {joints / theirs:.2f}"
    row("- joints only", joints, "at most 2 x PPoly", beside)

    last = engine.deltas[-1].motion
    end = timeline.end
    row("f, MOVE from rest", timed(lambda: plan(arm, timeline, last, end, end), 50), "at most 100 us")
    middle = timeline[5001].start + 0.4 * timeline[5001].duration
    row(
        "f, MOVE from motion, the rest dropped",
        timed(lambda: plan(arm, timeline, last, middle, middle, insert=False), 50),
        "at most 100 us",
    )
    row("f, MOVE inserted, next motion planned again", timed(lambda: plan(arm, timeline, last, middle, middle), 50), "")
    delta = plan(arm, timeline, last, middle, middle)
    row("apply an insertion in the middle", timed(lambda: timeline.apply(delta), 50), "")

    line = Engine(load_robot("puma560"))
    line.perform(Move(JointTarget(tuple(x * np.pi / 180 for x in (0, -45, 180, 0, 45, 0))), straight=False))
    pose = line.position().T_world_tool
    line.perform(Move(PoseTarget(pose._replace(py=pose.py + 0.2)), straight=True))
    before = line.timeline
    at = before.end
    back = Move(PoseTarget(pose), straight=True)
    line.perform(back)
    motion = line.deltas[-1].motion
    row("f, MOVES from rest, verified", timed(lambda: plan(arm, before, motion, at, at), 20), "")


if __name__ == "__main__":
    main()
