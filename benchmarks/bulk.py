"""Long files and long timelines, each at two sizes: `python -m benchmarks.bulk`.

What is linear has a ratio of about 10 to the smaller size. CPU times, the least of some rounds.
"""

from __future__ import annotations

import gc
import random
from collections.abc import Callable, Iterator
from functools import partial
from io import BytesIO
from itertools import count

from benchmarks.timeline import cpu, deltas, tiled
from vrs_cli.__main__ import COLLECT_AFTER
from vrs_cli.engine.book import Book
from vrs_cli.engine.comparison import compare
from vrs_cli.files.exports import EXPORTERS
from vrs_cli.language.analysis.structure import canonical_text

ROUNDS = 2
SIZES = (10_000, 100_000)


def works(size: int) -> Iterator[tuple[str, Callable[[], object]]]:
    fresh = count()  # lines that were formatted before are remembered
    yield "fmt, lines", lambda: canonical_text(program(size, next(fresh)))
    arm, timeline = tiled(size)
    other = timeline.apply(dict(deltas(timeline, random.Random(size)))["insert"])
    yield "COMPARE, segments", lambda: compare(arm, Book(timeline, timeline), Book(timeline, other))
    _, short = tiled(round(size * 0.01))
    for name in ("csv", "npz"):
        export = partial(EXPORTERS[name].write, arm=arm, timeline=short, rate=size / short.end)
        yield f"{name}, samples", lambda export=export: export(BytesIO())


def program(size: int, number: int) -> str:
    lines = "".join(f"  x{i % 1000} = {i}+2*sin({number})  ; {i}\n" for i in range(size))
    return f".PROGRAM main()\n{lines}.END\n"


def main() -> None:
    gc.set_threshold(COLLECT_AFTER)  # as a `vrs` command
    least: dict[str, float] = {}
    for size in SIZES:
        for name, work in works(size):
            gc.collect()
            gc.freeze()
            seconds = min(cpu(work) for _ in range(ROUNDS))
            gc.unfreeze()
            ratio = seconds / least.setdefault(name, seconds)
            print(f"{name:20} {size:9,} {seconds:8.2f} s   ratio {ratio:5.2f}", flush=True)


if __name__ == "__main__":
    main()
