"""What compiled programs call: functions and instructions by name, and the names that they find as globals."""

from __future__ import annotations

import ast as py
from collections.abc import Callable, Mapping, Sequence
from itertools import chain
from typing import Any, NoReturn

from vrs_cli.errors import ArithmeticOverflow, IllegalValue, UndefinedValue
from vrs_cli.kinematics.transform import compose
from vrs_cli.language.compile.compiler import compile_expression
from vrs_cli.language.compile.expressions import CELLS, ExpressionCompiler, Library
from vrs_cli.language.run.cells import NO_CELLS, Reference, new_variable
from vrs_cli.language.run.effects import CallProgram, Return, Wait
from vrs_cli.language.run.memory import Context
from vrs_cli.language.run.operands import Definable, Wording, stamp_of
from vrs_cli.language.run.operations import IN_CONTEXT, OF_VALUES, modulo, power
from vrs_cli.language.run.semantics.assignments import ASSIGNMENTS
from vrs_cli.language.run.semantics.input_output import INPUT_OUTPUT
from vrs_cli.language.run.semantics.motions import MOTIONS
from vrs_cli.language.run.semantics.settings import SETTINGS
from vrs_cli.language.run.semantics.signals import SIGNALS
from vrs_cli.language.run.semantics.tasks import TASKS
from vrs_cli.language.words.values import Kind, integer, kind_of_value, storable, whole, within_range, wrap
from vrs_cli.values.commands import Break
from vrs_cli.values.numbers import Value


def for_step(step: float) -> float:
    if step == 0.0:
        raise IllegalValue("a STEP of 0", "the loop would never end")
    return step


def setting(name: str, variable: Reference) -> Value:
    """`PARAMETER p = word`: the variable of that name if it has a value, otherwise the word itself."""
    return variable.value() if variable.defined() else name.upper()


def by_value(context: Context, value: Value) -> Reference:
    """Pass the value of an expression to a CALL, in a variable that nobody else can see."""
    kind = kind_of_value(value)
    key = "the argument"
    reference = new_variable(context.environment.spelling, key, Kind.REAL if kind is Kind.LOCATION else kind)
    (reference.locations if kind is Kind.LOCATION else reference.cells)[key] = value
    return reference


def overflow(error: ArithmeticError) -> ArithmeticOverflow:
    """Translate an error of Python's arithmetic into one of the language."""
    if isinstance(error, ZeroDivisionError):
        return ArithmeticOverflow("division by zero")
    return ArithmeticOverflow("the result is too large for a real")


def guarded(condition: Callable[[], float | bool]) -> Callable[[], bool]:
    """Return the condition of a WAIT for the driver, which expects no error but VrsError."""

    def ask() -> bool:
        try:
            return bool(condition())
        except ArithmeticError as error:
            raise overflow(error) from None

    return ask


def at_once() -> bool:
    return True


def reading_begins(context: Context) -> None:
    """Before a step with GETC: where it has to wait, it is done again, and takes the same again."""
    context.environment.system.begin_reading()


class Unset:
    """The limit of a loop that was entered past its FOR. To compare it or to add it raises the error."""

    def _say(self, _other: object) -> NoReturn:
        raise UndefinedValue("the limit of FOR", "the loop was entered by a jump past its FOR")

    __lt__ = __le__ = __gt__ = __ge__ = __radd__ = _say


UNSET = Unset()

# Who carries out which instruction: functions from evaluated operands to what the program asks for. What needs neither
# robot nor terminal (variables, signals, timers) an instruction does by itself, at its own instant of the program.
HANDLERS = {**MOTIONS, **SETTINGS, **ASSIGNMENTS, **SIGNALS, **INPUT_OUTPUT, **TASKS}

_OPERATORS = (compose, modulo, power)
_BITS: Mapping[str, Callable[..., float]] = {
    "complement": lambda x: wrap(~integer(x)),
    "bit_and": lambda a, b: wrap(integer(a) & integer(b)),
    "bit_or": lambda a, b: wrap(integer(a) | integer(b)),
    "bit_xor": lambda a, b: wrap(integer(a) ^ integer(b)),
}
_CHECKS = (for_step, guarded, at_once, reading_begins, stamp_of, storable, whole, within_range)
_OPERANDS = (setting, by_value, CallProgram, Definable, Reference, Wait, Wording)
_VALUES = {"NO_CELLS": NO_CELLS, "BREAK": Break(), "RETURN": Return()}
_NAMES = {**{one.__name__: one for one in (*_OPERATORS, *_CHECKS, *_OPERANDS)}, **_BITS, **_VALUES}

LIBRARY = Library(_NAMES, OF_VALUES, IN_CONTEXT, HANDLERS)


def evaluator(
    make: Callable[[ExpressionCompiler], py.expr], kinds: Mapping[str, Kind], own: Sequence[str] = ()
) -> Callable[..., Any]:
    """Compile an expression to a function of the context, and of a reference for each of `own`."""
    compiled = compile_expression(LIBRARY, make, kinds, own)

    def evaluate(context: Context, *references: Reference) -> Any:
        cells = context.environment.cells
        arrays = (cells(array.kind, array.key) for array in compiled.arrays)
        try:
            return compiled.function(context, *map(cells, CELLS), *chain.from_iterable(references), *arrays)
        except ArithmeticError as error:
            raise overflow(error) from None

    return evaluate
