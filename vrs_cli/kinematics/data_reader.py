"""Check plain data: tables, words and numbers with units. Each error says where in the data the mistake is, and what
would be right.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from math import radians
from reprlib import repr as brief

from msgspec import Struct

from vrs_cli.errors import FileDamaged, did_you_mean
from vrs_cli.kinematics.transform import Transform, from_oat

HUGE = 1e9  # all lengths, angles and rates of a robot must be smaller; refuses infinity and NaN
TINY = 1e-9  # smallest number accepted where a positive number is required


class Quantity(Struct, frozen=True):
    """A kind of number: its unit in a TOML file ("" if it has none), and whether it must be above zero."""

    unit: str
    positive: bool = False

    def to_si(self, value: float) -> float:
        if self.unit.startswith("mm"):
            return value / 1000.0
        return radians(value) if self.unit.startswith("deg") else float(value)

    def for_prismatic(self) -> Quantity:
        """Return the same quantity for a prismatic joint: with mm instead of deg."""
        return Quantity(self.unit.replace("deg", "mm"), self.positive)


LENGTH, ANGLE = Quantity("mm"), Quantity("deg")
PLAIN, POSITIVE = Quantity(""), Quantity("", positive=True)


class DataReader(Struct, frozen=True):
    """Checks plain data read from `file`. Data written by people (`human`) is in millimetres and degrees, other data in
    metres and radians.
    """

    file: str
    human: bool

    def table(self, data: object, key: str, keys: Iterable[str], options: Iterable[str] = ()) -> Mapping[str, object]:
        """Check that `data` is a table that has all `keys`, and no other keys than these and `options`; return the
        table. `key`: the position of the table in the file, for errors. Raises FileDamaged.
        """
        needed, known = tuple(keys), (*keys, *options)
        if not isinstance(data, Mapping):
            raise self.wrong(key, "is not a table", f"give {', '.join(known)}")
        for name in data:
            if name not in known:
                hint = did_you_mean(str(name), known, f"known here: {', '.join(known)}")
                raise self.wrong(key, f"has an unknown key {brief(name)}", hint)
        for name in needed:
            if name not in data:
                raise self.wrong(key, f"has no {name}", f"give {', '.join(needed)}")
        return data

    def number(self, value: object, key: str, quantity: Quantity) -> float:
        # only NaN differs from itself
        if isinstance(value, bool) or not isinstance(value, int | float) or value != value:
            raise self.wrong(key, f"{brief(value)} is not a number", f"give a number{self.in_unit(quantity)}")
        if not abs(value) < HUGE:
            raise self.wrong(
                key, f"{brief(value)} is too large", f"give less than {HUGE:g} {self.unit(quantity)}".rstrip()
            )
        if quantity.positive and not value > 0:
            raise self.wrong(key, f"{brief(value)} is not above zero", f"give a number above 0{self.in_unit(quantity)}")
        if quantity.positive and value < TINY:
            raise self.wrong(
                key, f"{brief(value)} is too small", f"give at least {TINY:g} {self.unit(quantity)}".rstrip()
            )
        return quantity.to_si(value) if self.human else float(value)

    def word(self, value: object, key: str) -> str:
        if not isinstance(value, str) or not value.strip():
            raise self.wrong(key, f"{brief(value)} is not a text", 'write it in quotes, as name = "puma560"')
        return value

    def unit(self, quantity: Quantity) -> str:
        return quantity.unit if self.human else self.si(quantity.unit)

    def in_unit(self, quantity: Quantity) -> str:
        return f" in {self.unit(quantity)}" if quantity.unit else ""

    def si(self, unit: str) -> str:
        return unit.replace("mm", "m").replace("deg", "rad")

    def wrong(self, key: str, what: str, right: str) -> FileDamaged:
        return FileDamaged(f"{self.file}: {key}: {what}", right)

    def number_list(self, data: object, key: str, quantities: Sequence[Quantity], right: str) -> tuple[float, ...]:
        """Check a list of numbers, one for each quantity, and return the numbers in SI units. `right`: the part of the
        error message that says what would be right. Raises FileDamaged.
        """
        if not isinstance(data, list | tuple) or len(data) != len(quantities):
            raise self.wrong(key, f"is not a list of {len(quantities)} numbers", right)
        return tuple([self.number(x, key, quantity) for x, quantity in zip(data, quantities, strict=True)])

    def frame(self, data: object, key: str) -> Transform:
        if self.human:
            x, y, z, o, a, t = self.number_list(
                data, key, [LENGTH] * 3 + [ANGLE] * 3, "give X, Y, Z, O, A, T in mm and deg"
            )
            return from_oat(x, y, z, o, a, t)
        return Transform(*self.number_list(data, key, [LENGTH] * 12, "give the rows of a matrix"))
