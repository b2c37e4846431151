"""What reaches a robot from any thread, and from signal handlers: it wakes a robot that waits."""

from __future__ import annotations

from queue import Empty, SimpleQueue
from typing import Generic, TypeVar

M = TypeVar("M")


class Inbox(Generic[M]):
    """Any thread may put a message in; one reads. To put one in takes no lock: a signal handler may do so too."""

    def __init__(self) -> None:
        self._queue: SimpleQueue[M] = SimpleQueue()
        self._first: list[M] = []  # what ended a wait

    def __len__(self) -> int:
        return self._queue.qsize() + len(self._first)

    def put(self, message: M) -> None:
        self._queue.put(message)

    def taken(self) -> list[M]:
        """All that is there, in order of arrival."""
        there, self._first = self._first, []
        try:
            while True:
                there.append(self._queue.get_nowait())
        except Empty:
            return there

    def wait(self, seconds: float | None) -> None:
        """Until a message is there, so many seconds [s] at most; None: however long that takes."""
        if not self._first:
            try:
                self._first.append(self._queue.get(timeout=seconds))
            except Empty:
                return
