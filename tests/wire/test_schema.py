"""The text of a JSON Schema is the same for all versions of msgspec and Python."""

from __future__ import annotations

import json
from enum import Enum

import msgspec

from vrs_cli.wire.codec import schema_text


class Colour(Enum):
    RED = "red"


class Point(msgspec.Struct):
    """A point. Python 3.13 and msgspec 0.23 dedent
    this line, older versions do not."""

    x: float


class Drawn(msgspec.Struct, tag=True):
    widths: dict[Colour, int]  # msgspec 0.23 gives the schema of its keys
    at: Point | None  # msgspec 0.21 writes null first
    description: str


def test_the_schema_does_not_depend_on_versions() -> None:
    made = json.loads(schema_text("drawings", drawn=Drawn))["$defs"]
    assert made["Point"]["description"].splitlines()[1] == "this line, older versions do not."
    fields = made["Drawn"]["properties"]
    assert fields["widths"] == {"type": "object", "additionalProperties": {"type": "integer"}}
    assert fields["at"] == {"anyOf": [{"$ref": "#/$defs/Point"}, {"type": "null"}]}
    assert fields["description"] == {"type": "string"}
