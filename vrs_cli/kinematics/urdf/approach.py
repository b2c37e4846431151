"""Where the fingers of a hand point, as its tip sees them: APPRO and DEPART go along the tip's Z, which is another
direction in the files of many makers.
"""

from __future__ import annotations

from collections.abc import Iterable
from math import degrees, pi
from typing import NamedTuple

from vrs_cli.kinematics.transform import (
    Transform,
    Vector,
    added,
    length,
    rotation_x,
    rotation_y,
    scaled,
    subtracted,
    to_oat,
)

CLEAR = 0.7  # cosine of the angle between where fingers point and an axis: farther off it is none
SHORT = 1e-3  # [m] no direction

Z = (0.0, 0.0, 1.0)


class Turned(NamedTuple):
    """A direction of the tip, and the turn that brings Z there."""

    name: str
    direction: Vector
    turn: Transform


_OTHERS = (
    Turned("X", (1.0, 0.0, 0.0), rotation_y(pi / 2)),
    Turned("-X", (-1.0, 0.0, 0.0), rotation_y(-pi / 2)),
    Turned("Y", (0.0, 1.0, 0.0), rotation_x(-pi / 2)),
    Turned("-Y", (0.0, -1.0, 0.0), rotation_x(pi / 2)),
    Turned("-Z", (0.0, 0.0, -1.0), rotation_x(pi)),
)


def other_than_z(last: Vector, fingers: Iterable[Vector]) -> Turned | None:
    """The axis of the tip that fingers point along, where it is clearly another than Z; `last`: a point of the last
    joint, and places of the fingers' ends, as the tip sees them.

    They point from the last joint to their ends and to the tip.
    """
    ends = [subtracted(end, last) for end in fingers]
    if not ends:
        return None
    mean = scaled((sum(x for x, _, _ in ends), sum(y for _, y, _ in ends), sum(z for _, _, z in ends)), 1.0 / len(ends))
    ahead = added(mean, scaled(last, -1.0))
    far = length(ahead)
    if far < SHORT:
        return None
    return next((one for one in _OTHERS if sum(map(float.__mul__, one.direction, ahead)) > CLEAR * far), None)


def note(tip: str, turned: Turned) -> str:
    """What is told of it."""
    angles = ", ".join(f"{round(degrees(angle), 3) + 0.0:g}" for angle in to_oat(turned.turn))
    return (
        f"the fingers point along {turned.name} of {tip}, but APPRO and DEPART go along its Z: "
        f"TOOL TRANS(0, 0, 0, {angles}) turns it, or flange = [0, 0, 0, {angles}] in a TOML file"
    )
