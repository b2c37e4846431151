"""The body of one robot: which client is it, what it has reported, and what it was ordered. Any thread may call any
method.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Sequence
from threading import Condition

from msgspec import Struct
from msgspec.structs import replace

from vrs_cli.errors import IllegalValue, RequestRefused
from vrs_cli.trajectory.measured import MeasuredRecord
from vrs_cli.values.measured import (
    BodyMode,
    BodySeen,
    DivergenceAlarm,
    Report,
    ReportCounts,
    ResyncReport,
)
from vrs_cli.values.replies import Message

SILENT = 3.0  # [s] without a report until the robot's joints count as unknown
AHEAD = 10.0  # [s] that the time of a report may be ahead of the robot's clock: no clock is wrong by more
PAST = 3600.0  # [s] that a report may be old
MAX_GAPS = 100  # stretches of missing numbers that are remembered
RATE_WINDOW = 5.0  # [s] of arrivals that tell the rate of reports
STANDS_FOR = 0.05  # [s] without motion after which a body that holds counts as standing
STILL = 1e-3  # [rad, m] and less is no motion, but noise


def check_time(t: float, now: float) -> None:
    """Check the time of a report [s] at this time of the robot's clock. Raises IllegalValue."""
    if not now - PAST <= t <= now + AHEAD:
        what = f"a report of {t:g} s, when the robot's clock is at {now:.3f} s"
        raise IllegalValue(what, f"at most {AHEAD:g} s later, or {PAST:g} s earlier", value=t)


class BodyChange(Struct, frozen=True):
    """The client `name` is the body (empty: none) where `before` was it, and its order from `at` [s] on."""

    name: str
    before: str
    order: BodyMode
    at: float


BodyNews = BodyChange | DivergenceAlarm | ResyncReport | Message
"""What is told of a body. A message is of the robot itself: what it could not do for its body."""


class ClockSeen(Struct, frozen=True):
    """The clock of a body: `offset` ahead of the robot's [s], and `drift` more with every second; `delay`: how old its
    reports are when they come [s].
    """

    offset: float = 0.0
    drift: float = 0.0
    delay: float = 0.0


class ReportNumbers:
    """Which numbers of reports have come. `next`: the one after the highest; `lost`: how many before it are missing."""

    def __init__(self, next: int) -> None:
        self.next, self.lost = next, 0
        self._gaps: deque[range] = deque(maxlen=MAX_GAPS)

    def new(self, first: int, reports: Sequence[Report]) -> Sequence[Report]:
        """Return the reports, numbered from `first`, whose numbers have not come before."""
        if first >= self.next:
            return reports
        return [one for number, one in enumerate(reports, first) if number >= self.next or self._gap(number)]

    def note(self, first: int, count: int) -> None:
        """Note that so many reports have come, numbered from `first`."""
        if first > self.next:
            self._gaps.append(range(self.next, first))
            self.lost += first - self.next
        for number in range(first, min(first + count, self.next)):
            gap = self._gap(number)
            if gap is not None:
                self._gaps.remove(gap)
                self._gaps.extend(part for part in (range(gap.start, number), range(number + 1, gap.stop)) if part)
                self.lost -= 1
        self.next = max(self.next, first + count)

    def _gap(self, number: int) -> range | None:
        """Return the stretch of missing numbers in which a number is."""
        return next((gap for gap in self._gaps if number in gap), None)


