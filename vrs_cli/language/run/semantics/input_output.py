"""Carry out instructions that assign variables (SET, HERE, SHIFT, FRAME, DECOMPOSE, PACK), use the terminal (TYPE,
PROMPT), or use logical units (ATTACH, FOPEN, READ, WRITE)."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from functools import partial
from itertools import zip_longest
from typing import cast

from msgspec.structs import replace

from vrs_cli.errors import IllegalValue, InvalidNumber, TypeMismatch, UnitNotAttached, VrsError
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.transform import Transform, inverse
from vrs_cli.language.run import effects
from vrs_cli.language.run.formats import TypeItem, encode
from vrs_cli.language.run.memory import Context, Definable, Handler, Wording, in_range, solve, transform
from vrs_cli.language.run.operations import configuration_bits, configuration_of, element, frame, pack, shift
from vrs_cli.language.run.variables import Reference
from vrs_cli.language.text.ast import Format
from vrs_cli.language.words.values import Kind, integer_between, kind_of_value, numbers_of, read_number, storable, whole
from vrs_cli.values.commands import Break
from vrs_cli.values.diagnostics import Span
from vrs_cli.values.numbers import Value


def _set(_context: Context, it: Wording, target: Definable) -> None:
    target.define(it.value)


def _set_frame(_context: Context, _it: Wording, target: Definable, *places: Transform | Joints) -> None:
    origin, on_x, on_y = map(transform, places)
    target.define(frame(origin, on_x, on_y, origin))


def _shift(_context: Context, _it: Wording, target: Definable, *distances: float | None) -> None:
    """Shift a location. In a compound `a:b`, the variable b changes, by distances along the axes of a."""
    reference = target.reference
    T = reference.value()
    if not isinstance(T, Transform):
        raise TypeMismatch(f"{reference.name} is a {kind_of_value(T).value}", "a transformation is wanted")
    reference.assign(shift(T, *distances))


def _here(context: Context, _it: Wording, target: Definable) -> None:
    joints = target.reference.cells.kind is Kind.PRECISION
    here = context.engine.position()
    target.define(here.joints if joints else here.T_world_tool)


def _joints_here(context: Context, _it: Wording, *targets: Reference | None) -> None:
    numbers = numbers_of(context.engine.position().joints, context.environment.units)
    if len(targets) > len(numbers):
        raise IllegalValue(f"JHERE with {len(targets)} variables", f"the robot has {len(numbers)} joints")
    for target, number in zip(targets, numbers, strict=False):
        if target is not None:
            target.assign(number)


def _decompose(context: Context, it: Wording, first: Reference) -> None:
    """Assign the numbers X, Y, Z, O, A, T of a transformation, or the joints of a precision point, to consecutive array
    elements. `first`: the first of these elements."""
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
    engine = context.engine
    near = engine.position().joints if before is None else _joints_from(context, before)
    joints, reasons = solve(engine, transform(place), near, None if asked is None else configuration_of(asked))
    for offset, number in enumerate(numbers_of(joints, context.environment.units)):
        element(_first_element(first), offset).assign(number)
    flags.assign(float(configuration_bits(engine.arm.configuration(joints))))
    error.assign(float(reasons))


def _solve_place(context: Context, it: Wording, target: Definable, error: Reference) -> None:
    joints = _joints_from(context, it.value)
    target.define(context.engine.world_pose(joints))
    error.assign(float(in_range(context.engine, joints)))


def _joints_from(context: Context, array: Reference) -> Joints:
    """Return the joint positions that are stored in consecutive array elements. Raises UndefinedValue if an element has
    no value."""
    first, count = _first_element(array), context.engine.model.joint_count
    values = [element(first, offset).value() for offset in range(count)]
    return context.environment.units.read(value for value in values if isinstance(value, float))


def _first_element(array: Reference) -> Reference:
    """Return a reference to element 0 of a whole array; return a reference to an element unchanged."""
    return array._replace(key=0) if array.key is None else array


NOWHERE = Span(0, 0, 0)


def _type(context: Context, _it: Wording, *items: TypeItem | None) -> Iterable[effects.Event]:
    return (effects.Type(*encode(items, context.environment.units)),)


_BETWEEN = r"\s*,\s*|\s+"


def _entries(line: str, kinds: list[Kind]) -> list[Value] | VrsError:
    """Return the values in a line that was read for PROMPT, one for each kind, or the mistake in the line. For a single
    variable the whole line is the value; several values are separated by commas or blanks. An empty field is 0."""
    fields = [line] if len(kinds) == 1 else re.split(_BETWEEN, line.strip())
    if len(fields) > len(kinds):
        return IllegalValue(f"{len(fields)} values where {len(kinds)} are wanted")
    values: list[Value] = []
    for field, kind in zip_longest(fields, kinds, fillvalue=""):
        value = field if kind is Kind.STRING else read_number(field) if field.strip() else 0.0
        if value is None:
            return InvalidNumber(field.strip(), "a number is wanted, such as -12.5")
        values.append(value)
    return values


def _prompt(_context: Context, _it: Wording, *items: Reference | str) -> effects.Answers:
    """Ask for a line, repeatedly until it has no mistake, and assign its values. An answer of None (no input) is taken
    as an empty line."""
    text = "".join(item for item in items if isinstance(item, str))
    targets = [item for item in items if isinstance(item, Reference)]
    values: list[Value] | VrsError | None = None
    while not isinstance(values, list):
        answer = yield effects.Prompt(text, len(targets), values)
        values = _entries(answer or "", [target.cells.kind for target in targets]) if targets else []
    for target, value in zip(targets, values, strict=True):
        if kind_of_value(value) is not target.cells.kind:
            raise TypeMismatch(target.name, "PROMPT reads reals and strings")
        target.assign(value)


Unit = Reference | float | None  # a unit as an operand: a variable, a number, or None if omitted (the robot)


def _attach(
    _context: Context, _it: Wording, asked: Unit = None, mode: float | None = None, device: str | None = None
) -> effects.Answers:
    """Attach a logical unit; without a number, attach the robot. In mode 4 the system chooses a free unit, whose number
    is stored in the variable `asked`."""
    if integer_between(mode or 0.0, 0, effects.MODE_BITS, "ATTACH mode") & effects.CHOOSE:
        name = effects.checked_device(device, None)
        if not isinstance(asked, Reference):
            raise IllegalValue("ATTACH mode 4", "it wants a variable for the number: ATTACH (lun, 4)")
        if (answer := (yield effects.AttachUnit(effects.ANY, name))) is None:
            raise UnitNotAttached("no unit is free", "DETACH one")
        asked.assign(float(answer))
        return
    given = asked.value() if isinstance(asked, Reference) else asked
    unit = effects.ROBOT if given is None else whole(cast(float, given))
    name = effects.checked_device(device, unit)
    yield effects.AttachRobot() if unit == effects.ROBOT else effects.AttachUnit(effects.checked_unit(unit), name)


def _detach(_context: Context, _it: Wording, number: float | None = None) -> Iterable[effects.Event]:
    unit = whole(number or 0.0)
    return (
        (Break(), effects.DetachRobot()) if unit == effects.ROBOT else (effects.DetachUnit(effects.checked_unit(unit)),)
    )


def _open(access: effects.Access, _context: Context, _it: Wording, unit: float, name: str) -> Iterable[effects.Event]:
    return (effects.OpenFile(effects.checked_disk(unit, access.value), name, access),)


def _write(
    context: Context, _it: Wording, number: float, handle: float | None = None, *items: TypeItem | None
) -> Iterable[effects.Event]:
    connection = None if handle is None else whole(handle)
    waits = not any(isinstance(item, Format) and item.code == "N" for item in items)
    unit, units = effects.checked_unit(number), context.environment.units
    return (effects.WriteRecord(unit, *encode(items, units), connection, waits),)


def _read(
    context: Context, _it: Wording, number: float, handle: Unit, mode: float | None, *variables: Reference | None
) -> effects.Answers:
    """Read one record and assign its values to the variables. If the record does not fit them, assign nothing, and set
    the status of the unit to an error. If `handle` is a variable, store the handle of the connection in it."""
    targets = [variable for variable in variables if variable is not None]
    unit, waits = effects.checked_unit(number), not whole(mode or 0.0) & effects.NO_WAIT
    line = yield effects.ReadRecord(unit, isinstance(handle, Reference), waits)
    if isinstance(handle, Reference) and (connection := context.environment.system.connection(unit)) is not None:
        handle.assign(float(connection))
    if line is None:
        return
    try:
        values = _record(line, [target.cells.kind for target in targets])
    except VrsError as refused:
        yield effects.RecordRefused(unit, refused.code)
        return
    for target, value in zip(targets, values, strict=True):
        target.assign(value)


def _command(
    _context: Context,
    _it: Wording,
    unit: float,
    command: float,
    data: str | None = None,
    answer: Reference | None = None,
) -> effects.Answers:
    """Send a command to a device (FCMND). `answer`: the variable for the device's answer (probably so; eV+ keyword
    reference, from memory)."""
    yield effects.CommandDevice(effects.checked_open(unit, "FCMND"), whole(command), data or "")
    if answer is not None:
        answer.assign("")  # no device gives an answer: 600 is the only command, and its answer is empty


def _fopen(
    context: Context, _it: Wording, unit: float, mode: float | None, *items: TypeItem | None
) -> Iterable[effects.Event]:
    """Open a device (FOPEN). The mode (16 for TCP in V+ programs) is ignored, because the device determines it."""
    whole(mode or 0.0)
    return (effects.OpenDevice(effects.checked_open(unit, "FOPEN"), encode(items, context.environment.units)[0]),)


def _record(line: str, kinds: list[Kind]) -> list[Value]:
    """Return the values in a line that was read for READ, one for each kind. If the last kind is a string, its value is
    the whole rest of the line; otherwise the rest of the line is ignored.

    Raises InvalidNumber for a missing or wrong number, StringOverflow for a string that is too long to store.
    """
    if kinds == [Kind.STRING]:
        return [storable(line)]
    takes_rest = bool(kinds) and kinds[-1] is Kind.STRING
    fields = re.split(_BETWEEN, line.strip(), maxsplit=len(kinds) - 1 if takes_rest else 0)
    fields += [""] * (len(kinds) - len(fields))
    values: list[Value] = []
    for field, kind in zip(fields, kinds, strict=False):
        value = storable(field) if kind is Kind.STRING else read_number(field)
        if value is None:
            raise InvalidNumber(repr(field))
        values.append(value)
    return values


INPUT_OUTPUT: Mapping[str, Handler] = {
    "SET": _set,
    "POINT": _set,
    "HERE": _here,
    "JHERE": _joints_here,
    "SHIFT": _shift,
    "INVERSE": lambda context, it, target: _set(context, replace(it, value=inverse(it.value)), target),
    "FRAME": _set_frame,
    "SETI": lambda _context, it, variable: variable.assign(float(int(it.value))),
    "DECOMPOSE": _decompose,
    "PACK": lambda _context, it, array, first, count: pack(array, first, count, it.value),
    "SOLVE.ANGLES": _solve_angles,
    "SOLVE.TRANS": _solve_place,
    "TYPE": _type,
    "TYPEI": lambda _context, _it, number: (effects.Type(*encode([Format("I", 0, None, span=NOWHERE), number])),),
    "PROMPT": _prompt,
    "ATTACH": _attach,
    "DETACH": _detach,
    **{access.value: partial(_open, access) for access in effects.Access},
    "FOPEN": _fopen,
    "FCLOSE": lambda _context, _it, unit: (effects.CloseFile(effects.checked_open(unit, "FCLOSE")),),
    "FCMND": _command,
    "FDELETE": lambda _context, _it, unit, name: (effects.DeleteFile(effects.checked_disk(unit, "FDELETE"), name),),
    "READ": _read,
    "WRITE": _write,
}
