"""Long replies in parts. A table of 100,000 rows takes 0.1 s to encode, in which no other thread has a turn, and more
memory than a connection may hold: so it is told part by part, each when the connection has taken the one before.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cache
from typing import Any, get_args, get_origin

from msgspec import Struct
from msgspec.structs import fields, replace

from vrs_cli.net.messages import Told
from vrs_cli.values.replies import Reply

MOST_ROWS = 200  # of one part


@cache
def _lists_of(kind: type[Struct]) -> tuple[str, ...]:
    """The fields of a reply that hold any number of rows."""
    return tuple(field.name for field in fields(kind) if _is_list(field.type))


def _is_list(type: Any) -> bool:
    return get_origin(type) is tuple and get_args(type)[1:] == (Ellipsis,)


def is_long(reply: Reply) -> bool:
    """Whether a reply is sent in parts."""
    return any(len(getattr(reply, name)) > MOST_ROWS for name in _lists_of(type(reply)))


def parts_of(told: Told) -> Iterator[Told]:
    """A long reply as messages, which `goes_on` in all but the last: each of its lists goes on where it ended."""
    reply = told.reply
    rows = {name: getattr(reply, name) for name in _lists_of(type(reply))}
    pieces = [(name, begin) for name, there in rows.items() for begin in range(0, len(there), MOST_ROWS)]
    for number, (name, begin) in enumerate(pieces, 1):
        piece: dict[str, tuple[object, ...]] = dict.fromkeys(rows, ())
        piece[name] = rows[name][begin : begin + MOST_ROWS]
        yield Told(replace(reply, **piece), told.id, goes_on=number < len(pieces))


def joined(parts: Sequence[Told]) -> Told:
    """The message of which these are the parts."""
    reply = parts[-1].reply
    lists = {name: tuple(row for part in parts for row in getattr(part.reply, name)) for name in _lists_of(type(reply))}
    return replace(parts[-1], reply=replace(reply, **lists))
