"""The kinds that values can have where they stand, and the kind of an expression where it is certain."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from vrs_cli.language.text import ast
from vrs_cli.language.text.ast import Expression
from vrs_cli.language.words.functions import FUNCTIONS
from vrs_cli.language.words.values import Kind
from vrs_cli.language.words.word import Shape

Kinds = frozenset[Kind]


ANY_KIND: Kinds = frozenset(Kind)


REAL: Kinds = frozenset({Kind.REAL})


STRING: Kinds = frozenset({Kind.STRING})


LOCATION: Kinds = frozenset({Kind.LOCATION})


PLACE: Kinds = frozenset({Kind.LOCATION, Kind.PRECISION})


PRINTED: Kinds = frozenset({Kind.REAL, Kind.STRING})


BARE: Kinds = frozenset({Kind.REAL, Kind.LOCATION})  # what a name without a sigil can be


# The arguments that are variables to be given a value.
VARIABLES: Mapping[Shape, Kinds] = {
    Shape.VARIABLE: PRINTED,
    Shape.REAL_VARIABLE: REAL,
    Shape.STRING_VARIABLE: STRING,
}


def kind_of(expression: Expression, of_variable: Callable[[ast.Variable], Kind | None]) -> Kind | None:
    """Return the kind of an expression, or None where `of_variable` knows none."""
    if isinstance(expression, ast.Variable):
        return of_variable(expression)
    if isinstance(expression, ast.Call):
        function = FUNCTIONS.get(expression.name)
        return function.result if function is not None else None
    if not isinstance(expression, ast.Binary):
        return CERTAIN.get(type(expression))
    if expression.operator == ":":
        return Kind.LOCATION
    sides = (kind_of(expression.left, of_variable), kind_of(expression.right, of_variable))
    return Kind.STRING if expression.operator == "+" and Kind.STRING in sides else Kind.REAL


CERTAIN: Mapping[type, Kind] = {ast.Number: Kind.REAL, ast.StringConstant: Kind.STRING, ast.Unary: Kind.REAL}
