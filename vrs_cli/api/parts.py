"""The parts of a cell in Python: where they are, what they stand on, and which one the hand holds."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from vrs_cli.api.location import Location
from vrs_cli.api.numbers import Units, number
from vrs_cli.values.replies import PartRow


class PartPlace(NamedTuple):
    """A part at a time [s]. `location` is None for a part that is not there; `on`: what it stands on, empty in the air
    and in the hand.
    """

    name: str
    time: float
    location: Location | None
    held: bool
    on: str

    @classmethod
    def of(cls, row: PartRow, units: Units) -> PartPlace:
        T = row.T_world_part
        return cls(row.name, row.time, None if T is None else Location.of(T, units), row.held, row.on)


class CellPart:
    """One part of a robot's cell."""

    def __init__(self, name: str, look: Callable[[float | None], PartPlace]) -> None:
        self.name, self._look = name, look

    def at(self, t: float) -> PartPlace:
        """Where it is at a time [s], past or planned."""
        return self._look(number(t, "t"))

    @property
    def now(self) -> PartPlace:
        """Where it is now."""
        return self._look(None)

    def __repr__(self) -> str:
        now = self.now
        place = "not there" if now.location is None else f"{now.location}{', held' * now.held}"
        return f"<CellPart {self.name}: {place}>"
