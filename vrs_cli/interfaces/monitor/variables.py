"""Commands that list and delete variables."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import chain
from typing import cast

from vrs_cli.errors import TypeMismatch, UndefinedValue
from vrs_cli.interfaces.dialogue import Dialogue, beside, beside_if
from vrs_cli.interfaces.monitor.consent import PLACES, agreed
from vrs_cli.interfaces.station.operands import Handler, own, real, sight
from vrs_cli.interfaces.station.station import Station
from vrs_cli.kinematics.joints import Joints, JointUnits
from vrs_cli.kinematics.transform import Transform
from vrs_cli.language.run.variables import Index, Reference, subscript
from vrs_cli.language.text.ast import Binary, Expression, Instruction, Unary, Variable
from vrs_cli.language.text.meaning import LOGICAL, RELATIONS
from vrs_cli.language.text.printer import expression_text
from vrs_cli.language.words.values import Kind, kind_of_value, whole
from vrs_cli.values.numbers import Value
from vrs_cli.values.replies import LocationTable, Message, NamedLocation, RealTable, Reply, StringTable

MANY = 100  # variables
Rows = tuple[tuple[str, Value], ...]

REALS, STRINGS = (Kind.REAL,), (Kind.STRING,)


def _table(kinds: tuple[Kind, ...], rows: Rows, units: JointUnits, truth: bool = False) -> Reply:
    """The reply for variables of these kinds. `truth`: a real stands for true or false."""
    if kinds == REALS:
        return RealTable(tuple((name, cast(float, value)) for name, value in rows), truth)
    if kinds == STRINGS:
        return StringTable(tuple((name, cast(str, value)) for name, value in rows))
    named = tuple(NamedLocation.of(name, cast("Transform | Joints", value)) for name, value in rows)
    return LocationTable(named, units)


def _list(kinds: tuple[Kind, ...], otherwise: str) -> Handler:
    def listed(station: Station, it: Instruction) -> Dialogue[None]:
        rows = yield from _rows(station, it, kinds, otherwise)
        yield (yield from beside_if(len(rows) >= MANY, lambda: _table(kinds, rows, station.units)))

    return listed


def shown_value(station: Station, expression: Expression) -> Dialogue[None]:
    """An expression alone at the prompt: what LISTR, LISTL or LISTS of it answers."""
    if isinstance(expression, Binary) and expression.operator == "==" and isinstance(expression.left, Variable):
        yield Message(f"== compares; {expression_text(expression.left)} = {expression_text(expression.right)} assigns")
    rows = yield from _values(station, expression)
    truth = isinstance(expression, Binary | Unary) and expression.operator in RELATIONS | LOGICAL
    yield _table((kind_of_value(rows[0][1]),), rows, station.units, truth)


def _rows(station: Station, it: Instruction, kinds: tuple[Kind, ...], otherwise: str) -> Dialogue[Rows]:
    """The values of the arguments, each with its name or text; without arguments all variables of these kinds."""
    asked = [argument for argument in it.arguments if argument is not None]
    if not asked:
        memory = station.environment.copy()
        return (yield from beside(lambda: tuple(chain.from_iterable(map(memory.variables, kinds)))))
    rows: list[tuple[str, Value]] = []
    for expression in asked:
        found = yield from _values(station, expression)
        for name, value in found:
            if kind_of_value(value) not in kinds:
                raise TypeMismatch(f"{name} is a {kind_of_value(value).value}", otherwise)
        rows += found
    return tuple(rows)


def _values(station: Station, expression: Expression) -> Dialogue[Rows]:
    """An expression with its value; for a name alone, the simple variable and all elements of the array."""
    rows: Rows = ()
    if isinstance(expression, Variable) and not expression.indexes:
        key = expression.key
        if (reference := own(station).get(key)) is not None:
            rows = tuple(_own_elements(station, expression, reference))
        else:
            found = station.environment.alone(key)
            rows = yield from beside_if(
                found.count() >= MANY, lambda: tuple(chain.from_iterable(map(found.variables, Kind)))
            )
    return rows or ((expression_text(expression), sight(station, expression)()),)


def _own_elements(station: Station, asked: Variable, reference: Reference) -> Iterator[tuple[str, Value]]:
    """Return the values of a variable that the stopped program has to itself. Raises UndefinedValue where there is
    none.
    """
    program, name = station.task.program if station.task is not None else "", asked.sigil + asked.name
    if reference.key is not None:
        yield f"{name} ({program})", reference.value()
        return
    for cells in (reference.cells, reference.locations):
        indexes = [index for index in cells if not isinstance(index, str)]
        for index in sorted(indexes, key=lambda index: index if isinstance(index, tuple) else (index,)):
            yield f"{name}[{subscript(index)}] ({program})", cells[index]


def _delete_variables(kinds: tuple[Kind, ...]) -> Handler:
    def delete(station: Station, it: Instruction) -> Dialogue[None]:
        doomed = [_variable_of(station, argument, kinds) for argument in it.arguments]
        if not (yield from agreed(station, f"{', '.join(name for name, _ in doomed)} will be deleted.")):
            return
        for name, index in doomed:
            station.environment.delete(name, index)

    return delete


def _variable_of(station: Station, expression: Expression | None, kinds: tuple[Kind, ...]) -> tuple[str, Index | None]:
    """The name, and the index of one element. Raises UndefinedValue, TypeMismatch."""
    if not isinstance(expression, Variable):
        raise TypeMismatch("an expression", "the name of a variable is wanted")
    name = expression.sigil + expression.name
    kind = station.environment.kind_of(name)
    if kind is None:
        raise UndefinedValue(name, "there is nothing to delete")
    if kind not in kinds:
        raise TypeMismatch(f"{name} is a {kind.value}")
    indexes = tuple(whole(real(station, index)) for index in expression.indexes or ())
    return name, None if not indexes else indexes[0] if len(indexes) == 1 else indexes


VARIABLES: Mapping[str, Handler] = {
    "LISTL": _list(PLACES, "LISTR lists reals, LISTS strings"),
    "LISTR": _list(REALS, "LISTL lists locations, LISTS strings"),
    "LISTS": _list(STRINGS, "LISTL lists locations, LISTR reals"),
    "DELETEL": _delete_variables(PLACES),
    "DPOINT": _delete_variables(PLACES),
    "DELETER": _delete_variables(REALS),
    "DELETES": _delete_variables(STRINGS),
}
