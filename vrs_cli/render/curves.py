"""Curves over time as SVG, for reports: panels below each other, with ticks and a legend, without another package."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from itertools import pairwise
from math import ceil, floor, isfinite, log10
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from vrs_cli.render.plots import Curves

WIDTH, HEIGHT, LEFT, RIGHT, TOP, BOTTOM = 900, 210, 64, 70, 22, 26  # [px] of a panel, and around its curves
COLOURS = ("#1a5fb4", "#b3201b", "#14692d", "#8a4b08", "#6b3fa0", "#00697a", "#a3246b")
TICKS = 6  # at most about so many along an axis
STEPS = (1.0, 2.0, 5.0, 10.0)
STYLE = "font:12px sans-serif;fill:#1a1f26"
HALO = "paint-order:stroke;stroke:#fff;stroke-width:3px"  # a name that lies on a curve can be read
MARK_ROWS = 2
FLAT = 1e-9  # of a panel whose curves are constant: half its height [unit]


def curves_svg(panels: Sequence[Curves], along: str) -> str:
    """Return the panels, which share the values along the axis, as one `<svg>`. The same text for the same numbers."""
    height = HEIGHT * len(panels) + BOTTOM
    parts = [_panel(panel, k * HEIGHT) for k, panel in enumerate(panels)]
    middle = LEFT + 0.5 * (WIDTH - LEFT - RIGHT)
    title = f'<text x="{middle:g}" y="{height - 6}" text-anchor="middle">{escape(along)}</text>'
    head = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" role="img" style="{STYLE}">'
    return f"{head}<title>{escape('; '.join(panel.title for panel in panels))}</title>{''.join(parts)}{title}</svg>"


def ticks(low: float, high: float) -> list[float]:
    """Return round numbers from `low` to `high`."""
    if not high > low:
        return [low]
    rough = (high - low) / TICKS
    size = 10.0 ** floor(log10(rough))
    step = next(one for one in STEPS if one * size >= rough * (1.0 - 1e-9)) * size
    return [k * step for k in range(ceil(low / step - 1e-9), floor(high / step + 1e-9) + 1)]


def _panel(panel: Curves, top: float) -> str:
    """Return one panel whose upper edge is at `top` [px]."""
    times = [float(t) for t in panel.along]
    columns = [[float(x) for x in column] for column in panel.columns]
    values = [x for column in columns for x in column if isfinite(x)] or [0.0]
    first, last = times[0], times[-1]
    low, high = min(values), max(values)
    margin = 0.05 * (high - low) or max(FLAT, 0.05 * abs(high))
    low, high = low - margin, high + margin
    inner, width = HEIGHT - TOP - BOTTOM, WIDTH - LEFT - RIGHT

    def x(t: float) -> float:
        return LEFT + width * ((t - first) / (last - first) if last > first else 0.0)

    def y(value: float) -> float:
        return top + TOP + inner * (high - value) / (high - low)

    under, right = top + HEIGHT - BOTTOM, WIDTH - RIGHT
    parts = [f'<text x="{LEFT}" y="{top + TOP - 8:g}" font-weight="bold">{escape(panel.title)}</text>']
    for t in ticks(first, last):
        parts.append(f'<path d="M{x(t):.1f} {top + TOP:g}V{under:g}" stroke="#d3d8df"/>')
        parts.append(f'<text x="{x(t):.1f}" y="{under + 15:g}" text-anchor="middle">{_said(t)}</text>')
    for value in ticks(low, high):
        parts.append(f'<path d="M{LEFT} {y(value):.1f}H{right}" stroke="#d3d8df"/>')
        parts.append(f'<text x="{LEFT - 6}" y="{y(value) + 4.0:.1f}" text-anchor="end">{_said(value)}</text>')
    drawn: list[str] = []
    for k, (name, column) in enumerate(zip(panel.names, columns, strict=True)):
        colour, points = COLOURS[k % len(COLOURS)], _points([(x(t), y(v)) for t, v in zip(times, column, strict=True)])
        under_it = drawn.count(points)  # a curve on which others lie already is dashed, so that these are seen
        dashes = f' stroke-dasharray="6 {6 * under_it}"' if under_it else ""
        drawn.append(points)
        parts.append(f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="1.6"{dashes}/>')
        place = top + TOP + 12 + 16 * k
        parts.append(f'<text x="{right + 10}" y="{place:g}" style="fill:{colour}">{escape(name)}</text>')
    for k, (place, name) in enumerate(panel.marks):
        level = top + TOP + 12 + 14 * (k % MARK_ROWS)  # names of neighbours do not lie upon each other
        parts.append(f'<path d="M{x(place):.1f} {top + TOP:g}V{under:g}" stroke="#545d69" stroke-dasharray="2 3"/>')
        parts.append(f'<text x="{x(place) + 4:.1f}" y="{level:g}" style="{HALO}">{escape(name)}</text>')
    parts.append(f'<path d="M{LEFT} {top + TOP:g}V{under:g}H{right}" fill="none" stroke="#545d69"/>')
    return "".join(parts)


def _points(places: Sequence[tuple[float, float]]) -> str:
    """Return points of a line in tenths of a pixel, without those in the middle of one place or of a level stretch."""
    rounded = [(f"{x:.1f}", f"{y:.1f}") for x, y in places]
    kept = rounded[:1]
    for (before, here), after in zip(pairwise(rounded), [*rounded[2:], None], strict=True):
        if here == before or (after is not None and before[1] == here[1] == after[1]):
            continue
        kept.append(here)
    return " ".join(f"{x},{y}" for x, y in kept)


def _said(value: float) -> str:
    """Return a number without needless digits, and never -0."""
    return f"{value + 0.0:.6g}" if abs(value) > 1e-12 else "0"
