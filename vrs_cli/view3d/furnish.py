"""What stands in a window: the scene, and the panels."""

from __future__ import annotations

from math import tan

import numpy as np

from vrs_cli.view3d.bar import Bar
from vrs_cli.view3d.figure import Figure
from vrs_cli.view3d.shown import Shown
from vrs_cli.view3d.stage import FIELD, Stage, camera_for
from vrs_cli.view3d.window import Window

ORANGE = (222, 120, 40)  # of what can be pressed
PANEL = 340.0  # [px] the width of the panels
EDGE, HEIGHT = 12.0, 152.0  # [px] the bar of time: from the edges of the picture, and high


class Scene:
    """The robot where it is, and what is around it."""

    def __init__(self, window: Window) -> None:
        scene, model = window.client.scene, window.watched.arm.model
        self._figure, self._stage = Figure(scene, "/robot", model), Stage(scene, model)

    def show(self, shown: Shown) -> None:
        position, base = shown.position, shown.frames.base
        self._figure.pose(position.joints, position.hand, base)
        self._stage.pose(position.T_world_tool, base)


def furnish(window: Window, title: str) -> None:
    """All parts of a window, in the order in which they are shown."""
    gui = window.client.gui
    gui.configure_theme(show_logo=False, show_share_button=False, brand_color=ORANGE)
    gui.set_panel_label(title)
    gui.main_panel.dock_left()
    gui.main_panel.set_width(PANEL)
    window.parts.append(Scene(window))
    _look(window)
    window.parts.append(_bar(window))


def _look(window: Window) -> None:
    """So that all of the robot is seen, above the bar."""
    camera, base = window.client.camera, window.watched.timeline[-1].motion.frames.base
    hidden = min((HEIGHT + EDGE) / camera.image_height, 0.5)
    seen = camera_for(window.watched.arm.model, camera.aspect / (1.0 - hidden), base)
    eye, aim = np.array(seen.position), np.array(seen.look_at)
    away = (eye - aim) / (1.0 - hidden)
    lower = np.array((0.0, 0.0, hidden * np.linalg.norm(away) * tan(0.5 * FIELD)))
    camera.fov = FIELD
    camera.position, camera.look_at = aim + away - lower, aim - lower


def _bar(window: Window) -> Bar:
    """Along the lower edge of the picture."""
    panel = window.client.gui.add_panel()
    with panel.add_tab("Time"):
        bar = Bar(window)
    panel.float(x=EDGE, y=-EDGE, width=max(window.width - PANEL - 2.0 * EDGE, PANEL), height=HEIGHT)
    return bar
