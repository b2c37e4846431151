"""Chunks of actions that arrive late: `follow` beside a queue that replaces and LeRobot's queue, which averages; 3
robots and 100 seeds of delays, known and estimated wrongly: `python -m benchmarks chunks [seeds]`.

The policy is a made one: each chunk leads from the joints that it saw to a wave, at 50 Hz for 2 s. All figures come
from joints at equal times, by differences: no model of the motion is asked. LeRobot's queue is written anew from its
documentation and source (huggingface/lerobot, docs/source/async.mdx and src/lerobot/async_inference, July 2026).
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from random import Random
from typing import NamedTuple

import numpy as np
from rich.console import Console
from rich.table import Table

from vrs_cli.engine.book import whole
from vrs_cli.engine.engine import Engine
from vrs_cli.engine.position import positions_at
from vrs_cli.engine.steering import Chunk
from vrs_cli.kinematics.arrays import Floats
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.robot_file import load_robot

ROBOTS = ("so100", "puma560", "cobra600")
SEEDS = 100
RATE, STEPS = 50, 100  # actions a second, and in a chunk, as ACT sends them (arXiv 2304.13705)
LASTING = 10.0  # [s] of each run
SOONEST, LATEST_ARRIVAL = 0.2, 0.6  # [s] from an observation to its chunk
WRONG = (0.05, 0.15)  # [s] by which an estimated time of observation is wrong at most
GROWING = 2.0  # [s] in which the waves grow
LEAD = 0.6  # [s] in which a chunk leads from the joints that it saw to its task
SHARE = 0.5  # of full velocity, acceleration and jerk, which the task takes at most
FINE, COARSE = 1e-3, 0.02  # [s] between the joints whose differences are taken, and between those whose lag is
LEROBOT_OLD, LEROBOT_NEW = 0.3, 0.7  # "weighted_average" of lerobot/async_inference/configs.py
LEROBOT_THRESHOLD = 0.5  # of a chunk: an observation is sent where the queue holds less


class Task(NamedTuple):
    """What a policy wants of a robot: waves about its middle joints, `size` (n,) [rad, m] at `rates` (n,) [rad/s]."""

    middle: Floats
    size: Floats
    rates: Floats

    @classmethod
    def of(cls, model: RobotModel, random: Random) -> Task:
        """Return waves of at most SHARE of a robot's velocity, acceleration and jerk, and a third of its ranges."""
        rates = np.array([random.uniform(0.8, 2.2) for _ in model.lower])
        size = 0.17 * np.subtract(model.upper, model.lower)
        for power, limit in enumerate((model.max_velocity, model.max_acceleration, model.max_jerk), 1):
            size = np.minimum(size, SHARE * np.array(limit) / rates**power)
        low, high = np.array(model.lower) + size, np.array(model.upper) - size
        return cls(np.clip(np.array(model.poses["ready"]), low, high), size, rates)

    def at(self, times: Floats) -> Floats:
        grown = np.minimum(times / GROWING, 1.0)[:, None] ** 2
        return self.middle + grown * self.size * np.sin(np.outer(times, self.rates))

    def chunk(self, seen: float, joints: Floats) -> tuple[Floats, Floats]:
        """Times (N,) [s] and joints (N, n) of the actions from an observation on."""
        times = seen + np.arange(STEPS) / RATE
        s = np.minimum((times - seen) / LEAD, 1.0)
        left = 1.0 - (s * s * s * (10.0 - 15.0 * s + 6.0 * s * s))[:, None]
        return times, self.at(times) + left * (joints - self.at(times[:1]))


class Ratios(NamedTuple):
    """How much of the limits of velocity, acceleration and jerk was taken at most; `lag`: the mean distance of the
    joints from what the newest chunk asks for then [deg, mm].
    """

    velocity: float
    acceleration: float
    jerk: float
    lag: float = 0.0


def ratios(model: RobotModel, joints: Floats, period: float, lag: float = 0.0) -> Ratios:
    """Take the differences of joints (N, n) at equal times: mean derivatives, which exceed a limit if anything does."""
    limits = (model.max_velocity, model.max_acceleration, model.max_jerk)
    most = [
        float((np.abs(np.diff(joints, k, axis=0)) / period**k / np.array(limit)).max())
        for k, limit in enumerate(limits, 1)
    ]
    return Ratios(most[0], most[1], most[2], lag)


def arrivals(random: Random) -> Iterator[tuple[float, float]]:
    """When each chunk is seen and arrives, one after the other [s]."""
    seen = 0.0
    while seen < LASTING:
        arrival = seen + random.uniform(SOONEST, LATEST_ARRIVAL)
        yield seen, arrival
        seen = arrival


