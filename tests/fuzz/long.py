"""Fuzzing for as long as one likes: `python -m tests.fuzz.long MINUTES [SEED]`.

Prints the number of texts, and every text that broke a law with its seed. Status 1 when there was one.
"""

from __future__ import annotations

import os
import signal
import sys
import tempfile
import traceback
from random import Random
from time import monotonic
from types import FrameType

from tests.fuzz.probe import probe
from tests.fuzz.texts import text

TOO_LONG = 20  # [s] for one text


class Hang(Exception):
    """A text took too long."""


def _alarm(_signal: int, _frame: FrameType | None) -> None:
    raise Hang(f"more than {TOO_LONG} s")


def main(minutes: float, seed: int = 1) -> int:
    os.chdir(tempfile.mkdtemp())
    signal.signal(signal.SIGALRM, _alarm)
    ends, count, known = monotonic() + minutes * 60.0, 0, set[str]()
    while monotonic() < ends:
        number = seed * 10_000_000 + count
        count += 1
        found = _tried(number)
        place = found.splitlines()[-1] if found else ""
        if found and place not in known:
            known.add(place)
            print(f"--- seed {number}\n{text(Random(number))!r}\n{found}", flush=True)
    print(f"{count} texts in {minutes:g} minutes, {len(known)} kinds of faults")
    return 1 if known else 0


def _tried(seed: int) -> str:
    """What a text breaks, as a traceback; empty where all is well."""
    signal.alarm(TOO_LONG)
    try:
        probe(text(Random(seed)))
    except Exception:
        return traceback.format_exc()
    finally:
        signal.alarm(0)
    return ""


if __name__ == "__main__":
    sys.exit(main(float(sys.argv[1]), *map(int, sys.argv[2:])))
