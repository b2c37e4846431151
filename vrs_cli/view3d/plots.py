"""Curves beside the picture: joints, their speed against its limits, the speed of the tool, over what the bar of time
spans. A plot that is not open costs nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from itertools import cycle
from threading import Lock
from typing import NamedTuple

import numpy as np
import viser
from viser import uplot

from vrs_cli.engine.position import positions_at
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.arrays import Floats
from vrs_cli.render.colours import COLOURS, CURVES
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.view3d.bar import PlaybackBar, TimeSpan
from vrs_cli.view3d.parts import Redrawing, Shown, put
from vrs_cli.view3d.window import RobotWindow

SAMPLES = 600  # of a curve: more than there are pixels
WIDTH, TALL = 380.0, 150  # [px] of the panel, and of a plot
ABOVE, RIGHT, BELOW, LEFT = 8, 14, 26, 52  # [px] beside the curves
MARGIN = "0.625rem"  # of viser's plots, left and right
HUES = tuple(COLOURS[ink][0] for ink in CURVES)
LEGEND = f"padding:2px {MARGIN} 6px;font-size:0.75rem;font-variant-numeric:tabular-nums"
STEP = 1e-4  # [s] over which the speed of the tool is measured


class PlotKind(NamedTuple):
    """A plot: how its box and its curves are called, and their values (N, curves) in the unit that people read."""

    box: str
    title: str
    names: Callable[[RobotArm], Sequence[str]]
    values: Callable[[RobotArm, Timeline, Floats], Floats]
    range: tuple[float, float] | None = None


def _joint_names(arm: RobotArm) -> list[str]:
    return [f"JT{joint}" for joint in range(1, arm.model.joint_count + 1)]


def _joints(arm: RobotArm, timeline: Timeline, times: Floats) -> Floats:
    units = arm.model.units
    scales = np.array([units.one_shown(joint, 1.0) for joint in range(1, arm.model.joint_count + 1)])
    joints: Floats = positions_at(arm, timeline, times).joints * scales
    return joints


def _shares(arm: RobotArm, timeline: Timeline, times: Floats) -> Floats:
    """The speeds of the joints in per cent of their limits."""
    shares: Floats = 100.0 * positions_at(arm, timeline, times).velocity / np.array(arm.model.max_velocity)
    return shares


def _tool_speed(arm: RobotArm, timeline: Timeline, times: Floats) -> Floats:
    before, after = (positions_at(arm, timeline, times + s).T_world_tool[:, :, 3] for s in (-STEP, STEP))
    speed: Floats = 1000.0 * np.linalg.norm(after - before, axis=1)[:, None] / (2.0 * STEP)
    return speed


KINDS: tuple[PlotKind, ...] = (
    PlotKind("joints", "Joints [deg, mm]", _joint_names, _joints),
    PlotKind("joint speeds", "Joint speeds [% of limit]", _joint_names, _shares, (-105.0, 105.0)),
    PlotKind("tool speed", "Tool speed [mm/s]", lambda _arm: ["tool"], _tool_speed),
)


class Plots:
    """Boxes in the container of the page that is open, and a panel with what they choose, of what the bar spans."""

    def __init__(self, window: RobotWindow, bar: PlaybackBar) -> None:
        self._window, self._bar, gui = window, bar, window.client.gui
        self._panel: viser.PanelHandle | None = None
        self._open: dict[PlotKind, _Plot] = {}
        self._lock = Lock()
        for kind in KINDS:
            box = gui.add_checkbox(kind.box, initial_value=False)
            box.on_update(window.doing_with(partial(self._choose, kind)))

    def _choose(self, kind: PlotKind, event: viser.GuiEvent[viser.GuiCheckboxHandle]) -> None:
        with self._lock:
            if event.target.value and kind not in self._open:
                if self._panel is None:  # on the right, opened with the first plot
                    self._panel = self._window.client.gui.add_panel()
                    self._tab = self._panel.add_tab("Plots")
                    self._panel.dock_right()
                    self._panel.set_width(WIDTH)
                with self._tab:
                    self._open[kind] = _Plot(kind, self._window)
            elif not event.target.value and kind in self._open:
                self._open.pop(kind).remove()
                if not self._open and self._panel is not None:
                    self._panel.remove()
                    self._panel = None

    def show(self, shown: Shown) -> None:
        if self._open:
            with self._lock:
                for plot in self._open.values():
                    plot.show(shown, self._bar.span)


class _Plot:
    """One plot in the container that is open, with a line at the time that is shown."""

    def __init__(self, kind: PlotKind, window: RobotWindow) -> None:
        self._kind, self._arm = kind, window.watched.arm
        gui, arm = window.client.gui, self._arm
        names = kind.names(arm)
        curves = zip(names, cycle(HUES), strict=False)
        scale = {"y": uplot.Scale(range=kind.range)} if kind.range else {}
        self._plot = gui.add_uplot(
            tuple(np.zeros(2) for _ in range(len(names) + 1)),
            (
                uplot.Series(label="s"),
                *(uplot.Series(label=name, stroke=hue, width=1.5) for name, hue in curves),
            ),
            scales={"x": uplot.Scale(time=False), **scale},
            axes=(uplot.Axis(size=BELOW), uplot.Axis(size=LEFT)),
            legend=uplot.Legend(show=False),
            cursor=uplot.Cursor(show=False),
            height=TALL,
            padding=(ABOVE, RIGHT, 0, 0),
        )
        self._follows = gui.add_html("")
        self._drawing = Redrawing(window.wall)

    def show(self, shown: Shown, span: TimeSpan) -> None:
        timeline = shown.timeline
        self._drawing.look((timeline.version, id(timeline)), span, lambda: self._draw(timeline, span))
        if shown.reads:
            put(self._follows, content=_line(span.percent(shown.t)) + self._legend(timeline, shown.t))

    def _draw(self, timeline: Timeline, span: TimeSpan) -> None:
        times = np.linspace(span.low, span.high, SAMPLES)
        self._plot.data = (times, *np.ascontiguousarray(self._kind.values(self._arm, timeline, times).T))

    def _legend(self, timeline: Timeline, t: float) -> str:
        """The title, the names of the curves, and their values at t."""
        values = self._kind.values(self._arm, timeline, np.array([t]))[0]
        told = (
            f'<span style="color:{colour}">{name} {value:.1f}</span>'
            for name, colour, value in zip(self._kind.names(self._arm), cycle(HUES), values.tolist(), strict=False)
        )
        return f'<div style="{LEGEND}"><b>{self._kind.title}</b><br>{" &nbsp; ".join(told)}</div>'

    def remove(self) -> None:
        self._plot.remove()
        self._follows.remove()


def _line(percent: float) -> str:
    """At the time that is shown, over the curves, which stand before it."""
    part = percent / 100.0
    place = f"left:calc({LEFT}px + (100% - {LEFT + RIGHT}px) * {part:.4f});top:-{TALL + ABOVE}px"
    line = f"position:absolute;{place};height:{TALL - BELOW}px;width:1px;background:#d2453c"
    return f'<div style="margin:0 {MARGIN};position:relative;height:0"><div style="{line}"></div></div>'
