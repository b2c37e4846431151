"""An hour of steering over a jittery line, in virtual time: the jerk of a robot that takes targets as they come, and of
one that follows stamped chunks: `python -m benchmarks jitter [SECONDS]`.

Somebody steers by smooth targets at 50 Hz, over a way of gamma 200 +- 80 ms. A naive client sets the joints to each
target when it comes. `redirected`: the robot goes after each target when it comes, within its limits. `stamped`:
targets go in chunks, each due so long after its time as `vrs lab steer ws://...` lets it be by default. Jerk is the
third difference of joints at the same 50 Hz, of all three, and of the targets themselves.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from random import Random
from typing import NamedTuple

import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.chunks import RATE, Task
from vrs_cli.api.control import CHUNK_S
from vrs_cli.cli.steer import ALLOWANCE
from vrs_cli.engine.book import whole
from vrs_cli.engine.clock import WallClock
from vrs_cli.engine.engine import Engine
from vrs_cli.engine.position import positions_at
from vrs_cli.engine.steering import Chunk
from vrs_cli.errors import TooLate
from vrs_cli.interfaces.streams import Steering
from vrs_cli.kinematics.arrays import Floats
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.net.delay_line import DelayLine, Gamma
from vrs_cli.values.commands import SetParameter

HOUR = 3600.0  # [s]
LINE, ROUND_TRIP = Gamma(0.2, 0.08), 0.4  # [s]
LEAD = ROUND_TRIP + CHUNK_S + ALLOWANCE  # [s]
BEGIN = 5.0  # [s] that are left out: the targets begin away from the robot
ROBOT = "puma560"


class Steered(NamedTuple):
    """Joints (N, n) [rad] at 50 Hz; `lag`: how much later than the targets they are meant to be [s]; `late`: the share
    of targets that came too late for that.
    """

    joints: Floats
    lag: float
    late: float = 0.0


class Jerk(NamedTuple):
    """The root mean square of all joints' jerk [deg/s3], and the largest as a part of its limit; `error`: the mean
    distance from the targets, at equal times but for the lag that is meant [deg].
    """

    rms: float
    most: float
    error: float


def jerk(model: RobotModel, it: Steered, targets: Floats) -> Jerk:
    first, late = round(BEGIN * RATE), round(it.lag * RATE)
    found = np.diff(it.joints[first:], 3, axis=0) * RATE**3
    error = np.abs(it.joints[first:] - targets[first - late : len(targets) - late]).mean()
    most = (np.abs(found) / np.array(model.max_jerk)).max()
    return Jerk(float(np.degrees(np.sqrt((found**2).mean()))), float(most), float(np.degrees(error)))


def naive(model: RobotModel, times: Floats, targets: Floats) -> Steered:
    """Set the joints to the newest target that has come."""
    arrived = np.array(_arrivals(times))
    newest = np.searchsorted(arrived, times, side="right") - 1
    ready = np.array(model.poses["ready"])
    return Steered(np.where(newest[:, None] >= 0, targets[np.maximum(newest, 0)], ready), LINE.mean)


def redirected(model: RobotModel, times: Floats, targets: Floats) -> Steered:
    """Go after each target when it comes."""
    now = 0.0
    engine = Engine(model, clock=WallClock(lambda: now, lambda _seconds: None))
    engine.perform(SetParameter("PROFILE", "SCURVE"))
    steering = Steering(engine)
    for now, t, target in zip(_arrivals(times), times.tolist(), targets.tolist(), strict=True):  # noqa: B007
        steering.to(tuple(target), t)
    return Steered(positions_at(engine.arm, engine.timeline, times).joints, LINE.mean)


def stamped(model: RobotModel, times: Floats, targets: Floats) -> Steered:
    """Follow chunks, each of which goes on from the last target of the one before."""
    now, late = 0.0, 0
    engine = Engine(model, clock=WallClock(lambda: now, lambda _seconds: None))
    chunks = list(_chunks(times))
    arrivals = _arrivals(np.array([times[last - 1] for _, last in chunks]))
    for now, (first, last) in zip(arrivals, chunks, strict=True):  # noqa: B007
        engine.clock.advance(engine.clock.reached)
        due = (times[first:last] + LEAD).tolist()
        try:
            chunk = Chunk(model, due, list(map(tuple, targets[first:last].tolist())))
            late += max(whole(engine.follow(chunk)).late - 1, 0)
        except TooLate:
            late += last - first
    return Steered(positions_at(engine.arm, engine.timeline, times).joints, LEAD, late / len(times))


def _arrivals(times: Floats) -> list[float]:
    line = DelayLine(LINE, "jitter")
    return [line.arrival(t) for t in times.tolist()]


def _chunks(times: Floats) -> Iterator[tuple[int, int]]:
    step = round(CHUNK_S * RATE)
    for first in range(0, len(times), step):
        yield max(first - 1, 0), min(first + step, len(times))


WAYS = {"naive": naive, "redirected": redirected, "stamped": stamped}


def measured(seconds: float = HOUR) -> dict[str, tuple[Jerk, Steered]]:
    model = load_robot(ROBOT)
    times = np.arange(0.0, seconds, 1.0 / RATE)
    targets = Task.of(model, Random(1)).at(times)
    found = {"targets": Steered(targets, 0.0)} | {name: way(model, times, targets) for name, way in WAYS.items()}
    return {name: (jerk(model, it, targets), it) for name, it in found.items()}


def main() -> None:
    seconds = float(sys.argv[-1]) if sys.argv[-1].replace(".", "").isdigit() else HOUR
    columns = ("way", "jerk, rms, deg/s3", "largest, of its limit", "error, deg", "later by, s", "too late, %")
    table = Table(*columns, title=f"{seconds:g} s of steering over gamma 200 +- 80 ms")
    for name, (it, steered) in measured(seconds).items():
        cells = f"{it.rms:.0f}", f"{it.most:.2f}", f"{it.error:.2f}", f"{steered.lag:g}", f"{100 * steered.late:.2f}"
        table.add_row(name, *cells)
    Console(width=110).print(table)


if __name__ == "__main__":
    main()
