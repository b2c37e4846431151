"""Keep frames for one user: frames that wait for the socket (`Outbox`), and the messages, commands and questions that a
server remembers while the connection is cut (`DeliveryLog`). Both are bounded. Pure: times are arguments.

Split long replies into parts: encoding a table of 100,000 rows takes 0.1 s, during which no other thread runs, and more
memory than a connection may use. Each part is sent when the connection has taken the previous part. Remove paths of the
server's folders from replies.
"""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import cache
from itertools import chain, islice, pairwise
from math import inf
from pathlib import Path
from typing import Any, TypeVar, cast, get_args, get_origin

from msgspec import Struct
from msgspec.structs import fields, replace

from vrs_cli.net import messages
from vrs_cli.values.replies import Reply, StyledLine
from vrs_cli.wire.codec import Encoding, Frame, encode

MAX_REFUSAL_CHARS = 400  # maximum number of characters kept of a refusal's message


class Bounds(Struct, frozen=True):
    """Maximum sizes of a delivery log. `seconds`: how long it is kept after the connection is cut [s]; `message_bytes`:
    size of messages; `ended`, `waiting`: number of finished and of unfinished commands."""

    seconds: float = 60.0
    message_bytes: int = 1_000_000
    ended: int = 1000
    waiting: int = 1000


USUAL = Bounds()


class DeliveryLog:
    """The messages that must reach one user. `key`: the secret with which the user can resume the connection. `seq`:
    the number of the last message to the user. `put`: sends a frame over the connection; None while the connection is
    cut. `waiting`: the ids of unfinished commands. `ended`: the final answers of finished commands, by id. `questions`:
    the unanswered questions, by number.
    """

    def __init__(self, key: str, bounds: Bounds = USUAL) -> None:
        self.key, self.bounds = key, bounds
        self.encoding = Encoding.JSON
        self.seq = 0
        self.put: Callable[[Frame], None] | None = None
        self._since: float | None = None  # time at which the connection was cut [s]; None while connected
        self._frames: deque[tuple[float, Frame]] = (
            deque()
        )  # time of sending [s] and frame; the last one is number `seq`
        self._size = 0
        self.waiting: set[int] = set()
        self.ended: dict[int, messages.Done] = {}
        self._forgotten = -1  # the highest id of a command whose result is forgotten
        self.questions: dict[int, messages.Asked] = {}

    # --- messages ---

    def tell(self, message: messages.Numbered, now: float) -> None:
        """Send a message now, or when the connection is resumed."""
        match message:
            case messages.Done(id) if id in self.waiting:
                self.waiting.remove(id)
                short = message.refusal and replace(
                    message.refusal, message=message.refusal.message[:MAX_REFUSAL_CHARS], detail="", hint=""
                )
                self.ended[id] = messages.Done(id, message.ok, short, message.version)
                if len(self.ended) > self.bounds.ended:
                    oldest = next(iter(self.ended))
                    del self.ended[oldest]
                    self._forgotten = max(self._forgotten, oldest)
            case messages.Asked(number):
                self.questions[number] = message
            case messages.Withdrawn(number):
                self.questions.pop(number, None)
        self.seq += 1
        frame = encode(replace(message, seq=self.seq), self.encoding)
        self._frames.append((now, frame))
        self._size += len(frame) + FRAME_OVERHEAD_BYTES
        earliest = (now if self._since is None else self._since) - self.bounds.seconds
        while self._frames and (self._frames[0][0] < earliest or self._size > self.bounds.message_bytes):
            self._size -= len(self._frames.popleft()[1]) + FRAME_OVERHEAD_BYTES
        if self.put is not None:
            self.put(frame)

    def since(self, seq: int) -> list[Frame] | None:
        """Return the frames after number `seq`; None if some of them are no longer kept."""
        missed = self.seq - seq
        known = 0 <= missed <= len(self._frames)
        return [frame for _, frame in list(self._frames)[len(self._frames) - missed :]] if known else None

    # --- commands ---

    def outcome(self, id: int) -> messages.Outcome:
        """Return the outcome of the command with this id."""
        if id in self.waiting:
            return messages.Outcome.TAKEN
        if id in self.ended:
            return messages.Outcome.DONE if self.ended[id].ok else messages.Outcome.REFUSED
        return messages.Outcome.FORGOTTEN if id <= self._forgotten else messages.Outcome.UNSEEN

    def begin(self, id: int, *, always: bool = False) -> bool:
        """Record a new command, which `Done` will end. Return False if too many commands are unfinished, unless
        `always`."""
        if len(self.waiting) >= self.bounds.waiting and not always:
            return False
        self.waiting.add(id)
        return True

    # --- the connection ---

    def cut(self, now: float) -> None:
        self.put, self._since = None, now

    def attach(self, put: Callable[[Frame], None], encoding: Encoding) -> None:
        self.put, self.encoding, self._since = put, encoding, None

    def is_expired(self, now: float) -> bool:
        """Return whether the user has been away for longer than the bounds allow."""
        return self._since is not None and now - self._since > self.bounds.seconds


FRAME_OVERHEAD_BYTES = 100  # estimated memory of a frame, in addition to its content


