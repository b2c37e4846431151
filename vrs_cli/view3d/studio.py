"""A scene that nobody drives: a trajectory with its arm, path and caption, to be recorded or photographed."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager

import rich
import viser
from viser import SceneApi

from vrs_cli.engine.position import position_at
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.view3d.paths import USUAL, Around
from vrs_cli.view3d.scenery import scenery
from vrs_cli.view3d.shown import Shown, ShownPart
from vrs_cli.view3d.stage import backdrop

MOST_SEGMENTS = 400  # whose way is drawn as usual: a recording has all of it anew for each of them, 30 MB for so many
NEAR = Around(before=5.0, after=5.0, step=5.0)  # of more segments
HOST = "127.0.0.1"


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
