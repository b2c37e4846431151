"""What compiled programs call: functions and instructions by name, and the names that they find as globals."""

from __future__ import annotations

from collections.abc import Callable
from typing import NoReturn

from vrs_cli.engine.commands import Break
from vrs_cli.errors import ArithmeticOverflow, IllegalValue, UndefinedValue
from vrs_cli.kinematics.transform import compose
from vrs_cli.language.compile.library import Library
from vrs_cli.language.run.cells import NO_CELLS, Reference, new_variable
from vrs_cli.language.run.effects import CallProgram, Return, Wait
from vrs_cli.language.run.memory import Context
from vrs_cli.language.run.operands import Definable, Wording, stamp_of
from vrs_cli.language.run.operations import IN_CONTEXT, OF_VALUES, modulo, power
from vrs_cli.language.run.semantics.table import HANDLERS
from vrs_cli.language.words.kind import Kind
from vrs_cli.language.words.values import Value, integer, kind_of_value, storable, whole, within_range, wrap


def complement(x: float) -> float:
    return wrap(~integer(x))


def bit_and(a: float, b: float) -> float:
    return wrap(integer(a) & integer(b))


def bit_or(a: float, b: float) -> float:
    return wrap(integer(a) | integer(b))


def bit_xor(a: float, b: float) -> float:
    return wrap(integer(a) ^ integer(b))


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


class Unset:
    """The limit of a loop that was entered past its FOR. To compare it or to add it raises the error."""

    def _say(self, _other: object) -> NoReturn:
        raise UndefinedValue("the limit of FOR", "the loop was entered by a jump past its FOR")

    __lt__ = __le__ = __gt__ = __ge__ = __radd__ = _say


UNSET = Unset()

_NAMES: dict[str, object] = {
    "compose": compose,
    "modulo": modulo,
    "power": power,
    "complement": complement,
    "bit_and": bit_and,
    "bit_or": bit_or,
    "bit_xor": bit_xor,
    "for_step": for_step,
    "setting": setting,
    "by_value": by_value,
    "guarded": guarded,
    "at_once": at_once,
    "stamp_of": stamp_of,
    "storable": storable,
    "whole": whole,
    "within_range": within_range,
    "CallProgram": CallProgram,
    "Definable": Definable,
    "Reference": Reference,
    "Wait": Wait,
    "Wording": Wording,
    "NO_CELLS": NO_CELLS,
    "BREAK": Break(),
    "RETURN": Return(),
}

LIBRARY = Library(_NAMES, OF_VALUES, IN_CONTEXT, HANDLERS)
