"""Messages as bytes and back: JSON in text frames, MessagePack in binary ones.

A frame that is a `str` is a text frame, one of `bytes` a binary frame: each says by itself which form it has.
"""

from __future__ import annotations

from enum import Enum
from hashlib import blake2b
from typing import Any, Generic, TypeVar

import msgspec

from vrs_cli.wire.records import RecordError

Frame = str | bytes
MARK = 8  # bytes
UNREADABLE = (msgspec.MsgspecError, UnicodeError, RecursionError)
M = TypeVar("M")
DIALECT = "https://json-schema.org/draft/2020-12/schema"


class Encoding(Enum):
    JSON = "json"
    MSGPACK = "msgpack"


class UnknownType(RecordError):
    """A message of an unknown type, which a later version may have."""


class MessageMarks(msgspec.Struct):
    """The fields that tell messages apart, whatever else they hold."""

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
    """Return a record as values of JSON."""
    table: dict[str, Any] = msgspec.to_builtins(value, str_keys=True)
    return table


def encode(message: msgspec.Struct, encoding: Encoding) -> Frame:
    """Encode a message as a frame. The same messages give the same bytes."""
    return to_json(message) if encoding is Encoding.JSON else _msgpack.encode(message)


def mark_of(value: object) -> str:
    """Return a short hash of a value: the same for equal values."""
    return blake2b(_msgpack.encode(value), digest_size=MARK).hexdigest()


class Reader(Generic[M]):
    """Reads frames as messages of one union of types, which have the key `type` as their tag."""

    def __init__(self, kinds: Any) -> None:
        self._text = msgspec.json.Decoder(kinds)
        self._binary = msgspec.msgpack.Decoder(kinds)
        tagged = getattr(kinds, "__args__", (kinds,))
        self._types = frozenset(str(kind.__struct_config__.tag) for kind in tagged)

    def read(self, frame: Frame) -> M:
        """Read the message of a frame. Raises RecordError, and no other error, whatever the frame is."""
        try:
            message: M = self._text.decode(frame) if isinstance(frame, str) else self._binary.decode(frame)
        except UNREADABLE as error:
            marks = marks_of(frame)
            if marks is not None and marks.type not in self._types:
                raise UnknownType(f"a message of the unknown type {marks.type[:40]!r}") from None
            raise RecordError(f"no message: {error}") from None
        return message


def marks_of(frame: Frame) -> MessageMarks | None:
    """Return the type, id and number of a frame; None if it is not a message."""
    try:
        return _text_marks.decode(frame) if isinstance(frame, str) else _binary_marks.decode(frame)
    except UNREADABLE:
        return None


def decode(data: Frame, kind: type[M]) -> M:
    """Read JSON as a value of that type. Raises RecordError."""
    try:
        return msgspec.json.decode(data, type=kind)
    except UNREADABLE as error:
        raise RecordError(str(error)) from None


def schema_text(title: str, **kinds: Any) -> str:
    """Return a JSON Schema in which each union, and each of its messages, has its name."""
    (*unions,), components = msgspec.json.schema_components(kinds.values(), ref_template="#/$defs/{name}")
    definitions = {**dict(zip(kinds, unions, strict=True)), **components}
    lines = ",\n".join(f'"{name}": {_json.encode(one).decode()}' for name, one in definitions.items())
    either = ", ".join(f'{{"$ref": "#/$defs/{name}"}}' for name in kinds)
    return f'{{"$schema": "{DIALECT}",\n"title": "{title}",\n"anyOf": [{either}],\n"$defs": {{\n{lines}\n}}}}\n'
