"""Instructions that give variables their values: SET, HERE, SHIFT, FRAME, DECOMPOSE, PACK."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import cast

from vrs_cli.errors import TypeMismatch
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.transform import Transform, inverse
from vrs_cli.language.run.cells import Reference
from vrs_cli.language.run.effects import Yielded
from vrs_cli.language.run.memory import Context
from vrs_cli.language.run.operands import NOTHING, Handler, Operands
from vrs_cli.language.run.operations import frame, pack, shift
from vrs_cli.language.words.values import kind_of_value, numbers_of


def _set(_context: Context, it: Operands) -> Iterable[Yielded]:
    it.definable(0).define(cast("Transform | Joints", it.value))
    return NOTHING


def _set_inverse(_context: Context, it: Operands) -> Iterable[Yielded]:
    it.definable(0).define(inverse(cast(Transform, it.value)))
    return NOTHING


def _set_frame(_context: Context, it: Operands) -> Iterable[Yielded]:
    origin, on_x, on_y = (it.transform(index) for index in (1, 2, 3))
    it.definable(0).define(frame(origin, on_x, on_y, origin))
    return NOTHING


def _shift(_context: Context, it: Operands) -> Iterable[Yielded]:
    """The last name of a compound is moved in the frame of those before it, as the numbers of it are."""
    reference = it.definable(0).reference
    T = reference.value()
    if not isinstance(T, Transform):
        raise TypeMismatch(f"{reference.name} is a {kind_of_value(T).value}", "a transformation is wanted")
    reference.assign(shift(T, *(it.real_or(index, 0.0) for index in (1, 2, 3))))
    return NOTHING


def _here(context: Context, it: Operands) -> Iterable[Yielded]:
    target = it.definable(0)
    target.define(context.robot.joints() if target.precision else context.robot.here())
    return NOTHING


def _set_integer(_context: Context, it: Operands) -> Iterable[Yielded]:
    cast(Reference, it.get(0)).assign(float(int(cast(float, it.value))))
    return NOTHING


def _decompose(context: Context, it: Operands) -> Iterable[Yielded]:
    """Elements from the one named on: X, Y, Z, O, A, T of a transformation, or the joints."""
    first = cast(Reference, it.get(0))
    if isinstance(first.key, str | tuple):
        raise TypeMismatch(first.name, "DECOMPOSE wants an element of an array with one index: a[1]")
    for offset, number in enumerate(numbers_of(cast("Transform | Joints", it.value), context.environment.units)):
        first._replace(key=(first.key or 0) + offset).assign(number)
    return NOTHING


def _pack(_context: Context, it: Operands) -> Iterable[Yielded]:
    pack(cast(Reference, it.get(0)), it.real(1), it.real(2), cast(str, it.value))
    return NOTHING


ASSIGNMENTS: Mapping[str, Handler] = {
    "SET": _set,
    "POINT": _set,
    "HERE": _here,
    "SHIFT": _shift,
    "INVERSE": _set_inverse,
    "FRAME": _set_frame,
    "SETI": _set_integer,
    "DECOMPOSE": _decompose,
    "PACK": _pack,
}
