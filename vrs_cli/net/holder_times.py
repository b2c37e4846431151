"""The times of one holder behind a line with delays, in those of the robot. Pure.

The robot has one clock. What is commanded takes effect from the clock's time at arrival on, t_c = t_iss + D_f, whatever
is said about it: nothing before t_c changes. When it was issued is what its sender claims, as far as that can be.

A holder may have a clock that is ahead of the robot's by an offset D. With D = -D_f a command for `now` is never late:
its time passes as slowly as commands arrive. With D = +D_b the position that is sent is that of the instant at which it
is seen.
"""

from __future__ import annotations

from msgspec import Struct

USUAL_ALLOWED = 10.0  # [s] that a command may have been on its way


class HolderTimes(Struct, frozen=True):
    """What a connection says of times [s]. `command_offset`, `look_offset`: D of who commands, and of who watches.
    `allowed`: a command was on its way no longer than this, whatever its sender says.
    """

    command_offset: float = 0.0
    look_offset: float = 0.0
    allowed: float = USUAL_ALLOWED

    @classmethod
    def behind(cls, forward: float, backward: float, allowed: float = USUAL_ALLOWED) -> HolderTimes:
        """Those that make up for the delays D_f and D_b of a line."""
        return cls(-forward, backward, allowed)

    def issued(self, claim: float | None, arrival: float) -> float:
        """When a command was issued, by the robot's clock: as claimed, within [arrival - allowed, arrival]."""
        if claim is None or claim != claim:
            return arrival
        return min(max(claim, arrival - self.allowed), arrival)

    def commanded(self, t: float) -> float:
        """The robot's time of a time in a command: MOVE ... AT t."""
        return t - self.command_offset

    def looked(self, now: float) -> float:
        """The time of the timeline that is looked at when the robot's clock is at `now`."""
        return now + self.look_offset
