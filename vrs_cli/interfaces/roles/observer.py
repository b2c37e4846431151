"""The observer: where a robot is, at any time. It never waits for those who move the robot."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from vrs_cli.engine.position import PositionArrays, Watched, position_at, positions_at
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.motion import Frames
from vrs_cli.values.results import Position

if TYPE_CHECKING:
    from vrs_cli.kinematics.arrays import Floats


class RecordedRobot(NamedTuple):
    """A saved trajectory, to be watched like a robot: all of it has happened."""

    arm: RobotArm
    timeline: Timeline

    @property
    def now(self) -> float:
        return self.timeline.end


class Observer:
    """Asks g of the timeline as it is now. Metres, radians, seconds."""

    def __init__(self, watched: Watched) -> None:
        self.watched = watched

    @property
    def arm(self) -> RobotArm:
        return self.watched.arm

    @property
    def timeline(self) -> Timeline:
        return self.watched.timeline

    @property
    def now(self) -> float:
        return self.watched.now

    @property
    def frames(self) -> Frames:
        """BASE and TOOL in force now."""
        return self.timeline.locate(self.now)[0].motion.frames

    def at(self, t: float | None = None) -> Position:
        """Return where the robot is at t [s], past or future, or now."""
        return position_at(self.arm, self.timeline, self.now if t is None else t)

    def over(self, times: Floats) -> PositionArrays:
        """Return where the robot is at times (N,) [s]."""
        return positions_at(self.arm, self.timeline, times)
