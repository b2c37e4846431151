"""Instructions that give variables their values: SET, HERE, SHIFT, FRAME, DECOMPOSE, PACK."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from msgspec.structs import replace

from vrs_cli.errors import TypeMismatch
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.transform import Transform, inverse
from vrs_cli.language.run.cells import Reference
from vrs_cli.language.run.effects import Event
from vrs_cli.language.run.memory import Context
from vrs_cli.language.run.operands import NOTHING, Definable, Handler, Wording, transform
from vrs_cli.language.run.operations import frame, pack, shift
from vrs_cli.language.words.values import kind_of_value, numbers_of


def _set(_context: Context, it: Wording, target: Definable) -> Iterable[Event]:
    target.define(it.value)
    return NOTHING


def _set_frame(_context: Context, _it: Wording, target: Definable, *places: Transform | Joints) -> Iterable[Event]:
    origin, on_x, on_y = map(transform, places)
    target.define(frame(origin, on_x, on_y, origin))
    return NOTHING


def _shift(_context: Context, _it: Wording, target: Definable, *distances: float | None) -> Iterable[Event]:
    """The last name of a compound is moved in the frame of those before it, as the numbers of it are."""
    reference = target.reference
    T = reference.value()
    if not isinstance(T, Transform):
        raise TypeMismatch(f"{reference.name} is a {kind_of_value(T).value}", "a transformation is wanted")
    reference.assign(shift(T, *distances))
    return NOTHING


def _here(context: Context, _it: Wording, target: Definable) -> Iterable[Event]:
    target.define(context.robot.joints() if target.precision else context.robot.here())
    return NOTHING


def _set_integer(_context: Context, it: Wording, variable: Reference) -> Iterable[Event]:
    variable.assign(float(int(it.value)))
    return NOTHING


def _decompose(context: Context, it: Wording, first: Reference) -> Iterable[Event]:
    """Elements from the one named on: X, Y, Z, O, A, T of a transformation, or the joints."""
    if isinstance(first.key, str | tuple):
        raise TypeMismatch(first.name, "DECOMPOSE wants an element of an array with one index: a[1]")
    for offset, number in enumerate(numbers_of(it.value, context.environment.units)):
        first._replace(key=(first.key or 0) + offset).assign(number)
    return NOTHING


def _pack(_context: Context, it: Wording, array: Reference, first: float, count: float) -> Iterable[Event]:
    pack(array, first, count, it.value)
    return NOTHING


ASSIGNMENTS: Mapping[str, Handler] = {
    "SET": _set,
    "POINT": _set,
    "HERE": _here,
    "SHIFT": _shift,
    "INVERSE": lambda context, it, target: _set(context, replace(it, value=inverse(it.value)), target),
    "FRAME": _set_frame,
    "SETI": _set_integer,
    "DECOMPOSE": _decompose,
    "PACK": _pack,
}
