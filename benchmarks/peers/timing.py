"""How work is timed, on both sides alike."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterable
from time import process_time
from typing import Any

REPEATS = 9


def each(call: Callable[..., object], *columns: Iterable[Any], rounds: int = 1) -> float:
    """Microseconds of one call, over rows of arguments: the least of repeats, without the loop itself."""
    rows = list(zip(*columns, strict=True)) * rounds

    def work() -> None:
        for row in rows:
            call(*row)

    def loop() -> None:
        for row in rows:
            _nothing(*row)

    return at_once(work, len(rows)) - at_once(loop, len(rows))


def at_once(work: Callable[[], object], count: int) -> float:
    """Microseconds of one of `count` operations that a run does: the least of repeats, of the processor."""
    work()
    return min(_timed(work) for _ in range(REPEATS)) / count * 1e6


def _timed(work: Callable[[], object]) -> float:
    start = process_time()
    work()
    return process_time() - start


def _nothing(*_: object) -> None:
    """What the loop costs without its work, a call into Python included: taken off from all sides alike."""


def serve(measure: Callable[[dict[str, Any]], dict[str, float]]) -> None:
    """What a peer does with its input and output."""
    print(json.dumps(measure(json.load(sys.stdin))))
