"""Free memory without blocking other threads: pause Python's cycle collector, and free long programs in parts."""

from __future__ import annotations

import gc
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import cache
from threading import Thread
from typing import TYPE_CHECKING
from weakref import finalize

if TYPE_CHECKING:
    from queue import SimpleQueue

# the thresholds of gc: collect new objects after this many allocations; collect the next generation after this many
# such collections
COLLECT_AFTER, COLLECTIONS = 10_000, 5
MANY = 20_000  # if there are more new objects than this, freeze them, because collecting them would take longer
FREED_AT_ONCE = 10_000  # free this many elements of a long sequence at once (about 5 ms), then let other threads run


@contextmanager
def pause_collector(*, lasting: bool = False) -> Iterator[None]:
    """Pause Python's cycle collector while a `with` block creates objects without reference cycles.

    Within `collect_in_small_parts` (in a server) the collector is not paused, because after the block it would examine
    all new objects in one long collection. `lasting`: the objects are many and live long, so they are moved to the
    oldest generation, which the collector examines only in a full collection.
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
                gc.unfreeze()  # moves the frozen objects to the oldest generation
            gc.enable()


@contextmanager
def collect_in_small_parts() -> Iterator[None]:
    """Make the cycle collector skip objects that have survived two collections, so that no collection blocks other
    threads for long (a full one takes 0.2 s for a million objects).

    Unused cycles of such old objects stay in memory until the `with` block ends, or longer if the caller had frozen
    objects before.
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
        _unused().put(())


def free_in_parts(owner: object, *parts: Sequence[object]) -> None:
    """Free the elements of long sequences in small parts, in another thread, once `owner` (which refers to `parts`) has
    been freed. The interpreter would free them in one call, which blocks all threads (85 ms for 180,000 steps)."""
    if _leave_alone in gc.callbacks and any(len(part) > FREED_AT_ONCE for part in parts):
        finalize(owner, _unused().put, parts).atexit = False


@cache
def _unused() -> SimpleQueue[tuple[Sequence[object], ...]]:
    """Return the queue of the sequences to free; an empty tuple ends the thread."""
    from queue import SimpleQueue  # imported here because only servers free sequences in parts

    return SimpleQueue()


def _free() -> None:
    while waiting := list(_unused().get()):
        while waiting:
            rest = list(waiting.pop())
            while rest:
                del rest[-FREED_AT_ONCE:]
                time.sleep(0.001)


def _leave_alone(phase: str, info: Mapping[str, int]) -> None:
    if phase == "stop" and info["generation"] == 1:
        gc.freeze()
