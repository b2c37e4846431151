"""Names of files as users of a served robot see them: nobody is told in which folder of the server they are."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any, TypeVar, cast

from msgspec import Struct, structs

from vrs_cli.wire.codec import Encoding, encode

M = TypeVar("M")
LONGEST = 1000  # rows of a table that are looked at: longer ones hold no names of files


def prefixes_of(folders: Iterable[Path | None]) -> tuple[str, ...]:
    """What stands before names in these folders, and the folders alone; the longest first."""
    there = [str(folder) for folder in folders if folder is not None]
    return tuple(sorted({*there, *(folder + os.sep for folder in there)}, key=len, reverse=True))


def may_hold(prefixes: tuple[str, ...], value: Struct) -> bool:
    """Whether a text in the value may have one of the prefixes. Not for a long value: all of it is encoded."""
    try:
        data = encode(value, Encoding.MSGPACK)
    except UnicodeError:
        return True
    return any(prefix.encode(errors="surrogateescape") in data for prefix in prefixes)


def without(prefixes: tuple[str, ...], value: M) -> M:
    """The same value with all texts in it without the prefixes."""
    return cast(M, _without(prefixes, value))


def _without(prefixes: tuple[str, ...], value: object) -> object:
    if isinstance(value, str):
        text = value
        for prefix in prefixes:
            text = text.replace(prefix, "" if prefix.endswith(os.sep) else ".")
        return value if text == value else text
    if isinstance(value, tuple) and len(value) <= LONGEST:
        found = [_without(prefixes, one) for one in value]
        changed = any(new is not old for new, old in zip(found, value, strict=True))
        return _tuple_like(value, found) if changed else value
    if isinstance(value, Struct):
        fields = {name: getattr(value, name) for name in value.__struct_fields__}
        new = {name: it for name, old in fields.items() if (it := _without(prefixes, old)) is not old}
        return structs.replace(value, **new) if new else value
    return value


def _tuple_like(old: tuple[Any, ...], found: list[object]) -> tuple[Any, ...]:
    """Of the same class, where that is a named one."""
    make = getattr(old, "_make", tuple)
    return cast(tuple[Any, ...], make(found))
