"""Operands of monitor commands: values of expressions and words that are typed at the prompt."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from vrs_cli.errors import IllegalValue, NoProgramSpecified, TypeMismatch
from vrs_cli.interfaces.dialogue import Dialogue
from vrs_cli.language.run.runtime import WatchedExpression, evaluate
from vrs_cli.language.run.variables import Reference
from vrs_cli.language.text.ast import BareWord, Call, Expression, Instruction, ProgramCall, Variable
from vrs_cli.language.words.monitor import MEASURED
from vrs_cli.language.words.values import kind_of_value, plain
from vrs_cli.values.numbers import Value
from vrs_cli.values.replies import Reply

if TYPE_CHECKING:
    from vrs_cli.interfaces.station.station import Station

NO_REPORT = ("no body has reported", "a body reports to a server: vrs body; in Python: r.report(t, joints)")
MOST_ROWS = 100_000
DEFAULT_ROWS = 10
Handler = Callable[["Station", Instruction], Dialogue[None] | Iterable[Reply] | None]  # None: no answer


def value(station: Station, expression: Expression) -> Value:
    """The present value of an expression. Raises ProgramError."""
    return evaluate(station.environment, station.engine, expression)


def real(station: Station, expression: Expression) -> float:
    """The present value of a real expression. Raises TypeMismatch for another kind of value."""
    found = value(station, expression)
    if not isinstance(found, float):
        raise TypeMismatch(f"a {kind_of_value(found).value}", "a real is wanted here")
    return found


def sight(station: Station, expression: Expression) -> Callable[[], Value]:
    """Return a function that evaluates an expression as the program that has stopped sees it."""
    seen = WatchedExpression(station.environment, station.engine, expression)
    return lambda: seen.value(own(station))


def own(station: Station) -> Mapping[str, Reference]:
    """The own variables of the program that has stopped: its arguments, and the variables of AUTO and LOCAL."""
    return {} if station.task is None else station.task.own


def operand(it: Instruction, index: int) -> Expression | None:
    return it.arguments[index] if index < len(it.arguments) else None


def real_or(station: Station, it: Instruction, index: int, default: float) -> float:
    given = operand(it, index)
    return default if given is None else real(station, given)


def moment(station: Station, it: Instruction) -> float:
    """AT t, IN dt, or now [s]."""
    at, within = it.modifiers.at, it.modifiers.within
    if at is not None:
        return real(station, at)
    return station.engine.now + (0.0 if within is None else real(station, within))


def word(expression: Expression | None) -> str:
    """The name of a file or a program, or another bare word, as it was typed."""
    if isinstance(expression, BareWord):
        return expression.text
    if isinstance(expression, Variable | Call | ProgramCall):
        return expression.name
    raise NoProgramSpecified()


def path_of(station: Station, it: Instruction) -> Path:
    """Raises FileError, FileOutside."""
    return station.folder.path(word(operand(it, 0)))


def times(station: Station, it: Instruction) -> Iterator[float]:
    """FROM t1 TO t2 STEP dt, and the exact end [s]. Raises IllegalValue."""
    first = real_or(station, it, 1, 0.0)
    last = real_or(station, it, 2, station.engine.end)
    if last < first:
        raise IllegalValue(f"FROM {plain(first)} TO {plain(last)}", "the first time comes first")
    step = real_or(station, it, 3, (last - first) / DEFAULT_ROWS or 1.0)
    if not step > 0.0 or (last - first) / step > MOST_ROWS:
        raise IllegalValue(f"STEP {plain(step)}", f"more than 0 s, for at most {MOST_ROWS} rows")
    for k in range(int((last - first) / step - 1e-9) + 1):
        yield first + k * step
    if last > first:
        yield last


def is_measured(asked: Expression | None) -> bool:
    """Return whether an operand is MEASURED: the measured robot, and no part or branch."""
    return isinstance(asked, BareWord) and asked.text.upper() == MEASURED
