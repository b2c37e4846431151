"""Draw in the terminal, in braille dots with colours or in plain letters: a canvas of cells, and the curves of PLOT
over time."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import groupby
from math import ceil, floor, hypot, log10, sqrt

from vrs_cli.render.blocks import Page, Piece, TextLine, line
from vrs_cli.render.colours import CURVES, Ink
from vrs_cli.values import numbers, replies

# bits of the dots, by row and column of a cell (braille patterns, from U+2800 in Unicode 1.1)
DOTS = ((0x01, 0x08), (0x02, 0x10), (0x04, 0x20), (0x40, 0x80))
FINE, PLAIN = (2, 4), (1, 1)  # number of dots in a cell, across and down

Dot = tuple[float, float]  # a point on a canvas, in dots: x to the right and y down
Cell = tuple[int, int, int]  # a cell of a canvas: its row, its column, and its dots as bits

HEIGHT = 16  # rows of the drawing, unless the page is shorter
WIDTH = 64  # columns of the drawing, unless the page is narrower
LABEL = 11  # columns of the numbers to the left of the curves
MIN_WIDTH, MIN_HEIGHT = 16, 6
TICK = 10  # approximate columns between the numbers of the time axis
TICKS = 0.5  # approximate number of labels of the vertical axis per row of the drawing
SPAN = 2  # where curves coincide, they alternate: each is drawn for this many columns
ENTRY = 28  # columns of one legend entry


class Canvas:
    """A canvas of cells. `owner` and `dots` have one dict per row, with the column as its key. `owner`: the number of
    the object drawn last in a cell. `dots`: the dots of a cell as bits."""

    def __init__(self, width: int, height: int, dots_wide: int, dots_high: int) -> None:
        self.width, self.height = width, height
        self.dots_wide, self.dots_high = dots_wide, dots_high
        self.owner: list[dict[int, int]] = [{} for _ in range(height)]
        self.dots: list[dict[int, int]] = [{} for _ in range(height)]
        self.shared = [False] * height  # whether a row is still shared with the canvas from which this one was copied

    def copy(self) -> Canvas:
        """Return a copy to draw on. After this call, do not draw on the original canvas."""
        made = Canvas(self.width, 0, self.dots_wide, self.dots_high)
        made.height, made.shared = self.height, [True] * self.height
        made.owner, made.dots = list(self.owner), list(self.dots)
        return made

    def empty(self) -> Canvas:
        """Return an empty canvas of the same size."""
        return Canvas(self.width, self.height, self.dots_wide, self.dots_high)

    def cells(self) -> list[Cell]:
        """Return the cells that have dots."""
        return [(row, column, bits) for row, dots in enumerate(self.dots) for column, bits in dots.items()]

    def lay(self, owner: int, cells: Iterable[Cell]) -> None:
        """Draw cells that were taken from another canvas of the same size."""
        for row, column, bits in cells:
            owners, dots = self._own(row)
            dots[column] = dots.get(column, 0) | bits
            owners[column] = owner

    def _own(self, row: int) -> tuple[dict[int, int], dict[int, int]]:
        """Return the owners and dots of a row, which the caller may change; copy them first if another canvas shares
        them."""
        if self.shared[row]:
            self.shared[row] = False
            self.owner[row], self.dots[row] = dict(self.owner[row]), dict(self.dots[row])
        return self.owner[row], self.dots[row]

    def mark(self, owner: int, x: int, y: int) -> None:
        """Draw one dot; ignore it if it is outside the canvas."""
        row, column = y // self.dots_high, x // self.dots_wide
        if 0 <= row < self.height and 0 <= column < self.width:
            owners, dots = self._own(row)
            dots[column] = dots.get(column, 0) | DOTS[y % self.dots_high][x % self.dots_wide]
            owners[column] = owner

    def _row(self, owner: int, first: int, last: int, y: int) -> None:
        """Draw adjacent dots from `first` to `last` in the row `y` of dots."""
        row, wide = y // self.dots_high, self.dots_wide
        first, last = max(first, 0), min(last, self.width * wide - 1)
        if not 0 <= row < self.height or last < first:
            return
        if first % wide:
            self.mark(owner, first, y)
            first += 1
        if last % wide < wide - 1:
            self.mark(owner, last, y)
            last -= 1
        (owners, dots), bits = self._own(row), sum(DOTS[y % self.dots_high][:wide])
        for column in range(first // wide, (last + 1) // wide):
            dots[column] = dots.get(column, 0) | bits
            owners[column] = owner

    def stroke(self, owner: int, a: Dot, b: Dot, thick: int = 1, every: int = 1) -> None:
        """Draw a straight line, `thick` dots wide; a dotted line has every `every`th dot."""
        (x0, y0), (x1, y1) = a, b
        steps = max(ceil(max(abs(x1 - x0), abs(y1 - y0))), 1)
        dx, dy = (x1 - x0) / steps, (y1 - y0) / steps
        for step in range(0, steps + 1, every):
            self.mark(owner, round(x0 + step * dx), round(y0 + step * dy))
        length = hypot(x1 - x0, y1 - y0)
        if thick > 1 and length > 0.0:
            off = 0.5 * (thick - 1) / length
            across, down = off * (y1 - y0), off * (x0 - x1)
            sides = ((across, down), (-across, -down))
            (ax, ay), (bx, by), (dx, dy), (cx, cy) = [(x + u, y + v) for x, y in (a, b) for u, v in sides]
            self._fill(owner, ((ax, ay), (bx, by), (cx, cy), (dx, dy)))

    def _fill(self, owner: int, corners: Sequence[Dot]) -> None:
        """Fill a convex figure."""
        edges = list(zip(corners, (*corners[1:], corners[0]), strict=True))
        high, low = min(y for _, y in corners), max(y for _, y in corners)
        for row in range(ceil(high), floor(low) + 1):
            cuts = [
                x0 + (row - y0) / (y1 - y0) * (x1 - x0)
                for (x0, y0), (x1, y1) in edges
                if y0 != y1 and min(y0, y1) <= row <= max(y0, y1)
            ]
            if cuts:
                self._row(owner, round(min(cuts)), round(max(cuts)), row)

    def disc(self, owner: int, middle: Dot, radius: float) -> None:
        x, y = map(round, middle)
        for down in range(-floor(radius), floor(radius) + 1):
            half = floor(sqrt(radius * radius - down * down))
            self._row(owner, x - half, x + half, y + down)

    def pieces(self, row: int, look: Callable[[int], tuple[Ink, str]]) -> Iterator[Piece]:
        """Yield a row as pieces of text, one for each sequence of adjacent cells drawn by the same object (owner).
        `look`: returns the ink (kind of text, which decides the colour) for an owner, and the letter that draws it on
        canvases with one dot per cell."""
        dots = self.dots[row]
        for owner, columns in groupby(range(self.width), self.owner[row].get):
            if owner is None:
                yield " " * len(list(columns)), Ink.TEXT
            else:
                ink, letter = look(owner)
                yield "".join([chr(0x2800 + dots[at]) if self.dots_wide > 1 else letter for at in columns]), ink


# --- curves over time --------------------------------------------------------------------------------------------


def round_figures(first: float, last: float, size: int, count: float) -> dict[int, str]:
    """Return about `count` round numbers from `first` to `last`: a dict from the row or column (of `size`) of a number
    to its text."""
    step = round_step(abs(last - first) / max(count, 1.0))
    decimals, slack = max(0, -floor(log10(step) + 1e-9)), 1e-9 * step
    least, most = ceil((min(first, last) - slack) / step), floor((max(first, last) + slack) / step)
    values = [number * step for number in range(least, most + 1)]
    return {round((value - first) / (last - first) * (size - 1)): numbers.decimal(value, decimals) for value in values}


def round_step(least: float) -> float:
    """Return the smallest number that is at least `least` and equals 1, 2 or 5 times a power of ten."""
    power = 10.0 ** floor(log10(least))
    return next(factor * power for factor in (1.0, 2.0, 5.0, 10.0) if factor * power >= least * (1.0 - 1e-9))


def chart(plot: replies.Plot, page: Page) -> Iterator[TextLine]:
    """Yield the title, the curves, the time axis and the legend. The drawing fits the page height if possible."""
    width = WIDTH if page.width is None else max(MIN_WIDTH, min(page.width - LABEL - 2, 2 * WIDTH))
    fine = page.unicode and page.colours
    legend = list(_legend(plot.curves, LABEL + width, fine))
    around = 3 + len(legend)  # number of rows needed for the legend, the title and the time axis
    height = HEIGHT if page.height is None else max(MIN_HEIGHT, min(page.height - around, HEIGHT))
    low = min(min(curve.values) for curve in plot.curves)
    high = max(max(curve.values) for curve in plot.curves)
    if high - low <= 1e-9:  # a constant curve: choose a range around it, because the scale needs one
        low, high = low - 1.0, high + 1.0
    yield line(f"{plot.title} [{plot.unit}]", Ink.HEADING)
    canvas = _draw_curves(plot.curves, low, high, Canvas(width, height, *(FINE if fine else PLAIN)))
    figures = round_figures(high, low, height, TICKS * height)
    for row in range(height):
        axis = (f"{figures.get(row, ''):>{LABEL - 1}} {'+' if row in figures else '|'}", Ink.NOTE)
        yield TextLine(
            (axis, *canvas.pieces(row, lambda curve: (CURVES[curve % len(CURVES)], plot.curves[curve].mark)))
        )
    yield from _time_axis(plot.times, width)
    yield from legend


def _draw_curves(curves: Sequence[replies.Curve], low: float, high: float, canvas: Canvas) -> Canvas:
    """Draw all curves. Where curves coincide, they take turns every SPAN columns, so that each stays visible."""
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
    """Draw one curve across the width; steep parts become vertical strokes."""
    columns, rows = canvas.width * canvas.dots_wide, canvas.height * canvas.dots_high
    before: int | None = None
    for x in range(columns):
        y = round((high - _at(values, x / (columns - 1))) / (high - low) * (rows - 1))
        start = y if before is None else before + (1 if y > before else -1 if y < before else 0)
        for dot in range(min(start, y), max(start, y) + 1):
            canvas.mark(curve, x, dot)
        before = y


def _at(values: Sequence[float], fraction: float) -> float:
    """Return the value at a fraction (0 to 1) of the curve's length, interpolated between the neighbouring samples."""
    place = fraction * (len(values) - 1)
    i = min(int(place), max(len(values) - 2, 0))
    return values[i] + (values[min(i + 1, len(values) - 1)] - values[i]) * (place - i)