class RobotBody:
    """The body of a robot. `record`: all that was measured. `name`: the client that is the body,
    empty if none is; it may report in its own name alone. `order`, since `ordered_at` [s]: what the body is told to do.
    `clock`: what is known of its clock, by whoever measures it.

    `told` are called with each change, each alarm and each RESYNC, in the thread in which that happens;
    `record.listeners`, with the reports that were taken. `now` is the robot's clock [s].
    """

    def __init__(
        self, record: MeasuredRecord, now: Callable[[], float], wall: Callable[[], float] = time.monotonic
    ) -> None:
        self.record, self.now, self._wall = record, now, wall
        self.name = ""
        self.order, self.ordered_at = BodyMode.FOLLOWS, 0.0
        self.clock = ClockSeen()
        self.told: list[Callable[[BodyNews], None]] = []
        self.reporter = ""  # who sent the last report
        self._lock = Condition()
        self._begin(0)

    def _begin(self, first: int) -> None:
        """Count anew, from a report of that number."""
        self._numbers, self._counts = ReportNumbers(first), ReportCounts()
        self._mode = BodyMode.FOLLOWS
        self._last: float | None = None  # the time of the newest report [s]
        self._stood: Report | None = None  # the first report of a body that stands by order or by itself
        self._stands: Report | None = None  # the newest one, if it stands for long enough
        self._arrivals: deque[tuple[float, int]] = deque()  # when reports came, by the wall clock [s], and how many
        self._heard_at: float | None = None

    # --- who is the body ---

    def embody(self, name: str, first: int = 0) -> int:
        """Make a client the body. Return the number of the report that it is to send next; `first` if it was not the
        body before. Raises RequestRefused if another one is.
        """
        with self._lock:
            if self.name not in ("", name):
                raise RequestRefused(f"{self.name} is the body", "it gives that back, or BODY RELEASE takes it away")
            if self.name != name:
                self._begin(first)
                self.clock = ClockSeen()
                self._become(name)
            return self._numbers.next

    def leave(self, name: str) -> bool:
        """Note that a client is the body no longer. Return whether it was."""
        with self._lock:
            if not name or self.name != name:
                return False
            self._become("")
            return True

    def _become(self, name: str) -> None:
        before, self.name = self.name, name
        self._tell_change(before)

    # --- what it reports ---

    def take(self, reports: Sequence[Report], first: int | None = None, name: str = "") -> ReportCounts:
        """Put reports into the record, and return what became of them. The first has the number `first`; without one
        they have the next numbers. Raises RequestRefused from a client that is not the body, and IllegalValue for what
        cannot be joints of this robot or, from a client, times of its clock; then it takes none of them.
        """
        with self._lock:
            self.check_is(name)
            if name:
                now = self.now()
                for one in reports:
                    check_time(one.t, now)
            first = self._numbers.next if first is None else first
            new = self._numbers.new(first, reports)
            found, doubled = self.record.add(new), len(reports) - len(new)
            found = replace(found, received=len(reports), duplicate=found.duplicate + doubled)
            self._numbers.note(first, len(reports))
            self._counts += found
            if new:
                self.reporter = name
                self._note_arrival(new)
                self._note_standing(new)
            return found

    def check_is(self, name: str) -> None:
        """Check that a client is the body. Raises RequestRefused."""
        if name != self.name:
            is_body = f"{self.name} is the body" if self.name else "nobody is the body"
            raise RequestRefused(f"a report of {name or 'this process'}, but {is_body}", "be the body first")

    def _note_arrival(self, reports: Sequence[Report]) -> None:
        newest, wall = max(reports, key=lambda one: one.t), self._wall()
        if self._last is None or newest.t >= self._last:
            self._last, self._mode = newest.t, newest.mode
        self._heard_at = wall
        self._arrivals.append((wall, len(reports)))
        while self._arrivals[0][0] < wall - RATE_WINDOW:
            self._arrivals.popleft()

    def _note_standing(self, reports: Sequence[Report]) -> None:
        for one in reports:
            first = self._stood
            if one.mode is BodyMode.FOLLOWS or one.t < self.ordered_at:
                self._stood = self._stands = None
            elif first is None or any(abs(a - b) > STILL for a, b in zip(one.joints, first.joints, strict=True)):
                self._stood, self._stands = one, None
            elif one.t >= first.t + STANDS_FOR:
                self._stands = one
        self._lock.notify_all()

    def check_reports(self) -> None:
        """Check that somebody reports where the body is, or has just become the body. Raises RequestRefused."""
        last, since = self._last, self.unknown_since
        if last is None and not self.name:
            hint = "vrs body URL starts a body, r.report reports for a robot of this process"
            raise RequestRefused("nothing measures this robot", hint)
        if since is not None and (self.name or self.reporter):
            raise RequestRefused(f"nothing was measured since {since:.3f} s", "wait until the body reports again")

    def standing(self, within: float) -> Report:
        """Wait until the body stands still, by an order or by itself, and return its report of that. A body without a
        client is not waited for: its last report counts. Raises RequestRefused after `within` seconds.
        """
        with self._lock:
            if not self.name and not self.reporter:
                newest = self.record.view
                assert newest.end is not None, "it has reported"
                return next(iter(newest.between(newest.end, newest.end)))
            name = self.name
            self._lock.wait_for(lambda: self._stands is not None or self.name != name, within)
            found = self._stands
            if found is None or self.name != name:
                what = f"{name or 'the body'} was told to hold, and has not reported within {within:g} s that it stands"
                raise RequestRefused(
                    what if self.name == name else f"{name} is the body no longer", "try {RESYNC} again"
                )
            return found

    # --- what it is told ---

    def command(self, order: BodyMode, at: float | None = None) -> None:
        """Order the body to follow the timeline, or to hold still, from a time on; absent: now."""
        with self._lock:
            self.order, self.ordered_at = order, self.now() if at is None else at
            if order is BodyMode.FOLLOWS:
                self._stood = self._stands = None
            self._tell_change(self.name)

    def tell(self, news: BodyNews) -> None:
        """Tell an alarm, what was done about it, or a change of the body."""
        for tell in self.told:
            tell(news)

    def _tell_change(self, before: str) -> None:
        self.tell(BodyChange(self.name, before, self.order, self.ordered_at))

    # --- what is known of it ---

    @property
    def seen(self) -> BodySeen | None:
        """What is known of the body; None if there is none, and nothing was reported."""
        with self._lock:
            if not self.name and self._last is None:
                return None
            counts = replace(self._counts, lost=self._numbers.lost)
            clock = self.clock
            return BodySeen(
                self.name,
                self._mode,
                self.order,
                counts,
                self._last,
                clock.offset,
                clock.drift,
                clock.delay,
                self._rate(),
            )

    def _rate(self) -> float:
        """How many reports come in a second."""
        if len(self._arrivals) < 2 or self._wall() - self._arrivals[-1][0] > SILENT:
            return 0.0
        first, last = self._arrivals[0], self._arrivals[-1]
        return (sum(count for _, count in self._arrivals) - first[1]) / max(last[0] - first[0], 1e-9)

    @property
    def unknown_since(self) -> float | None:
        """Since when nothing was measured [s]; None while reports come, and if none ever came."""
        with self._lock:
            silent = self._heard_at is not None and self._wall() - self._heard_at > SILENT
            return self._last if silent or (self._last is not None and not self.name) else None
