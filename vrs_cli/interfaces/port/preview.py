"""A preview of a robot, as its user knows it: commands may still be on their way."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator
from math import inf

from msgspec import Struct

from vrs_cli.errors import VrsError
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.numbers import seconds

FRESH = 3.0  # [s] that a flag is told of after the times that it is about


class Expected(Struct, frozen=True):
    """The expected effect of a command that is on its way, `issued` at that time of the robot's clock [s]: from `begin`
    on it changes the timeline [s] (None: it does not), or `refused` says why the robot will not do it. `planned`: what
    it changes is seen already; else it may change all from its arrival on. `text`: as it was given.
    """

    id: int
    text: str
    issued: float
    begin: float | None = None
    refused: VrsError | None = None
    planned: bool = True


class Previewed(Struct, frozen=True):
    """A timeline with all that is under way, as it is known now. `now`: the robot's clock; `heard`: that clock t_c as
    it is heard, D_b ago: by then all has happened as the timeline says; `arrives`: when a command of now comes to the
    robot; `shown`: the time that a viewer is shown, which `predicts` where that is not the present [s].

    From `unconfirmed` on [s] it is not what the robot has said (infinity: all of it is), as commands are on their way
    (`expected`, in the order of sending), or it is not heard any more (`away`). `round_trip`: D_f + D_b [s]. `flagged`:
    the times of which something wrong was shown, before a command was known that changed it, in order.
    """

    timeline: Timeline
    now: float
    heard: float
    arrives: float
    shown: float
    predicts: bool = False
    unconfirmed: float = inf
    expected: tuple[Expected, ...] = ()
    away: bool = False
    round_trip: float = 0.0
    flagged: tuple[tuple[float, float], ...] = ()

    @classmethod
    def of(cls, timeline: Timeline, now: float) -> Previewed:
        """Preview a robot of this process: nothing is on its way."""
        return cls(timeline, now, now, now, now)

    @property
    def reported(self) -> float:
        """The time at which the robot stands in the picture [s]: as it is heard where it is predicted too."""
        return self.heard if self.predicts else self.now

    def lines(self, t: float) -> Iterator[str]:
        """Yield the notes about time t [s]."""
        if self.predicts:
            yield f"{seconds(self.shown - self.heard)} ahead of what is heard, D_f + D_b is {seconds(self.round_trip)}"
        before = bisect_right(self.flagged, (t, inf))
        if before and t < self.flagged[before - 1][1] + FRESH:
            begin, end = self.flagged[before - 1]
            yield f"flagged: {begin:.3f} to {seconds(end)} was shown before a command changed it"
        if t >= self.unconfirmed:
            yield self.doubt

    @property
    def doubt(self) -> str:
        """The part that is not confirmed, and the reason; empty where all is confirmed."""
        return "" if self.unconfirmed == inf else f"unconfirmed from {seconds(self.unconfirmed)} on: {self._under_way}"

    @property
    def _under_way(self) -> str:
        return "the robot is not heard" if self.away else ", ".join(it.text or "a command" for it in self.expected)
