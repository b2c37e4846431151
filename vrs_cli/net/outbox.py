"""What is to be sent over one connection, in order, until its socket takes it; bounded in bytes."""

from __future__ import annotations

from math import inf

from msgspec import Struct

from vrs_cli.net.messages import Clock, Sample, Status
from vrs_cli.wire.codec import Encoding, Frame, encode

NEWEST_WINS = (Sample, Clock, Status)  # what was not sent yet is out of date when the next one comes

BESIDE = 100  # bytes that a frame takes in memory, beside its own


class Outbox:
    """`size`: the bytes that wait; a long message counts as half of what may wait, so that it gets through alone.
    `overflown`: there were too many, and they were dropped; nothing more is taken.
    """

    def __init__(self, most: int) -> None:
        self.most, self.size, self.overflown = most, 0, False
        self.encoding = Encoding.JSON
        self._waiting: dict[object, tuple[Frame | Struct, int]] = {}  # and what it counts
        self._count = 0

    def put(self, frame: Frame, *, counts: bool = True) -> None:
        """`counts`: it is one of those that may be too many."""
        if self.overflown:
            return
        self._count += 1
        size = min(len(frame) + BESIDE, self.most // 2) if counts else 0
        self._waiting[self._count] = frame, size
        self.size += size
        if self.size > self.most:
            self.drop()
            self.overflown = True

    def send(self, message: Struct) -> None:
        if isinstance(message, NEWEST_WINS):
            self._waiting.pop(type(message), None)
            self._waiting[type(message)] = message, 0
        else:
            self.put(encode(message, self.encoding))

    def drop(self) -> None:
        self._waiting.clear()
        self.size = 0

    def taken(self, most: float = inf) -> list[Frame]:
        """What waits, for the socket: the first of it, until it is so many bytes or more."""
        taken: list[Frame] = []
        while self._waiting and most > 0:
            one, size = self._waiting.pop(next(iter(self._waiting)))
            frame = encode(one, self.encoding) if isinstance(one, Struct) else one
            taken.append(frame)
            self.size -= size
            most -= len(frame)
        return taken
