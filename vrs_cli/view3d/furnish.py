"""What stands in a window: the scene, and the panels."""

from __future__ import annotations

from vrs_cli.view3d.figure import Figure
from vrs_cli.view3d.shown import Shown
from vrs_cli.view3d.window import Window


class Arm:
    """The robot where it is."""

    def __init__(self, figure: Figure) -> None:
        self._figure = figure

    def show(self, shown: Shown) -> None:
        self._figure.pose(shown.position.joints, shown.position.hand, shown.frames.base)


def furnish(window: Window, title: str) -> None:
    """All parts of a window."""
    client = window.client
    client.gui.configure_theme(show_logo=False, show_share_button=False, brand_color=(222, 120, 40))
    client.gui.set_panel_label(title)
    client.scene.set_up_direction("+z")
    client.scene.configure_environment_map(None)
    client.scene.add_grid("/floor", width=3.0, height=3.0, cell_size=0.1, section_size=0.5)
    window.parts.append(Arm(Figure(client.scene, "/robot", window.watched.arm.model)))
