"""PLOT in the terminal: curves over time, in braille dots with colours, or in letters where there are neither."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from vrs_cli.dialogue.numbers import fixed
from vrs_cli.render.blocks import Line, Page, Piece, line
from vrs_cli.render.canvas import FINE, PLAIN, Canvas
from vrs_cli.render.colours import CURVES, Ink

if TYPE_CHECKING:
    from vrs_cli.dialogue.replies import Curve, Plot

HEIGHT = 16  # lines of the drawing
WIDTH = 64  # its columns, unless the page is narrower
LABEL = 11  # columns of the figures at the left
LEAST_WIDTH = 16
TICK = 16  # columns between the figures below


def chart(plot: Plot, page: Page) -> Iterator[Line]:
    """The title, the drawing, the time axis and the legend."""
    width = WIDTH if page.width is None else max(LEAST_WIDTH, min(page.width - LABEL - 2, 2 * WIDTH))
    low = min(min(curve.values) for curve in plot.curves)
    high = max(max(curve.values) for curve in plot.curves)
    if high - low <= 1e-9:  # all the same: with some room
        low, high = low - 1.0, high + 1.0
    yield line(f"{plot.title} [{plot.unit}]", Ink.HEADING)
    fine = page.unicode and page.colours
    canvas = Canvas(width, HEIGHT, *(FINE if fine else PLAIN))
    for number, curve in enumerate(plot.curves):
        _draw(canvas, number, curve.values, low, high)
    for row in range(HEIGHT):
        yield Line((_figure(row, low, high), *_cells(canvas, row, plot.curves, fine)))
    yield from _time_axis(plot.times, width)
    yield from (_legend(number, curve, fine) for number, curve in enumerate(plot.curves))


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


def _figure(row: int, low: float, high: float) -> Piece:
    """The scale at the left: at the top, in the middle and at the bottom."""
    shown = row in (0, HEIGHT // 2, HEIGHT - 1)
    value = high - (high - low) * row / (HEIGHT - 1)
    return (f"{fixed(value) if shown else '':>{LABEL - 1}} |", Ink.NOTE)


def _cells(canvas: Canvas, row: int, curves: Sequence[Curve], fine: bool) -> Iterator[Piece]:
    for owner, first, last in canvas.runs(row):
        if owner is None:
            yield (" " * (last - first), Ink.TEXT)
        else:
            marks = canvas.braille(row, first, last) if fine else curves[owner].mark * (last - first)
            yield (marks, CURVES[owner % len(CURVES)])


def _time_axis(times: Sequence[float], width: int) -> Iterator[Line]:
    ticks = range(0, width - TICK // 2, TICK)  # with room for the last figure
    rule = "".join("+" if column in ticks else "-" for column in range(width))
    yield line(" " * LABEL + rule, Ink.NOTE)
    first, last = times[0], times[-1]
    figures = (f"{fixed(first + (last - first) * column / (width - 1)):<{TICK}}" for column in ticks)
    yield line(" " * LABEL + "".join(figures).rstrip() + " s", Ink.NOTE)


def _legend(number: int, curve: Curve, fine: bool) -> Line:
    stroke = "──" if fine else curve.mark
    span = f"{fixed(min(curve.values))} to {fixed(max(curve.values))}"
    return Line(
        (
            (" " * LABEL, Ink.TEXT),
            (f"{stroke} {curve.label:<5}", CURVES[number % len(CURVES)]),
            (f" {span}", Ink.NOTE),
        )
    )
