"""Messages from any thread, and from signal handlers, for one reader: they wake it where it waits."""

from __future__ import annotations

import time
from collections import deque
from contextlib import suppress
from threading import Lock
from typing import Generic, TypeVar

M = TypeVar("M")


class Inbox(Generic[M]):
    """To put a message in waits for no lock: a signal handler may do so too.

    A lock is the bell. A `SimpleQueue` has one inside, but its `get` may wait for ever: where the time runs out while
    a signal is handled, CPython takes the time that is left, which is below zero, for none at all.
    """

    def __init__(self) -> None:
        self._messages: deque[M] = deque()
        self._bell = Lock()

    def __len__(self) -> int:
        return len(self._messages)

    def put(self, message: M) -> None:
        self._messages.append(message)
        with suppress(RuntimeError):  # it rings already
            self._bell.release()

    def taken(self) -> list[M]:
        """All that is there, in order of arrival."""
        there: list[M] = []
        with suppress(IndexError):
            while True:
                there.append(self._messages.popleft())
        return there

    def wait(self, seconds: float | None) -> None:
        """Until a message is there, so many seconds [s] at most; None: however long that takes."""
        end = None if seconds is None else time.monotonic() + seconds
        while not self._messages:
            left = -1.0 if end is None else end - time.monotonic()
            if end is not None and left <= 0.0:
                return
            self._bell.acquire(timeout=left)

    def take(self, seconds: float | None) -> M | None:
        """The next message; None where none comes within so many seconds [s]."""
        self.wait(seconds)
        try:
            return self._messages.popleft()
        except IndexError:
            return None
