"""Stretches of time in which no part changes its state, as a search for contacts goes through them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from vrs_cli.kinematics.transform import Transform
from vrs_cli.values.motion import Frames


class HeldPart(NamedTuple):
    """The part in the hand, and T_flange_part."""

    name: str
    T: Transform


class Stage(NamedTuple):
    """From `begin` to `end` [s]: T_world_part of the parts that stand, and the one in the hand.

    `hand`: times [s], and how far the hand is open then. `changed`: parts that were taken, put down or brought when
    the stage begins. `gripped`: parts that the hand may touch, because it is about to take them.
    """

    begin: float
    end: float
    frames: Frames
    standing: Mapping[str, Transform]
    held: HeldPart | None
    hand: tuple[Sequence[float], Sequence[float]]
    changed: frozenset[str] = frozenset()
    gripped: frozenset[str] = frozenset()