class Outbox:
    """Frames that wait for the socket, in order. `size`: their bytes, at most `most`; a frame counts as at most half of
    `most`, so that a single long frame fits. `overflown`: there were too many bytes; all frames were dropped, and later
    frames are ignored.
    """

    def __init__(self, most: int) -> None:
        self.most, self.size, self.overflown = most, 0, False
        self.encoding = Encoding.JSON
        self._waiting: dict[object, tuple[Frame | Struct, int]] = {}  # frames and their counted bytes
        self._count = 0

    def put(self, frame: Frame, *, counts: bool = True) -> None:
        """Append a frame; `counts`: whether its bytes are part of `size`."""
        if self.overflown:
            return
        self._count += 1
        size = min(len(frame) + FRAME_OVERHEAD_BYTES, self.most // 2) if counts else 0
        self._waiting[self._count] = frame, size
        self.size += size
        if self.size > self.most:
            self._waiting.clear()
            self.size, self.overflown = 0, True

    def send(self, message: Struct) -> None:
        if isinstance(message, messages.Sample | messages.Clock | messages.Status):  # replaces a waiting older one
            self._waiting.pop(type(message), None)
            self._waiting[type(message)] = message, 0
        else:
            self.put(encode(message, self.encoding))

    def take_frames(self, most: float = inf) -> list[Frame]:
        """Remove frames in order, until they have `most` bytes or more; return them."""
        taken: list[Frame] = []
        while self._waiting and most > 0:
            one, size = self._waiting.pop(next(iter(self._waiting)))
            frame = encode(one, self.encoding) if isinstance(one, Struct) else one
            taken.append(frame)
            self.size -= size
            most -= len(frame)
        return taken


M = TypeVar("M")
MAX_PART_ROWS = 200  # maximum number of rows of one part
MAX_SEARCHED_ROWS = 1000  # maximum number of rows searched for paths; longer tables contain no paths


# --- long replies in parts ------------------------------------------------------------------------------------------


@cache
def _lists_of(kind: type[Struct]) -> tuple[str, ...]:
    """Return the names of the fields of a reply that are lists of rows."""
    return tuple(
        field.name
        for field in fields(kind)
        if get_origin(field.type) is tuple and get_args(field.type)[1:] == (Ellipsis,)
    )


def is_long(reply: Reply) -> bool:
    """Return whether a reply is sent in parts."""
    return any(len(getattr(reply, name)) > MAX_PART_ROWS for name in _lists_of(type(reply)))


def parts_of(message: messages.Told, lines: Iterable[StyledLine] = ()) -> Iterator[messages.Told]:
    """Split a long reply and its `lines` into messages; the lines are rendered as the messages are taken. All messages
    but the last have `goes_on`, and each list continues where it ended in the previous message.
    """
    reply, drawn = message.reply, iter(lines)
    rows = {name: getattr(reply, name) for name in _lists_of(type(reply))}
    none: dict[str, tuple[object, ...]] = dict.fromkeys(rows, ())

    def parts() -> Iterator[messages.Told]:
        for name, there in rows.items():
            for begin in range(0, len(there), MAX_PART_ROWS):
                yield messages.Told(
                    replace(reply, **{**none, name: there[begin : begin + MAX_PART_ROWS]}), message.id, goes_on=True
                )
        while part := tuple(islice(drawn, MAX_PART_ROWS)):
            yield messages.Told(replace(reply, **none), message.id, goes_on=True, lines=part)

    for part, following in pairwise(chain(parts(), (None,))):
        assert part is not None, "None comes last"
        yield part if following is not None else replace(part, goes_on=False)


def join_parts(parts: Sequence[messages.Told]) -> messages.Told:
    """Join the parts of a long reply into one message."""
    reply = parts[-1].reply
    lists = {name: tuple(row for part in parts for row in getattr(part.reply, name)) for name in _lists_of(type(reply))}
    lines = tuple(line for part in parts for line in part.lines)
    return replace(parts[-1], reply=replace(reply, **lists), lines=lines)


# --- paths of folders -----------------------------------------------------------------------------------------------


def prefixes_of(folders: Iterable[Path | None]) -> tuple[str, ...]:
    """Return the paths of folders, each with and without a final separator; the longest first."""
    there = [str(folder) for folder in folders if folder is not None]
    return tuple(sorted({*there, *(folder + os.sep for folder in there)}, key=len, reverse=True))


def may_hold(prefixes: tuple[str, ...], value: Struct) -> bool:
    """Return whether a string in the value may contain one of the prefixes. Slow for long values, because it encodes
    them.
    """
    try:
        data = encode(value, Encoding.MSGPACK)
    except UnicodeError:
        return True
    return any(prefix.encode(errors="surrogateescape") in data for prefix in prefixes)


def without(prefixes: tuple[str, ...], value: M) -> M:
    """Return the value with the prefixes removed from its strings; the same object if no string contains one."""
    new: Any = value
    if isinstance(value, str):
        text = str(value)
        for prefix in prefixes:
            text = text.replace(prefix, "" if prefix.endswith(os.sep) else ".")
        new = value if text == value else text
    elif isinstance(value, tuple) and len(value) <= MAX_SEARCHED_ROWS:
        found = [without(prefixes, one) for one in value]
        if any(one is not old for one, old in zip(found, value, strict=True)):
            new = getattr(value, "_make", tuple)(found)  # keep the class of a named tuple
    elif isinstance(value, Struct):
        fields_of = {name: getattr(value, name) for name in value.__struct_fields__}
        changed = {name: it for name, old in fields_of.items() if (it := without(prefixes, old)) is not old}
        new = replace(value, **changed) if changed else value
    return cast(M, new)
