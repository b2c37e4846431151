"""Try many random sessions of a robot in a cell: `python -m tests.laws.long_worlds 3000 [first seed]`."""

from __future__ import annotations

import time

from tests.by_hand import command
from tests.laws.world_sessions import session

LENGTH = 25  # commands


def main(count: int, first: int = 0) -> None:
    begun, courses, moves, changes, windows = time.process_time(), 0, 0, 0, 0
    for seed in range(first, first + count):
        try:
            it = session(seed, LENGTH)
        except BaseException:
            print(f"seed {seed}", flush=True)
            raise
        courses, moves, changes = courses + it.courses, moves + it.grips, changes + it.crossings
        windows += it.windows
        if not (seed + 1) % 100:
            print(f"{seed + 1}: {courses} courses, {time.process_time() - begun:.0f} s", flush=True)
    found = f"{courses} courses, {windows} windows, {moves} moves of parts, {changes} changes of signals"
    print(f"{count} sessions, {found}, {time.process_time() - begun:.0f} s of CPU")


if __name__ == "__main__":
    command(main)
