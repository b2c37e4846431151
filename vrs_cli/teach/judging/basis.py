"""What every check is judged by: the evidence, and beside it the rounding, the given locations and the model's run."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property

from msgspec import Struct

from vrs_cli.kinematics.transform import Transform, Vector, compose, position
from vrs_cli.language.run.variables import Item
from vrs_cli.teach.evidence import Evidence
from vrs_cli.teach.places import FixedPlace, GivenPlace, Place
from vrs_cli.teach.tip import Piece, tip_pieces
from vrs_cli.teach.verdict import Rounding, written_place
from vrs_cli.values.numbers import Value

HALF = 0.5  # of the points: for what is nearly right
NEAR = 5.0  # times the distance that is allowed: nearly right
MORE = 1.1  # times a limit of speed or time: nearly right
PRECISION = 0.1  # of the rounding: searches are so precise


class Basis(Struct, frozen=True):
    """`locations`: that are given, as the variant has them. `model`: the evidence of the model's run in this variant;
    None where no check compares with it.
    """

    rounding: Rounding = Rounding()
    locations: Mapping[Item, Value] = {}
    model: Evidence | None = None

    def place(self, place: Place, of_model: Transform | None = None) -> Transform:
        """Return T_world_place; `of_model`: where the model's run has it. Raises ValueError where that is not known."""
        if isinstance(place, FixedPlace):
            return place.T
        if not isinstance(place, GivenPlace):
            if of_model is None:
                raise ValueError("the model's run is not known")
            return of_model
        found: Transform | None = None
        for item in place.items:
            value = self.locations.get(item)
            if not isinstance(value, Transform):
                raise ValueError(f"{place.text} is no given location")
            found = value if found is None else compose(found, value)
        assert found is not None
        return found

    def point(self, place: Place) -> Vector:
        """Return where a place is in the world [m]."""
        return position(self.place(place))


class JudgedRun(Struct, frozen=True, dict=True):
    """A run that checks judge. What several of them need is computed once."""

    evidence: Evidence
    basis: Basis

    @property
    def mm(self) -> float:
        """Return the rounding of lengths [mm]."""
        return self.basis.rounding.mm

    @property
    def s(self) -> float:
        """Return the rounding of times [s]."""
        return self.basis.rounding.s

    @property
    def precision(self) -> float:
        """Return how precise searches for lengths are [m]."""
        return 1e-3 * PRECISION * self.mm

    def said(self, place: Vector) -> str:
        """Return a place in mm, for a reason."""
        return written_place(place, self.mm)

    @cached_property
    def tip(self) -> list[Piece]:
        """The place of the tool's tip in the course of the run."""
        return self.pieces(0)

    @cached_property
    def velocity(self) -> list[Piece]:
        """The velocity of the tip."""
        return self.pieces(1)

    @cached_property
    def acceleration(self) -> list[Piece]:
        """The acceleration of the tip."""
        return self.pieces(2)

    def pieces(self, order: int) -> list[Piece]:
        """Return the tip's place, or a derivative of it, from the beginning of the run to its end."""
        it = self.evidence
        return tip_pieces(it.arm, it.timeline, it.started, it.end, order)
