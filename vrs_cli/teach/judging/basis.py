"""What every check is judged against beside the evidence, and the places that checks name."""

from __future__ import annotations

from collections.abc import Mapping

from msgspec import Struct

from vrs_cli.kinematics.transform import Transform, compose
from vrs_cli.language.run.variables import Item
from vrs_cli.teach.evidence import Evidence
from vrs_cli.teach.places import FixedPlace, GivenPlace, Place
from vrs_cli.teach.verdict import Rounding
from vrs_cli.values.numbers import Value

HALF = 0.5  # of the points: for what is nearly right


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
        if isinstance(place, GivenPlace):
            found = None
            for item in place.items:
                value = self.locations.get(item)
                if not isinstance(value, Transform):
                    raise ValueError(f"{place.text} is no given location")
                found = value if found is None else compose(found, value)
            if found is not None:
                return found
        if of_model is None:
            raise ValueError("the model's run is not known")
        return of_model


def turns(place: Place) -> bool:
    """Return whether a place has an orientation."""
    return not isinstance(place, FixedPlace) or place.turned
