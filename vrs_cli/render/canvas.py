"""Cells of a terminal as dots that drawings are made of: eight a cell in braille, or one."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import groupby
from math import ceil, floor, hypot, sqrt

from vrs_cli.render.blocks import Piece
from vrs_cli.render.colours import Ink

BRAILLE = 0x2800
DOTS = ((0x01, 0x08), (0x02, 0x10), (0x04, 0x20), (0x40, 0x80))  # by row, then column (Unicode 1.1, U+2800 block)
FINE, PLAIN = (2, 4), (1, 1)  # dots of a cell, across and down

Dot = tuple[float, float]  # to the right and down, in dots
Cell = tuple[int, int, int]  # row, column, dots


class Canvas:
    """Rows of cells by their columns. `owner`: who drew last in a cell; `dots`: the dots of a cell as bits."""

    def __init__(self, width: int, height: int, dots_wide: int, dots_high: int) -> None:
        self.width, self.height = width, height
        self.dots_wide, self.dots_high = dots_wide, dots_high
        self.owner: list[dict[int, int]] = [{} for _ in range(height)]
        self.dots: list[dict[int, int]] = [{} for _ in range(height)]
        self.shared = [False] * height  # with the canvas that this one is a copy of: nothing was drawn in those rows

    def copy(self) -> Canvas:
        """The same, to draw on without changing this one, which is drawn on no more."""
        made = Canvas(self.width, 0, self.dots_wide, self.dots_high)
        made.height, made.shared = self.height, [True] * self.height
        made.owner, made.dots = list(self.owner), list(self.dots)
        return made

    def empty(self) -> Canvas:
        """Another one of this size."""
        return Canvas(self.width, self.height, self.dots_wide, self.dots_high)

    def cells(self) -> list[Cell]:
        """The cells that are drawn in."""
        return [(row, column, bits) for row, dots in enumerate(self.dots) for column, bits in dots.items()]

    def lay(self, owner: int, cells: Iterable[Cell]) -> None:
        """Put on what was drawn on another canvas of this size."""
        for row, column, bits in cells:
            owners, dots = self._own(row)
            dots[column] = dots.get(column, 0) | bits
            owners[column] = owner

    def _own(self, row: int) -> tuple[dict[int, int], dict[int, int]]:
        """Return the owners and the dots of a row to draw in: copies of those that another canvas shares."""
        if self.shared[row]:
            self.shared[row] = False
            self.owner[row], self.dots[row] = dict(self.owner[row]), dict(self.dots[row])
        return self.owner[row], self.dots[row]

    def mark(self, owner: int, x: int, y: int) -> None:
        """One dot; none outside."""
        row, column = y // self.dots_high, x // self.dots_wide
        if 0 <= row < self.height and 0 <= column < self.width:
            owners, dots = self._own(row)
            dots[column] = dots.get(column, 0) | DOTS[y % self.dots_high][x % self.dots_wide]
            owners[column] = owner

    def _row(self, owner: int, first: int, last: int, y: int) -> None:
        """Dots beside each other."""
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
        """A straight line, `thick` dots wide; of a dotted one each `every`th dot."""
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
        """The inside of a convex figure."""
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
        """A row in pieces of one owner each. `look`: the ink of an owner, and its letter where a cell is one dot."""
        dots = self.dots[row]
        for owner, columns in groupby(range(self.width), self.owner[row].get):
            if owner is None:
                yield " " * len(list(columns)), Ink.TEXT
            else:
                ink, letter = look(owner)
                yield "".join([chr(BRAILLE + dots[at]) if self.dots_wide > 1 else letter for at in columns]), ink
