"""A cell as a record, for clients of a robot in that cell."""

from __future__ import annotations

from typing import Any

import msgspec
from msgspec import Struct, ValidationError, structs

from vrs_cli.language.run.signals import Cell, Follow
from vrs_cli.values.world import CellScene
from vrs_cli.wire.records import RecordError

MAX_CELL_BYTES = 1_000_000  # maximum size of a cell in a message [bytes]


class FollowRecord(Struct, frozen=True):
    when: int
    sets: int | None
    after: float
    lasting: float | None = None
    variables: tuple[str, ...] = ()
    rows: tuple[tuple[float | str, ...], ...] = ()
    again: bool = False


class CellRecord(Struct, frozen=True):
    names: dict[int, str]
    follows: tuple[FollowRecord, ...]
    scene: CellScene


def cell_record(cell: Cell) -> dict[str, Any] | None:
    """Return the record of a cell; None if it is too large for a message."""
    if len(msgspec.json.encode(cell)) > MAX_CELL_BYTES:
        return None
    record: dict[str, Any] = msgspec.to_builtins(cell, str_keys=True)
    return record


def cell_of(record: dict[str, Any]) -> Cell:
    """Return the cell of a record. Raises RecordError."""
    try:
        read = msgspec.convert(record, CellRecord, str_keys=True)
    except ValidationError as wrong:
        raise RecordError(f"a cell: {wrong}") from None
    return Cell(read.names, tuple(Follow(**structs.asdict(one)) for one in read.follows), read.scene)
