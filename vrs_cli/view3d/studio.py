"""The parts of each scene, and a scene that nobody drives: a trajectory to be recorded or photographed."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from math import floor

import rich
import viser
from viser import SceneApi

from vrs_cli.engine.position import position_at
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.model import RobotModel, levers
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.view3d.figure import Figure
from vrs_cli.view3d.paths import USUAL, Around, Path
from vrs_cli.view3d.placing import put
from vrs_cli.view3d.shown import Shown, ShownPart
from vrs_cli.view3d.stage import Stage, backdrop

MOST_SEGMENTS = 400  # whose way is drawn as usual: a recording has all of it anew for each of them, 30 MB for so many
NEAR = Around(before=5.0, after=5.0, step=5.0)  # of more segments
HOST = "127.0.0.1"
TENTHS = 10  # of a second in a caption: finer figures are not read while they change


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


class Studio:
    """All that is seen of a timeline, one moment at a time; with `parts` that only some pictures have. Of the way
    of the tool it is less where there are many segments.
    """

    def __init__(self, scene: SceneApi, arm: RobotArm, timeline: Timeline, *parts: ShownPart) -> None:
        self._arm, self._timeline = arm, timeline
        backdrop(scene)
        seen = scenery(scene, arm.model, NEAR if len(timeline) > MOST_SEGMENTS else USUAL)
        self._parts: tuple[ShownPart, ...] = (*seen, *parts)

    def show(self, t: float) -> Shown:
        """The moment t [s]."""
        shown = Shown(self._arm, self._timeline, t, position_at(self._arm, self._timeline, t), t)
        for part in self._parts:
            part.show(shown)
        return shown


@contextmanager
def server() -> Iterator[viser.ViserServer]:
    """A viser on a free port of this machine, for as long as something is recorded or photographed."""
    with _hushed():
        made = viser.ViserServer(host=HOST, port=0, verbose=False)
        try:
            yield made
        finally:
            made.stop()


@contextmanager
def _hushed() -> Iterator[None]:
    """viser tells its address on standard output, which may be where a page goes; and a browser opens a connection in
    advance that it may not need, which the library of its server logs as a fault.
    """
    console, log = rich.get_console(), logging.getLogger("websockets.server")
    quiet, disabled = console.quiet, log.disabled
    console.quiet = log.disabled = True
    try:
        yield
    finally:
        console.quiet, log.disabled = quiet, disabled


class Caption:
    """The time and the command that moves the robot, above the arm."""

    def __init__(self, scene: SceneApi, model: RobotModel) -> None:
        (_, _, foot), reaches = levers(model)
        height = foot + 1.05 * reaches[0]
        self._label = scene.add_label(
            "/caption", "", anchor="bottom-center", position=(0.0, 0.0, height), font_screen_scale=1.5
        )

    def show(self, shown: Shown) -> None:
        put(self._label, text=caption(shown))


def caption(shown: Shown) -> str:
    """`3.2 s  MOVES part`, the command only while it moves the robot."""
    t = floor(shown.t * TENTHS + 1e-6) / TENTHS
    command = shown.position.text if shown.position.moving else ""
    return f"{t:.1f} s  {command}".rstrip()
