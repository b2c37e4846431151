"""What a robot will do with the commands that are on their way to it, in the units of whoever asks."""

from __future__ import annotations

from msgspec import Struct
from numpy.typing import ArrayLike

from vrs_cli.api.numbers import Units
from vrs_cli.api.posture import Posture
from vrs_cli.interfaces.roles.observer import Observer, RecordedRobot
from vrs_cli.interfaces.roles.preview import Expected, Previewed
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.numbers import count


class Preview(Struct, frozen=True, eq=False):
    """As it was known when it was asked for: a value, which later commands do not change. Times are seconds.

    `timeline`: with all that is on its way; from `unconfirmed` on it is not what the robot has said (infinity: all of
    it is). `commands`: what is expected of each that is on its way, in the order of sending: `text`, `issued`, `begin`
    (from when on it changes the timeline, or None), `refused` (why the robot will not do it, or None), `planned`.
    `arrives`: the robot's clock when a command of now comes to it; `round_trip`: D_f + D_b, as measured. `flagged`:
    pairs, the times of which something wrong was seen here, as a command was not known yet.
    """

    arm: RobotArm
    units: Units
    timeline: Timeline
    arrives: float
    unconfirmed: float
    commands: tuple[Expected, ...]
    round_trip: float
    flagged: tuple[tuple[float, float], ...]

    @classmethod
    def of(cls, it: Previewed, arm: RobotArm, units: Units) -> Preview:
        return cls(arm, units, it.timeline, it.arrives, it.unconfirmed, it.expected, it.round_trip, it.flagged)

    def where(self, t: ArrayLike | None = None) -> Posture:
        """Where the robot will be at a time [s], or at times (N,); where none is given, when a command of now comes to
        it.
        """
        observer = Observer(RecordedRobot(self.arm, self.timeline))
        return Posture.seen(observer, self.arrives if t is None else t, self.arm.model, self.units)

    def __repr__(self) -> str:
        end, under_way = self.timeline.end, count(len(self.commands), "command")
        until = "all" if self.unconfirmed > end else f"to {self.unconfirmed:.3f} s"
        return f"<Preview to {end:.3f} s: confirmed {until}, {under_way} on the way>"
