"""Numbers as they come from outside and as they are shown: checked arrays, in VAL-II's units or in SI."""

from __future__ import annotations

from enum import Enum

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vrs_cli.kinematics.joints import JointUnits

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]


class Units(Enum):
    """`VAL`: millimetres and degrees, as VAL-II has them; `SI`: metres and radians. Times are seconds in both."""

    VAL = "VAL"
    SI = "SI"

    @classmethod
    def of(cls, given: str | Units) -> Units:
        """Raises ValueError for a name that is none."""
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
        """(n,): what makes numbers that are shown of joints [rad, m]; 1 in SI."""
        if self is Units.SI:
            return np.ones(count)
        return np.array([kinds.one_shown(joint, 1.0) for joint in range(1, count + 1)])


def numbers(given: ArrayLike, what: str, *shape: int) -> Floats:
    """Finite numbers of a shape (..., *shape), as an array of their own.

    Raises TypeError for what is no numbers, ValueError for another shape, and for nan and infinity.
    """
    try:
        array = np.asarray(given)
    except ValueError:
        raise ValueError(f"{what}: the rows are not of one length") from None
    if array.dtype.kind not in "fiu":
        raise TypeError(f"{what}: numbers are wanted, not {_said(given)}")
    if array.shape[array.ndim - len(shape) :] != shape or array.ndim < len(shape):
        wanted = f"{_shape(shape)} or {_shape(('N', *shape))}"
        raise ValueError(f"{what}: the shape {array.shape} does not fit, {wanted} is wanted")
    if not np.isfinite(array).all():
        raise ValueError(f"{what}: finite numbers are wanted, not {array[~np.isfinite(array)][0]}")
    return array.astype(np.float64)


def number(given: float, what: str) -> float:
    """One finite number. Raises TypeError, ValueError."""
    array = numbers(given, what)
    if array.ndim:
        raise TypeError(f"{what}: one number is wanted, not {_said(given)}")
    return float(array)


def freeze(array: Floats) -> Floats:
    """Make an array read-only, and return it."""
    array.flags.writeable = False
    return array


def _shape(shape: tuple[int | str, ...]) -> str:
    return f"({', '.join(map(str, shape))}{',' * (len(shape) == 1)})" if shape else "one number"


def _said(given: object) -> str:
    text = repr(given)
    return text if len(text) <= 40 else f"{text[:37]}..."
