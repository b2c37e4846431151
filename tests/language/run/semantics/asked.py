"""What a line asks for, and a place that lines need."""

from __future__ import annotations

from math import pi

import pytest

from tests.language.running import run_lines
from vrs_cli.kinematics.transform import Transform, from_oat
from vrs_cli.language.run.effects import Event
from vrs_cli.values.commands import Move

PART = "SET part = TRANS(500, 150, -100, 90, 90, 0)"
DOWN = from_oat(0.5, 0.15, -0.1, pi / 2, pi / 2, 0.0)


def close(a: Transform, b: Transform) -> bool:
    return tuple(a) == pytest.approx(tuple(b), abs=1e-12)


def only(*lines: str) -> Event:
    """The one thing that the last line asks for."""
    (request,) = run_lines(*lines).requests
    return request


def move(*lines: str) -> Move:
    request = only(*lines)
    assert isinstance(request, Move)
    return request
