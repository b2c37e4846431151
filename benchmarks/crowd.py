"""How evenly a robot is looked at, alone and idle, and where 30 robots in one process each run a program without end:
`python -m benchmarks crowd [robots] [seconds]`.

A viewer samples g at 50 Hz in a thread of its own; a gap is the time between two of its samples. One process has one
interpreter lock: threads that compute take turns of 5 ms. A process a robot is measured beside it.
"""

from __future__ import annotations

import multiprocessing
import os
import sys
import time
from itertools import pairwise
from statistics import median
from threading import Thread
from typing import NamedTuple

from benchmarks.longest import Quiet
from tests.interfaces.holders.holder import Holder
from vrs_cli.engine.clock import WallClock
from vrs_cli.engine.position import joints_at
from vrs_cli.interfaces.session.session import Session

ROBOTS, SECONDS, RATE = 30, 4.0, 50.0
BUSY = ".PROGRAM busy\nDO\nx = x+1\nDRIVE 1, 1, 100\nDRIVE 1, -1, 100\nUNTIL FALSE\n.END"
SPIN = ".PROGRAM spin\nDO\nx = x+1\nUNTIL FALSE\n.END"


class Gaps(NamedTuple):
    """Between two samples of a viewer [ms]."""

    middle: float
    worst: float

    def __str__(self) -> str:
        return f"{self.middle:6.1f} ms median, {self.worst:7.1f} ms at most"


def main() -> None:
    given = [float(text) for text in sys.argv[2:4]]
    robots, seconds = [*given, *(ROBOTS, SECONDS)[len(given) :]]
    print(f"Gaps between the samples of a viewer at {RATE:g} Hz, for {seconds:g} s; {os.cpu_count()} cores")
    print(f"{'one idle robot':<52} {in_threads(1, '', seconds)}")
    for name, text in (("moves without end", BUSY), ("computes without end", SPIN)):
        print(f"{f'{robots:g} robots in one process, each {name}':<52} {in_threads(int(robots), text, seconds)}")
        print(f"{f'{robots:g} processes, each {name}':<52} {in_processes(int(robots), text, seconds)}", flush=True)


def in_threads(robots: int, text: str, seconds: float) -> Gaps:
    served = [robot(text) for _ in range(robots)]
    gaps = looked_at(served[0], seconds)
    for session in served:
        session.actor.close()
    return gaps


def in_processes(robots: int, text: str, seconds: float) -> Gaps:
    context = multiprocessing.get_context("fork")
    told: multiprocessing.SimpleQueue[Gaps] = context.SimpleQueue()

    def alone() -> None:
        told.put(in_threads(1, text, seconds))

    processes = [context.Process(target=alone) for _ in range(robots)]
    for process in processes:
        process.start()
    found = [told.get() for _ in processes]
    for process in processes:
        process.join()
    return Gaps(median(gaps.middle for gaps in found), max(gaps.worst for gaps in found))


def robot(text: str) -> Session:
    """A robot in real time that is served, and runs a program if there is one."""
    session = Session(Quiet(), clock=WallClock(time.monotonic, time.sleep))
    if text:
        session.load_text(text)
    session.actor.serve()
    if text:
        Holder(session).ask(f"EXECUTE {text.split()[1]}")
    return session


def looked_at(session: Session, seconds: float) -> Gaps:
    at: list[float] = []
    holder, ends = Holder(session), time.monotonic() + seconds

    def view() -> None:
        due = time.monotonic()
        while due < ends:
            joints_at(holder.arm, holder.timeline, holder.now)
            at.append(time.monotonic())
            due += 1.0 / RATE
            time.sleep(max(due - time.monotonic(), 0.0))

    viewer = Thread(target=view)
    viewer.start()
    viewer.join()
    gaps = [1e3 * (b - a) for a, b in pairwise(at)]
    return Gaps(median(gaps), max(gaps))


if __name__ == "__main__":
    main()
