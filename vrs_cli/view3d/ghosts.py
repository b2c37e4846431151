"""Arms that are not there yet, or would be: where the motion under way ends, what other branches do, and, behind a line
with delays, the robot that is predicted beside the one that is reported.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from html import escape
from itertools import pairwise

import numpy as np
from viser import GuiHtmlHandle, LabelHandle, LineSegmentsHandle, SceneApi

from vrs_cli.engine.position import finish_after, position_at
from vrs_cli.engine.tool_path import ToolLine, ToolPath
from vrs_cli.errors import RequestRefused
from vrs_cli.interfaces.port.preview import Previewed
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.model import RobotModel, levers, link_frames
from vrs_cli.kinematics.transform import Transform, Vector, position
from vrs_cli.net.far_end import Ahead
from vrs_cli.net.messages import At, Done, ServerMessage
from vrs_cli.net.socket_port import SocketPort
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.acts import BranchSeen
from vrs_cli.values.results import Position
from vrs_cli.view3d.bar import FLAGGED, UNCONFIRMED
from vrs_cli.view3d.figure import Figure
from vrs_cli.view3d.parts import Colour, Shown, put
from vrs_cli.view3d.paths import THICK
from vrs_cli.view3d.window import RobotWindow
from vrs_cli.wire.records import Form, RecordError
from vrs_cli.wire.snapshots import BranchShown, ShowBranch, snapshot_of

GOAL, GOAL_OPACITY = (236, 150, 70), 0.28
BRANCHES, BRANCH_OPACITY = ((140, 96, 200), (60, 150, 150), (190, 90, 130)), 0.3  # of so many at most
BESIDE = 0.004  # [m, rad] of a link: one that stands nearer is not seen either, as that of the base never is
COINCIDE = 0.02  # [rad, m] of a joint: a ghost that stands nearer would only tint the arm


class Ghost:
    """One arm that is seen through. It is made when it is first seen."""

    def __init__(self, scene: SceneApi, root: str, model: RobotModel, colour: Colour, opacity: float) -> None:
        self._scene, self._root, self._model = scene, root, model
        self._colour, self._opacity = colour, opacity
        self._figure: Figure | None = None
        self._at: Position | None = None  # where it stands
        self._links: Sequence[Transform] = ()

    def hide(self) -> None:
        if self._figure is not None:
            put(self._figure, visible=False)

    def stand(self, at: Position, shown: Shown) -> bool:
        """Stand there, or hide where the arm is there too; whether it is seen. Which of its links coincide with those
        of the arm is looked at only where other things are read.
        """
        if max(abs(x - y) for x, y in zip(at.joints, shown.position.joints, strict=True)) < COINCIDE:
            self.hide()
            return False
        if self._figure is None:
            self._figure = Figure(self._scene, self._root, self._model, colour=self._colour, opacity=self._opacity)
        elif at is self._at and self._figure.visible and not shown.reads:
            return True
        self._figure.pose(at.joints, at.hand, shown.frames.base)
        if at is not self._at:
            self._at, self._links = at, link_frames(self._model, at.joints)
        here = link_frames(self._model, shown.position.joints)
        for i, (ours, its) in enumerate(zip(here, self._links, strict=True)):
            self._figure.show_link(i, max(abs(a - b) for a, b in zip(ours, its, strict=True)) > BESIDE)
        put(self._figure, visible=True)
        return True

    def remove(self) -> None:
        if self._figure is not None:
            self._figure.remove()
            self._figure = None


class GoalGhost:
    """Shows where the motion under way ends; hidden at rest, and where the arm is there already."""

    def __init__(self, scene: SceneApi, model: RobotModel) -> None:
        self._ghost = Ghost(scene, "/goal", model, GOAL, GOAL_OPACITY)
        self._goal: Position | None = None
        self._timeline: Timeline | None = None  # that leads there
        self.visible = True

    def show(self, shown: Shown) -> None:
        if not (self.visible and shown.position.moving):
            self._ghost.hide()
            return
        timeline, end = shown.timeline, finish_after(shown.timeline, shown.t)
        if self._goal is None or self._timeline is not timeline or self._goal.time != end:
            self._timeline, self._goal = timeline, position_at(shown.arm, timeline, end)
        self._ghost.stand(self._goal, shown)


class BranchGhosts:
    """Shows the arm as the other branches have it at the time that is shown, each with how much later it ends. Their
    timelines come from the robot, once for each version. `moves` is called where one of them does.
    """

    def __init__(
        self, scene: SceneApi, arm: RobotArm, robot: SocketPort, moves: Callable[[], object] = lambda: None
    ) -> None:
        self._scene, self._arm, self._robot, self._moves = scene, arm, robot, moves
        self._asked: dict[str, int] = {}  # the version that was asked for
        self._found: dict[str, Timeline] = {}
        self._drawn: dict[str, tuple[Ghost, LabelHandle]] = {}
        self.visible = True

    def show(self, shown: Shown) -> None:
        found = shown.surveyed
        others = [one for one in found.branches if not one.row.present] if found is not None and self.visible else []
        others = others[: len(BRANCHES)]
        for seen in others:
            self._fetch(seen)
        self._forget([seen.row.name for seen in others])
        for number, seen in enumerate(others):
            timeline = self._found.get(seen.row.name)
            if timeline is not None:
                self._show(number, seen, timeline, shown)

    def _fetch(self, seen: BranchSeen) -> None:
        name = seen.row.name
        if self._asked.get(name) == seen.version:
            return

        def hear(message: ServerMessage) -> None:
            if isinstance(message, Done) and isinstance(message.found, BranchShown):
                with suppress(RecordError):
                    self._found[name] = snapshot_of(message.found.snapshot, Form.of(self._arm)).timeline()
            elif isinstance(message, Done):  # it is gone, or will be asked for again
                self._asked.pop(name, None)

        with suppress(RequestRefused):  # there is no connection now
            self._robot.begin(lambda id: At(id, ShowBranch(name)), hear)
            self._asked[name] = seen.version

    def _forget(self, names: Sequence[str]) -> None:
        for name in [name for name in self._drawn if name not in names]:
            ghost, label = self._drawn.pop(name)
            ghost.remove()
            label.remove()
        for name in [name for name in self._asked if name not in names]:
            del self._asked[name]
            self._found.pop(name, None)

    def _show(self, number: int, seen: BranchSeen, timeline: Timeline, shown: Shown) -> None:
        name, at = seen.row.name, position_at(self._arm, timeline, shown.t)
        if name not in self._drawn:
            ghost = Ghost(self._scene, f"/branches/{name}", self._arm.model, BRANCHES[number], BRANCH_OPACITY)
            self._drawn[name] = ghost, self._scene.add_label(f"/branches/{name}-name", "", visible=False)
        ghost, label = self._drawn[name]
        if at.moving:
            self._moves()
        apart = ghost.stand(at, shown)
        if apart:
            label.position = position(at.T_world_tool)
        put(label, text=f"{name}: {seen.row.end - shown.timeline.end:+.1f} s", visible=apart)


# --- a robot behind a line with delays -------------------------------------------------------------------------------


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
