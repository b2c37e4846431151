"""A trajectory as a picture file: joint angles, joint velocities and the tool's position over time.

Matplotlib draws it; it comes with the extra `plot`, is looked for before anything runs and imported last.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from importlib import import_module
from importlib.util import find_spec
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from vrs_cli.errors import UsageError
from vrs_cli.extras import how_to_install
from vrs_cli.files.atomic import atomically, check_writable
from vrs_cli.interfaces.monitor.plotting import PICTURES

if TYPE_CHECKING:
    from vrs_cli.kinematics.arm import RobotArm
    from vrs_cli.kinematics.arrays import Floats
    from vrs_cli.trajectory.timeline import Timeline
    from vrs_cli.values.replies import Plot


TIME = "t [s]"
SAMPLES = 2000  # along the whole time, beside the borders of segments
MOST_BORDERS = 4000  # of segments that get samples of their own
SIZE = (9.0, 8.0)  # [inch]
DOTS_PER_INCH = 120
STYLE = {"svg.hashsalt": "vrs", "svg.fonttype": "none", "font.size": 9.0}


class Curves(NamedTuple):
    """One panel: its unit, and named columns of values, each over the N values `along`. `marks`: values along the axis
    at which a line stands, each with its name.
    """

    title: str
    names: Sequence[str]
    columns: Iterable[Sequence[float] | Floats]
    along: Sequence[float] | Floats
    marks: Sequence[tuple[float, str]] = ()


def check_plot(path: str | Path) -> None:
    """Raise now what would make `plot_trajectory` fail later: UsageError or FileError."""
    suffix = Path(path).suffix.lower()
    if suffix not in PICTURES:
        raise PlotError(f"{path} is no picture file", f"its name ends in {', '.join(PICTURES[:-1])} or {PICTURES[-1]}")
    _check_matplotlib()
    check_writable(path)


def _check_matplotlib() -> None:
    if find_spec("matplotlib") is None:
        raise PlotError("a plot needs matplotlib, which is not installed", how_to_install("matplotlib"))


class PlotError(UsageError, text="No plot"):
    """A plot cannot be made."""


def plot_trajectory(path: str | Path, arm: RobotArm, timeline: Timeline, title: str) -> None:
    """Draw the whole timeline into a picture file: the same bytes for the same timeline.

    Raises UsageError (no matplotlib, no picture file) or FileError.
    """
    plot_panels(path, TIME, trajectory_panels(arm, timeline), title)


def plot_curves(path: str | Path, plot: Plot) -> None:
    """Draw what PLOT shows into a file. Raises as `plot_trajectory` does."""
    names, columns = [curve.label for curve in plot.curves], [curve.values for curve in plot.curves]
    plot_panels(path, TIME, [Curves(f"[{plot.unit}]", names, columns, plot.times)], plot.title)


def plot_panels(path: str | Path, along: str, panels: Sequence[Curves], title: str) -> None:
    """Draw panels below each other. Raises as `plot_trajectory` does."""
    check_plot(path)
    picture = _drawn(along, panels, title, Path(path).suffix.lower()[1:])
    with atomically(path) as stream:
        stream.write(picture)


def trajectory_panels(arm: RobotArm, timeline: Timeline) -> tuple[Curves, ...]:
    """Joints, their velocities and the tool, at even steps and at the borders of segments, where curves bend."""
    import numpy as np

    from vrs_cli.engine.position import positions_at
    from vrs_cli.files.exports import shown_joints

    times = np.linspace(timeline.start, timeline.end, SAMPLES)
    if len(timeline) <= MOST_BORDERS:
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


def _drawn(along: str, panels: Sequence[Curves], title: str, form: str) -> bytes:
    matplotlib: Any = import_module("matplotlib")
    figure_class: Any = import_module("matplotlib.figure").Figure
    with matplotlib.rc_context(STYLE):
        figure = figure_class(figsize=SIZE, dpi=DOTS_PER_INCH, layout="constrained")
        figure.suptitle(title)
        axes = figure.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0]
        for axis, panel in zip(axes, panels, strict=True):
            _draw_panel(axis, panel)
        axes[-1].set_xlabel(along)
        buffer, undated = BytesIO(), {"svg": {"Date": None}, "png": {"Software": None}, "pdf": {"CreationDate": None}}
        figure.savefig(buffer, format=form, metadata=undated[form])  # without the date of today
        return buffer.getvalue()


def _draw_panel(axis: Any, panel: Curves) -> None:
    """A curve on which others lie already is drawn in dashes, so that these are seen through it."""
    import numpy as np

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
