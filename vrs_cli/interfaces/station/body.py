"""The body of one robot: which client is the body, its reports, and its orders. Compares the reports with the timeline,
reacts to alarms, and re-synchronises the body (RESYNC). Any thread may call any method of `RobotBody`.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Sequence
from math import inf
from threading import Condition
from typing import TYPE_CHECKING

from msgspec import Struct
from msgspec.structs import replace

from vrs_cli.engine.engine import Engine
from vrs_cli.engine.position import joints_at
from vrs_cli.errors import IllegalValue, RequestRefused, UsageError, VrsError
from vrs_cli.interfaces.dialogue import Dialogue, beside, quietly
from vrs_cli.trajectory.measured import MeasuredRecord
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values import commands, measured, replies

if TYPE_CHECKING:
    from vrs_cli.twin.divergence import DivergenceWatch


SILENT = 3.0  # time without a report after which the robot's joints count as unknown [s]
AHEAD = 10.0  # how far the time of a report may be ahead of the robot's clock [s]: no clock is wrong by more
PAST = 3600.0  # greatest age of a report [s]
MAX_GAPS = 100  # maximum number of stretches of missing numbers that are remembered
RATE_WINDOW = 5.0  # period of arrivals from which the rate of reports is computed [s]
STANDS_FOR = 0.05  # time without motion after which a holding body counts as standing [s]
STILL = 1e-3  # a change up to this size is noise and not motion [rad, m]


def check_time(t: float, now: float) -> None:
    """Check the time of a report [s] against `now`, the time of the robot's clock. Raises IllegalValue."""
    if not now - PAST <= t <= now + AHEAD:
        what = f"a report of {t:g} s, when the robot's clock is at {now:.3f} s"
        raise IllegalValue(what, f"at most {AHEAD:g} s later, or {PAST:g} s earlier", value=t)


class BodyChange(Struct, frozen=True):
    """A change of the body: the client `name` is the body (empty: none), `before` was the body until then, and its
    order applies from `at` [s] on.
    """

    name: str
    before: str
    order: measured.BodyMode
    at: float


BodyNews = BodyChange | measured.DivergenceAlarm | measured.ResyncReport | replies.Message
"""News of a body. A message comes from the robot itself, and tells what it could not do for its body."""


class ClockSeen(Struct, frozen=True):
    """The clock of a body: `offset` ahead of the robot's [s], and `drift` more with every second; `delay`: the age of
    its reports when they arrive [s].
    """

    offset: float = 0.0
    drift: float = 0.0
    delay: float = 0.0


class ReportNumbers:
    """Keeps track of the numbers of received reports. `next`: the number after the highest received one; `lost`: how
    many numbers before that are missing.
    """

    def __init__(self, next: int) -> None:
        self.next, self.lost = next, 0
        self._gaps: deque[range] = deque(maxlen=MAX_GAPS)

    def new(self, first: int, reports: Sequence[measured.Report]) -> Sequence[measured.Report]:
        """Return the reports, numbered from `first`, whose numbers were not received before."""
        if first >= self.next:
            return reports
        return [one for number, one in enumerate(reports, first) if number >= self.next or self._gap(number)]

    def note(self, first: int, count: int) -> None:
        """Note that `count` reports have arrived, numbered from `first`."""
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
        """Return the stretch of missing numbers that contains a number."""
        return next((gap for gap in self._gaps if number in gap), None)


