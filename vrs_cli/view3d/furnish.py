"""What stands in a window: the scene, and the panels."""

from __future__ import annotations

from collections.abc import Callable
from math import tan
from typing import NamedTuple

import numpy as np

from vrs_cli.view3d.bar import PlaybackBar
from vrs_cli.view3d.delays import DelayPanel
from vrs_cli.view3d.ghosts import BranchGhosts, GoalGhost
from vrs_cli.view3d.limits import LimitsView
from vrs_cli.view3d.looks import all_of
from vrs_cli.view3d.panel import Panel
from vrs_cli.view3d.panel_front_end import PanelFrontEnd
from vrs_cli.view3d.paths import Path
from vrs_cli.view3d.places import PlacesView
from vrs_cli.view3d.plots import Plots
from vrs_cli.view3d.reach import ReachView
from vrs_cli.view3d.reasons import Asking, Reasons
from vrs_cli.view3d.shown import Shown
from vrs_cli.view3d.stage import FIELD, camera_for
from vrs_cli.view3d.studio import scenery
from vrs_cli.view3d.window import RobotWindow


class Choice(NamedTuple):
    """`choose` shows it or hides it."""

    label: str
    hint: str
    at_first: bool
    choose: Callable[[bool], None]


class AtWill:
    """Adds its parts to a window, and their boxes where the panel is that is open now."""

    def __init__(self, window: RobotWindow) -> None:
        scene, arm = window.client.scene, window.watched.arm
        path = next(part for part in window.parts if isinstance(part, Path))
        goal = GoalGhost(scene, arm.model)
        choices = [
            Choice("Path", "Past blue, planned orange, lighter where motions blend", True, _setter(path, "visible")),
            Choice("Commands", "The text of each command where its motion begins", False, _setter(path, "commands")),
            Choice("Goal", "The arm as it will stand when the motion ends", True, _setter(goal, "visible")),
        ]
        limits, reach = LimitsView(scene, "/robot", arm.model), ReachView(scene, "/robot", arm)
        choices.append(
            Choice("Joint ranges", "How far each joint goes, and where it is", False, _setter(limits, "visible"))
        )
        if reach.known:
            hint = "How far the tool gets in this configuration"
            choices.append(Choice("Reach", hint, False, _setter(reach, "visible")))
        window.parts += (goal, limits, reach)
        self.reasons = Reasons(scene, arm.model)
        window.parts.append(self.reasons)
        if window.robot is not None:
            places, branches = PlacesView(scene, arm.model), BranchGhosts(scene, arm, window.robot, window.again)
            window.parts += (places, branches)
            choices += (
                Choice("Places", "The locations that have names", True, _setter(places, "visible")),
                Choice("Branches", "The arm as other branches move it", True, _setter(branches, "visible")),
            )
        for choice in choices:
            _add_box(window, choice)

    def explain(self, front_end: PanelFrontEnd) -> None:
        """What is typed at a panel, and refused, is shown with its reason."""
        front_end.explained, front_end.refused = (
            self.reasons.explain,
            Asking(front_end.robot, self.reasons.explain).refused,
        )


def _add_box(window: RobotWindow, choice: Choice) -> None:
    box = window.client.gui.add_checkbox(choice.label, choice.at_first, hint=choice.hint)
    box.on_update(window.doing(lambda: choice.choose(box.value)))


def _setter(part: object, name: str) -> Callable[[bool], None]:
    return lambda value: setattr(part, name, value)


ORANGE = (222, 120, 40)  # of what can be pressed
EDGE = 12.0  # [px] from the edges of the picture
HEIGHT = 166.0  # [px] of the bar of time
SHEET = 300.0  # [px] that viser's sheet has at the foot of a phone, when nothing else in it is open
PHONE = 800.0  # [px] of the width of a page, where that sheet takes the place of panels
CHOICES = 230.0  # [px] the width of the panel of what is to be shown


class Edges:
    """viser's own panel, which has the bar, is as wide as the picture, however wide that is."""

    def __init__(self, window: RobotWindow) -> None:
        self._window, self._panel, self._width = window, window.client.gui.main_panel, window.width
        self._panel.float(x=EDGE, y=-EDGE, width=self._wide, height=HEIGHT)

    def show(self, _shown: Shown) -> None:
        if self._width != self._window.width:
            self._width = self._window.width
            self._panel.set_width(self._wide)

    @property
    def _wide(self) -> float:
        return max(self._width - 2.0 * EDGE, CHOICES)


def furnish(window: RobotWindow, title: str) -> None:
    """All parts of a window, in the order in which they are shown. What is shown at will has its box in `choices`."""
    client, model = window.client, window.watched.arm.model
    with client.atomic():
        window.parts.extend(scenery(client.scene, model))
        _look(window)
        window.tick(window.wall())
    client.flush()  # the robot is seen before there are panels, which a page takes longer to make
    if said := all_of(model).missing:
        window.tell(said)
    gui = client.gui
    gui.configure_theme(show_logo=False, show_share_button=False, brand_color=ORANGE)
    gui.set_panel_label(title)
    choices = gui.add_panel()
    window.parts.append(Edges(window))
    bar = PlaybackBar(window)
    window.parts.append(bar)
    with choices.add_tab("Show"):
        at_will = AtWill(window)
        window.parts.append(Plots(window, bar))
    choices.float(x=-EDGE, y=EDGE, width=CHOICES)
    choices.minimize()
    if window.robot is not None:
        panel = Panel(window)
        at_will.explain(panel.front_end)
        window.parts += panel.parts
        window.closing.append(panel.close)
        window.type = panel.front_end.type
        window.parts.append(DelayPanel(window, window.robot))


def _look(window: RobotWindow) -> None:
    """So that all of the robot is seen, above the bar."""
    camera, base = window.client.camera, window.watched.timeline[-1].motion.frames.base
    covers = SHEET if window.width < PHONE else HEIGHT + EDGE
    hidden = min(covers / window.height, 0.5)
    seen = camera_for(window.watched.arm.model, window.width / window.height / (1.0 - hidden), base)
    eye, aim = np.array(seen.position), np.array(seen.look_at)
    away = (eye - aim) / (1.0 - hidden)
    lower = np.array((0.0, 0.0, hidden * np.linalg.norm(away) * tan(0.5 * FIELD)))
    camera.fov = FIELD
    camera.position, camera.look_at = aim + away - lower, aim - lower
