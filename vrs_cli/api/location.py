"""Check numbers given in Python, and define locations (one or many) and units (those of VAL-II, or SI)."""

from __future__ import annotations

from enum import Enum
from functools import cached_property
from math import pi

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vrs_cli.api.answers import figures, table
from vrs_cli.kinematics.arrays import compose_batch, to_oat_batch
from vrs_cli.kinematics.joints import JointUnits
from vrs_cli.kinematics.transform import Transform
from vrs_cli.language.run.operations import trans as of_numbers
from vrs_cli.language.words.values import numbers_of, plain
from vrs_cli.render.blocks import number_columns
from vrs_cli.values.numbers import decimal

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]


class Units(Enum):
    """Units of a Robot. `VAL`: millimetres and degrees; `SI`: metres and radians. Times are seconds in both."""

    VAL = "VAL"
    SI = "SI"

    @classmethod
    def of(cls, given: str | Units) -> Units:
        """Return the units of this name. Raises ValueError for an unknown name."""
        try:
            return cls(given)
        except ValueError:
            raise ValueError(f'units {given!r}: "VAL" (mm, degrees) or "SI" (m, radians) is wanted') from None

    @property
    def length(self) -> str:
        return "mm" if self is Units.VAL else "m"

    @property
    def angle(self) -> str:
        return "deg" if self is Units.VAL else "rad"

    def scales(self, kinds: JointUnits, count: int) -> Floats:
        """Return the factors (n,) that convert joints [rad, m] to these units; 1 in SI."""
        if self is Units.SI:
            return np.ones(count)
        return np.array([kinds.one_shown(joint, 1.0) for joint in range(1, count + 1)])


def numbers(given: ArrayLike, what: str, *shape: int) -> Floats:
    """Return finite numbers as a new array of a shape (..., *shape). `what`: their name in messages. Raises TypeError
    for values that are not numbers, ValueError for another shape, nan or infinity."""
    try:
        array = np.asarray(given)
    except ValueError:
        raise ValueError(f"{what}: the rows are not of one length") from None
    if array.dtype.kind not in "fiu":
        raise TypeError(f"{what}: numbers are wanted, not {_short_repr(given)}")
    if array.shape[array.ndim - len(shape) :] != shape or array.ndim < len(shape):
        wanted = f"{_shape_text(shape)} or {_shape_text(('N', *shape))}"
        raise ValueError(f"{what}: the shape {array.shape} does not fit, {wanted} is wanted")
    if not np.isfinite(array).all():
        raise ValueError(f"{what}: finite numbers are wanted, not {array[~np.isfinite(array)][0]}")
    return array.astype(np.float64)


def number(given: float, what: str) -> float:
    """Return one finite number. Raises TypeError, ValueError."""
    array = numbers(given, what)
    if array.ndim:
        raise TypeError(f"{what}: one number is wanted, not {_short_repr(given)}")
    return float(array)


def freeze(array: Floats) -> Floats:
    """Make an array read-only, and return it."""
    array.flags.writeable = False
    return array


def _shape_text(shape: tuple[int | str, ...]) -> str:
    return f"({', '.join(map(str, shape))}{',' * (len(shape) == 1)})" if shape else "one number"


def _short_repr(given: object) -> str:
    text = repr(given)
    return text if len(text) <= 40 else f"{text[:37]}..."


