"""A robot behind a line with delays: beside the robot as it is reported the one that is predicted, what was shown
wrongly and what is not confirmed in colours, and the delays on a panel.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from html import escape
from itertools import pairwise

import numpy as np
from viser import GuiHtmlHandle, LineSegmentsHandle, SceneApi

from vrs_cli.engine.position import position_at
from vrs_cli.engine.tool_path import ToolLine, ToolPath
from vrs_cli.interfaces.port.preview import Previewed
from vrs_cli.kinematics.model import levers
from vrs_cli.kinematics.transform import Vector, position
from vrs_cli.net.far_end import Ahead
from vrs_cli.net.socket_port import SocketPort
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.view3d.figure import Colour
from vrs_cli.view3d.ghosts import Ghost
from vrs_cli.view3d.paths import THICK
from vrs_cli.view3d.placing import put
from vrs_cli.view3d.shown import Shown
from vrs_cli.view3d.strip import FLAGGED, UNCONFIRMED
from vrs_cli.view3d.window import RobotWindow

PREDICTED = (58, 124, 214)
OPACITY = 0.35  # of the robot that is predicted
ERROR = 1e-3  # [m] that a way may be beside the tool's
AROUND = 2.5  # times as thick as the way of the tool, which is inside
RECENT = 60.0  # [s] that what was shown wrongly stays in the picture
EDGE, ABOVE, WIDTH = 12.0, 190.0, 300.0  # [px] the panel: from the edges of the picture, and wide
NARROW = 900.0  # [px] of a picture in which it would cover the arm
PRESENT, HEARD = "at its present", "as it is heard, with a prediction"


class DelayPanel:
    """Nodes /predicted, /unconfirmed, /flagged; the panel is there once there is something to tell."""

    def __init__(self, window: RobotWindow, robot: SocketPort) -> None:
        self._window, self._far = window, robot.far
        scene, self._arm = window.client.scene, window.watched.arm
        self._ahead = Ahead.AUTO if self._far.ahead is Ahead.PRESENT else self._far.ahead  # what is predicted
        self._ghost = Ghost(scene, "/predicted", self._arm.model, PREDICTED, OPACITY)
        self._path = ToolPath(self._arm, ERROR)
        thick = AROUND * THICK * levers(self._arm.model)[1][0]
        self._unconfirmed = Way(scene, "/unconfirmed", UNCONFIRMED, thick)
        self._flagged = Way(scene, "/flagged", FLAGGED, thick)
        self._told: GuiHtmlHandle | None = None

    def _add_panel(self) -> GuiHtmlHandle:
        """Add the panel at the right above the bar of time; only its title is open where there is no room beside the
        arm.
        """
        gui, chosen = self._window.client.gui, PRESENT if self._far.ahead is Ahead.PRESENT else HEARD
        panel = gui.add_panel()
        with panel.add_tab("Delays"):
            choice = gui.add_dropdown("The robot is shown", (PRESENT, HEARD), initial_value=chosen)
            told = gui.add_html("")
        choice.on_update(self._window.doing(lambda: self._choose(choice.value)))
        panel.float(x=-EDGE, y=-ABOVE, width=WIDTH)
        if self._window.width < NARROW:
            panel.minimize()
        return told

    def _choose(self, chosen: str) -> None:
        self._far.ahead = self._ahead if chosen == HEARD else Ahead.PRESENT

    def show(self, shown: Shown) -> None:
        seen = shown.seen
        if seen is None:
            return
        self._show_ghost(shown, seen)
        if shown.reads:
            self._show_ways(shown.t, seen)
            self._tell(shown.t, seen)

    # --- the robot that is predicted ---

    def _show_ghost(self, shown: Shown, seen: Previewed) -> None:
        """While the robot is followed, and where it is not in the same place."""
        playback = self._window.playback
        if not (seen.predicts and playback.follows and playback.playing):
            self._ghost.hide()
            return
        there = position_at(self._arm, seen.timeline, seen.shown)
        self._ghost.stand(there, shown)
        if there.moving:
            self._window.again()

    # --- ways in colours ---

    def _show_ways(self, t: float, seen: Previewed) -> None:
        """The way of what is not confirmed, and of what was shown wrongly a while ago."""
        fresh = [(begin, end) for begin, end in seen.flagged if t - RECENT < end and begin < t + RECENT]
        ahead = (seen.unconfirmed, seen.timeline.end)
        spans = [*fresh, ahead] if ahead[0] < ahead[1] else fresh
        lines = self._path.lines(seen.timeline, min(it[0] for it in spans), spans[-1][1]) if spans else []
        ways = [[way for line in lines if (way := self._cut(seen.timeline, line, *span))] for span in spans]
        self._unconfirmed.show(ways.pop() if spans is not fresh else [])
        self._flagged.show([way for some in ways for way in some])

    def _cut(self, timeline: Timeline, line: ToolLine, begin: float, end: float) -> Sequence[Vector]:
        """The points of a line that lie between two times, at which it is cut."""
        begin, end = max(begin, line.begin), min(end, line.end)
        if not begin < end:
            return []
        inside = [p for t, p in zip(line.times, line.points, strict=True) if begin < t + line.offset < end]
        return [self._tip(timeline, begin), *inside, self._tip(timeline, end)]

    def _tip(self, timeline: Timeline, t: float) -> Vector:
        return position(position_at(self._arm, timeline, t).T_world_tool)

    # --- what is told ---

    def _tell(self, t: float, seen: Previewed) -> None:
        if self._told is None:
            if self._far.near and not seen.predicts:
                return
            self._told = self._add_panel()
        told = "".join(f"<div>{line}</div>" for line in _lines(t, seen))
        style = "padding:0 0.625rem 0.4rem;font-size:0.8rem;font-variant-numeric:tabular-nums"
        put(self._told, content=f'<div style="{style}">{told}</div>')


class Way:
    """Parts of the way of the tool tip in a colour, so thick [m]; sent where they change."""

    def __init__(self, scene: SceneApi, name: str, colour: Colour, thick: float) -> None:
        self._scene, self._name, self._colour, self._thick = scene, name, colour, thick
        self._node: LineSegmentsHandle | None = None
        self._drawn: list[Sequence[Vector]] = []

    def show(self, ways: list[Sequence[Vector]]) -> None:
        if ways == self._drawn:
            return
        self._drawn = ways
        pairs = np.array([pair for way in ways for pair in pairwise(way)], dtype=float).reshape(-1, 2, 3)
        if self._node is None:
            self._node = self._scene.add_line_segments(self._name, pairs, self._colour, thickness=self._thick)
        elif len(pairs):
            self._node.points = pairs.astype(np.float32)
        self._node.visible = bool(len(pairs))


def _lines(t: float, seen: Previewed) -> Iterator[str]:
    """The delays and the meaning of the colours, as HTML."""
    yield f"D_f + D_b: <b>{1e3 * seen.round_trip:.0f} ms</b>"
    if seen.predicts:
        yield f"heard: {seen.heard:.2f} s, {_patch(PREDICTED)}predicted: {seen.shown:.2f} s"
    for line in dict.fromkeys((*seen.lines(t), seen.doubt)):  # what is to come is of interest before it is shown
        kind, _, rest = line.partition(" ")
        colour = {"flagged:": FLAGGED, "unconfirmed": UNCONFIRMED}.get(kind)
        if colour is not None:
            yield f"{_patch(colour)}{kind} {escape(rest)}"


def _patch(colour: Colour) -> str:
    return f'<span style="color:rgb{colour}">&#9632;</span> '
