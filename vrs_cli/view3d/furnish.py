"""Fill a window with the scene and the panels."""

from __future__ import annotations

from functools import partial
from math import tan

import numpy as np

from vrs_cli.view3d.bar import PlaybackBar
from vrs_cli.view3d.figure import all_of
from vrs_cli.view3d.ghosts import BranchGhosts, DelayPanel, GoalGhost
from vrs_cli.view3d.panel import Panel
from vrs_cli.view3d.parts import Shown
from vrs_cli.view3d.paths import Path
from vrs_cli.view3d.places import PlacesView, Reasons, explain_refusal
from vrs_cli.view3d.plots import Plots
from vrs_cli.view3d.reach import LimitsView, ReachView
from vrs_cli.view3d.stage import FIELD, camera_for
from vrs_cli.view3d.studio import scenery
from vrs_cli.view3d.window import RobotWindow

ORANGE = (222, 120, 40)  # of what can be pressed
EDGE = 12.0  # [px] from the edges of the picture
HEIGHT = 166.0  # [px] of the bar of time
SHEET = 300.0  # [px] that viser's sheet has at the foot of a phone, when nothing else in it is open
PHONE = 800.0  # [px] of the width of a page, where that sheet takes the place of panels
CHOICES = 230.0  # [px] the width of the panel of what is to be shown


def _add_choices(window: RobotWindow) -> Reasons:
    """Add the parts that are shown as somebody wants it, with their boxes in the panel that is open now. What is
    returned shows why motions are refused."""
    scene, arm, robot = window.client.scene, window.watched.arm, window.robot

    def box(part: object, shows: str, label: str, hint: str, *, at_first: bool = False) -> None:
        """A box that sets an attribute of a part."""
        handle = window.client.gui.add_checkbox(label, at_first, hint=hint)
        handle.on_update(window.doing(lambda: setattr(part, shows, handle.value)))

    path = next(part for part in window.parts if isinstance(part, Path))
    goal, limits = GoalGhost(scene, arm.model), LimitsView(scene, "/robot", arm.model)
    reach, reasons = ReachView(scene, "/robot", arm), Reasons(scene, arm.model)
    window.parts += (goal, limits, reach, reasons)
    box(path, "visible", "Path", "Past blue, planned orange, lighter where motions blend", at_first=True)
    box(path, "commands", "Commands", "The text of each command where its motion begins")
    box(goal, "visible", "Goal", "The arm as it will stand when the motion ends", at_first=True)
    box(limits, "visible", "Joint ranges", "How far each joint goes, and where it is")
    if reach.known:
        box(reach, "visible", "Reach", "How far the tool gets in this configuration")
    if robot is not None:
        places, branches = PlacesView(scene, arm.model), BranchGhosts(scene, arm, robot, window.again)
        window.parts += (places, branches)
        box(places, "visible", "Places", "The locations that have names", at_first=True)
        box(branches, "visible", "Branches", "The arm as other branches move it", at_first=True)
    return reasons


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
    """Add all parts of a window, in the order in which they are shown. `choices` has the boxes of `_add_choices`."""
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
        reasons = _add_choices(window)
        window.parts.append(Plots(window, bar))
    choices.float(x=-EDGE, y=EDGE, width=CHOICES)
    choices.minimize()
    if window.robot is not None:
        panel = Panel(window)
        panel.front_end.explained = reasons.explain  # what is typed, and refused, is shown with its reason
        panel.front_end.refused = partial(explain_refusal, window.robot, reasons.explain)
        window.parts += panel.parts
        window.closing.append(panel.close)
        window.type = panel.front_end.type
        window.parts.append(DelayPanel(window, window.robot))


def _look(window: RobotWindow) -> None:
    """Aim the camera so that all of the robot is seen above the bar."""
    camera, base = window.client.camera, window.watched.timeline[-1].motion.frames.base
    covers = SHEET if window.width < PHONE else HEIGHT + EDGE
    hidden = min(covers / window.height, 0.5)
    seen = camera_for(window.watched.arm.model, window.width / window.height / (1.0 - hidden), base)
    eye, aim = np.array(seen.position), np.array(seen.look_at)
    away = (eye - aim) / (1.0 - hidden)
    lower = np.array((0.0, 0.0, hidden * np.linalg.norm(away) * tan(0.5 * FIELD)))
    camera.fov = FIELD
    camera.position, camera.look_at = aim + away - lower, aim - lower
