"""Plot curves over time: a trajectory as a picture file with matplotlib, and panels of curves as SVG without it.

Matplotlib comes with the extra `plot`. The code looks for it before anything runs, and imports it as late as possible.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape
from importlib import import_module
from importlib.util import find_spec
from io import BytesIO
from itertools import pairwise
from math import ceil, floor, isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from vrs_cli.errors import UsageError
from vrs_cli.extras import how_to_install
from vrs_cli.files.atomic import atomically, check_writable
from vrs_cli.interfaces.monitor.timeline import PICTURES
from vrs_cli.render.chart import round_step

if TYPE_CHECKING:
    from vrs_cli.kinematics.arm import RobotArm
    from vrs_cli.kinematics.arrays import Floats
    from vrs_cli.trajectory.timeline import Timeline
    from vrs_cli.values.replies import Plot

TIME = "t [s]"
SAMPLES = 2000  # number of equidistant samples, in addition to those at the boundaries of segments
SIZE = (9.0, 8.0)  # [inch] size of a picture
STYLE = {"svg.hashsalt": "vrs", "svg.fonttype": "none", "font.size": 9.0}


class Curves(NamedTuple):
    """One panel of curves: its title with the unit, and named columns with N values each, one for each of the N values
    of the horizontal axis, `along`. `marks`: named vertical lines, by their value on this axis."""

    title: str
    names: Sequence[str]
    columns: Iterable[Sequence[float] | Floats]
    along: Sequence[float] | Floats
    marks: Sequence[tuple[float, str]] = ()


def check_plot(path: str | Path) -> None:
    """Raise in advance the error that `plot_trajectory` would raise later: UsageError or FileError."""
    if Path(path).suffix.lower() not in PICTURES:
        raise PlotError(f"{path} is no picture file", f"its name ends in {', '.join(PICTURES[:-1])} or {PICTURES[-1]}")
    if find_spec("matplotlib") is None:
        raise PlotError("a plot needs matplotlib, which is not installed", how_to_install("matplotlib"))
    check_writable(path)


class PlotError(UsageError, text="No plot"):
    """The error raised if a plot cannot be made."""


def plot_trajectory(path: str | Path, arm: RobotArm, timeline: Timeline, title: str) -> None:
    """Draw the whole timeline into a picture file; equal timelines give equal bytes. Raises UsageError (no matplotlib,
    unknown kind of file) or FileError."""
    plot_panels(path, TIME, trajectory_panels(arm, timeline), title)


def plot_curves(path: str | Path, plot: Plot) -> None:
    """Draw the curves of PLOT into a file. Raises the errors of `plot_trajectory`."""
    names, columns = [curve.label for curve in plot.curves], [curve.values for curve in plot.curves]
    plot_panels(path, TIME, [Curves(f"[{plot.unit}]", names, columns, plot.times)], plot.title)


def plot_panels(path: str | Path, along: str, panels: Sequence[Curves], title: str) -> None:
    """Draw panels below each other into a file. Raises the errors of `plot_trajectory`."""
    check_plot(path)
    picture = _picture_bytes(along, panels, title, Path(path).suffix.lower()[1:])
    with atomically(path) as stream:
        stream.write(picture)


def trajectory_panels(arm: RobotArm, timeline: Timeline) -> tuple[Curves, ...]:
    """Return panels with the joints, their velocities and the tool. The samples are equidistant; further samples are at
    the boundaries of segments, where curves bend."""
    import numpy as np

    from vrs_cli.engine.position import positions_at
    from vrs_cli.files.exports import shown_joints

    times = np.linspace(timeline.start, timeline.end, SAMPLES)
    if len(timeline) <= 4000:
        times = np.union1d(times, [segment.start for segment in timeline])
    units = arm.model.units
    names = tuple(dict.fromkeys(units.unit(joint) for joint in range(1, arm.model.joint_count + 1)))
    unit, rate = ", ".join(names), ", ".join(f"{name}/s" for name in names)
    at = positions_at(arm, timeline, times)
    joints = [f"JT{i}" for i in range(1, arm.model.joint_count + 1)]
    return (
        Curves(f"joints [{unit}]", joints, shown_joints(at.joints, units).T, times),
        Curves(f"joint velocities [{rate}]", joints, shown_joints(at.velocity, units).T, times),
        Curves("tool [mm]", ("X", "Y", "Z"), at.T_world_tool[:, :, 3].T * 1000.0, times),
    )


def _picture_bytes(along: str, panels: Sequence[Curves], title: str, form: str) -> bytes:
    import numpy as np

    matplotlib: Any = import_module("matplotlib")
    figure_class: Any = import_module("matplotlib.figure").Figure
    with matplotlib.rc_context(STYLE):
        figure = figure_class(figsize=SIZE, dpi=120, layout="constrained")
        figure.suptitle(title)
        axes = figure.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0]
        for axis, panel in zip(axes, panels, strict=True):
            before: list[Sequence[float] | Floats] = []
            for name, column in zip(panel.names, panel.columns, strict=True):
                under = sum(np.allclose(column, other, rtol=0.0, atol=1e-9) for other in before)
                stroke = {"dashes": (2.0, 2.0 * under)} if under else {}
                axis.plot(panel.along, column, label=name, linewidth=1.2, **stroke)
                before.append(column)
            for place, name in panel.marks:
                axis.axvline(place, color="black", linewidth=0.8, linestyle="--")
                axis.annotate(name, (place, 1.0), xycoords=("data", "axes fraction"))
            axis.set_ylabel(panel.title)
            axis.grid(visible=True, alpha=0.3)
            axis.margins(x=0.0)
            axis.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False)
        axes[-1].set_xlabel(along)
        buffer, undated = BytesIO(), {"svg": {"Date": None}, "png": {"Software": None}, "pdf": {"CreationDate": None}}
        figure.savefig(
            buffer, format=form, metadata=undated[form]
        )  # omit the date, so that equal curves give equal bytes
        return buffer.getvalue()


WIDTH, HEIGHT, LEFT, RIGHT, TOP, BOTTOM = 900, 210, 64, 70, 22, 26  # [px] size of a panel, and its margins
CURVE_COLOURS = ("#1a5fb4", "#b3201b", "#14692d", "#8a4b08", "#6b3fa0", "#00697a", "#a3246b")
TICKS = 6  # approximate maximum number of ticks along an axis
HALO = "paint-order:stroke;stroke:#fff;stroke-width:3px"  # white outline that keeps a name readable on a curve
FLAT = 1e-9  # minimum margin above and below constant curves, in the curve's unit; keeps the range from being zero


def curves_svg(panels: Sequence[Curves], along: str) -> str:
    """Return panels with a common horizontal axis as one `<svg>`. Equal numbers give equal text."""
    height = HEIGHT * len(panels) + BOTTOM
    parts = [_panel(panel, k * HEIGHT) for k, panel in enumerate(panels)]
    middle = LEFT + 0.5 * (WIDTH - LEFT - RIGHT)
    title = f'<text x="{middle:g}" y="{height - 6}" text-anchor="middle">{escape(along)}</text>'
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" role="img" '
        'style="font:12px sans-serif;fill:#1a1f26">'
    )
    return f"{head}<title>{escape('; '.join(panel.title for panel in panels))}</title>{''.join(parts)}{title}</svg>"


def ticks(low: float, high: float) -> list[float]:
    """Return round numbers from `low` to `high`."""
    if not high > low:
        return [low]
    step = round_step((high - low) / TICKS)
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
        parts.append(f'<text x="{x(t):.1f}" y="{under + 15:g}" text-anchor="middle">{_number_text(t)}</text>')
    for value in ticks(low, high):
        parts.append(f'<path d="M{LEFT} {y(value):.1f}H{right}" stroke="#d3d8df"/>')
        parts.append(f'<text x="{LEFT - 6}" y="{y(value) + 4.0:.1f}" text-anchor="end">{_number_text(value)}</text>')
    drawn: list[str] = []
    for k, (name, column) in enumerate(zip(panel.names, columns, strict=True)):
        colour = CURVE_COLOURS[k % len(CURVE_COLOURS)]
        points = _points([(x(t), y(v)) for t, v in zip(times, column, strict=True)])
        under_it = drawn.count(points)  # a curve that coincides with earlier ones is dashed, so that all stay visible
        dashes = f' stroke-dasharray="6 {6 * under_it}"' if under_it else ""
        drawn.append(points)
        parts.append(f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="1.6"{dashes}/>')
        place = top + TOP + 12 + 16 * k
        parts.append(f'<text x="{right + 10}" y="{place:g}" style="fill:{colour}">{escape(name)}</text>')
    for k, (place, name) in enumerate(panel.marks):
        # alternate between two heights, so that neighbouring names do not overlap
        level = top + TOP + 12 + 14 * (k % 2)
        parts.append(f'<path d="M{x(place):.1f} {top + TOP:g}V{under:g}" stroke="#545d69" stroke-dasharray="2 3"/>')
        parts.append(f'<text x="{x(place) + 4:.1f}" y="{level:g}" style="{HALO}">{escape(name)}</text>')
    parts.append(f'<path d="M{LEFT} {top + TOP:g}V{under:g}H{right}" fill="none" stroke="#545d69"/>')
    return "".join(parts)


def _points(places: Sequence[tuple[float, float]]) -> str:
    """Return the points of a line in tenths of a pixel, without repeated points and without the inner points of
    horizontal pieces."""
    rounded = [(f"{x:.1f}", f"{y:.1f}") for x, y in places]
    kept = rounded[:1]
    for (before, here), after in zip(pairwise(rounded), [*rounded[2:], None], strict=True):
        if here == before or (after is not None and before[1] == here[1] == after[1]):
            continue
        kept.append(here)
    return " ".join(f"{x},{y}" for x, y in kept)


def _number_text(value: float) -> str:
    """Return a number without unnecessary digits, and never as -0."""
    return f"{value + 0.0:.6g}" if abs(value) > 1e-12 else "0"
