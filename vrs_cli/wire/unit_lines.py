"""The lines of a file of what units are given (`--record-units`, `--replay-units`): JSON, one arrival a line."""

from __future__ import annotations

import msgspec

from vrs_cli.wire.records import RecordError

UNREADABLE = (msgspec.MsgspecError, UnicodeDecodeError, RecursionError)


class UnitLine(msgspec.Struct, frozen=True, omit_defaults=True, forbid_unknown_fields=True, rename={"within": "in"}):
    """What happens on a device, at a `time` [s] of the robot's clock; or `within` so many seconds [s] after the line
    before, or after the program has written the text `after`. `data`: bytes as characters, code for code.
    """

    time: float | None = None
    after: str | None = None
    within: float = 0.0
    device: str = ""
    event: str = "data"
    handle: int | None = None
    data: str = ""
    code: int = 0


_decoder, _encoder = msgspec.json.Decoder(UnitLine), msgspec.json.Encoder()


def read_unit_line(line: str | bytes) -> UnitLine:
    """Raises RecordError."""
    try:
        return _decoder.decode(line)
    except UNREADABLE as error:
        raise RecordError(str(error)) from None


def written_unit_line(line: UnitLine) -> bytes:
    return _encoder.encode(line) + b"\n"
