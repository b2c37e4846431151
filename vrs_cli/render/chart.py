"""PLOT in the terminal: curves over time, in braille dots with colours, or in letters where there are neither."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from vrs_cli.dialogue.numbers import fixed
from vrs_cli.render.blocks import Line, Page, Piece, line
from vrs_cli.render.colours import CURVES, Ink

if TYPE_CHECKING:
    from vrs_cli.dialogue.replies import Curve, Plot

HEIGHT = 16  # lines of the drawing
WIDTH = 64  # its columns, unless the page is narrower
LABEL = 11  # columns of the figures at the left
LEAST_WIDTH = 16
TICK = 16  # columns between the figures below

BRAILLE = 0x2800
DOTS = ((0x01, 0x08), (0x02, 0x10), (0x04, 0x20), (0x40, 0x80))  # by row, then column (Unicode 1.1, U+2800 block)
DOTS_WIDE, DOTS_HIGH = 2, 4


def chart(plot: Plot, page: Page) -> Iterator[Line]:
    """The title, the drawing, the time axis and the legend."""
    width = WIDTH if page.width is None else max(LEAST_WIDTH, min(page.width - LABEL - 2, 2 * WIDTH))
    low = min(min(curve.values) for curve in plot.curves)
    high = max(max(curve.values) for curve in plot.curves)
    if high - low <= 1e-9:  # all the same: with some room
        low, high = low - 1.0, high + 1.0
    yield line(f"{plot.title} [{plot.unit}]", Ink.HEADING)
    fine = page.unicode and page.colours
    canvas = Canvas(width, HEIGHT, *((DOTS_WIDE, DOTS_HIGH) if fine else (1, 1)))
    for number, curve in enumerate(plot.curves):
        canvas.draw(number, curve.values, low, high)
    for row in range(HEIGHT):
        yield Line((_figure(row, low, high), *_cells(canvas, row, plot.curves, fine)))
    yield from _time_axis(plot.times, width)
    yield from (_legend(number, curve, fine) for number, curve in enumerate(plot.curves))


class Canvas:
    """Cells of dots. `owner`: which curve drew last in a cell; `dots`: the dots of a cell as bits."""

    def __init__(self, width: int, height: int, dots_wide: int, dots_high: int) -> None:
        self.width, self.height = width, height
        self.dots_wide, self.dots_high = dots_wide, dots_high
        self.owner: dict[tuple[int, int], int] = {}
        self.dots: dict[tuple[int, int], int] = {}

    def draw(self, curve: int, values: Sequence[float], low: float, high: float) -> None:
        """One curve, its values spread over the width; steep parts are drawn as vertical strokes."""
        columns, rows = self.width * self.dots_wide, self.height * self.dots_high
        before: int | None = None
        for x in range(columns):
            value = _at(values, x / (columns - 1))
            y = round((high - value) / (high - low) * (rows - 1))
            start = y if before is None else before + (1 if y > before else -1 if y < before else 0)
            for dot in range(min(start, y), max(start, y) + 1):
                self._mark(curve, x, dot)
            before = y

    def _mark(self, curve: int, x: int, y: int) -> None:
        cell = (y // self.dots_high, x // self.dots_wide)
        bit = DOTS[y % self.dots_high][x % self.dots_wide]
        self.dots[cell] = self.dots.get(cell, 0) | bit
        self.owner[cell] = curve


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
    for column in range(canvas.width):
        owner = canvas.owner.get((row, column))
        if owner is None:
            yield (" ", Ink.TEXT)
        else:
            mark = chr(BRAILLE + canvas.dots[row, column]) if fine else curves[owner].mark
            yield (mark, CURVES[owner % len(CURVES)])


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
