"""Give memory back without holding others: the cycle collector pauses, and long programs are freed in parts."""

from __future__ import annotations

import gc
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from queue import SimpleQueue
from threading import Thread
from weakref import finalize

COLLECT_AFTER, COLLECTIONS = 10_000, 5  # new values that are looked at together, and how often before they are old
FREED_AT_ONCE = 10_000  # elements of a long sequence, which may be trees: about 5 ms


@contextmanager
def pause_collector() -> Iterator[None]:
    """Pause the collector: nothing made in the block is part of a cycle, so nothing is kept that would be freed. Where
    others wait, nothing is paused: all that was made would be looked at together after the block.
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


@contextmanager
def collect_in_small_parts() -> Iterator[None]:
    """While others wait for this process: what has outlived two collections is looked at no more, so that none takes
    long, however much there is (0.2 s for a million values). A cycle of values that old stays until the block ends,
    and longer where the caller has frozen objects: they stay frozen.
    """
    thresholds, frozen_by_caller = gc.get_threshold(), gc.get_freeze_count()
    gc.set_threshold(COLLECT_AFTER, COLLECTIONS)
    gc.callbacks.append(_leave_alone)
    Thread(target=_free, name="free", daemon=True).start()
    try:
        yield
    finally:
        gc.callbacks.remove(_leave_alone)
        gc.set_threshold(*thresholds)
        if not frozen_by_caller:
            gc.unfreeze()
        _unused.put(())


def free_in_parts(owner: object, *parts: Sequence[object]) -> None:
    """In such a process: when `owner` is gone, free the elements of its long sequences a part at a time, in a thread of
    its own. The interpreter would free them in one call, which holds all threads (85 ms for 180,000 steps).
    """
    if _leave_alone in gc.callbacks and any(len(part) > FREED_AT_ONCE for part in parts):
        finalize(owner, _unused.put, parts).atexit = False


_unused: SimpleQueue[tuple[Sequence[object], ...]] = SimpleQueue()


def _free() -> None:
    while waiting := list(_unused.get()):
        while waiting:
            rest = list(waiting.pop())
            while rest:
                del rest[-FREED_AT_ONCE:]
                time.sleep(0.001)


def _leave_alone(phase: str, info: Mapping[str, int]) -> None:
    if phase == "stop" and info["generation"] == 1:
        gc.freeze()
