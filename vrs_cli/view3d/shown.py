"""What a window shows in one moment, what shows it, and when a costly picture is made again."""

from __future__ import annotations

from collections.abc import Callable
from math import inf
from typing import NamedTuple, Protocol

from vrs_cli.interfaces.port.preview import Previewed
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.acts import Surveyed
from vrs_cli.values.motion import Frames
from vrs_cli.values.results import Position

LEAST = 0.25  # [s] between two pictures
COSTS = 20.0  # times as long as a picture took to be made, no other one is


class Shown(NamedTuple):
    """One moment of a robot: what every part of a scene draws itself by. Metres, radians, seconds.

    `t`: the time that is shown, `position`: g there; `now`: the robot's clock. `surveyed`: what there is beside the
    timeline, None where nobody can be asked. `seen`: of a robot afar, how much of this it has said. `reads`: what is
    read is to be looked at too, which is not in every picture.
    """

    arm: RobotArm
    timeline: Timeline
    t: float
    position: Position
    now: float
    surveyed: Surveyed | None = None
    seen: Previewed | None = None
    reads: bool = True

    @property
    def frames(self) -> Frames:
        """BASE and TOOL in force then."""
        return self.timeline.locate(self.t)[0].motion.frames


class ShownPart(Protocol):
    """Something in a scene or a panel. It remembers what it drew last, and sends nothing where that is still so."""

    def show(self, shown: Shown) -> None: ...


class Redrawing:
    """Decides when a picture is made again that may change all the time. `wall` tells the time of the day [s]."""

    def __init__(self, wall: Callable[[], float]) -> None:
        self._wall = wall
        self._of: object = None
        self._urgent: object = None
        self._due = -inf

    def look(self, of: object, urgent: object, draw: Callable[[], None]) -> None:
        """Draw it if what it shows is another one: later where that is `of`, at once where it is `urgent`."""
        began = self._wall()
        if urgent == self._urgent and (of == self._of or began < self._due):
            return
        self._of, self._urgent = of, urgent
        draw()
        ended = self._wall()
        self._due = ended + max(LEAST, COSTS * (ended - began))