def followed(model: RobotModel, seed: int, wrong: float = 0.0) -> Ratios:
    """Follow the chunks of a seed; each is stamped with up to `wrong` [s] too early or too late a time."""
    random, engine = Random(seed), Engine(model)
    task, start = Task.of(model, random), engine.position().joints
    asked: list[tuple[float, Chunk]] = []
    for seen, arrival in arrivals(random):
        times, actions = task.chunk(seen, np.array(engine.position(seen).joints if seen else start))
        times = times + random.uniform(-wrong, wrong)
        coming = times >= arrival
        chunk = Chunk(model, times[coming].tolist(), [tuple(row) for row in actions[coming].tolist()])
        asked.append((whole(engine.follow(chunk)).begin, chunk))
    joints = positions_at(engine.arm, engine.timeline, np.arange(0.0, LASTING, FINE)).joints
    return ratios(model, joints, FINE, _lag(engine, asked))


def _lag(engine: Engine, asked: list[tuple[float, Chunk]]) -> float:
    """The mean distance from what the newest chunk asks for, of all joints, at equal times [deg, mm]."""
    errors, ends = [], [begin for begin, _ in asked[1:]] + [LASTING]
    for (begin, chunk), end in zip(asked, ends, strict=True):
        times = np.arange(np.ceil(begin / COARSE) * COARSE, end, COARSE)
        errors.append(positions_at(engine.arm, engine.timeline, times).joints - chunk.at(times))
    scales = [1e3 if engine.model.units.slides(k) else np.degrees(1.0) for k in range(1, engine.model.joint_count + 1)]
    return float((np.abs(np.concatenate(errors)) * np.array(scales)).mean())


def replacing(model: RobotModel, seed: int) -> Ratios:
    """A queue that drops what it has when a chunk arrives, and plays the chunk from its first action on."""
    random = Random(seed)
    task, played = Task.of(model, random), [np.array(model.poses["ready"])]
    queue: list[Floats] = []
    for seen, arrival in arrivals(random):
        _, actions = task.chunk(seen, played[-1])
        for _ in range(round(arrival * RATE) - round(seen * RATE)):
            played.append(queue.pop(0) if queue else played[-1])
        queue = list(actions)
    return ratios(model, np.array(played), 1.0 / RATE)


def averaging(model: RobotModel, seed: int) -> Ratios:
    """LeRobot's queue of asynchronous inference (`RobotClient._aggregate_action_queues`): actions have numbers, counted
    from the last one that was played when the policy looked. Of a new chunk those that are not played yet take the
    place of the queue; where the queue holds the same number, as the weighted average of both.
    """
    random = Random(seed)
    task, played = Task.of(model, random), [np.array(model.poses["ready"])]
    queue: dict[int, Floats] = {}
    latest, coming = -1, None
    for step in range(round(LASTING * RATE)):
        t = step / RATE
        if coming is None and len(queue) <= LEROBOT_THRESHOLD * STEPS:
            number, (_, actions) = max(latest, 0), task.chunk(t, played[-1])
            coming = t + random.uniform(SOONEST, LATEST_ARRIVAL), {number + k: row for k, row in enumerate(actions)}
        if coming is not None and t >= coming[0]:
            new = {k: row for k, row in coming[1].items() if k > latest}
            queue = {k: LEROBOT_OLD * queue[k] + LEROBOT_NEW * row if k in queue else row for k, row in new.items()}
            coming = None
        if queue:
            latest = min(queue)
            played.append(queue.pop(latest))
        else:
            played.append(played[-1])
    return ratios(model, np.array(played), 1.0 / RATE)


WAYS: dict[str, Callable[[RobotModel, int], Ratios]] = {
    "a queue that replaces": replacing,
    "LeRobot's weighted average": averaging,
    "follow": followed,
    **{
        f"follow, times wrong by {wrong:g} s": lambda model, seed, wrong=wrong: followed(model, seed, wrong)
        for wrong in WRONG
    },
}


def main() -> None:
    """Show the largest ratios of all seeds, and the mean lag of the worst seed."""
    seeds = int(sys.argv[-1]) if sys.argv[-1].isdigit() else SEEDS
    table = Table("robot", "way", "velocity", "acceleration", "jerk", "lag, deg (mm)", title=f"{seeds} seeds of delays")
    for name in ROBOTS:
        model = load_robot(name)
        for way, of in WAYS.items():
            worst = np.array([of(model, seed) for seed in range(seeds)]).max(axis=0).tolist()
            *limits, lag = [f"{number:.2f}" for number in worst]
            table.add_row(name, way, *limits, lag if of not in (replacing, averaging) else "")
    console = Console(width=120)
    console.print(table)
    console.print("Velocity, acceleration and jerk are parts of the limits; of queues they are those of their steps.")


if __name__ == "__main__":
    main()
