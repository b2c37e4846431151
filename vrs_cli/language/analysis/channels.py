"""The input channels of the first VAL: a plain number, 1 and up, is the input that VAL-II numbers from 1001."""

from __future__ import annotations

from collections.abc import Iterable

from vrs_cli.language.text import ast
from vrs_cli.language.text.ast import Expression
from vrs_cli.language.words.signals import INPUTS, OUTPUTS
from vrs_cli.values.diagnostics import Span


def channel(expression: Expression) -> int | None:
    """The signal that a number of VAL stands for, negative for the inverse; None for anything else."""
    if isinstance(expression, ast.Unary) and expression.operator == "-":
        inner = channel(expression.operand)
        return None if inner is None else -inner
    if not isinstance(expression, ast.Number) or not expression.value.is_integer() or not expression.value:
        return None
    number = int(expression.value)
    return number + INPUTS[0] - OUTPUTS[0] if number in OUTPUTS else number


def signals_on(channels: Iterable[Expression | None], span: Span) -> ast.Call:
    """`SIG(...)` of these channels; what is no plain number is a signal number already."""
    return ast.Call("SIG", tuple(_signal(one) for one in channels if one is not None), True, span=span)


def _signal(expression: Expression) -> Expression:
    number = channel(expression)
    if number is None:
        return expression
    known = ast.Number(float(abs(number)), str(abs(number)), span=expression.span)
    return known if number > 0 else ast.Unary("-", known, span=expression.span)
