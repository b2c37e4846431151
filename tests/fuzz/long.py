"""Fuzzing for as long as one likes: `python -m tests.fuzz.long texts COUNT [SEED]`, or `numbers LINES [SEED]`.

Prints how many texts, or lines with extreme numbers, there were, what was done with them, and every fault with its seed
and text: `texts 1 SEED` tries that one alone. Text n of a run is that of SEED + n. Status 1 when there was a fault.
"""

from __future__ import annotations

import os
import signal
import sys
import tempfile
import traceback
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from random import Random
from time import process_time
from types import FrameType
from typing import Literal

from tests.by_hand import command
from tests.fuzz.probe import Probe, typed
from tests.fuzz.texts import Text, text

TOO_LONG = 20  # [s] of the processor for one text, or one session
TOLD = 5000  # texts, or lines, after which it is said how far it has come
SESSIONS = 10_000_000  # seeds of one run with numbers


class Hang(Exception):
    """A text took too long."""


class Watch:
    """Looks from time to time whether it is still the same text. To set a clock for each would be slow."""

    def __init__(self) -> None:
        self.present = self._seen = -1
        signal.signal(signal.SIGPROF, self._look)
        signal.setitimer(signal.ITIMER_PROF, TOO_LONG, TOO_LONG)

    def _look(self, _signal: int, _frame: FrameType | None) -> None:
        if self.present == self._seen:
            raise Hang(f"more than {TOO_LONG} s")
        self._seen = self.present


class Faults:
    """Those met so far, each kind told once."""

    def __init__(self) -> None:
        self._kinds = Counter[str]()
        self._watch = Watch()

    def __len__(self) -> int:
        return len(self._kinds)

    def tried(self, seed: int, act: Callable[[], object], told: object = "") -> None:
        self._watch.present = seed
        try:
            act()
        except Exception as error:
            self._tell(seed, error, told)

    def _tell(self, seed: int, error: Exception, told: object) -> None:
        place = str(traceback.extract_tb(error.__traceback__)[-1])
        self._kinds[place] += 1
        if self._kinds[place] == 1:
            print(f"--- seed {seed} {told!r}\n{traceback.format_exc()}", flush=True)


def texts(count: int, seed: int, faults: Faults) -> str:
    """Check, format, run and type texts. What they were made of, and how often each was done, is told."""
    probe, made = Probe(Path.cwd()), Counter[str]()
    began = process_time()
    for number in range(seed, seed + count):
        it = text(Random(number))
        faults.tried(number, lambda: probe(it.text), it)  # noqa: B023  # it is called at once
        made.update(_makings(it))
        if (number - seed + 1) % TOLD == 0:
            print(f"{number - seed + 1} texts, {_told(probe.counted)}", file=sys.stderr, flush=True)
    rate = count / (process_time() - began)
    return f"{count} texts ({_told(made)}): {_told(probe.counted)}; {rate:.0f} texts a CPU second"


def _makings(it: Text) -> tuple[str, ...]:
    return (it.kind, "mutated") if it.mutations else (it.kind,)


def _told(counted: Counter[str]) -> str:
    return ", ".join(f"{number} {what}" for what, number in sorted(counted.items()))


def numbers(lines: int, seed: int, faults: Faults) -> str:
    """Type lines with extreme numbers."""
    done, sessions = 0, 0

    def session() -> None:
        nonlocal done
        done += typed(Random(seed * SESSIONS + sessions))

    while done < lines:
        faults.tried(seed * SESSIONS + sessions, session)
        sessions += 1
    return f"{done} lines with extreme numbers in {sessions} sessions"


def main(way: Literal["texts", "numbers"], much: int, seed: int = 1) -> int:
    os.chdir(tempfile.mkdtemp())
    faults = Faults()
    told = {"texts": texts, "numbers": numbers}[way](much, seed, faults)
    print(f"{told}; {len(faults)} kinds of faults")
    return 1 if faults else 0


if __name__ == "__main__":
    command(main)
