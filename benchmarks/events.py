"""Dated events on the timeline: what one costs, and the state of a channel at any time: `python -m benchmarks.events`.

Times are CPU times, the best of some rounds.
"""

from __future__ import annotations

import gc
import random
from collections.abc import Iterator
from time import process_time

from benchmarks.engine import straight, traced, wandering
from vrs_cli.engine.engine import Engine
from vrs_cli.interfaces.dialogue import Notes
from vrs_cli.interfaces.session.session import Session
from vrs_cli.kinematics.joints import Profile
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.commands import HAND, SetChannels, Stamp

EVENTS = 10_000
READS = 20_000
LOOPS = 2000  # of a program
ROUNDS = 5
CHANNELS = 8


def requests(order: str) -> Iterator[SetChannels]:
    """So many signals: each later than the one before, or at times drawn at random."""
    source = random.Random(1)
    for number in range(EVENTS):
        at = 0.01 * number if order == "at the end" else round(source.uniform(0.0, 0.01 * EVENTS), 3)
        yield SetChannels(((1 + number % CHANNELS, float(number & 1)),), Stamp(at), "SIGNAL 1")


def given(order: str) -> tuple[Engine, float]:
    """A robot with all these events, and how long one took [s]."""
    engine, all_of_them = wandering(20), list(requests(order))
    gc.collect()
    begun = process_time()
    for request in all_of_them:
        engine.begin(request, program=True)
    return engine, (process_time() - begun) / EVENTS


def memory() -> float:
    """What an event takes with all that UNDO needs [bytes]."""
    taken, (engine, _) = traced(lambda: given("at the end"))
    assert engine.timeline.event_count == EVENTS
    return taken / EVENTS


def reading(timeline: Timeline, channels: tuple[int, ...]) -> float:
    """How long it takes to tell what a channel is at a time drawn at random [s]."""
    source, best = random.Random(2), 1.0
    asked = [(source.choice(channels), source.uniform(0.0, timeline.last)) for _ in range(READS)]
    for _ in range(ROUNDS):
        begun = process_time()
        for channel, t in asked:
            timeline.value_at(channel, t)
        best = min(best, (process_time() - begun) / READS)
    return best


def program(*steps: str) -> float:
    """How long a loop with these steps takes each time [s]."""
    session = Session(Notes())
    session.load_text("\n".join((".PROGRAM loop()", f"FOR i = 1 TO {LOOPS}", *steps, "END", ".END\n")))
    gc.collect()
    begun = process_time()
    session.execute("loop")
    return (process_time() - begun) / LOOPS


def of_programs() -> tuple[float, float]:
    """What a SIGNAL and what the observation of a signal costs a program [s]."""
    signals = ("SIGNAL 2", "SIGNAL -2")
    empty, two, read = (
        min(program(*steps) for _ in range(ROUNDS))
        for steps in (("x = 1", "IF x == 1 THEN", "END"), ("x = 1", *signals), ("IF SIG(1) THEN", "END", *signals))
    )
    return (two - empty) / 2.0, read - two


def figures() -> Iterator[tuple[str, str, float, float]]:
    """Name, unit, value, and what is wanted."""
    for order in ("at the end", "at random times"):
        tried = [given(order) for _ in range(ROUNDS)]
        yield f"an event {order}", "us", 1e6 * min(took for _, took in tried), 40.0
        timeline = tried[0][0].timeline
        yield (
            f"- a signal at a time, {EVENTS} events",
            "us",
            1e6 * reading(timeline, tuple(range(1, CHANNELS + 1))),
            2.0,
        )
        yield "- the hand, which none of them changes", "us", 1e6 * reading(timeline, (HAND,)), 2.0
    signal, observation = of_programs()
    yield "SIGNAL of a program", "us", 1e6 * signal, 40.0
    yield "an observation of a program", "us", 1e6 * observation, 40.0
    yield "an event, memory", "bytes", memory(), 1500.0


def main() -> None:
    for name, unit, value, wanted in figures():
        print(f"{name:42} {value:9.2f} {unit:6} wanted: {wanted:g}", flush=True)
    print(f"f, MOVES of 200 mm, in the same run {straight(Profile.LSPB).ours:15.0f} us")


if __name__ == "__main__":
    main()
