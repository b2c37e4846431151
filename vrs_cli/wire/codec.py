"""Encode messages as bytes and decode them: JSON in text frames, MessagePack in binary frames.

A `str` is a text frame and `bytes` are a binary frame, so the type of a frame shows its encoding.
"""

from __future__ import annotations

from enum import Enum
from functools import cache
from typing import Any, Generic, TypeVar

import msgspec

from vrs_cli.wire.records import RecordError

Frame = str | bytes
UNREADABLE = (msgspec.MsgspecError, UnicodeError, RecursionError)
M = TypeVar("M")
DIALECT = "https://json-schema.org/draft/2020-12/schema"


class Encoding(Enum):
    JSON = "json"
    MSGPACK = "msgpack"


class UnknownType(RecordError):
    """The error for a message of an unknown type; later versions of vrs may send such messages."""


class MessageMarks(msgspec.Struct):
    """The fields of a message that identify it."""

    type: str
    id: Any = None
    seq: Any = None

    @property
    def known_id(self) -> int | None:
        return self.id if type(self.id) is int and self.id >= 0 else None


_text_marks, _binary_marks = msgspec.json.Decoder(MessageMarks), msgspec.msgpack.Decoder(MessageMarks)
_json, _msgpack = msgspec.json.Encoder(), msgspec.msgpack.Encoder()


def to_json(message: msgspec.Struct) -> str:
    return _json.encode(message).decode()


def table_of(value: msgspec.Struct) -> dict[str, Any]:
    """Convert a record to JSON-compatible values (dicts, lists, numbers, strings)."""
    table: dict[str, Any] = msgspec.to_builtins(value, str_keys=True)
    return table


def encode(message: msgspec.Struct, encoding: Encoding) -> Frame:
    """Encode a message as a frame. Equal messages give equal bytes."""
    return to_json(message) if encoding is Encoding.JSON else _msgpack.encode(message)


def mark_of(value: object) -> str:
    """Return a short hash of a value."""
    from hashlib import blake2b  # imported here because it loads OpenSSL, and trajectory files need no hash

    return blake2b(_msgpack.encode(value), digest_size=8).hexdigest()


class Reader(Generic[M]):
    """Decodes frames as messages of one union of types. The key `type` of a message names its type."""

    def __init__(self, kinds: Any) -> None:
        self._text = msgspec.json.Decoder(kinds)
        self._binary = msgspec.msgpack.Decoder(kinds)
        self._types = frozenset(str(kind.__struct_config__.tag) for kind in getattr(kinds, "__args__", (kinds,)))

    def read(self, frame: Frame) -> M:
        """Decode the message of a frame. Raises RecordError, and no other error, whatever the frame contains."""
        try:
            message: M = self._text.decode(frame) if isinstance(frame, str) else self._binary.decode(frame)
        except UNREADABLE as error:
            marks = marks_of(frame)
            if marks is not None and marks.type not in self._types:
                raise UnknownType(f"a message of the unknown type {marks.type[:40]!r}") from None
            raise RecordError(f"no message: {error}") from None
        return message


def marks_of(frame: Frame) -> MessageMarks | None:
    """Return the fields `type`, `id` and `seq` of the message in a frame; None if the frame contains no message."""
    try:
        return _text_marks.decode(frame) if isinstance(frame, str) else _binary_marks.decode(frame)
    except UNREADABLE:
        return None


def decode(data: Frame, kind: type[M]) -> M:
    """Decode JSON as a value of a type. Raises RecordError."""
    try:
        found: M = _decoder(kind).decode(data)  # type: ignore[arg-type]  # types are hashable
    except UNREADABLE as error:
        raise RecordError(str(error)) from None
    return found


_decoder = cache(msgspec.json.Decoder)


def schema_text(title: str, **kinds: Any) -> str:
    """Return the JSON Schema of unions of messages, and of the messages in them. `kinds`: the unions by name."""
    (*unions,), components = msgspec.json.schema_components(kinds.values(), ref_template="#/$defs/{name}")
    definitions = {**dict(zip(kinds, unions, strict=True)), **components}
    lines = ",\n".join(f'"{name}": {_json.encode(_stable(one)).decode()}' for name, one in definitions.items())
    either = ", ".join(f'{{"$ref": "#/$defs/{name}"}}' for name in kinds)
    return f'{{"$schema": "{DIALECT}",\n"title": "{title}",\n"anyOf": [{either}],\n"$defs": {{\n{lines}\n}}}}\n'


def _stable(schema: Any) -> Any:
    """Return a schema in a form that does not depend on the versions of msgspec and Python: with dedented descriptions,
    null as the last alternative, and without schemas of keys (`propertyNames`)."""
    from inspect import cleandoc  # imported here because few processes print a schema

    if isinstance(schema, dict):
        return {
            key: cleandoc(value) if key == "description" and isinstance(value, str) else _stable(value)
            for key, value in schema.items()
            if key != "propertyNames"
        }
    return sorted(map(_stable, schema), key=lambda one: one == {"type": "null"}) if isinstance(schema, list) else schema
