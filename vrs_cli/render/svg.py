"""A plot as a small SVG picture, for notebooks: nothing is needed to draw it. The same for the same plot."""

from __future__ import annotations

from collections.abc import Iterator
from html import escape
from math import ceil, floor, log10

from vrs_cli.render.colours import COLOURS, CURVES
from vrs_cli.values.replies import Curve, Plot

WIDTH, HEIGHT = 640, 300  # of the picture
LEFT, TOP, RIGHT, BOTTOM = 60, 24, 70, 36  # margins round the drawing
GREY = "#767676"
STEPS = (1.0, 2.0, 5.0, 10.0)  # of a scale, times a power of ten
LINES = 6  # of a scale, about so many


class Scale:
    """Values from `low` to `high` on a line from `begin` to `end` in the picture."""

    def __init__(self, low: float, high: float, begin: float, end: float) -> None:
        room = 0.0 if high - low > 1e-9 else 1.0
        self.low, self.high, self.begin, self.end = low - room, high + room, begin, end

    def place(self, value: float) -> float:
        return self.begin + (value - self.low) / (self.high - self.low) * (self.end - self.begin)

    def marks(self) -> Iterator[float]:
        """Round values along it."""
        least = (self.high - self.low) / LINES
        power = 10.0 ** floor(log10(least))
        step = power * next(one for one in STEPS if one * power >= least * (1.0 - 1e-9))
        for number in range(ceil(self.low / step), floor(self.high / step) + 1):
            yield number * step


def picture(plot: Plot) -> str:
    """The plot as an SVG element."""
    values = [value for curve in plot.curves for value in curve.values]
    across = Scale(plot.times[0], plot.times[-1], LEFT, WIDTH - RIGHT)
    up = Scale(min(values), max(values), HEIGHT - BOTTOM, TOP)
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" width="{WIDTH}" height="{HEIGHT}" '
        f'font-family="sans-serif" font-size="11" fill="{GREY}">'
    )
    title = _text(LEFT, 14, f"{plot.title} [{plot.unit}]", "start")
    parts = [head, title, *_grid(across, up), *_curves(plot, across, up), "</svg>"]
    return "\n".join(parts) + "\n"


def _grid(across: Scale, up: Scale) -> Iterator[str]:
    for value in up.marks():
        y = up.place(value)
        yield _stroke(f"M{LEFT} {y:.1f}H{WIDTH - RIGHT}")
        yield _text(LEFT - 6, y + 4, f"{value + 0.0:.6g}", "end")
    for value in across.marks():
        x = across.place(value)
        yield _stroke(f"M{x:.1f} {TOP}V{HEIGHT - BOTTOM}")
        yield _text(x, HEIGHT - BOTTOM + 16, f"{value + 0.0:.6g}", "middle")
    yield _text((LEFT + WIDTH - RIGHT) / 2, HEIGHT - 4, "t [s]", "middle")


def _curves(plot: Plot, across: Scale, up: Scale) -> Iterator[str]:
    for number, curve in enumerate(plot.curves):
        colour, _ = COLOURS[CURVES[number % len(CURVES)]]
        yield f'<path d="{_path(plot, curve, across, up)}" fill="none" stroke="{colour}" stroke-width="1.5"/>'
        y = TOP + 10 + 16 * number
        yield f'<text x="{WIDTH - RIGHT + 8}" y="{y}" fill="{colour}">{escape(curve.label)}</text>'


def _path(plot: Plot, curve: Curve, across: Scale, up: Scale) -> str:
    points = zip(plot.times, curve.values, strict=True)
    return "M" + "L".join(f"{across.place(t):.1f} {up.place(value):.1f}" for t, value in points)


def _stroke(path: str) -> str:
    return f'<path d="{path}" stroke="{GREY}" stroke-opacity="0.25"/>'


def _text(x: float, y: float, text: str, anchor: str) -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}">{escape(text)}</text>'
