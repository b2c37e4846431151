"""Variables listed and deleted."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import cast

from vrs_cli.dialogue.replies import LocationTable, Message, NamedLocation, RealTable, Reply, StringTable
from vrs_cli.dialogue.talk import Talk
from vrs_cli.errors import TypeMismatch, UndefinedValue
from vrs_cli.interfaces.monitor.consent import agreed
from vrs_cli.interfaces.station.operands import Handler, own, real, shown, sight
from vrs_cli.interfaces.station.station import Station
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.transform import Transform
from vrs_cli.language.run.cells import Index, Reference, subscript
from vrs_cli.language.text.ast import Binary, Expression, Instruction, Unary, Variable
from vrs_cli.language.text.precedence import LOGICAL, RELATIONS
from vrs_cli.language.words.kind import Kind
from vrs_cli.language.words.values import Value, kind_of_value, whole

Rows = tuple[tuple[str, Value], ...]

PLACES, REALS, STRINGS = frozenset({Kind.LOCATION, Kind.PRECISION}), frozenset({Kind.REAL}), frozenset({Kind.STRING})


def _places(station: Station, rows: Rows) -> Reply:
    named = tuple(NamedLocation.of(name, cast("Transform | Joints", value)) for name, value in rows)
    return LocationTable(named, station.units)


def _reals(_station: Station, rows: Rows) -> Reply:
    return RealTable(_real_rows(rows))


def _real_rows(rows: Rows) -> tuple[tuple[str, float], ...]:
    return tuple((name, cast(float, value)) for name, value in rows)


def _strings(_station: Station, rows: Rows) -> Reply:
    return StringTable(tuple((name, cast(str, value)) for name, value in rows))


def _list(kinds: frozenset[Kind], table: Callable[[Station, Rows], Reply], otherwise: str) -> Handler:
    def listed(station: Station, it: Instruction) -> Talk[None]:
        yield table(station, tuple(_rows(station, it, kinds, otherwise)))

    return listed


def shown_value(station: Station, expression: Expression) -> Iterator[Reply]:
    """An expression alone at the prompt: what LISTR, LISTL or LISTS of it answers."""
    if isinstance(expression, Binary) and expression.operator == "==" and isinstance(expression.left, Variable):
        yield Message(f"== compares; {shown(expression.left)} = {shown(expression.right)} assigns")
    rows = _values(station, expression)
    kind = kind_of_value(rows[0][1])
    if kind is Kind.REAL:
        yield RealTable(_real_rows(rows), _is_truth(expression))
    else:
        yield _strings(station, rows) if kind is Kind.STRING else _places(station, rows)


def _is_truth(expression: Expression) -> bool:
    """Whether it says that something is so."""
    return isinstance(expression, Binary | Unary) and expression.operator in RELATIONS | LOGICAL


def _rows(station: Station, it: Instruction, kinds: frozenset[Kind], otherwise: str) -> Iterator[tuple[str, Value]]:
    """What was asked for, each with its name or text; everything of these kinds when nothing was."""
    asked = [argument for argument in it.arguments if argument is not None]
    if not asked:
        for kind in (one for one in Kind if one in kinds):
            yield from station.environment.variables(kind)
    for expression in asked:
        for name, value in _values(station, expression):
            if kind_of_value(value) not in kinds:
                raise TypeMismatch(f"{name} is a {kind_of_value(value).value}", otherwise)
            yield name, value


def _values(station: Station, expression: Expression) -> Rows:
    """An expression with its value; of a name alone, all that it stands for."""
    return _elements(station, expression) or ((shown(expression), sight(station, expression)()),)


def _elements(station: Station, expression: Expression) -> tuple[tuple[str, Value], ...]:
    """What a name alone stands for: the simple variable and all elements of the array of that name."""
    if not isinstance(expression, Variable) or expression.indexes:
        return ()
    if expression.key in own(station):
        return tuple(_own_elements(station, expression, own(station)[expression.key]))
    return tuple(station.environment.values_named(expression.key))


def _own_elements(station: Station, asked: Variable, reference: Reference) -> Iterator[tuple[str, Value]]:
    """The same of a variable of the program that has stopped. Raises UndefinedValue where there is none."""
    program, name = station.task.program if station.task is not None else "", asked.sigil + asked.name
    if reference.key is not None:
        yield f"{name} ({program})", reference.value()
        return
    for cells in (reference.cells, reference.locations):
        indexes = [index for index in cells if not isinstance(index, str)]
        for index in sorted(indexes, key=lambda index: index if isinstance(index, tuple) else (index,)):
            yield f"{name}[{subscript(index)}] ({program})", cells[index]


def _delete_variables(kinds: frozenset[Kind]) -> Handler:
    def delete(station: Station, it: Instruction) -> Talk[None]:
        doomed = [_variable_of(station, argument, kinds) for argument in it.arguments]
        if not (yield from agreed(station, f"{', '.join(name for name, _ in doomed)} will be deleted.")):
            return
        for name, index in doomed:
            station.environment.delete(name, index)

    return delete


def _variable_of(station: Station, expression: Expression | None, kinds: frozenset[Kind]) -> tuple[str, Index | None]:
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
    "LISTL": _list(PLACES, _places, "LISTR lists reals, LISTS strings"),
    "LISTR": _list(REALS, _reals, "LISTL lists locations, LISTS strings"),
    "LISTS": _list(STRINGS, _strings, "LISTL lists locations, LISTR reals"),
    "DELETEL": _delete_variables(PLACES),
    "DPOINT": _delete_variables(PLACES),
    "DELETER": _delete_variables(REALS),
    "DELETES": _delete_variables(STRINGS),
}
