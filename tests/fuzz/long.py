"""Fuzzing for as long as one likes: `python -m tests.fuzz.long texts MINUTES [SEED]`, or `numbers LINES [SEED]`.

Prints how many texts, or lines with extreme numbers, there were, and every one that broke a law with its seed. Status 1
when there was one.
"""

from __future__ import annotations

import os
import signal
import sys
import tempfile
import traceback
from collections.abc import Callable
from random import Random
from time import monotonic
from types import FrameType

from tests.fuzz.probe import probe, typed
from tests.fuzz.texts import text

TOO_LONG = 20  # [s] of the processor for one text, or one session
TOLD = 250  # sessions after which it is said how far it has come


class Hang(Exception):
    """A text took too long."""


def _alarm(_signal: int, _frame: FrameType | None) -> None:
    raise Hang(f"more than {TOO_LONG} s")


class Faults:
    """Those met so far, each kind told once."""

    def __init__(self) -> None:
        self.kinds: set[str] = set()

    def tried(self, seed: int, act: Callable[[Random], object]) -> None:
        signal.setitimer(signal.ITIMER_PROF, TOO_LONG)
        try:
            act(Random(seed))
        except Exception as error:
            self._tell(seed, error)
        finally:
            signal.setitimer(signal.ITIMER_PROF, 0.0)

    def _tell(self, seed: int, error: Exception) -> None:
        place = str(traceback.extract_tb(error.__traceback__)[-1])
        if place not in self.kinds:
            self.kinds.add(place)
            print(f"--- seed {seed}\n{traceback.format_exc()}", flush=True)


def texts(minutes: float, seed: int, faults: Faults) -> str:
    ends, count = monotonic() + minutes * 60.0, 0
    while monotonic() < ends:
        faults.tried(seed * 10_000_000 + count, lambda random: probe(text(random)))
        count += 1
    return f"{count} texts in {minutes:g} minutes"


def numbers(lines: float, seed: int, faults: Faults) -> str:
    done, sessions = [0], 0

    def session(random: Random) -> None:
        done[0] += typed(random)

    while done[0] < lines:
        faults.tried(seed * 10_000_000 + sessions, session)
        sessions += 1
        if sessions % TOLD == 0:
            print(f"{done[0]} lines", file=sys.stderr, flush=True)
    return f"{done[0]} lines with extreme numbers in {sessions} sessions"


def main(way: str, much: float, seed: int = 1) -> int:
    os.chdir(tempfile.mkdtemp())
    signal.signal(signal.SIGPROF, _alarm)
    faults = Faults()
    told = {"texts": texts, "numbers": numbers}[way](much, seed, faults)
    print(f"{told}, {len(faults.kinds)} kinds of faults")
    return 1 if faults.kinds else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], float(sys.argv[2]), *map(int, sys.argv[3:])))
