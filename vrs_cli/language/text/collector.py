"""Free memory without blocking other threads: pause Python's cycle collector, and free long programs in parts."""

from __future__ import annotations

import gc
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from queue import SimpleQueue
from threading import Thread
from weakref import finalize

COLLECT_AFTER, COLLECTIONS = 10_000, 5  # new values per collection; and number of collections until values count as old
MANY = 20_000  # number of new values above which a collection takes longer than freezing them
FREED_AT_ONCE = 10_000  # number of elements of a long sequence that are freed at once (about 5 ms)


@contextmanager
def pause_collector(*, lasting: bool = False) -> Iterator[None]:
    """Pause Python's cycle collector while a block makes values without cycles.

    In a process that serves other clients nothing is paused, because after the block the collector would look at all
    new values together. `lasting`: the values are many and live long, so the collector does not look at them before its
    next full collection.
    """
    if _leave_alone in gc.callbacks:
        yield
        return
    running, before = gc.isenabled(), gc.get_count()[0]
    gc.disable()
    try:
        yield
    finally:
        if running:
            if lasting and gc.get_count()[0] - before > MANY and not gc.get_freeze_count():
                gc.freeze()
                gc.unfreeze()  # unfrozen values belong to the oldest generation
            gc.enable()


@contextmanager
def collect_in_small_parts() -> Iterator[None]:
    """Make the cycle collector skip values that have survived two collections, so that no collection blocks others for
    long (0.2 s for a million values).

    Cycles of such old values stay in memory until the block ends, or longer if the caller has frozen objects.
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
    """Free the elements of the long sequences of `owner` in parts, in another thread, after `owner` itself is freed.
    The interpreter would free them in one call, which blocks all threads (85 ms for 180,000 steps)."""
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
