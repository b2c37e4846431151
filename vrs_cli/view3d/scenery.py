"""What is seen of a robot wherever it is shown: in a browser that drives it, on a page, on a photograph."""

from __future__ import annotations

from viser import SceneApi

from vrs_cli.kinematics.model import RobotModel
from vrs_cli.view3d.figure import Figure
from vrs_cli.view3d.paths import USUAL, Around, Path
from vrs_cli.view3d.shown import Shown, ShownPart
from vrs_cli.view3d.stage import Stage


def scenery(scene: SceneApi, model: RobotModel, around: Around = USUAL) -> list[ShownPart]:
    """All parts of the scene itself, with the way of the tool so far `around` the present."""
    return [ArmScene(scene, model), Path(scene, model, around=around)]


class ArmScene:
    """The robot where it is, with what is around it."""

    def __init__(self, scene: SceneApi, model: RobotModel) -> None:
        self._stage, self._figure = Stage(scene, model), Figure(scene, "/robot", model)

    def show(self, shown: Shown) -> None:
        base = shown.frames.base
        self._stage.pose(shown.position.T_world_tool, base)
        self._figure.pose(shown.position.joints, shown.position.hand, base)
