"""Compiled expressions of the prompt, evaluated."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from vrs_cli.language.compile.compiler import CompiledExpression
from vrs_cli.language.compile.expressions import CELLS
from vrs_cli.language.run.cells import Reference
from vrs_cli.language.run.library import overflow
from vrs_cli.language.run.memory import Context


def evaluator(compiled: CompiledExpression) -> Callable[..., Any]:
    """A function of the context, and of a reference for each variable that the expression was compiled to be given."""

    def evaluate(context: Context, *references: Reference) -> Any:
        cells = context.environment.cells
        given = (part for reference in references for part in reference)
        simple, elements = (cells(kind) for kind in CELLS), (cells(one.kind, one.key) for one in compiled.arrays)
        try:
            return compiled.function(context, *simple, *given, *elements)
        except ArithmeticError as error:
            raise overflow(error) from None

    return evaluate
