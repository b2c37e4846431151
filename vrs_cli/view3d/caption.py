"""What moment a scene shows, in the scene itself: a recording has no panel that could tell it."""

from __future__ import annotations

from math import floor

from viser import SceneApi

from vrs_cli.kinematics.model import RobotModel, levers
from vrs_cli.view3d.shown import Shown

TENTHS = 10  # of a second: finer figures are not read while they change


class Caption:
    """The time and the command that moves the robot, above the arm."""

    def __init__(self, scene: SceneApi, model: RobotModel) -> None:
        (_, _, foot), reaches = levers(model)
        height = foot + 1.05 * reaches[0]
        self._label = scene.add_label(
            "/caption", "", anchor="bottom-center", position=(0.0, 0.0, height), font_screen_scale=1.5
        )

    def show(self, shown: Shown) -> None:
        text = caption(shown)
        if text != self._label.text:
            self._label.text = text


def caption(shown: Shown) -> str:
    """`3.2 s  MOVES part`, the command only while it moves the robot."""
    t = floor(shown.t * TENTHS + 1e-6) / TENTHS
    command = shown.position.text if shown.position.moving else ""
    return f"{t:.1f} s  {command}".rstrip()