class RobotBody:
    """The body of a robot. `record`: all measurements. `name`: the client that is the body, empty if there is none;
    only this client may report. `order`, since `ordered_at` [s]: the body's order to follow or to hold. `clock`:
    measured offset, drift and delay of its clock.

    The functions in `told` are called with each change, alarm and RESYNC, in the thread in which it happens;
    `record.listeners` are called with the accepted reports. `now` is the robot's clock [s].
    """

    def __init__(
        self, record: MeasuredRecord, now: Callable[[], float], wall: Callable[[], float] = time.monotonic
    ) -> None:
        self.record, self.now, self._wall = record, now, wall
        self.name = ""
        self.order, self.ordered_at = measured.BodyMode.FOLLOWS, 0.0
        self.clock = ClockSeen()
        self.told: list[Callable[[BodyNews], None]] = []
        self.reporter = ""  # the sender of the last report
        self._lock = Condition()
        self._begin(0)

    def _begin(self, first: int) -> None:
        """Start counting at the report with number `first`."""
        self._numbers, self._counts = ReportNumbers(first), measured.ReportCounts()
        self._mode = measured.BodyMode.FOLLOWS
        self._last: float | None = None  # the time of the newest report [s]
        # the first report of a body that has stopped, after an order or by itself
        self._stood: measured.Report | None = None
        # the newest such report, if the body has been stopped for long enough
        self._stands: measured.Report | None = None
        self._arrivals: deque[tuple[float, int]] = deque()  # when reports arrived, by the wall clock [s], and how many
        self._heard_at: float | None = None

    # --- the client that is the body ---

    def embody(self, name: str, first: int = 0) -> int:
        """Make a client the body. Return the number of the report that the client must send next; `first` if it was not
        the body before. Raises RequestRefused if another client is the body.
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
        """Note that a client is no longer the body. Return whether it was the body."""
        with self._lock:
            if not name or self.name != name:
                return False
            self._become("")
            return True

    def _become(self, name: str) -> None:
        before, self.name = self.name, name
        self.tell(BodyChange(name, before, self.order, self.ordered_at))

    # --- reports ---

    def take(
        self, reports: Sequence[measured.Report], first: int | None = None, name: str = ""
    ) -> measured.ReportCounts:
        """Add reports to the record, and return what became of them. The first has the number `first`; without `first`
        they have the next numbers. Raises RequestRefused if the client is not the body, and IllegalValue for values
        that cannot be joints of this robot or, from a client, times of its clock; then no report is added.
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

    def _note_arrival(self, reports: Sequence[measured.Report]) -> None:
        newest, wall = max(reports, key=lambda one: one.t), self._wall()
        if self._last is None or newest.t >= self._last:
            self._last, self._mode = newest.t, newest.mode
        self._heard_at = wall
        self._arrivals.append((wall, len(reports)))
        while self._arrivals[0][0] < wall - RATE_WINDOW:
            self._arrivals.popleft()

    def _note_standing(self, reports: Sequence[measured.Report]) -> None:
        for one in reports:
            first = self._stood
            if one.mode is measured.BodyMode.FOLLOWS or one.t < self.ordered_at:
                self._stood = self._stands = None
            elif first is None or any(abs(a - b) > STILL for a, b in zip(one.joints, first.joints, strict=True)):
                self._stood, self._stands = one, None
            elif one.t >= first.t + STANDS_FOR:
                self._stands = one
        self._lock.notify_all()

    def check_reports(self) -> None:
        """Check that the body sends reports, or has just become the body. Raises RequestRefused."""
        last, since = self._last, self.unknown_since
        if last is None and not self.name:
            hint = "vrs body URL starts a body, r.report reports for a robot of this process"
            raise RequestRefused("nothing measures this robot", hint)
        if since is not None and (self.name or self.reporter):
            raise RequestRefused(f"nothing was measured since {since:.3f} s", "wait until the body reports again")

    def standing(self, within: float) -> measured.Report:
        """Wait until the body stands still, after an order or by itself, and return the report of that. Without a
        client this does not wait: the last report of the body counts. Raises RequestRefused after `within` seconds.
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

    # --- orders and news ---

    def command(self, order: measured.BodyMode, at: float | None = None) -> None:
        """Order the body to follow the timeline, or to hold still, from the time `at` on; None: from now on."""
        with self._lock:
            self.order, self.ordered_at = order, self.now() if at is None else at
            if order is measured.BodyMode.FOLLOWS:
                self._stood = self._stands = None
            self.tell(BodyChange(self.name, self.name, order, self.ordered_at))

    def tell(self, news: BodyNews) -> None:
        """Report an alarm, the reaction to it, or a change of the body to all listeners."""
        for tell in self.told:
            tell(news)

    # --- the state of the body ---

    @property
    def view(self) -> measured.BodySeen | None:
        """The known facts about the body; None if there is no body and nothing was reported."""
        with self._lock:
            if not self.name and self._last is None:
                return None
            counts = replace(self._counts, lost=self._numbers.lost)
            clock = self.clock
            return measured.BodySeen(
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

    def _rate(self) -> float:  # [1/s]
        if len(self._arrivals) < 2 or self._wall() - self._arrivals[-1][0] > SILENT:
            return 0.0
        first, last = self._arrivals[0], self._arrivals[-1]
        return (sum(count for _, count in self._arrivals) - first[1]) / max(last[0] - first[0], 1e-9)

    @property
    def unknown_since(self) -> float | None:
        """Return since when there were no measurements [s]; None while reports arrive, or if there never were any."""
        with self._lock:
            silent = self._heard_at is not None and self._wall() - self._heard_at > SILENT
            return self._last if silent or (self._last is not None and not self.name) else None


PARAMETER = "DIVERGENCE"  # name of the parameter that selects an OnAlarm
STANDS_WITHIN = 5.0  # longest time until a body that was ordered to hold has stopped and reported that [s]
# an order to follow reaches the body within DELAYS times the delay of reports plus MARGIN [s]
DELAYS, MARGIN = 2.0, 0.1
SETTLES = 1.0  # additional time for a body to begin, after it has entered or was ordered to follow [s]
NEAR = 5e-3  # a body that enters within this distance of the timeline follows it at once [rad, m]
AGAIN_AFTER = 10.0  # an alarm sooner after RESYNC than this is one that RESYNC cannot resolve [s]
# RESYNC corrects a body that differs for one of these reasons; a blocked joint or a payload would remain
PASSING = frozenset(
    (
        *(measured.DivergenceCause.STOPPED, measured.DivergenceCause.OTHER_COMMANDER),
        *(measured.DivergenceCause.LOST_COMMAND, measured.DivergenceCause.DELAY),
    )
)


class DivergenceGuard:
    """Passes the reports of `body` to a watch, and reacts to an alarm as PARAMETER DIVERGENCE says. Reports may arrive
    in any thread, one after the other.

    `timeline` returns the robot's timeline, in any thread. `alarm`: the last alarm, while the body still differs.
    `settle` does everything that is due by now, `stop` stops motion and programs, `runs` returns whether a program
    runs. `ask` queues a dialogue of the robot itself, an urgent one before all others; from any thread.
    """

    def __init__(
        self,
        body: RobotBody,
        engine: Engine,
        timeline: Callable[[], Timeline],
        settle: Callable[[], object],
        stop: Callable[[], None],
        runs: Callable[[], bool],
        ask: Callable[[Dialogue[None], bool], object],
    ) -> None:
        self._body, self._engine, self._timeline = body, engine, timeline
        self._settle, self._stop, self._runs, self.ask = settle, stop, runs, ask
        self._watch: DivergenceWatch | None = None
        self._last: measured.DivergenceAlarm | None = None
        self._due = False  # whether an automatic RESYNC is pending until the body is no longer stopped
        self._entered = -inf  # time at which a client became the body [s]
        self._synchronised = -inf  # time of the last automatic RESYNC [s]
        body.told.append(self._hear)

    @property
    def on_alarm(self) -> measured.OnAlarm:
        return measured.OnAlarm(str(self._engine.settings.parameters[PARAMETER]).lower())

    def choose(self, what: measured.OnAlarm) -> None:
        self._engine.perform(commands.SetParameter(PARAMETER, what.name))

    @property
    def alarm(self) -> measured.DivergenceAlarm | None:
        watch = self._watch
        return self._last if watch is not None and watch.diverged else None

    def take(self, reports: Sequence[measured.Report]) -> None:
        if self.on_alarm is measured.OnAlarm.OFF:
            self._watch = None
            return
        if self._watch is None:
            from vrs_cli.twin.divergence import DivergenceWatch

            self._watch = DivergenceWatch(self._engine.arm)
        timeline = self._timeline()
        for report in reports:
            alarm = self._watch.take(timeline, report, ordered=self._may_hold(report.t))
            if alarm is not None:
                self._raise(alarm)
        if self._due and reports[-1].mode is not measured.BodyMode.STOPPED:
            self._due = False
            self.ask(self._resync_by_itself(), False)

    def _may_hold(self, t: float) -> bool:
        """Return whether a body may hold at time t [s]: because of an order to hold, or because the body has just
        entered or has just been ordered to follow.
        """
        body, since = self._body, max(self._body.ordered_at, self._entered)
        return body.order is measured.BodyMode.HOLDS or t < since + DELAYS * body.clock.delay + SETTLES

    def _raise(self, alarm: measured.DivergenceAlarm) -> None:
        """Report an alarm, and carry out the reaction that is set."""
        self._last = alarm
        self._body.tell(alarm)
        what = self.on_alarm
        if what is measured.OnAlarm.ABORT:
            self.ask(quietly(self._stop), True)
        comes_back = what is measured.OnAlarm.RESYNC and alarm.cause is measured.DivergenceCause.PUSH
        if what in (measured.OnAlarm.HOLD, measured.OnAlarm.RESYNC) and not comes_back:
            self._body.command(measured.BodyMode.HOLDS)
        first = alarm.t > self._synchronised + AGAIN_AFTER or alarm.cause is measured.DivergenceCause.STOPPED
        self._due = what is measured.OnAlarm.RESYNC and first and alarm.cause in PASSING

    def _hear(self, what: object) -> None:
        """Make a new body hold until RESYNC, if the set reaction is that."""
        if isinstance(what, BodyChange) and what.name != what.before:
            self._watch, self._due, self._entered = None, False, self._body.now()
            if what.name and self.on_alarm is measured.OnAlarm.RESYNC:
                self._due = True
                self._body.command(measured.BodyMode.HOLDS)

    # --- RESYNC ---

    def resync(
        self, *, stops: bool, issued: float | None, check: Callable[[], object]
    ) -> Dialogue[measured.ResyncReport]:
        """Make the body hold, move the robot to where the body stands and on to where the robot was going (not if
        `stops`), and make the body follow again. `check` is called again when the body stands. Raises RequestRefused,
        MotionError, PowerOff; then the body still holds.
        """
        body = self._body
        body.check_reports()
        body.command(measured.BodyMode.HOLDS)
        report = yield from beside(lambda: body.standing(STANDS_WITHIN))
        self._settle()  # time has passed meanwhile
        check()
        if report.mode is measured.BodyMode.STOPPED and not stops:
            what = f"{body.name or 'the body'} has stopped by itself"
            raise RequestRefused(what, "end its emergency stop first, or {RESYNC STOP} goes to where it stands")
        leaves = self._engine.now + DELAYS * body.clock.delay + MARGIN if body.name else 0.0
        done = self._engine.resync(report.joints, stops=stops, leaves=leaves, issued=issued)
        body.command(measured.BodyMode.FOLLOWS, done.until)
        body.tell(done)
        return done

    def _resync_by_itself(self) -> Dialogue[None]:
        """Carry out an automatic RESYNC. A body that stands where the robot does follows at once."""

        def check() -> None:
            if self._runs():
                raise UsageError("RESYNC has to wait until the program stops", "{ABORT} stops it")

        check()
        report = yield from beside(lambda: self._body.standing(STANDS_WITHIN))
        self._settle()
        engine = self._engine
        here = joints_at(engine.arm, engine.timeline, engine.now)
        near = max(abs(a - b) for a, b in zip(report.joints, here, strict=True)) < NEAR
        if near and engine.now >= engine.end:
            self._body.command(measured.BodyMode.FOLLOWS)
            return
        done = yield from self.resync(stops=False, issued=None, check=check)
        self._synchronised = done.until

    def telling(self, dialogue: Dialogue[None]) -> Dialogue[None]:
        """Carry out a dialogue of the robot itself, and report the error if the dialogue fails."""
        try:
            yield from dialogue
        except VrsError as error:
            self._body.tell(replies.Message(f"After an alarm of the body: {error}", replies.Tone.WARNING))
