"""Expressions that VAL-II's own table of operators would group otherwise than we do (see precedence.py)."""

from __future__ import annotations

from collections.abc import Iterator

from msgspec import Struct

from vrs_cli.language.text import ast
from vrs_cli.language.text.ast import Expression
from vrs_cli.language.text.lexer import Token
from vrs_cli.language.text.precedence import LOGICAL, ORDER, VAL_ORDER, Grouping
from vrs_cli.language.text.printer import expression_text
from vrs_cli.values.diagnostics import Span


class OtherGrouping(Struct, frozen=True):
    """The two readings of an expression, with parentheses."""

    ours: str
    theirs: str
    span: Span


def val_grouping(expression: Expression) -> Iterator[OtherGrouping]:
    """Each part of an expression, between parentheses, that VAL-II groups otherwise."""
    flat = tuple(_flat(expression))
    if any(isinstance(item, Token) and item.value in LOGICAL for item in flat):
        texts = [item if isinstance(item, Token) else expression_text(item) for item in flat]
        ours, theirs = _OURS.tree(texts), _VAL.tree(texts)
        if theirs != ours:
            yield OtherGrouping(ours[1:-1], theirs[1:-1], expression.span)
    for value in flat:
        for inner in _inside(value):
            yield from val_grouping(inner)


def _flat(expression: Expression, root: bool = True) -> Iterator[Token | Expression]:
    """The signs and values of an expression as they stand in the source."""
    if not isinstance(expression, ast.Unary | ast.Binary) or (expression.grouped and not root):
        yield expression
        return
    if isinstance(expression, ast.Binary):
        yield from _flat(expression.left, False)
    yield Token("", expression.operator, expression.operator, expression.span)
    yield from _flat(expression.operand if isinstance(expression, ast.Unary) else expression.right, False)


def _inside(value: Token | Expression) -> Iterator[Expression]:
    """The expressions inside a value: of parentheses, arguments and indexes."""
    if isinstance(value, ast.Binary | ast.Unary):
        yield value
    elif isinstance(value, ast.Call):
        yield from (argument for argument in value.arguments if argument is not None)
    elif isinstance(value, ast.Variable):
        yield from value.indexes or ()


# A tree as its text, with parentheses round every part and the whole.


def _unary(sign: Token, operand: str) -> str:
    return f"({sign.value}{' ' * sign.value.isalpha()}{operand})"


def _binary(sign: Token, left: str, right: str) -> str:
    return f"({left} {sign.value} {right})"


_OURS, _VAL = Grouping(ORDER, _unary, _binary), Grouping(VAL_ORDER, _unary, _binary)
