"""The body of one robot (the real or simulated arm that executes the motions): which client acts as the body, its
reports of measured joints, and its orders. The reports are compared with the timeline; if they differ, an alarm starts
a reaction. RESYNC makes the body and the timeline agree again. Any thread may call the methods of `RobotBody`."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Sequence
from math import inf
from threading import Condition
from typing import TYPE_CHECKING

from msgspec import Struct, structs

from vrs_cli.engine.engine import Engine
from vrs_cli.engine.position import joints_at
from vrs_cli.errors import IllegalValue, RequestRefused, UsageError, VrsError
from vrs_cli.interfaces.dialogue import Dialogue, beside, quietly
from vrs_cli.trajectory.measured import MeasuredRecord
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values import commands, measured, results

if TYPE_CHECKING:
    from vrs_cli.twin.divergence import DivergenceWatch


SILENT = 3.0  # [s] if no report arrives for this time, the joints of the body count as unknown
AHEAD = 10.0  # [s] refuse reports with a later time than the robot's clock plus this: no clock is that wrong
PAST = 3600.0  # [s] refuse reports that are older than this
MAX_GAPS = 100  # remember at most this many ranges of missing report numbers
RATE_WINDOW = 5.0  # [s] compute the rate of reports over this period
STANDS_FOR = 0.05  # [s] a body that was ordered to hold counts as at rest if it has not moved for this time
STILL = 1e-3  # [rad, m] a joint that changes by less has not moved: the change is noise


def check_time(t: float, now: float) -> None:
    """Check that the time `t` of a report [s] is possible at `now`, the time of the robot's clock [s]. Raises
    IllegalValue."""
    if not now - PAST <= t <= now + AHEAD:
        raise IllegalValue(
            f"a report of {t:g} s, when the robot's clock is at {now:.3f} s",
            f"at most {AHEAD:g} s later, or {PAST:g} s earlier",
            value=t,
        )


class BodyChange(Struct, frozen=True):
    """A change of the body. `name`: the client that now acts as the body (empty: none); `before`: the client that acted
    as the body until now. `order`: whether the body shall follow the timeline or hold, starting at the time `at`
    [s]."""

    name: str
    before: str
    order: measured.BodyMode
    at: float


# a notification to the listeners of a body; a `Message` reports that an automatic reaction to an alarm has failed
BodyNews = BodyChange | measured.DivergenceAlarm | results.ResyncReport | results.Message


class ClockSeen(Struct, frozen=True):
    """The measured clock of a body. `offset`: how far it is ahead of the robot's clock [s]; `drift`: the growth of this
    offset per second. `delay`: the age of the body's reports on arrival [s]."""

    offset: float = 0.0
    drift: float = 0.0
    delay: float = 0.0


class ReportNumbers:
    """The numbers of the received reports. `next`: the highest received number plus 1; `lost`: how many lower numbers
    are missing. Ranges of missing numbers are called gaps."""

    def __init__(self, next: int) -> None:
        self.next, self.lost = next, 0
        self._gaps: deque[range] = deque(maxlen=MAX_GAPS)

    def new(self, first: int, reports: Sequence[measured.Report]) -> Sequence[measured.Report]:
        """Return those reports that have not been received before. `first`: the number of the first report in
        `reports`."""
        return [one for number, one in enumerate(reports, first) if number >= self.next or self._gap(number)]

    def note(self, first: int, count: int) -> None:
        """Record that `count` reports have arrived, numbered consecutively from `first`."""
        if first > self.next:
            self._gaps.append(range(self.next, first))
            self.lost += first - self.next
        for number in range(first, min(first + count, self.next)):
            if (gap := self._gap(number)) is not None:
                self._gaps.remove(gap)
                self._gaps.extend(part for part in (range(gap.start, number), range(number + 1, gap.stop)) if part)
                self.lost -= 1
        self.next = max(self.next, first + count)

    def _gap(self, number: int) -> range | None:
        """Return the gap (range of missing numbers) that contains a number; None if the number is not missing."""
        return next((gap for gap in self._gaps if number in gap), None)


