"""Watch the body of a robot: compare its reports with the timeline, act on alarms, re-synchronise it (RESYNC)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import inf
from typing import TYPE_CHECKING

from vrs_cli.engine.engine import Engine
from vrs_cli.engine.position import joints_at
from vrs_cli.errors import RequestRefused, UsageError, VrsError
from vrs_cli.interfaces.dialogue import Dialogue, beside, quietly
from vrs_cli.interfaces.station.body import BodyChange, RobotBody
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.commands import SetParameter
from vrs_cli.values.measured import BodyMode, DivergenceAlarm, DivergenceCause, OnAlarm, Report, ResyncReport
from vrs_cli.values.replies import Message, Tone

if TYPE_CHECKING:
    from vrs_cli.twin.divergence import DivergenceWatch

PARAMETER = "DIVERGENCE"  # has the name of an OnAlarm
STANDS_WITHIN = 5.0  # [s] a body that is told to hold stands still, and its reports of that have come
DELAYS, MARGIN = 2.0, 0.1  # times the delay of reports, and [s]: in that time an order to follow gets to the body
SETTLES = 1.0  # [s] more for a body that enters, or is told to follow, to begin
NEAR = 5e-3  # [rad, m] a body that enters so near to the timeline follows it at once
AGAIN_AFTER = 10.0  # [s] an alarm that comes sooner after RESYNC is one that RESYNC does not help against
# a body that differs for one of these is brought back by RESYNC; a blocked joint or a payload would stay
PASSING = frozenset(
    (
        *(DivergenceCause.STOPPED, DivergenceCause.OTHER_COMMANDER),
        *(DivergenceCause.LOST_COMMAND, DivergenceCause.DELAY),
    )
)


class DivergenceGuard:
    """Gives the reports of `body` to a watch, and does on an alarm what PARAMETER DIVERGENCE says. Reports come in any
    thread, one after the other.

    `timeline`: that of the robot, for any thread. `alarm`: the last alarm, while the body still differs. `settle` lets
    happen what is due by now, `stop` stops motion and programs, `runs` tells whether a program does. `ask` lets the
    robot do something by itself, an urgent thing before all others; from any thread.
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
        self._last: DivergenceAlarm | None = None
        self._due = False  # RESYNC by itself, when the body is no longer stopped
        self._entered = -inf  # [s] when a client became the body
        self._synchronised = -inf  # [s] when RESYNC was done by itself last
        body.told.append(self._hear)

    @property
    def on_alarm(self) -> OnAlarm:
        return OnAlarm(str(self._engine.settings.parameters[PARAMETER]).lower())

    def choose(self, what: OnAlarm) -> None:
        """Do that on an alarm."""
        self._engine.perform(SetParameter(PARAMETER, what.name))

    @property
    def alarm(self) -> DivergenceAlarm | None:
        watch = self._watch
        return self._last if watch is not None and watch.diverged else None

    def take(self, reports: Sequence[Report]) -> None:
        """Watch reports."""
        if self.on_alarm is OnAlarm.OFF:
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
        if self._due and reports[-1].mode is not BodyMode.STOPPED:
            self._due = False
            self.ask(self._resync_by_itself(), False)

    def _may_hold(self, t: float) -> bool:
        """Return whether a body may hold at time t [s]: by an order, or because it has only just got one to follow."""
        body = self._body
        since = max(body.ordered_at, self._entered)
        return body.order is BodyMode.HOLDS or t < since + DELAYS * body.clock.delay + SETTLES

    def _raise(self, alarm: DivergenceAlarm) -> None:
        """Tell an alarm, and do what is set."""
        self._last = alarm
        self._body.tell(alarm)
        what = self.on_alarm
        if what is OnAlarm.ABORT:
            self.ask(quietly(self._stop), True)
        comes_back = what is OnAlarm.RESYNC and alarm.cause is DivergenceCause.PUSH
        if what in (OnAlarm.HOLD, OnAlarm.RESYNC) and not comes_back:
            self._body.command(BodyMode.HOLDS)
        first = alarm.t > self._synchronised + AGAIN_AFTER or alarm.cause is DivergenceCause.STOPPED
        self._due = what is OnAlarm.RESYNC and first and alarm.cause in PASSING

    def _hear(self, what: object) -> None:
        """Let a body that enters hold until RESYNC, if that is set."""
        if isinstance(what, BodyChange) and what.name != what.before:
            self._watch, self._due, self._entered = None, False, self._body.now()
            if what.name and self.on_alarm is OnAlarm.RESYNC:
                self._due = True
                self._body.command(BodyMode.HOLDS)

    # --- RESYNC ---

    def resync(self, *, stops: bool, issued: float | None, check: Callable[[], object]) -> Dialogue[ResyncReport]:
        """Let the body hold, go to where it stands and on to where the robot was going (not if it `stops`), and let it
        follow again. `check` is called again when it stands. Raises RequestRefused, MotionError, PowerOff; then the
        body still holds.
        """
        body = self._body
        body.check_reports()
        body.command(BodyMode.HOLDS)
        report = yield from beside(lambda: body.standing(STANDS_WITHIN))
        self._settle()  # time has gone on meanwhile
        check()
        if report.mode is BodyMode.STOPPED and not stops:
            what = f"{body.name or 'the body'} has stopped by itself"
            raise RequestRefused(what, "end its emergency stop first, or {RESYNC STOP} goes to where it stands")
        leaves = self._engine.now + DELAYS * body.clock.delay + MARGIN if body.name else 0.0
        done = self._engine.resync(report.joints, stops=stops, leaves=leaves, issued=issued)
        body.command(BodyMode.FOLLOWS, done.until)
        body.tell(done)
        return done

    def _resync_by_itself(self) -> Dialogue[None]:
        """Do RESYNC because it is set. A body that stands where the robot does follows at once."""

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
            self._body.command(BodyMode.FOLLOWS)
            return
        done = yield from self.resync(stops=False, issued=None, check=check)
        self._synchronised = done.until

    def telling(self, dialogue: Dialogue[None]) -> Dialogue[None]:
        """Do what the robot does by itself, and tell why where it cannot be done."""
        try:
            yield from dialogue
        except VrsError as error:
            self._body.tell(Message(f"After an alarm of the body: {error}", Tone.WARNING))
