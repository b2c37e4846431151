"""Cells as records: they come back equal, and what is none is refused."""

from __future__ import annotations

from typing import Any

import msgspec
import pytest

from tests.laws.world_sessions import CELL
from vrs_cli.files.cell_file import parse_cell
from vrs_cli.language.run.signals import NO_CELL
from vrs_cli.wire import cells
from vrs_cli.wire.cells import cell_of, cell_record
from vrs_cli.wire.records import RecordError

TABLES = """
[signals]
"camera.go" = 5
"camera.ready" = 1005
[[follow]]
when = "camera.go"
set = "camera.ready"
after = 0.125
lasting = 0.5
variables = ["found.x", "$name"]
rows = [[120.5, "a"], [-1, "b"]]
again = true
"""
MESH = """
[[part]]
name = "wedge"
shape = "sphere"
radius = 20
at = [0, 550, -250, 90, 30, 10]
grasp = [{at = [0, 0, 3], width = 30}]
"""


@pytest.mark.parametrize("text", ["", TABLES, CELL, TABLES + MESH])
def test_a_cell_comes_back_as_json_and_messagepack(text: str) -> None:
    cell = parse_cell(text)
    record = cell_record(cell)
    assert record is not None
    assert cell_of(msgspec.json.decode(msgspec.json.encode(record))) == cell
    assert cell_of(msgspec.msgpack.decode(msgspec.msgpack.encode(record))) == cell


def test_a_large_cell_has_no_record(monkeypatch: pytest.MonkeyPatch) -> None:
    record = msgspec.json.encode(cell_record(NO_CELL))
    monkeypatch.setattr(cells, "MAX_CELL_BYTES", len(record) - 1)
    assert cell_record(NO_CELL) is None


@pytest.mark.parametrize("change", [{"follows": 3}, {"names": {"x": "y"}}, {"scene": {"parts": [{}]}}, {"scene": None}])
def test_what_is_no_cell_is_refused(change: dict[str, Any]) -> None:
    record = cell_record(parse_cell(CELL))
    assert record is not None
    with pytest.raises(RecordError, match="a cell: "):
        cell_of(record | change)
