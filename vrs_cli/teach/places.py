"""A place as a check names it: numbers, a location that the exercise gives, or where the model solution has it."""

from __future__ import annotations

from msgspec import Struct

from vrs_cli.kinematics.transform import Transform
from vrs_cli.language.run.variables import Item


class FixedPlace(Struct, frozen=True, tag=True):
    """T_world_place as numbers. `turned`: its orientation was given too."""

    T: Transform
    turned: bool


class GivenPlace(Struct, frozen=True, tag=True):
    """A location of `given.v2`, or a compound of several, `pallet:corner`. `text`: as it was written."""

    text: str
    items: tuple[Item, ...]


class ModelPlace(Struct, frozen=True, tag=True):
    """The place that the model's run has."""


Place = FixedPlace | GivenPlace | ModelPlace
MODEL = "model"
