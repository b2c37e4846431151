"""Values of the robot in Python as tables of a notebook."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

from vrs_cli.render.blocks import Column, Grid, line, number_column
from vrs_cli.render.colours import Ink
from vrs_cli.render.html import blocks_html
from vrs_cli.values.numbers import fixed

ROWS = 5  # at the beginning and at the end of a long table


def table(title: str, columns: Sequence[Column], count: int, row: Callable[[int], tuple[str, ...]]) -> str:
    """A title and a table of so many rows, of which a long one shows the first and the last."""
    if count <= 2 * ROWS + 1:
        rows = tuple(map(row, range(count)))
    else:
        first, last = map(row, range(ROWS)), map(row, range(count - ROWS, count))
        rows = (*first, ("...",) * len(columns), *last)
    return blocks_html((line(title, Ink.NOTE), Grid(tuple(columns), rows)))


def number_columns(names: Iterable[str]) -> tuple[Column, ...]:
    """Columns of numbers."""
    return tuple(map(number_column, names))


def figures(numbers: Iterable[float]) -> tuple[str, ...]:
    return tuple(map(fixed, numbers))
