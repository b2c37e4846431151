"""Messages as bytes that many connections share: encoded once in each form that anybody wants, and deflated once.

Deflated, a message may refer back to those before it, if whoever gets it has got them too. So what is deflated has its
place in a context: a run of messages, of which nobody takes one without all that came before it in the run. Everything
else goes as it is, which leaves the context of a connection alone (RFC 7692, 6 and 7.2).
"""

from __future__ import annotations

import zlib
from collections.abc import Callable
from itertools import count
from typing import NamedTuple

from msgspec import Struct

from vrs_cli.net.messages import ServerMessage
from vrs_cli.wire.codec import Encoding, encode

# One context serves all, so its memory costs nothing: a full window. For what robots do, level 9 takes up to twice as
# long as 6 for 2 % fewer bytes, and level 1 is a third faster for 5 to 20 % more.
LEVEL, WINDOW_BITS, MEMORY = 6, 15, 8
_TAIL = 4  # bytes at the end of what is flushed that a frame does not carry (RFC 7692, 7.2.1)


class MessageForm(NamedTuple):
    """How somebody hears messages: as text (JSON) or MessagePack; `full`: with what it cannot compute by itself."""

    text: bool
    full: bool = False


class DeflatedPlace(NamedTuple):
    """Of something deflated: in the context with this number, after so many others."""

    context: int
    number: int


class Packet(Struct, eq=False):
    """One message as bytes. `place`: where it is deflated. `frame`: the same as a frame, once somebody has made one."""

    data: bytes
    text: bool
    place: DeflatedPlace | None = None
    frame: bytes = b""

    def follows(self, last: DeflatedPlace | None) -> bool:
        """Whether somebody can inflate it who has got what is at the place `last`, and all before that."""
        place = self.place
        return place is None or place.number == 0 or last == (place.context, place.number - 1)


class DeflateContext:
    """Deflates messages, each with a look back at those before it."""

    _numbers = count()

    def __init__(self) -> None:
        self._number, self._index = next(DeflateContext._numbers), 0
        self._compressor = zlib.compressobj(LEVEL, zlib.DEFLATED, -WINDOW_BITS, MEMORY)

    def deflated(self, packet: Packet) -> Packet:
        data = self._compressor.compress(packet.data) + self._compressor.flush(zlib.Z_SYNC_FLUSH)
        place = DeflatedPlace(self._number, self._index)
        self._index += 1
        return Packet(data[:-_TAIL], packet.text, place)


class Letter:
    """A message to many. `make`: the message, full or not. `size`: of all the bytes that have been made of it."""

    def __init__(self, make: Callable[[bool], ServerMessage]) -> None:
        self._make = make
        self._packets: dict[MessageForm, Packet] = {}
        self.size = 0

    def packet(self, form: MessageForm) -> Packet:
        found = self._packets.get(form)
        if found is None:
            frame = encode(self._make(form.full), Encoding.JSON if form.text else Encoding.MSGPACK)
            found = self._packets[form] = Packet(frame.encode() if isinstance(frame, str) else frame, form.text)
            self.size += len(found.data)
        return found
