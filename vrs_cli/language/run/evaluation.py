"""Compiled expressions of the prompt, evaluated."""

from __future__ import annotations

from collections.abc import Callable
from itertools import chain
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
        arrays = (cells(array.kind, array.key) for array in compiled.arrays)
        try:
            return compiled.function(context, *map(cells, CELLS), *chain.from_iterable(references), *arrays)
        except ArithmeticError as error:
            raise overflow(error) from None

    return evaluate
