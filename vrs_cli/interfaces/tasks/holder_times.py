"""The times of one holder, perhaps behind a line with delays, in those of the robot. Pure.

The robot has one clock. What is commanded takes effect from the clock's time at arrival on, t_c = t_iss + D_f, whatever
is said about it: nothing before t_c changes. When it was issued is what its sender claims, as far as that can be true.

A holder may have a clock that is ahead of the robot's by an offset D. With D = -D_f a command for its present is never
late: that clock is as far behind as commands take to arrive. (Who watches has D = D_b, or looks further ahead:
`Subscribe.ahead`.)
"""

from __future__ import annotations

from msgspec import Struct

from vrs_cli.values.acts import Go
from vrs_cli.values.commands import Move, Stamp

USUAL_ALLOWED = 10.0  # [s] that a command may have been on its way


class HolderTimes(Struct, frozen=True):
    """Corrections of the times that a holder gives [s]. `offset`: D. `allowed`: a command was on its way no longer than
    this, whatever its sender says.
    """

    offset: float = 0.0
    allowed: float = USUAL_ALLOWED

    def issue_time(self, claim: float | None, arrival: float) -> float:
        """Return when a command was issued, by the robot's clock: as claimed, within [arrival - allowed, arrival]."""
        if claim is None or claim != claim:
            return arrival
        return min(max(claim, arrival - self.allowed), arrival)

    def robot_time(self, t: float) -> float:
        """Convert a time in a command (MOVE ... AT t) to the robot's clock [s]."""
        return t - self.offset


THE_ROBOTS = HolderTimes()


def move_of(act: Go, times: HolderTimes) -> Move:
    """Return the motion of an act, with its times by the robot's clock."""
    stamp = None if act.executed is None else Stamp(times.robot_time(act.executed))
    return Move(act.goal.target, act.straight, speed=act.speed, stamp=stamp, text=act.text)
