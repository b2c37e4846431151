"""Replies as HTML, for notebooks: tables as tables, plots as small SVG pictures, everything else as lines of one width.

The same for the same replies; nothing else is needed to draw them.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from html import escape
from itertools import groupby
from math import ceil, floor

from vrs_cli.render.blocks import PIPE, Block, Grid, Piece, TextLine
from vrs_cli.render.chart import round_step
from vrs_cli.render.colours import COLOURS, CURVES, GREY, RED
from vrs_cli.render.layout import blocks
from vrs_cli.values.replies import Plot, Reply

WIDTH, HEIGHT = 640, 300  # of the picture of a plot
LEFT, TOP, RIGHT, BOTTOM = 60, 24, 70, 36  # margins round the drawing
LINES = 6  # of a scale, about so many


def html(replies: Iterable[Reply]) -> str:
    """All of them, one below the other. The same for the same replies."""
    return "".join(picture(reply) if isinstance(reply, Plot) else blocks_html(blocks(reply, PIPE)) for reply in replies)


def blocks_html(shown: Iterable[Block]) -> str:
    parts = []
    for is_grid, run in groupby(shown, lambda block: isinstance(block, Grid)):
        if is_grid:
            parts += [_table(grid) for grid in run if isinstance(grid, Grid)]
        else:
            lines = "\n".join(pieces_html(line.pieces) for line in run if isinstance(line, TextLine))
            parts.append(f"<pre>{lines}</pre>")
    return "".join(parts)


def pieces_html(pieces: Iterable[Piece]) -> str:
    """Pieces of a line, in their colours."""
    shown = []
    for text, ink in pieces:
        colour, bold = COLOURS[ink]
        style = f"color:{colour};" * bool(colour) + "font-weight:bold" * bold
        shown.append(f'<span style="{style}">{escape(text)}</span>' if style else escape(text))
    return "".join(shown)


def _table(grid: Grid) -> str:
    """A table whose numbers, with their units, stay on one line."""
    styles = ["text-align:right;white-space:nowrap" if column.right else "text-align:left" for column in grid.columns]
    heads = [column.heading for column in grid.columns]
    head = f"<thead><tr>{_cells('th', heads, styles)}</tr></thead>" if any(heads) else ""
    rows = "".join(f"<tr>{_cells('td', row, styles)}</tr>" for row in grid.rows)
    return f"<table>{head}<tbody>{rows}</tbody></table>"


def _cells(tag: str, texts: Iterable[str], styles: Iterable[str]) -> str:
    pairs = zip(texts, styles, strict=True)
    return "".join(f'<{tag} style="{style}">{escape(text)}</{tag}>' for text, style in pairs)


# --- plots as SVG ---------------------------------------------------------------------------------------------------


class SvgScale:
    """Values from `low` to `high` on a line from `begin` to `end` in the picture."""

    def __init__(self, low: float, high: float, begin: float, end: float) -> None:
        room = 0.0 if high - low > 1e-9 else 1.0
        self.low, self.high, self.begin, self.end = low - room, high + room, begin, end

    def place(self, value: float) -> float:
        return self.begin + (value - self.low) / (self.high - self.low) * (self.end - self.begin)

    def marks(self) -> Iterator[float]:
        """Round values along it."""
        step = round_step((self.high - self.low) / LINES)
        for number in range(ceil(self.low / step), floor(self.high / step) + 1):
            yield number * step


def picture(plot: Plot, at: float | None = None) -> str:
    """The plot as an SVG element, with a line at a time [s], where one is given."""
    values = [value for curve in plot.curves for value in curve.values]
    across = SvgScale(plot.times[0], plot.times[-1], LEFT, WIDTH - RIGHT)
    up = SvgScale(min(values), max(values), HEIGHT - BOTTOM, TOP)
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" width="{WIDTH}" height="{HEIGHT}" '
        f'font-family="sans-serif" font-size="11" fill="{GREY}">'
    )
    title = _text(LEFT, 14, f"{plot.title} [{plot.unit}]", "start")
    moment = [] if at is None else [_moment(across.place(min(max(at, plot.times[0]), plot.times[-1])))]
    parts = [head, title, *_grid(across, up), *_curves(plot, across, up), *moment, "</svg>"]
    return "\n".join(parts) + "\n"


def _grid(across: SvgScale, up: SvgScale) -> Iterator[str]:
    for value in up.marks():
        y = up.place(value)
        yield _stroke(f"M{LEFT} {y:.1f}H{WIDTH - RIGHT}")
        yield _text(LEFT - 6, y + 4, f"{value + 0.0:.6g}", "end")
    for value in across.marks():
        x = across.place(value)
        yield _stroke(f"M{x:.1f} {TOP}V{HEIGHT - BOTTOM}")
        yield _text(x, HEIGHT - BOTTOM + 16, f"{value + 0.0:.6g}", "middle")
    yield _text((LEFT + WIDTH - RIGHT) / 2, HEIGHT - 4, "t [s]", "middle")


def _curves(plot: Plot, across: SvgScale, up: SvgScale) -> Iterator[str]:
    for number, curve in enumerate(plot.curves):
        colour, _ = COLOURS[CURVES[number % len(CURVES)]]
        points = zip(plot.times, curve.values, strict=True)
        path = "M" + "L".join(f"{across.place(t):.1f} {up.place(value):.1f}" for t, value in points)
        yield f'<path d="{path}" fill="none" stroke="{colour}" stroke-width="1.5"/>'
        y = TOP + 10 + 16 * number
        yield f'<text x="{WIDTH - RIGHT + 8}" y="{y}" fill="{colour}">{escape(curve.label)}</text>'


def _moment(x: float) -> str:
    return f'<path d="M{x:.1f} {TOP}V{HEIGHT - BOTTOM}" stroke="{RED}" stroke-width="2" stroke-dasharray="4 3"/>'


def _stroke(path: str) -> str:
    return f'<path d="{path}" stroke="{GREY}" stroke-opacity="0.25"/>'


def _text(x: float, y: float, text: str, anchor: str) -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}">{escape(text)}</text>'