def _time_axis(times: Sequence[float], width: int) -> Iterator[TextLine]:
    figures = round_figures(times[0], times[-1], width, width / TICK)
    yield line(" " * LABEL + "".join("+" if column in figures else "-" for column in range(width)), Ink.NOTE)
    shown = ""
    for column, figure in sorted(figures.items()):
        begin = min(column, width - len(figure))  # shift the last number to the left, so that it ends at the right edge
        if not shown or begin > len(shown):
            shown = f"{shown:<{begin}}{figure}"
    yield line(" " * LABEL + f"{shown} s", Ink.NOTE)


def _legend(curves: Sequence[replies.Curve], width: int, fine: bool) -> Iterator[TextLine]:
    """Yield the curves with their minimum and maximum, as many per row as fit."""
    together = max((width - LABEL) // ENTRY, 1)
    for first in range(0, len(curves), together):
        pieces: list[Piece] = [(" " * LABEL, Ink.TEXT)]
        for number, curve in enumerate(curves[first : first + together], first):
            span = f" {numbers.decimal(min(curve.values))} to {numbers.decimal(max(curve.values))}"
            label = f"{'──' if fine else curve.mark} {curve.label}"
            pieces += [(label, CURVES[number % len(CURVES)]), (f"{span:<{ENTRY - len(label)}}", Ink.NOTE)]
        yield TextLine((*pieces[:-1], (pieces[-1][0].rstrip(), Ink.NOTE)))