class RobotBody:
    """The body of a robot. `record`: all measurements. `name`: the client that acts as the body; empty if none does.
    Only this client may send reports. `order`: to follow the timeline or to hold, since the time `ordered_at` [s].
    `clock`: the measured offset, drift and delay of its clock.

    The functions in `listeners` are called with each change, alarm and RESYNC, in the thread in which it occurs. Those
    in `record.listeners` are called with the accepted reports. `now` returns the time of the robot's clock [s].
    """

    def __init__(
        self, record: MeasuredRecord, now: Callable[[], float], wall: Callable[[], float] = time.monotonic
    ) -> None:
        self.record, self.now, self._wall = record, now, wall
        self.name = ""
        self.order, self.ordered_at = measured.BodyMode.FOLLOWS, 0.0
        self.clock = ClockSeen()
        self.listeners: list[Callable[[BodyNews], None]] = []
        self.reporter = ""  # name of the client that sent the last report
        self._lock = Condition()
        self._begin(0)

    def _begin(self, first: int) -> None:
        """Forget all reports. `first`: the number of the report expected next."""
        self._numbers, self._counts = ReportNumbers(first), measured.ReportCounts()
        self._mode = measured.BodyMode.FOLLOWS
        self._last: float | None = None  # [s] time given in the newest report
        # first report since which the body has not moved, while it holds or is stopped
        self._rest_begin: measured.Report | None = None
        # newest report at that position, once the body has been at rest for STANDS_FOR
        self._rest_report: measured.Report | None = None
        # arrivals of reports: the time by the wall clock [s], and the number of reports
        self._arrivals: deque[tuple[float, int]] = deque()
        self._heard_at: float | None = None

    # --- the client that is the body ---

    def embody(self, name: str, first: int = 0) -> int:
        """Let a client act as the body. Return the number of the report that the client must send next: `first`, or the
        next number if this client already acts as the body. Raises RequestRefused if another client does."""
        with self._lock:
            if self.name not in ("", name):
                raise RequestRefused(f"{self.name} is the body", "it gives that back, or BODY RELEASE takes it away")
            if self.name != name:
                self._begin(first)
                self.clock = ClockSeen()
                self._become(name)
            return self._numbers.next

    def leave(self, name: str) -> bool:
        """Record that a client no longer acts as the body (the arm of the robot). Return whether it was the body before
        this call."""
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
        """Add reports to the record. Return how many were received, late, duplicate or reordered. `first`: the number
        of the first report; None: the next number. Raises RequestRefused if the client `name` does not act as the body.
        Raises IllegalValue, and adds no report, for values that cannot be joints of this robot, and for impossible
        times of a client."""
        with self._lock:
            self.check_is(name)
            if name:
                now = self.now()
                for one in reports:
                    check_time(one.t, now)
            first = self._numbers.next if first is None else first
            new = self._numbers.new(first, reports)
            found, doubled = self.record.add(new), len(reports) - len(new)
            found = structs.replace(found, received=len(reports), duplicate=found.duplicate + doubled)
            self._numbers.note(first, len(reports))
            self._counts += found
            if new:
                self.reporter = name
                self._note_arrival(new)
                self._note_standing(new)
            return found

    def check_is(self, name: str) -> None:
        """Check that a client acts as the body. Raises RequestRefused if it does not."""
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
            first = self._rest_begin
            if one.mode is measured.BodyMode.FOLLOWS or one.t < self.ordered_at:
                self._rest_begin = self._rest_report = None
            elif first is None or any(abs(a - b) > STILL for a, b in zip(one.joints, first.joints, strict=True)):
                self._rest_begin, self._rest_report = one, None
            elif one.t >= first.t + STANDS_FOR:
                self._rest_report = one
        self._lock.notify_all()

    def check_reports(self) -> None:
        """Check that the body sends reports, or has only just become the body. Raises RequestRefused."""
        last, since = self._last, self.unknown_since
        if last is None and not self.name:
            raise RequestRefused(
                "nothing measures this robot",
                "vrs body URL starts a body, r.report reports for a robot of this process",
            )
        if since is not None and (self.name or self.reporter):
            raise RequestRefused(f"nothing was measured since {since:.3f} s", "wait until the body reports again")

    def wait_for_rest(self, within: float) -> measured.Report:
        """Wait until the body is at rest, because of an order or by itself. Return a report of its position. If no
        client acts as the body, return the last report without waiting. Raises RequestRefused if the body is not at
        rest after `within` seconds."""
        with self._lock:
            if not self.name and not self.reporter:
                newest = self.record.view
                assert newest.end is not None, "it has reported"
                return next(iter(newest.between(newest.end, newest.end)))
            name = self.name
            self._lock.wait_for(lambda: self._rest_report is not None or self.name != name, within)
            found = self._rest_report
            if found is None or self.name != name:
                raise RequestRefused(
                    f"{name or 'the body'} was told to hold, and has not reported within {within:g} s that it stands"
                    if self.name == name
                    else f"{name} is the body no longer",
                    "try {RESYNC} again",
                )
            return found

    # --- orders and news ---

    def command(self, order: measured.BodyMode, at: float | None = None) -> None:
        """Order the body to follow the timeline or to hold, starting at the time `at` [s]; None: now."""
        with self._lock:
            self.order, self.ordered_at = order, self.now() if at is None else at
            if order is measured.BodyMode.FOLLOWS:
                self._rest_begin = self._rest_report = None
            self.tell(BodyChange(self.name, self.name, order, self.ordered_at))

    def tell(self, news: BodyNews) -> None:
        """Inform all listeners of an alarm, a failed reaction to one, a RESYNC or a change of the body."""
        for tell in self.listeners:
            tell(news)

    # --- the state of the body ---

    @property
    def view(self) -> measured.BodySeen | None:
        """The known state of the body; None if no client acts as the body and there has been no report."""
        with self._lock:
            if not self.name and self._last is None:
                return None
            counts = structs.replace(self._counts, lost=self._numbers.lost)
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

    def _rate(self) -> float:  # rate of reports [1/s]
        if len(self._arrivals) < 2 or self._wall() - self._arrivals[-1][0] > SILENT:
            return 0.0
        first, last = self._arrivals[0], self._arrivals[-1]
        return (sum(count for _, count in self._arrivals) - first[1]) / max(last[0] - first[0], 1e-9)

    @property
    def unknown_since(self) -> float | None:
        """The time of the last report [s] if reports no longer arrive; None while they do, or if there has never been
        one."""
        with self._lock:
            silent = self._heard_at is not None and self._wall() - self._heard_at > SILENT
            return self._last if silent or (self._last is not None and not self.name) else None


