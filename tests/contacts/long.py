"""First contacts of random motions beside looks at all poses.

`python -m tests.contacts.long MOTIONS SEED [ROBOT [FIRST]]`: a hundred motions in each scene; those before number FIRST
are made and not looked at, so that a part of a long run can be repeated. Prints how far the times are apart, and the
CPU time of a motion; status 1 where a touch that lasts for a millisecond is missed, or a time is more than a
millisecond off.
"""

from __future__ import annotations

from itertools import islice
from random import Random
from statistics import mean, median
from time import process_time

from tests.by_hand import command
from tests.contacts.cases import cases, looked_at_all

IN_SCENE = 100


def main(count: int, seed: int, robot: str = "puma560", first: int = 0) -> int:
    spent, late, wrong = list[float](), list[float](), 0
    made = enumerate(cases(Random(seed), first + count, robot, IN_SCENE))
    for number, case in islice(made, first, None):
        case.found()  # the model of a new scene is made
        begun = process_time()
        found = case.found()
        spent.append(process_time() - begun)
        dense = looked_at_all(case)
        if found is not None and dense.earliest is not None:
            late.append(abs(found.t - dense.earliest))
        if not dense.agrees(found):
            wrong += 1
            print(f"motion {number} of seed {seed}: found {found}, all poses {dense}")
    print(f"{count} motions, {len(late)} with a contact, {wrong} wrong, {1e3 * median(late or [0.0]):.2f} ms off")
    mean_ms, middle, most = (1e3 * of(spent) for of in (mean, median, max))
    print(f"CPU of a motion: mean {mean_ms:.2f} ms, median {middle:.2f} ms, worst {most:.2f} ms")
    return int(wrong > 0)


if __name__ == "__main__":
    command(main)
