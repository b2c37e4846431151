"""Red paint on what touches: links of the arm, the part in the hand, parts and fixtures of a cell."""

from __future__ import annotations

from importlib.util import find_spec
from math import floor
from typing import TYPE_CHECKING

from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.view3d.figure import Figure
from vrs_cli.view3d.parts import Colour, Shown
from vrs_cli.view3d.scene_bodies import SceneBodies
from vrs_cli.world.world import World

if TYPE_CHECKING:
    from vrs_cli.contacts.checker import Checker

RED = (214, 48, 49)
LASTING = (
    0.1  # [s] what touches at any time of such a stretch is red in all of it: a short contact is seen in a film too
)
MOST = 1000  # stretches that are remembered


class ContactMarks:
    """Paints red what touches around the moment shown. Without MuJoCo nothing is painted."""

    def __init__(self, world: World, figure: Figure, bodies: SceneBodies) -> None:
        self._world, self._figure, self._bodies = world, figure, bodies
        self._off = world.settings.scene.empty or find_spec("mujoco") is None
        self._checker: Checker | None = None
        self._timeline: Timeline | None = None
        self._known: dict[int, set[int]] = {}  # what touches in each stretch
        self._red = set[int]()

    def show(self, shown: Shown) -> None:
        if self._off:
            return
        self._forget(shown.timeline)
        stretch = floor(min(shown.t, shown.timeline.last) / LASTING)  # nothing changes after that
        red = self._known.get(stretch)
        if red is None:
            red = self._known[stretch] = self._touching(shown.timeline, LASTING * stretch)
        for owner in red ^ self._red:
            self._paint(owner, RED if owner in red else None)
        self._red = red

    def _forget(self, timeline: Timeline) -> None:
        """Forget what is not so on this timeline."""
        before, self._timeline = self._timeline, timeline
        if before is not None and before is not timeline:
            since = before.same_until(timeline)
            self._known = {k: red for k, red in self._known.items() if LASTING * (k + 1) < since}
        if len(self._known) > MOST:
            self._known.clear()

    def _touching(self, timeline: Timeline, begin: float) -> set[int]:
        if self._checker is None:
            from vrs_cli.contacts.checker import Checker

            self._checker = Checker(self._world.settings.arm, self._world.settings.scene)
        course = self._world.course(timeline)
        return self._checker.touching(timeline, max(begin, timeline.start), begin + LASTING, course)

    def _paint(self, owner: int, colour: Colour | None) -> None:
        assert self._checker is not None
        if owner < self._checker.floor:
            self._figure.paint(owner, colour)
        elif owner > self._checker.floor:
            self._bodies.paint(self._checker.names[owner], colour)