class Location:
    """The pose of a tool, or an array of poses: transformations of VAL-II.

    `xyz` (..., 3): X, Y, Z; `oat` (..., 3): the angles O, A, T. They are in mm and degrees, or in metres and radians
    for `units="SI"`. `matrix` (..., 4, 4): the homogeneous transformation, always in metres. `a @ b` is VAL-II's `a:b`.
    """

    def __init__(self, rows: Floats, units: Units = Units.VAL) -> None:
        """Make locations from `rows` (..., 3, 4) [m], the upper three rows of `matrix`."""
        self.rows, self.units = freeze(rows), units

    @classmethod
    def of(cls, T: Transform, units: Units = Units.VAL) -> Location:
        return cls(np.array(T).reshape(3, 4), units)

    @classmethod
    def from_matrix(cls, matrix: ArrayLike, units: str | Units = Units.VAL) -> Location:
        """Make locations from homogeneous transformations (4, 4) or (N, 4, 4) [m]. Raises ValueError if a matrix is not
        a rigid transformation."""
        M = numbers(matrix, "matrix", 4, 4)
        R = M[..., :3, :3]
        rigid = np.allclose(R @ R.swapaxes(-1, -2), np.eye(3), atol=1e-6) and (np.linalg.det(R) > 0.0).all()
        if not rigid or not (M[..., 3, :] == (0.0, 0.0, 0.0, 1.0)).all():
            raise ValueError("matrix: a rotation and a position over 0, 0, 0, 1 are wanted")
        return cls(M[..., :3, :], Units.of(units))

    @property
    def shape(self) -> tuple[int, ...]:
        """Return () for one location, (N,) for N locations."""
        return self.rows.shape[:-2]

    @cached_property
    def xyz(self) -> Floats:
        """Return X, Y, Z (..., 3) [mm], or [m] in SI."""
        return freeze(self.rows[..., 3] * (1000.0 if self.units is Units.VAL else 1.0))

    @cached_property
    def oat(self) -> Floats:
        """Return the angles O, A, T (..., 3) [degrees], or [rad] in SI."""
        oat = to_oat_batch(self.rows)
        return freeze(np.degrees(oat) if self.units is Units.VAL else oat)

    @cached_property
    def matrix(self) -> Floats:
        """Return the homogeneous transformations (..., 4, 4) [m]."""
        last = np.broadcast_to((0.0, 0.0, 0.0, 1.0), (*self.shape, 1, 4))
        return freeze(np.concatenate((self.rows, last), axis=-2))

    @property
    def transform(self) -> Transform:
        """Return a single location as a Transform [m]. Raises ValueError for an array of locations."""
        if self.shape:
            raise ValueError(f"location: one is wanted, not an array of shape {self.shape}")
        return Transform(*self.rows.ravel().tolist())

    def __matmul__(self, other: Location) -> Location:
        """Return `a @ b`, VAL-II's `a:b`: the location b, given in the frame a. Arrays (N,) are multiplied row by
        row."""
        if not isinstance(other, Location):
            return NotImplemented
        return Location(compose_batch(self.rows, other.rows), self.units)

    def inverse(self) -> Location:
        """Return the inverse location: `a @ a.inverse()` is the identity."""
        R = self.rows[..., :3].swapaxes(-1, -2)
        return Location(np.concatenate((R, -R @ self.rows[..., 3:]), axis=-1), self.units)

    def __len__(self) -> int:
        if not self.shape:
            raise TypeError("one location has no length")
        return self.shape[0]

    def __getitem__(self, index: int | slice) -> Location:
        """Return one of N locations by its index, or some of them by a slice. Raises IndexError, TypeError."""
        if not self.shape:
            raise TypeError("one location has no others in it")
        return Location(self.rows[index].copy(), self.units)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Location) and np.array_equal(self.rows, other.rows)

    def __hash__(self) -> int:
        return hash(self.rows.tobytes())

    def _repr_html_(self) -> str:
        """Return the text of one location, or a table of many."""
        if not self.shape:
            return f"<pre>{self!r}</pre>"
        rows = np.concatenate((self.xyz, self.oat), axis=-1).reshape(-1, 6).tolist()
        return table(
            f"{self!r} [{self.units.length}, {self.units.angle}]",
            number_columns(*"XYZOAT"),
            len(rows),
            lambda i: figures(rows[i]),
        )

    def __repr__(self) -> str:
        if self.shape:
            return f"{'x'.join(map(str, self.shape))} locations"
        if self.units is Units.VAL:
            return f"trans({', '.join(map(plain, numbers_of(self.transform)))})"
        six = ", ".join(decimal(x, 6) for x in (*self.xyz.tolist(), *self.oat.tolist()))
        return f'trans({six}, units="SI")'


def trans(
    x: ArrayLike = 0.0,
    y: ArrayLike = 0.0,
    z: ArrayLike = 0.0,
    o: ArrayLike | None = None,
    a: ArrayLike | None = None,
    t: ArrayLike | None = None,
    *,
    units: str | Units = Units.VAL,
) -> Location:
    """Return the location with these coordinates [mm] and angles [degrees], or [m] and [rad] with `units="SI"`.

    Numbers give one location, arrays (N,) give N locations, as numpy broadcasts them. Without angles there is no
    rotation, as in VAL-II. Raises TypeError, ValueError.
    """
    asked = Units.of(units)
    given = {name: part for name, part in zip("xyzoat", (x, y, z, o, a, t), strict=True) if part is not None}
    mm, degrees = (1.0, 1.0) if asked is Units.VAL else (1000.0, 180.0 / pi)
    parts = [numbers(part, name) * (mm if name in "xyz" else degrees) for name, part in given.items()]
    try:
        columns = np.stack(np.broadcast_arrays(*parts), axis=-1)
    except ValueError:
        raise ValueError(f"trans: arrays of shapes {', '.join(str(part.shape) for part in parts)} do not fit") from None
    rows = columns.reshape(-1, len(parts)).tolist()
    made = [of_numbers(*map(dict(zip(given, row, strict=True)).get, "xyzoat")) for row in rows]
    return Location(np.array(made, dtype=np.float64).reshape(*columns.shape[:-1], 3, 4), asked)