PARAMETER = "DIVERGENCE"  # name of the parameter that selects the reaction to an alarm (`OnAlarm`)
STANDS_WITHIN = 5.0  # [s] a body that was ordered to hold must stop, and report its stop, within this time
# [s] an order reaches the body after at most DELAYS times the delay of its reports, plus MARGIN
DELAYS, MARGIN = 2.0, 0.1
# [s] extra time without alarms for a body to start moving, after it has connected or was ordered to follow
SETTLES = 1.0
NEAR = 5e-3  # [rad, m] a body at rest that is nearer to the timeline than this can follow it without RESYNC
AGAIN_AFTER = 10.0  # [s] if an alarm follows RESYNC within this time, RESYNC did not help: do not try it again
# causes of a difference for which RESYNC helps; a blocked joint or a payload would cause a new difference
PASSING = frozenset(
    (
        *(measured.DivergenceCause.STOPPED, measured.DivergenceCause.OTHER_COMMANDER),
        *(measured.DivergenceCause.LOST_COMMAND, measured.DivergenceCause.DELAY),
    )
)


class DivergenceGuard:
    """The alarm handler of a robot. It compares the reports of `body` with the timeline, and reacts to an alarm as set
    by PARAMETER DIVERGENCE.

    Reports may arrive in any thread, but not in two at the same time. `timeline` returns the robot's timeline, in any
    thread. `alarm`: the last alarm, as long as the body still differs. `settle` carries out all events up to now,
    `stop` stops motion and programs, `runs` returns whether a program is running. `ask` queues a dialogue of the robot
    itself, from any thread; if its second argument is true, the dialogue precedes all others."""

    def __init__(
        self,
        engine: Engine,
        timeline: Callable[[], Timeline],
        settle: Callable[[], object],
        stop: Callable[[], None],
        runs: Callable[[], bool],
        ask: Callable[[Dialogue[None], bool], object],
    ) -> None:
        self._engine, self._timeline = engine, timeline
        self.body = RobotBody(engine.measured, lambda: engine.clock.reached)
        self._settle, self._stop, self._runs, self.ask = settle, stop, runs, ask
        self._watch: DivergenceWatch | None = None
        self._last: measured.DivergenceAlarm | None = None
        self._due = False  # whether an automatic RESYNC waits until the body is no longer stopped (emergency stop)
        self._entered = -inf  # [s] when a client began to act as the body
        self._synchronised = -inf  # [s] when the last automatic RESYNC ended
        self.body.listeners.append(self._hear)
        self.body.record.listeners.insert(0, self.take)

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
        timeline, body = self._timeline(), self.body
        for report in reports:
            # no alarm for a body at rest that was ordered to hold, has just connected, or was just ordered to follow
            since = max(body.ordered_at, self._entered)
            holds = body.order is measured.BodyMode.HOLDS or report.t < since + DELAYS * body.clock.delay + SETTLES
            if (alarm := self._watch.take(timeline, report, ordered=holds)) is not None:
                self._raise(alarm)
        if self._due and reports[-1].mode is not measured.BodyMode.STOPPED:
            self._due = False
            self.ask(self._resync_by_itself(), False)

    def _raise(self, alarm: measured.DivergenceAlarm) -> None:
        """Report an alarm, and start the reaction that PARAMETER DIVERGENCE selects."""
        self._last = alarm
        self.body.tell(alarm)
        what = self.on_alarm
        if what is measured.OnAlarm.ABORT:
            self.ask(quietly(self._stop), True)
        comes_back = what is measured.OnAlarm.RESYNC and alarm.cause is measured.DivergenceCause.PUSH
        if what in (measured.OnAlarm.HOLD, measured.OnAlarm.RESYNC) and not comes_back:
            self.body.command(measured.BodyMode.HOLDS)
        first = alarm.t > self._synchronised + AGAIN_AFTER or alarm.cause is measured.DivergenceCause.STOPPED
        self._due = what is measured.OnAlarm.RESYNC and first and alarm.cause in PASSING

    def _hear(self, what: object) -> None:
        """Order a new body to hold until the automatic RESYNC, if PARAMETER DIVERGENCE selects RESYNC."""
        if isinstance(what, BodyChange) and what.name != what.before:
            self._watch, self._due, self._entered = None, False, self.body.now()
            if what.name and self.on_alarm is measured.OnAlarm.RESYNC:
                self._due = True
                self.body.command(measured.BodyMode.HOLDS)

    # --- RESYNC ---

    def resync(
        self, *, stops: bool, issued: float | None, check: Callable[[], object]
    ) -> Dialogue[results.ResyncReport]:
        """Order the body to hold; move the robot of the timeline to the body's position, and from there to its earlier
        target (unless `stops`); order the body to follow again. `check`: checks that RESYNC is allowed, and is called
        again when the body is at rest. Raises RequestRefused, MotionError, PowerOff; the body then still holds."""
        self.body.check_reports()
        self.body.command(measured.BodyMode.HOLDS)
        report = yield from beside(lambda: self.body.wait_for_rest(STANDS_WITHIN))
        self._settle()  # carry out the events of the time spent waiting
        check()
        if report.mode is measured.BodyMode.STOPPED and not stops:
            raise RequestRefused(
                f"{self.body.name or 'the body'} has stopped by itself",
                "end its emergency stop first, or {RESYNC STOP} goes to where it stands",
            )
        leaves = self._engine.now + DELAYS * self.body.clock.delay + MARGIN if self.body.name else 0.0
        done = self._engine.resync(report.joints, stops=stops, leaves=leaves, issued=issued)
        self.body.command(measured.BodyMode.FOLLOWS, done.until)
        self.body.tell(done)
        return done

    def _resync_by_itself(self) -> Dialogue[None]:
        """Carry out an automatic RESYNC. If the body is already where the timeline ends, only order it to follow."""

        def check() -> None:
            if self._runs():
                raise UsageError("RESYNC has to wait until the program stops", "{ABORT} stops it")

        check()
        report = yield from beside(lambda: self.body.wait_for_rest(STANDS_WITHIN))
        self._settle()
        engine = self._engine
        here = joints_at(engine.arm, engine.timeline, engine.now)
        if engine.now >= engine.end and max(abs(a - b) for a, b in zip(report.joints, here, strict=True)) < NEAR:
            self.body.command(measured.BodyMode.FOLLOWS)
            return
        self._synchronised = (yield from self.resync(stops=False, issued=None, check=check)).until

    def report_failure(self, dialogue: Dialogue[None]) -> Dialogue[None]:
        """Carry out a dialogue of the robot itself. If it fails, report the error as news of the body."""
        try:
            yield from dialogue
        except VrsError as error:
            self.body.tell(results.Message(f"After an alarm of the body: {error}", results.Tone.WARNING))
