"""What leaves a process and comes back: replies, questions, events and errors, as JSON or as MessagePack.

    {"v":1,"kind":"Message","body":{"text":"Program completed","tone":"note"}}

`kind` is the class of the value, `body` its fields in metres, radians and seconds, `v` the version of this form. A
motion, and what has motions, is written as the records of a trajectory file.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from typing import Any, Final, NamedTuple, get_args

import msgspec

from vrs_cli import errors
from vrs_cli.dialogue.questions import Question
from vrs_cli.dialogue.replies import Reply
from vrs_cli.engine.engine import Postponement
from vrs_cli.engine.settings import Settings
from vrs_cli.engine.snapshot import Snapshot
from vrs_cli.errors import Place, ProgramError, VrsError
from vrs_cli.trajectory.delta import TimelineDelta
from vrs_cli.version import __version__
from vrs_cli.wire.codec import Encoding
from vrs_cli.wire.records import (
    Count,
    DeltaRecord,
    Form,
    Motions,
    RecordError,
    SegmentRecord,
    delta_of,
    delta_record,
    segment_records,
    segments_of,
)

VERSION = 1


class Refusal(msgspec.Struct, frozen=True):
    """An error with its numbers; `message` is what is shown of it."""

    code: int
    title: str
    message: str
    detail: str = ""
    hint: str = ""
    value: float | None = None
    lower: float | None = None
    upper: float | None = None
    joint: int = 0
    place: Place | None = None

    @classmethod
    def of(cls, error: VrsError) -> Refusal:
        told: dict[str, Any] = error.numbers
        return cls(error.code, error.title, str(error), error.detail, error.hint, **told)

    def error(self) -> VrsError:
        """The error again: of its class, with the same message and numbers."""
        kind = _KIND_OF_CODE.get(self.code, VrsError)
        told = {name: getattr(self, name) for name in ("value", "lower", "upper", "joint", "place")}
        made = kind(self.detail, self.hint, **told)
        return made if str(made) == self.message else Quoted(self)


class Quoted(ProgramError):
    """A refusal in words of its own, as of a line that cannot be read."""

    def __init__(self, refusal: Refusal) -> None:
        super().__init__(refusal.detail, refusal.hint)
        self.refusal: Final = refusal

    def __str__(self) -> str:
        return self.refusal.message

    @property
    def title(self) -> str:
        return self.refusal.title


_KIND_OF_CODE: Mapping[int, type[VrsError]] = {
    kind.code: kind
    for kind in vars(errors).values()
    if isinstance(kind, type) and issubclass(kind, VrsError) and "code" in vars(kind)
}


Sendable = Reply | Question | TimelineDelta | Snapshot | Postponement | Refusal


# --- records of what has motions in it ------------------------------------------------------------------------------


class SnapshotRecord(msgspec.Struct, frozen=True):
    version: Count
    segments: tuple[SegmentRecord, ...]
    settings: Settings
    first: Count = 0


def _delta_record(delta: TimelineDelta) -> DeltaRecord:
    return delta_record(delta, Motions())


def _delta(record: DeltaRecord, form: Form) -> TimelineDelta:
    return delta_of(record, Motions(), form)


def snapshot_record(snapshot: Snapshot) -> SnapshotRecord:
    segments = segment_records(snapshot.segments, Motions(), None)
    return SnapshotRecord(snapshot.version, segments, snapshot.settings, snapshot.first)


def snapshot_of(record: SnapshotRecord, form: Form) -> Snapshot:
    segments = segments_of(record.segments, Motions(), None, form)
    return Snapshot(record.version, segments, record.settings, record.first)


class _AsRecord(NamedTuple):
    """How a class of values is written: as which record, and the ways there and back."""

    record: type[msgspec.Struct]
    put: Callable[[Any], msgspec.Struct]
    take: Callable[[Any, Form], Any]


_AS_RECORD: Mapping[type, _AsRecord] = {
    TimelineDelta: _AsRecord(DeltaRecord, _delta_record, _delta),
    Snapshot: _AsRecord(SnapshotRecord, snapshot_record, snapshot_of),
}


# --- bytes ----------------------------------------------------------------------------------------------------------


class _Sent(msgspec.Struct, frozen=True):
    v: int
    kind: str
    body: Any


class _Received(msgspec.Struct, frozen=True):
    v: int
    kind: str = ""
    body: msgspec.Raw = msgspec.Raw(b"")


KINDS: Mapping[str, type] = {kind.__name__: kind for kind in get_args(Sendable)}
_ENCODE: Mapping[Encoding, Callable[[object], bytes]] = {
    Encoding.JSON: msgspec.json.Encoder().encode,
    Encoding.MSGPACK: msgspec.msgpack.Encoder().encode,
}


def encode(value: Sendable, encoding: Encoding = Encoding.JSON) -> bytes:
    """A value as bytes. The same values give the same bytes."""
    own = _AS_RECORD.get(type(value))
    return _ENCODE[encoding](_Sent(VERSION, type(value).__name__, value if own is None else own.put(value)))


def decode(data: bytes, form: Form, encoding: Encoding = Encoding.JSON) -> Sendable:
    """The value of bytes; `form` is that of the robot they speak of. Raises RecordError, whatever the bytes are."""
    try:
        received = _decoder(_Received, encoding)(data)
        if received.v != VERSION:
            raise RecordError(f"a message of version {received.v}; this vrs {__version__} reads version {VERSION}")
        if received.kind not in KINDS:
            raise RecordError(f"a message of the unknown kind {received.kind!r}")
        return _value(KINDS[received.kind], received.body, form, encoding)
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError) as error:
        raise RecordError(f"no message: {error}") from None


def _value(kind: type, body: msgspec.Raw, form: Form, encoding: Encoding) -> Sendable:
    own = _AS_RECORD.get(kind)
    value: Sendable
    value = _decoder(kind, encoding)(body) if own is None else own.take(_decoder(own.record, encoding)(body), form)
    return value


@cache
def _decoder(kind: type, encoding: Encoding) -> Callable[[bytes | msgspec.Raw], Any]:
    if encoding is Encoding.JSON:
        return msgspec.json.Decoder(kind).decode
    return msgspec.msgpack.Decoder(kind).decode
