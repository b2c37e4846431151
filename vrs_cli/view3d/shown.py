"""What a window shows in one moment, and what shows it."""

from __future__ import annotations

from typing import NamedTuple, Protocol

from vrs_cli.interfaces.roles.preview import Previewed
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.acts import Surveyed
from vrs_cli.values.motion import Frames
from vrs_cli.values.results import Position


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
