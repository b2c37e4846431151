"""Python's cycle collector, out of the way while many values are made: it would walk them all again and again."""

from __future__ import annotations

import gc
from collections.abc import Iterator, Mapping
from contextlib import contextmanager

COLLECT_AFTER, COLLECTIONS = 10_000, 5  # new values that are looked at together, and how often before they are old


@contextmanager
def pause_collector() -> Iterator[None]:
    """Nothing made in the block is part of a cycle, so nothing is kept that would have been freed. Where others wait,
    nothing is paused: all that was made would be looked at together after the block.
    """
    if _leave_alone in gc.callbacks:
        yield
        return
    running = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if running:
            gc.enable()


def collect_in_small_parts() -> None:
    """In a process that others wait for: what has outlived two collections is looked at no more, so that none takes
    long, however much there is (0.2 s for a million values). A cycle of values that old stays until the process ends.
    """
    gc.set_threshold(COLLECT_AFTER, COLLECTIONS)
    gc.callbacks.append(_leave_alone)


def _leave_alone(phase: str, info: Mapping[str, int]) -> None:
    if phase == "stop" and info["generation"] == 1:
        gc.freeze()
