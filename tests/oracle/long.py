"""Random programs for as long as one likes: `python -m tests.oracle.long PROGRAMS [FIRST]`.

Seeds FIRST, FIRST + 1, ... are tried, the robots in turn. Prints the seed, the program and the faults of each that
broke a law, and ends with status 1 then; `python -m tests.oracle.long 1 SEED` shows one again.
"""

from __future__ import annotations

import traceback
from pathlib import Path
from tempfile import TemporaryDirectory

from tests.by_hand import command
from tests.oracle.trial import Trial

TOLD = 5  # faults of a program


def main(programs: int, first: int = 1) -> int:
    motions = refused = broken = 0
    with TemporaryDirectory() as folder:
        for seed in range(first, first + programs):
            trial = Trial(seed, Path(folder))
            faults = faults_of(trial)
            motions, refused, broken = motions + trial.motions, refused + trial.refused, broken + bool(faults)
            if faults:
                print(f"--- seed {seed}, {trial.robot.name}", *faults[:TOLD], trial.program, sep="\n", flush=True)
    print(f"{programs} programs from seed {first}: {motions} motions, {refused} refused, {broken} programs with faults")
    return 1 if broken else 0


def faults_of(trial: Trial) -> list[str]:
    try:
        return trial.judge()
    except Exception:
        return [traceback.format_exc()]


if __name__ == "__main__":
    command(main)
