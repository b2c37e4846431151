"""An hour of steering at 50 Hz, through the whole engine, with each profile: `python -m benchmarks steering`."""

from __future__ import annotations

import gc
import sys
from array import array
from math import cos, degrees, pi, radians
from statistics import median
from time import perf_counter, process_time

from benchmarks.report import Figure, show
from vrs_cli.cli.steer import KEPT
from vrs_cli.engine.engine import Engine
from vrs_cli.interfaces.streams import Steering
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.model import PROFILES
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.values.commands import SetParameter

TARGETS = 180_000
PERIOD = 0.02  # [s]
PART = 2_000  # targets whose times are compared: the first of them, and the last
SWING, LASTING = radians(40.0), 4.0  # of every joint [rad, s]: 31 deg/s at most


def main() -> None:
    for profile in PROFILES:
        hour(profile)


def hour(profile: str) -> None:
    """Measure a stream that the robot follows with a profile, and show it."""
    engine = Engine(load_robot("puma560"))
    engine.perform(SetParameter("PROFILE", profile))
    begun, before = perf_counter(), memory()
    steering, times = stream(engine, TARGETS)
    passed, following = perf_counter() - begun, steering.following
    figures = [
        Figure("a target, the first 2000", 1e6 * median(times[100 : PART + 100])),
        Figure("a target, the last 2000", 1e6 * median(times[-PART:]), "as the first"),
        Figure("a target, the slowest of 180,000", 1e6 * max(times), "20,000: the period"),
    ]
    show(
        f"Steering at 50 Hz for an hour, {profile}",
        figures,
        (
            f"{TARGETS} targets in {passed:.1f} s: {TARGETS * PERIOD / passed:.0f} times as fast as real time",
            f"{len(engine.timeline)} segments, {len(engine.book.deltas)} deltas, {(memory() - before) / 1e6:.0f} MB",
            f"followed to {degrees(following.turning.rms):.3f} deg rms, {degrees(following.turning.worst):.3f} at most",
        ),
    )


def stream(engine: Engine, count: int) -> tuple[Steering, array[float]]:
    """The steering after so many targets, and how long the processor took for each [s]."""
    steering, times = Steering(engine), array("d")  # a list would weigh a tenth of what is measured
    for k in range(count):
        if k % KEPT == 0:
            gc.freeze()  # as `vrs lab steer` does
        target = swinging(engine.model.poses["ready"], k * PERIOD)
        before = process_time()
        steering.to(target, k * PERIOD)
        times.append(process_time() - before)
    return steering, times


def swinging(middle: Joints, t: float) -> Joints:
    """All joints to and fro, neighbours against each other."""
    away = 0.5 * SWING * (1.0 - cos(2.0 * pi * t / LASTING))
    return tuple(q + (away if i % 2 else -away) for i, q in enumerate(middle))


def memory() -> int:
    """What Python's values take now [bytes]; 0 where the system does not say."""
    gc.collect()
    try:
        with open("/proc/self/statm", encoding="ascii") as statm:
            return int(statm.read().split()[1]) * 4096
    except OSError:
        return 0


if __name__ == "__main__":
    sys.exit(main())
