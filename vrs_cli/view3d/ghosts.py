"""Arms that are not there yet, or would be: where the motion under way ends, and what other branches do."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress

from viser import LabelHandle, SceneApi

from vrs_cli.engine.position import finish_after, position_at
from vrs_cli.errors import RequestRefused
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.model import RobotModel, link_frames
from vrs_cli.kinematics.transform import Transform, position
from vrs_cli.net.messages import At, Done, ServerMessage
from vrs_cli.net.socket_port import SocketPort
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.acts import BranchSeen
from vrs_cli.values.results import Position
from vrs_cli.view3d.figure import Figure
from vrs_cli.view3d.placing import put
from vrs_cli.view3d.shown import Shown
from vrs_cli.wire.records import Form, RecordError
from vrs_cli.wire.snapshots import BranchShown, ShowBranch, snapshot_of

GOAL, GOAL_OPACITY = (236, 150, 70), 0.28
BRANCHES, BRANCH_OPACITY = ((140, 96, 200), (60, 150, 150), (190, 90, 130)), 0.3  # of so many at most
BESIDE = 0.004  # [m, rad] of a link: one that stands nearer is not seen either, as that of the base never is
COINCIDE = 0.02  # [rad, m] of a joint: a ghost that stands nearer would only tint the arm


class Ghost:
    """One arm that is seen through. It is made when it is first seen."""

    def __init__(
        self, scene: SceneApi, root: str, model: RobotModel, colour: tuple[int, int, int], opacity: float
    ) -> None:
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
