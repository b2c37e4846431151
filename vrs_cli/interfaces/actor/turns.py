"""Who comes next, where many ask for more than can be done at once: each has a turn, one after the other."""

from __future__ import annotations

from collections import deque
from collections.abc import Collection, Iterator
from typing import Generic, TypeVar

R = TypeVar("R")


class Turns(Generic[R]):
    """Requests, in the order in which each has asked for his own; who had a turn comes after all others."""

    def __init__(self) -> None:
        self._waiting: dict[object, deque[R]] = {}  # by who asks, whose turn it is first
        self._count = 0

    def __len__(self) -> int:
        return self._count

    def __iter__(self) -> Iterator[R]:
        return (request for own in self._waiting.values() for request in own)

    def put(self, request: R, by: object) -> None:
        self._waiting.setdefault(by, deque()).append(request)
        self._count += 1

    def next(self, busy: Collection[object] = ()) -> R | None:
        """The request whose turn it is, of those who are not busy."""
        return next((own[0] for by, own in self._waiting.items() if by not in busy), None)

    def begin(self, request: R, by: object) -> None:
        """He has had his turn."""
        own = self._waiting.pop(by)
        self._count -= 1
        own.remove(request)
        if own:
            self._waiting[by] = own

    def taken(self) -> list[R]:
        """All, which wait no longer."""
        there, self._waiting, self._count = list(self), {}, 0
        return there
