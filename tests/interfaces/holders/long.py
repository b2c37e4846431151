"""The long run of `crowd.py`: `python -m tests.interfaces.holders.long [lines] [first seed] [runs]`."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

from tests.by_hand import command
from tests.interfaces.holders.crowd import Crowd


def main(lines: int = 10_000, first: int = 1, runs: int = 1) -> None:
    for seed in range(first, first + runs):
        with TemporaryDirectory() as folder:
            crowd = Crowd(seed, threads=8, lines=lines, folder=Path(folder), together=seed % 2 == 0)
            crowd.run()
        print(
            f"seed {seed}: {crowd.done} done, {crowd.refused} wrong lines, {crowd.overtaken} refused by a stop, "
            f"{crowd.left} holders gone, {crowd.faults} faults of the disk, {len(crowd.told)} times told: all agree"
        )


if __name__ == "__main__":
    command(main)
