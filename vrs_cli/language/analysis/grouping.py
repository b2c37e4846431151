"""Expressions that VAL-II's own table of operators would group otherwise than we do (see precedence.py)."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from msgspec import Struct

from vrs_cli.language.text import ast
from vrs_cli.language.text.ast import Expression, Span
from vrs_cli.language.text.lexer import Token
from vrs_cli.language.text.precedence import LOGICAL, VAL_ORDER, Grouping
from vrs_cli.language.text.printer import expression_text

# A tree without places: a value as its text, a sign with one or two trees.
Tree = str | tuple["Tree", ...]


class OtherGrouping(Struct, frozen=True):
    """The two readings of an expression, with parentheses."""

    ours: str
    theirs: str
    span: Span


def val_grouping(expression: Expression) -> Iterator[OtherGrouping]:
    """Each part of an expression, between parentheses, that VAL-II groups otherwise."""
    flat: list[Token | Tree] = []
    values: list[Expression] = []
    ours = _flatten(expression, flat, values, expression_text)
    if any(isinstance(item, Token) and item.value in LOGICAL for item in flat):
        theirs = _VAL.tree(flat)
        if theirs != ours:
            yield OtherGrouping(_shown(ours), _shown(theirs), expression.span)
    for value in values:
        for inner in _inside(value):
            yield from val_grouping(inner)


def _unary(sign: Token, operand: Tree) -> Tree:
    return (sign.value, operand)


def _binary(sign: Token, left: Tree, right: Tree) -> Tree:
    return (sign.value, left, right)


_VAL: Grouping[Tree] = Grouping(VAL_ORDER, _unary, _binary)


def _flatten(
    expression: Expression,
    flat: list[Token | Tree],
    values: list[Expression],
    text_of: Callable[[Expression], str],
    root: bool = True,
) -> Tree:
    """The signs and values of an expression as they stand in the source, and their tree as we group them."""
    if isinstance(expression, ast.Unary) and (root or not expression.grouped):
        flat.append(Token("PREFIX", expression.operator, expression.operator, 0, 0, 0))
        return (expression.operator, _flatten(expression.operand, flat, values, text_of, False))
    if isinstance(expression, ast.Binary) and (root or not expression.grouped):
        left = _flatten(expression.left, flat, values, text_of, False)
        flat.append(Token("INFIX", expression.operator, expression.operator, 0, 0, 0))
        return (expression.operator, left, _flatten(expression.right, flat, values, text_of, False))
    values.append(expression)
    text = text_of(expression)
    flat.append(text)
    return text


def _inside(value: Expression) -> Iterator[Expression]:
    """The expressions inside a value: of parentheses, arguments and indexes."""
    if isinstance(value, ast.Binary | ast.Unary):
        yield value
    elif isinstance(value, ast.Call):
        yield from (argument for argument in value.arguments if argument is not None)
    elif isinstance(value, ast.Variable):
        yield from value.indexes or ()


def _shown(tree: Tree) -> str:
    """A tree with parentheses round every part."""
    if isinstance(tree, str):
        return tree
    parts = [part if isinstance(part, str) else f"({_shown(part)})" for part in tree[1:]]
    if len(parts) == 1:
        blank = " " if str(tree[0]).isalpha() else ""
        return f"{tree[0]}{blank}{parts[0]}"
    return f"{parts[0]} {tree[0]} {parts[1]}"
