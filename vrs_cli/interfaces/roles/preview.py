"""What a robot will do with all that was asked of it, as whoever asked knows it: commands may be on their way still."""

from __future__ import annotations

from math import inf

from msgspec import Struct

from vrs_cli.errors import VrsError
from vrs_cli.trajectory.timeline import Timeline


class Expected(Struct, frozen=True):
    """What is expected of a command that is on its way, `issued` at that time of the robot's clock [s]: from `begin` on
    it changes the timeline [s] (None: it does not), or `refused` says why the robot will not do it. `planned`: what it
    changes is seen already; else it may change all from its arrival on. `text`: as it was given.
    """

    id: int
    text: str
    issued: float
    begin: float | None = None
    refused: VrsError | None = None
    planned: bool = True


class Previewed(Struct, frozen=True):
    """A timeline with all that is under way: from `unconfirmed` on [s] it is not what the robot has said (infinity: all
    of it is). `expected`: of each command, in the order of sending. `arrives`: the robot's clock when a command of now
    comes to it; `round_trip`: D_f + D_b, `flagged`: times of which something wrong was seen, as a command was not known
    yet [s].
    """

    timeline: Timeline
    arrives: float
    unconfirmed: float = inf
    expected: tuple[Expected, ...] = ()
    round_trip: float = 0.0
    flagged: tuple[tuple[float, float], ...] = ()
