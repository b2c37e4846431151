"""Replies as users of a served robot get them: without names of the server's folders, and long ones in parts.

A table of 100,000 rows takes 0.1 s to encode, in which no other thread has a turn, and more memory than a connection
may hold. So it is told part by part, each when the connection has taken the one before.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Sequence
from functools import cache
from itertools import islice
from pathlib import Path
from typing import Any, TypeVar, cast, get_args, get_origin

from msgspec import Struct
from msgspec.structs import fields, replace

from vrs_cli.net.messages import Told
from vrs_cli.values.replies import Reply, StyledLine
from vrs_cli.wire.codec import Encoding, encode

M = TypeVar("M")
MOST_ROWS = 200  # of one part
LONGEST = 1000  # rows of a table that are searched: longer tables hold no names of files


# --- long replies in parts ------------------------------------------------------------------------------------------


@cache
def _lists_of(kind: type[Struct]) -> tuple[str, ...]:
    """Return the fields of a reply that hold any number of rows."""
    return tuple(
        field.name
        for field in fields(kind)
        if get_origin(field.type) is tuple and get_args(field.type)[1:] == (Ellipsis,)
    )


def is_long(reply: Reply) -> bool:
    """Return whether a reply is sent in parts."""
    return any(len(getattr(reply, name)) > MOST_ROWS for name in _lists_of(type(reply)))


def parts_of(told: Told, lines: Iterable[StyledLine] = ()) -> Iterator[Told]:
    """Split a long reply into messages, and its `lines`, which are drawn as they are taken. All but the last message
    have `goes_on`; each list continues where it ended.
    """
    reply, drawn = told.reply, iter(lines)
    rows = {name: getattr(reply, name) for name in _lists_of(type(reply))}
    none: dict[str, tuple[object, ...]] = dict.fromkeys(rows, ())

    def parts() -> Iterator[Told]:
        for name, there in rows.items():
            for begin in range(0, len(there), MOST_ROWS):
                yield Told(replace(reply, **{**none, name: there[begin : begin + MOST_ROWS]}), told.id, goes_on=True)
        while part := tuple(islice(drawn, MOST_ROWS)):
            yield Told(replace(reply, **none), told.id, goes_on=True, lines=part)

    last: Told | None = None
    for part in parts():
        if last is not None:
            yield last
        last = part
    if last is not None:
        yield replace(last, goes_on=False)


def joined(parts: Sequence[Told]) -> Told:
    """Join the parts of a message."""
    reply = parts[-1].reply
    lists = {name: tuple(row for part in parts for row in getattr(part.reply, name)) for name in _lists_of(type(reply))}
    lines = tuple(line for part in parts for line in part.lines)
    return replace(parts[-1], reply=replace(reply, **lists), lines=lines)


# --- names of files -------------------------------------------------------------------------------------------------


def prefixes_of(folders: Iterable[Path | None]) -> tuple[str, ...]:
    """Return the paths of folders, with and without a separator; the longest first."""
    there = [str(folder) for folder in folders if folder is not None]
    return tuple(sorted({*there, *(folder + os.sep for folder in there)}, key=len, reverse=True))


def may_hold(prefixes: tuple[str, ...], value: Struct) -> bool:
    """Return whether a text in the value may have one of the prefixes. It encodes the value: not for a long one."""
    try:
        data = encode(value, Encoding.MSGPACK)
    except UnicodeError:
        return True
    return any(prefix.encode(errors="surrogateescape") in data for prefix in prefixes)


def without(prefixes: tuple[str, ...], value: M) -> M:
    """Return the value with the prefixes removed from all its texts; the same value if it has none."""
    new: Any = value
    if isinstance(value, str):
        text = str(value)
        for prefix in prefixes:
            text = text.replace(prefix, "" if prefix.endswith(os.sep) else ".")
        new = value if text == value else text
    elif isinstance(value, tuple) and len(value) <= LONGEST:
        found = [without(prefixes, one) for one in value]
        if any(one is not old for one, old in zip(found, value, strict=True)):
            new = getattr(value, "_make", tuple)(found)  # of the same class, if that is a named one
    elif isinstance(value, Struct):
        fields_of = {name: getattr(value, name) for name in value.__struct_fields__}
        changed = {name: it for name, old in fields_of.items() if (it := without(prefixes, old)) is not old}
        new = replace(value, **changed) if changed else value
    return cast(M, new)
