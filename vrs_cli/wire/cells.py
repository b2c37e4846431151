"""Convert a cell (a robot's surroundings and signals) to a record for clients, and back."""

from __future__ import annotations

from typing import Any

import msgspec

from vrs_cli.language.run.signals import Cell
from vrs_cli.wire.codec import table_of
from vrs_cli.wire.records import RecordError

MAX_CELL_BYTES = 1_000_000  # maximum size of a cell in a message [bytes]


def cell_record(cell: Cell) -> dict[str, Any] | None:
    """Return the record of a cell; None if it is too large for a message."""
    return None if len(msgspec.json.encode(cell)) > MAX_CELL_BYTES else table_of(cell)


def cell_of(record: dict[str, Any]) -> Cell:
    """Return the cell of a record. Raises RecordError."""
    try:
        return msgspec.convert(record, Cell, str_keys=True)
    except msgspec.ValidationError as wrong:
        raise RecordError(f"a cell: {wrong}") from None
