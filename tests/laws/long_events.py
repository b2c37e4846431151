"""Try many random sessions of motions and dated events: `python -m tests.laws.long_events 10000 [first seed]`."""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

from tests.by_hand import command
from tests.laws.event_sessions import session

LENGTH = 30  # commands


def main(count: int, first: int = 0) -> None:
    begun, deltas, most, windows = time.process_time(), 0, 0, 0
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(first, first + count):
            try:
                it = session(seed, LENGTH, Path(folder) / "session.vrst" if not seed % 10 else None)
            except BaseException:
                print(f"seed {seed}", flush=True)
                raise
            deltas, most, windows = deltas + it.deltas, max(most, it.most), windows + it.forgot
            if not (seed + 1) % 1000:
                print(f"{seed + 1} sessions, {deltas} deltas, {time.process_time() - begun:.0f} s", flush=True)
    found = f"{deltas} deltas, {windows} looks at windows, at most {most} events at once"
    print(f"{count} sessions, {found}, {time.process_time() - begun:.0f} s of CPU")


if __name__ == "__main__":
    command(main)
