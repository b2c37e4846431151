"""Instructions that give variables their values: SET, HERE, SHIFT, FRAME, DECOMPOSE, PACK."""

from __future__ import annotations

from collections.abc import Mapping

from msgspec.structs import replace

from vrs_cli.errors import TypeMismatch
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.transform import Transform, inverse
from vrs_cli.language.run.memory import Context, Definable, Handler, Wording, transform
from vrs_cli.language.run.operations import configuration_bits, configuration_of, element, frame, pack, shift
from vrs_cli.language.run.variables import Reference
from vrs_cli.language.words.values import Kind, kind_of_value, numbers_of


def _set(_context: Context, it: Wording, target: Definable) -> None:
    target.define(it.value)


def _set_frame(_context: Context, _it: Wording, target: Definable, *places: Transform | Joints) -> None:
    origin, on_x, on_y = map(transform, places)
    target.define(frame(origin, on_x, on_y, origin))


def _shift(_context: Context, _it: Wording, target: Definable, *distances: float | None) -> None:
    """The last name of a compound is moved in the frame of those before it, as the numbers of it are."""
    reference = target.reference
    T = reference.value()
    if not isinstance(T, Transform):
        raise TypeMismatch(f"{reference.name} is a {kind_of_value(T).value}", "a transformation is wanted")
    reference.assign(shift(T, *distances))


def _here(context: Context, _it: Wording, target: Definable) -> None:
    joints = target.reference.cells.kind is Kind.PRECISION
    target.define(context.robot.joints() if joints else context.robot.here())


def _decompose(context: Context, it: Wording, first: Reference) -> None:
    """Assign elements from the one named on: X, Y, Z, O, A, T of a transformation, or the joints."""
    if isinstance(first.key, str | tuple):
        raise TypeMismatch(first.name, "DECOMPOSE wants an element of an array with one index: a[1]")
    for offset, number in enumerate(numbers_of(it.value, context.environment.units)):
        first._replace(key=(first.key or 0) + offset).assign(number)


def _solve_angles(
    context: Context,
    _it: Wording,
    first: Reference,
    flags: Reference,
    error: Reference,
    place: Transform,
    before: Reference | None = None,
    asked: float | None = None,
) -> None:
    robot = context.robot
    near = robot.joints() if before is None else _joints_from(context, before)
    joints, reasons = robot.solve(transform(place), near, None if asked is None else configuration_of(asked))
    for offset, number in enumerate(numbers_of(joints, context.environment.units)):
        element(_beginning(first), offset).assign(number)
    flags.assign(float(configuration_bits(robot.configuration(joints))))
    error.assign(float(reasons))


def _solve_place(context: Context, it: Wording, target: Definable, error: Reference) -> None:
    joints = _joints_from(context, it.value)
    target.define(context.robot.place(joints))
    error.assign(float(context.robot.in_range(joints)))


def _joints_from(context: Context, array: Reference) -> Joints:
    """Raises UndefinedValue where an element has no value."""
    first, count = _beginning(array), context.robot.dof
    values = [element(first, offset).value() for offset in range(count)]
    return context.environment.units.read(value for value in values if isinstance(value, float))


def _beginning(array: Reference) -> Reference:
    """Of a whole array, its element 0."""
    return array._replace(key=0) if array.key is None else array


ASSIGNMENTS: Mapping[str, Handler] = {
    "SET": _set,
    "POINT": _set,
    "HERE": _here,
    "SHIFT": _shift,
    "INVERSE": lambda context, it, target: _set(context, replace(it, value=inverse(it.value)), target),
    "FRAME": _set_frame,
    "SETI": lambda _context, it, variable: variable.assign(float(int(it.value))),
    "DECOMPOSE": _decompose,
    "PACK": lambda _context, it, array, first, count: pack(array, first, count, it.value),
    "SOLVE.ANGLES": _solve_angles,
    "SOLVE.TRANS": _solve_place,
}
