"""The body of a served robot: reports come in from one client, and go out to all who look. In the thread of the
connections.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import islice
from math import inf

from vrs_cli.errors import IllegalValue, LimitReached, VrsError
from vrs_cli.interfaces.station.body import ClockSeen, RobotBody
from vrs_cli.net.body_messages import BodyStatus, Embodied, Embody, Measured, MeasuredWindow, ShownMeasured
from vrs_cli.net.broadcast import Broadcast
from vrs_cli.net.limits import Bucket
from vrs_cli.net.timesync import OneWay
from vrs_cli.wire.records import RecordError
from vrs_cli.wire.report_rows import MAX_REPORTS, ReportRows, columns_of, reports_of, row_parts

MAX_RATE, MAX_AT_ONCE = 2000.0, 100_000.0  # reports a second; more at once after a cut
REFUSED_EVERY = 1.0  # [s] between two refusals of reports
STATUS_EVERY = 1.0  # [s] between two messages of counts and of the clock
DELAY_SHARE = 1.0 / 16.0  # of a new delay in the mean


class ServedBody:
    """Gives the messages of clients to the `body` of a robot, and what the body measures to those who look."""

    def __init__(self, body: RobotBody, broadcast: Broadcast, wall: Callable[[], float]) -> None:
        self.body, self._broadcast, self._wall = body, broadcast, wall
        self._clock, self._budget = OneWay(), Bucket(MAX_RATE, MAX_AT_ONCE, wall())
        self._refused_at = self._told_at = -inf
        self._told = BodyStatus()

    # --- what a client asks ---

    def embody(self, name: str, message: Embody) -> Embodied:
        """Make a client the body, or take that from it. Raises RequestRefused if another one is the body."""
        body = self.body
        if not message.held:
            body.leave(name)
            return Embodied(message.id, message.first)
        if body.name != name:
            self._clock = OneWay()
        next = body.embody(name, message.first)
        return Embodied(message.id, next, body.order, body.ordered_at)

    def take(self, name: str, message: Measured) -> None:
        """Take reports of a client. Raises what is wrong with them, once a second."""
        try:
            came = self.body.now()
            self.body.check_is(name)
            if not self._budget.left(self._wall()) >= 0.0:
                raise LimitReached(f"more than {MAX_RATE:g} reports a second", "send fewer, or wait")
            self._budget.spend(len(message.times), self._wall())
            try:
                reports = reports_of(message, self.body.record.joint_count)
            except RecordError as wrong:
                raise IllegalValue(f"reports: {wrong}") from None
            self.body.take(reports, message.first, name)
            self._clock.heard(message.sent, came, message.round_trip)
            self._note_clock(came - reports[-1].t)
        except VrsError:
            wall = self._wall()
            if wall >= self._refused_at + REFUSED_EVERY:
                self._refused_at = wall
                raise

    def _note_clock(self, age: float) -> None:
        known, before = self._clock.estimate, self.body.clock
        assert known is not None, "it has heard of the clock"
        delay = age if before == ClockSeen() else before.delay + (age - before.delay) * DELAY_SHARE
        self.body.clock = ClockSeen(known.offset, known.drift, delay)

    def window(self, message: MeasuredWindow) -> ShownMeasured:
        """Answer what was measured in a stretch of time, as much as fits into one message."""
        told = self._broadcast.measured.count
        end = inf if message.end is None else message.end
        found = list(islice(self.body.record.seen.between(message.begin, end), MAX_REPORTS + 1))
        parts = tuple(ReportRows(**columns_of(part)) for part in row_parts(found[:MAX_REPORTS]))
        return ShownMeasured(message.id, parts, told, goes_on=len(found) > MAX_REPORTS)

    # --- what all are told ---

    def tick(self, *, changed: bool = False) -> None:
        """Tell all what is known of the body: at once if it has `changed`, else once a second."""
        wall, body = self._wall(), self.body
        unknown = body.unknown_since
        changed = changed or (unknown is None) != (self._told.unknown is None)
        if not changed and wall < self._told_at + STATUS_EVERY:
            return
        self._told_at = wall
        status = BodyStatus(body.seen, unknown)
        if status != self._told:
            self._told = status
            self._broadcast.announce(status)
