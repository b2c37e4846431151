"""Journals for as long as one likes, with real processes: `python -m tests.files.long KILLS [ROUNDS] [FIRST]`.

KILLS sessions on one journal, each ended by kill -9 in the middle of its commands; then ROUNDS times every race for a
file, and every way to take it away while it is written. Prints what lost something that was acknowledged. Status 1
when anything did.
"""

from __future__ import annotations

import traceback
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

from tests.by_hand import command
from tests.files.contest import Vrs
from tests.files.identity import CHANGES
from tests.files.kills import DAY, killed
from tests.files.races import RACES


def main(kills: int, rounds: int = 1, first: int = 1) -> int:
    faults = kills_on_one_journal(range(first, first + kills))
    for _ in range(rounds):
        faults += sum(_faulty(name, partial(_run, race)) for name, race in RACES.items())
        faults += sum(_faulty(name, partial(taken_away, act=act)) for name, act in CHANGES.items())
    print(f"{rounds} x {len(RACES)} races, {rounds} x {len(CHANGES)} files taken away: {faults} faults", flush=True)
    return 1 if faults else 0


def kills_on_one_journal(seeds: range) -> int:
    """How many sessions lost something."""
    acknowledged, faults = list[str](), 0
    with TemporaryDirectory() as folder:
        for seed in seeds:
            faults += _faulty(f"kill {seed}", lambda _, seed=seed: killed(Path(folder), seed, acknowledged))
    print(f"{len(seeds)} kills, {len(acknowledged)} commands acknowledged: {faults} faults", flush=True)
    return faults


def _run(race: Callable[[Path], Sequence[Vrs]], folder: Path) -> None:
    for one in race(folder):
        one.check()


def taken_away(folder: Path, act: Callable[[Path], object], more: int = 3) -> None:
    """A session goes on in a fresh file, and says so before its next answer, or at its end; the status tells, too."""
    with Vrs(1, folder, "--save", DAY) as one:
        one.go()
        one.drive(3)
        act(folder / DAY)
        one.drive(more)
        assert (one.journal.name == "day-2.vrst") == (more > 0), one.said
        assert one.leave() == 1
    assert one.journal.name == "day-2.vrst", one.said
    one.check()


def _faulty(name: str, run: Callable[[Path], None]) -> int:
    with TemporaryDirectory() as folder:
        try:
            run(Path(folder))
        except Exception:
            print(f"--- {name}\n{traceback.format_exc()}", flush=True)
            return 1
    return 0


if __name__ == "__main__":
    command(main)
