"""Messages between a server, the client that is a robot's body, and those who look at what the body measures.

Numbers of reports count all reports of one body from 0. Times are those of the robot's clock [s].
"""

from __future__ import annotations

from vrs_cli.values.measured import BodyMode, BodySeen, DivergenceAlarm
from vrs_cli.wire.messages import ClientMessage, Numbered, Request, Result, ServerMessage
from vrs_cli.wire.records import Count, Length, Number, Time
from vrs_cli.wire.report_rows import ReportRows

# --- from the client ------------------------------------------------------------------------------------------------


class Embody(Request, frozen=True):
    """Be the robot's body from now on; with `held` false, be it no longer. `embodied` answers. One client at a time is
    the body. `first`: the number of the oldest report that the client can still send; `rate`: how many reports it will
    send [1/s].
    """

    held: bool = True
    first: Count = 0
    rate: Length = 0.0


class Measured(ClientMessage, ReportRows, frozen=True, kw_only=True):
    """Reports of the body, at most 2,000, with times that rise. `first`: the number of the first one; the others have
    the numbers after it. `sent`: when it sent this, by the clock that `times` are of [s]. `round_trip`: the shortest
    D_f + D_b that it has measured [s]. A refusal is told once a second.
    """

    first: Count
    sent: Number
    round_trip: Length = 0.0


class MeasuredWindow(Request, frozen=True):
    """Ask for what was measured from `begin` to `end` [s]; absent: to the last report. `shownmeasured` answers."""

    begin: Time
    end: Time | None = None


# --- from the server ------------------------------------------------------------------------------------------------


class Embodied(Result, frozen=True):
    """The answer to `embody`. `next`: the number of the first report that the server has not. `mode`, `at`: as in
    `bodyorder`.
    """

    next: Count = 0
    mode: BodyMode = BodyMode.FOLLOWS
    at: float = 0.0


class BodyOrder(Numbered, frozen=True):
    """To the body: from the time `at` on follow the timeline, or hold still."""

    mode: BodyMode
    at: float


class BodyReleased(Numbered, frozen=True):
    """To a client that was the body: it is the body no longer."""


class BodyStatus(ServerMessage, frozen=True):
    """The body of the robot, absent if there is none; `unknown`: nothing was measured since that time [s]. Sent to all
    when something of it changes, counts and clock at most once a second.
    """

    body: BodySeen | None = None
    unknown: float | None = None


class Measurements(ServerMessage, ReportRows, frozen=True, kw_only=True):
    """What was measured, for subscribers, in the order in which it came. `first` counts the reports that were told
    since the robot was started: if it is not the next, this client was too slow, and `measuredwindow` asks for what is
    missing.
    """

    first: Count


class ShownMeasured(Result, frozen=True):
    """The answer to `measuredwindow`. `told`: the reports up to this number of `measurements` are in it. `goes_on`: the
    end was too far for one message; ask again from the last time on.
    """

    parts: tuple[ReportRows, ...] = ()
    told: Count = 0
    goes_on: bool = False


class Alarm(Numbered, frozen=True):
    """The measured robot differs from the timeline."""

    alarm: DivergenceAlarm


OF_BODY = Embody | Measured | MeasuredWindow
