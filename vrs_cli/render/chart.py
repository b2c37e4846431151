"""PLOT in the terminal: curves over time, in braille dots with colours, or in letters where there are neither."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import ceil, floor, log10

from vrs_cli.render.blocks import Page, Piece, TextLine, line
from vrs_cli.render.canvas import FINE, PLAIN, Canvas
from vrs_cli.render.colours import CURVES, Ink
from vrs_cli.values.numbers import fixed
from vrs_cli.values.replies import Curve, Plot

HEIGHT = 16  # lines of the drawing, unless the page is lower
WIDTH = 64  # its columns, unless the page is narrower
LABEL = 11  # columns of the figures at the left
LEAST_WIDTH, LEAST_HEIGHT = 16, 6
TICK = 10  # columns between the figures below, about
TICKS = 0.5  # figures at the left, about, in each row
SPAN = 2  # columns that one of several curves has in turn
ENTRY = 28  # columns of a curve in the legend


def round_figures(first: float, last: float, size: int, count: float) -> dict[int, str]:
    """Return about so many round figures by their places, on a scale from `first` to `last` over `size` rows or
    columns.
    """
    step = round_step(abs(last - first) / max(count, 1.0))
    decimals, slack = max(0, -floor(log10(step) + 1e-9)), 1e-9 * step
    least, most = ceil((min(first, last) - slack) / step), floor((max(first, last) + slack) / step)
    values = [number * step for number in range(least, most + 1)]
    return {round((value - first) / (last - first) * (size - 1)): fixed(value, decimals) for value in values}


def round_step(least: float) -> float:
    """The smallest of 1, 2 and 5 times a power of ten that is not below `least`."""
    power = 10.0 ** floor(log10(least))
    return next(factor * power for factor in (1.0, 2.0, 5.0, 10.0) if factor * power >= least * (1.0 - 1e-9))


def chart(plot: Plot, page: Page) -> Iterator[TextLine]:
    """The title, the drawing, the time axis and the legend: all is seen at once where the page is not too low."""
    width = WIDTH if page.width is None else max(LEAST_WIDTH, min(page.width - LABEL - 2, 2 * WIDTH))
    fine = page.unicode and page.colours
    legend = list(_legend(plot.curves, LABEL + width, fine))
    around = 3 + len(legend)  # with the title and two rows of the time axis
    height = HEIGHT if page.height is None else max(LEAST_HEIGHT, min(page.height - around, HEIGHT))
    low = min(min(curve.values) for curve in plot.curves)
    high = max(max(curve.values) for curve in plot.curves)
    if high - low <= 1e-9:  # all the same: with some room
        low, high = low - 1.0, high + 1.0
    yield line(f"{plot.title} [{plot.unit}]", Ink.HEADING)
    canvas = _drawn(plot.curves, low, high, Canvas(width, height, *(FINE if fine else PLAIN)))
    figures = round_figures(high, low, height, TICKS * height)
    for row in range(height):
        axis = (f"{figures.get(row, ''):>{LABEL - 1}} {'+' if row in figures else '|'}", Ink.NOTE)
        yield TextLine(
            (axis, *canvas.pieces(row, lambda curve: (CURVES[curve % len(CURVES)], plot.curves[curve].mark)))
        )
    yield from _time_axis(plot.times, width)
    yield from legend


def _drawn(curves: Sequence[Curve], low: float, high: float, canvas: Canvas) -> Canvas:
    """All curves. Cells of several curves are theirs in turn from column to column, so that those that coincide are
    seen.
    """
    shared: dict[tuple[int, int], list[int]] = {}
    for number, curve in enumerate(curves):
        alone = canvas.empty()
        _draw(alone, number, curve.values, low, high)
        for row, column, _ in alone.cells():
            shared.setdefault((row, column), []).append(number)
        canvas.lay(number, alone.cells())
    for (row, column), owners in shared.items():
        canvas.owner[row][column] = owners[column // SPAN % len(owners)]
    return canvas


def _draw(canvas: Canvas, curve: int, values: Sequence[float], low: float, high: float) -> None:
    """One curve, its values spread over the width; steep parts are drawn as vertical strokes."""
    columns, rows = canvas.width * canvas.dots_wide, canvas.height * canvas.dots_high
    before: int | None = None
    for x in range(columns):
        value = _at(values, x / (columns - 1))
        y = round((high - value) / (high - low) * (rows - 1))
        start = y if before is None else before + (1 if y > before else -1 if y < before else 0)
        for dot in range(min(start, y), max(start, y) + 1):
            canvas.mark(curve, x, dot)
        before = y


def _at(values: Sequence[float], fraction: float) -> float:
    """The value at a fraction of the way, between its neighbours."""
    place = fraction * (len(values) - 1)
    i = min(int(place), max(len(values) - 2, 0))
    follower = values[min(i + 1, len(values) - 1)]
    return values[i] + (follower - values[i]) * (place - i)


def _time_axis(times: Sequence[float], width: int) -> Iterator[TextLine]:
    figures = round_figures(times[0], times[-1], width, width / TICK)
    yield line(" " * LABEL + "".join("+" if column in figures else "-" for column in range(width)), Ink.NOTE)
    shown = ""
    for column, figure in sorted(figures.items()):
        begin = min(column, width - len(figure))  # the last one ends where the drawing does
        if not shown or begin > len(shown):
            shown = f"{shown:<{begin}}{figure}"
    yield line(" " * LABEL + f"{shown} s", Ink.NOTE)


def _legend(curves: Sequence[Curve], width: int, fine: bool) -> Iterator[TextLine]:
    """The curves with their least and greatest values, as many in a row as fit."""
    together = max((width - LABEL) // ENTRY, 1)
    for first in range(0, len(curves), together):
        pieces: list[Piece] = [(" " * LABEL, Ink.TEXT)]
        for number, curve in enumerate(curves[first : first + together], first):
            span = f" {fixed(min(curve.values))} to {fixed(max(curve.values))}"
            label = f"{'──' if fine else curve.mark} {curve.label}"
            pieces += [(label, CURVES[number % len(CURVES)]), (f"{span:<{ENTRY - len(label)}}", Ink.NOTE)]
        yield TextLine((*pieces[:-1], (pieces[-1][0].rstrip(), Ink.NOTE)))
