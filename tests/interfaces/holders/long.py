"""The long run of `crowd.py`: `python -m tests.interfaces.holders.long [lines] [first seed] [runs]`."""

from __future__ import annotations

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from tests.interfaces.holders.crowd import Crowd


def main() -> None:
    lines, first, runs = _asked()
    for seed in range(first, first + runs):
        with TemporaryDirectory() as folder:
            crowd = Crowd(seed, threads=8, lines=lines, folder=Path(folder), together=seed % 2 == 0)
            crowd.run()
        print(
            f"seed {seed}: {crowd.done} done, {crowd.refused} wrong lines, {crowd.overtaken} refused by a stop, "
            f"{crowd.left} holders gone, {crowd.faults} faults of the disk, {len(crowd.told)} times told: all agree"
        )


def _asked() -> tuple[int, int, int]:
    given = [int(text) for text in sys.argv[1:4]]
    lines, first, runs = [*given, *(10_000, 1, 1)[len(given) :]]
    return lines, first, runs


if __name__ == "__main__":
    main()
