"""Cells of a terminal as dots that drawings are made of: eight a cell in braille, or one."""

from __future__ import annotations

from math import ceil, hypot

BRAILLE = 0x2800
DOTS = ((0x01, 0x08), (0x02, 0x10), (0x04, 0x20), (0x40, 0x80))  # by row, then column (Unicode 1.1, U+2800 block)
FINE, PLAIN = (2, 4), (1, 1)  # dots of a cell, across and down
APART = 0.7  # dots between two of a thick line, at most: a slanting one has no holes then

Dot = tuple[float, float]  # to the right and down, in dots


class Canvas:
    """`owner`: who drew last in a cell (row, column); `dots`: the dots of a cell as bits."""

    def __init__(self, width: int, height: int, dots_wide: int, dots_high: int) -> None:
        self.width, self.height = width, height
        self.dots_wide, self.dots_high = dots_wide, dots_high
        self.owner: dict[tuple[int, int], int] = {}
        self.dots: dict[tuple[int, int], int] = {}

    def mark(self, owner: int, x: int, y: int) -> None:
        """One dot; none outside."""
        row, column = y // self.dots_high, x // self.dots_wide
        if 0 <= row < self.height and 0 <= column < self.width:
            cell = (row, column)
            self.dots[cell] = self.dots.get(cell, 0) | DOTS[y % self.dots_high][x % self.dots_wide]
            self.owner[cell] = owner

    def stroke(self, owner: int, a: Dot, b: Dot, thick: int = 1, every: int = 1) -> None:
        """A straight line, `thick` dots wide; of a dotted one each `every`th dot."""
        (x0, y0), (x1, y1) = a, b
        length = hypot(x1 - x0, y1 - y0) or 1.0
        steps = max(ceil(max(abs(x1 - x0), abs(y1 - y0)) if thick == 1 else length / APART), 1)
        dx, dy = (x1 - x0) / steps, (y1 - y0) / steps
        beside = ceil((thick - 1) / APART)
        for i in range(beside + 1):
            off = (thick - 1) * (i / beside - 0.5) if beside else 0.0
            x, y = x0 + off * (y1 - y0) / length, y0 - off * (x1 - x0) / length
            for step in range(0, steps + 1, every):
                self.mark(owner, round(x + step * dx), round(y + step * dy))

    def disc(self, owner: int, middle: Dot, radius: float) -> None:
        x0, y0 = middle
        reach = range(-round(radius) - 1, round(radius) + 2)
        for dx in reach:
            for dy in reach:
                if hypot(dx, dy) <= radius:
                    self.mark(owner, round(x0) + dx, round(y0) + dy)

    def braille(self, row: int, column: int) -> str:
        """The dots of a cell as one character."""
        return chr(BRAILLE + self.dots[row, column])
