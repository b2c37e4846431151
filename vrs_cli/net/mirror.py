"""A robot as a remote user knows it: a snapshot and every change of the timeline after it, its clock, and its status.

Observers and viewers look at a mirror as they look at the robot itself. Pure: messages are put in, the wall clock is an
argument. A change that does not follow on what is known is not guessed at: the mirror is `lost`, and stays as it was,
until another snapshot comes. It keeps a window of the past, so that it does not grow with time.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import islice, zip_longest
from math import inf
from typing import TYPE_CHECKING

from msgspec import Struct
from msgspec.structs import replace

from vrs_cli.engine.engine import TimelineChange
from vrs_cli.engine.feed import Feed, KnownEvents, Snapshot, TimelineReplaced, fit_delta, last_values, unfit_delta
from vrs_cli.engine.settings import Settings
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.trajectory.instant import down_to_grid
from vrs_cli.trajectory.measured import MeasuredRecord, MeasuredTimeline
from vrs_cli.trajectory.timeline import Timeline, TimelineDelta
from vrs_cli.values.questions import PromptStatus
from vrs_cli.wire.records import Form, RecordError
from vrs_cli.wire.steered import SteeredRecord, steered_delta

if TYPE_CHECKING:
    from vrs_cli.world.course import World

WINDOW = 600.0  # [s] of the past that are kept, unless somebody wants more or less
SLACK = 0.25  # of the window may be there beside it: what has become too old goes together, at the cost of what stays


class ClockReading(Struct, frozen=True):
    """A reading of a robot's clock: `now` [s] when a wall clock was at `since` [s]. The clock goes on at `rate`;
    with None it stands, as time is virtual or paused. While it goes it shows no time before `floor` [s].
    """

    now: float = 0.0
    rate: float | None = None
    since: float = 0.0
    floor: float = -inf

    def at(self, wall: float) -> float:
        """The robot's time [s] when that wall clock is at `wall` [s]."""
        if self.rate is None:
            return self.now
        return max(self.now, self.floor, down_to_grid(self.now + self.rate * (wall - self.since)))

    def then(self, later: ClockReading, wall: float) -> ClockReading:
        """Follow this reading by a later one. The clock does not go back: if it was shown too far ahead, it stands
        until its time has come.
        """
        goes_on = self.rate is not None and later.rate is not None
        return replace(later, floor=self.at(wall)) if goes_on else later


class _Held(Struct, frozen=True):
    """The state at one moment: the timeline from its segment number `first` on with the `known` events, after change
    `seq`.
    """

    timeline: Timeline
    first: int
    settings: Settings
    seq: int
    known: KnownEvents

    @classmethod
    def of(cls, snapshot: Snapshot, seq: int) -> _Held:
        return cls(snapshot.timeline(), snapshot.first, snapshot.settings, seq, snapshot.known_events)

    def since(self, t: float, world: World | None) -> _Held:
        """Return the state without the segments that ended before t [s], and the events before the others."""
        timeline, known = self.timeline, self.known
        gone = timeline.index_at(t)
        events = max(timeline.events_by(timeline[gone].start, before=True), known.values)
        values, later = last_values(timeline, events), timeline.event_slice(events, timeline.event_count)
        state = None if world is None else world.course(timeline).state_at(timeline[gone].start)
        kept = Timeline(islice(timeline, gone, None), timeline.version, (*values, *later), state)
        known = KnownEvents(known.first + events - known.values, len(values))
        return replace(self, timeline=kept, first=self.first + gone, known=known)

    def with_older(self, older: Snapshot) -> _Held:
        """Return the state with the segments of an older window before its own, and the events."""
        timeline, known = self.timeline, self.known
        segments = (*older.segments[: self.first - older.first], *timeline)
        new, ours = known.first - older.first_event, tuple(timeline.events)
        values = (*older.values, *older.events[: max(new, 0)])
        since = values[-1].time if values else -inf
        missed = () if new <= len(older.events) else [one for one in ours[: known.values] if one.time > since]
        events = (*values, *missed, *ours[known.values :])
        begins = KnownEvents(known.first, len(events) - len(ours) + known.values) if missed else older.known_events
        longer = Timeline(segments, timeline.version, events, older.world)
        return replace(self, timeline=longer, first=older.first, known=begins)


class Mirror:
    """A robot that others move. One thread puts in what comes, any thread reads.

    `window`: so many seconds before the robot's clock are kept. `begins`: the timeline is known from this time on;
    before it the robot was elsewhere than the mirror says. `events` tells of every change of the known timeline, as the
    robot does. `world`: of the cell around the robot, None where there is none. `record`: takes the reports of its
    body.
    """

    def __init__(
        self,
        arm: RobotArm,
        snapshot: Snapshot,
        seq: int,
        wall: Callable[[], float],
        window: float = inf,
        world: World | None = None,
    ) -> None:
        self.arm, self.window, self.world, self._wall = arm, window, world, wall
        self.clock = ClockReading()
        self.lost, self._form = False, Form.of(arm)
        self.record = MeasuredRecord(arm.model.joint_count)
        self.before_measured: Callable[[], None] = lambda: None  # is called before what was measured is read
        self._held = _Held.of(snapshot, seq)
        self.events: Feed[TimelineChange] = Feed(lambda: TimelineReplaced(self.timeline, self.settings))

    # --- reading ---

    @property
    def timeline(self) -> Timeline:
        return self._held.timeline

    @property
    def measured(self) -> MeasuredTimeline:
        """What the body of the robot has reported, as far as it was told here."""
        self.before_measured()
        return self.record.view

    @property
    def settings(self) -> Settings:
        """Those in force when the last snapshot was taken."""
        return self._held.settings

    @property
    def now(self) -> float:
        """The robot's clock [s], by its last reading."""
        return self.clock.at(self._wall())

    @property
    def rate(self) -> float | None:
        """Seconds of the robot's clock in one second; None if its time does not pass by itself."""
        return self.clock.rate

    @property
    def seq(self) -> int:
        """The number of the last change that is in the timeline."""
        return self._held.seq

    def whole(self, delta: TimelineDelta) -> TimelineDelta:
        """Return a delta of the known timeline as one of the robot's whole timeline."""
        return unfit_delta(delta, self._held.first, self._held.known)

    @property
    def begins(self) -> float:
        """The time [s] from which on the timeline is known; -infinity if all of it is."""
        return self._held.timeline.start if self._held.first else -inf

    # --- what comes ---

    def replace(self, snapshot: Snapshot, seq: int) -> None:
        """Take the timeline after change `seq`: all of it, or a window up to its end. The mirror is no longer lost."""
        self._held, self.lost = self._drop_old(_Held.of(snapshot, seq)), False
        self.events.publish([TimelineReplaced(self.timeline, self.settings)])

    def change(self, delta: TimelineDelta, seq: int) -> None:
        """Apply the change with the next number. A known one changes nothing; any other makes the mirror `lost`, as
        does one that reaches back behind what is known.
        """
        held = self._held
        if self.lost or seq <= held.seq:
            return
        follows = seq == held.seq + 1 and delta.version == held.timeline.version
        here = fit_delta(delta, held.timeline, held.first, held.known) if follows else None
        if here is None:
            self.lost = True
            return
        held = replace(held, timeline=held.timeline.apply(here), seq=seq)
        self._held = self._drop_old(held)
        forgot = self._held is not held
        self.events.publish([here, TimelineReplaced(self.timeline, self.settings)] if forgot else [here])

    def steer(self, target: SteeredRecord, seq: int) -> None:
        """Apply the change of that number, given in short as one target of steering. If it cannot be rebuilt, the
        mirror is `lost`, and changes have to come in full.
        """
        held = self._held
        if self.lost or seq <= held.seq:
            return
        try:
            delta = steered_delta(target, held.timeline, self.arm, self._form, held.first)
        except RecordError:
            self.lost = True
        else:
            self.change(delta, seq)

    def extend(self, older: Snapshot) -> bool:
        """Add an older window, which reaches up to what is known. False if it does not fit any more: ask for it
        again.
        """
        held, count = self._held, self._held.first - older.first
        joint = older.segments[count : count + 1]  # the first that is held, perhaps cut off by now
        if self.lost or count < 0 or not joint or joint[0].truncate(held.timeline[0].finish) != held.timeline[0]:
            return False
        self._held = held.with_older(older)
        self.events.publish([TimelineReplaced(self.timeline, self.settings)])
        return True

    def _drop_old(self, held: _Held) -> _Held:
        """Drop what is older than the window, if that is enough to be worth the copy."""
        begin = self.now - self.window
        old = held.timeline.start < begin - SLACK * self.window and held.timeline.index_at(begin)
        return held.since(begin, self.world) if old else held


def parting(before: Timeline, after: Timeline) -> float:
    """Return the time [s] from which on two timelines differ, where both are known; infinity if they do not."""
    begin = max(before.start, after.start)
    pairs = zip_longest(*(islice(one, one.index_at(begin), None) for one in (before, after)))
    for one, other in pairs:
        if one is None or other is None:
            return float((other or one).start)
        if one != other:
            end = min(one.finish, other.finish)
            same = one.truncate(end) == other.truncate(end)
            return end if same else max(min(one.start, other.start), begin)
    return inf


class LastStatus:
    """The last status that the robot told, with its clock since. A clock that was shown does not go back while time
    passes.
    """

    def __init__(self, wall: Callable[[], float]) -> None:
        self._wall = wall
        self._status, self._clock = PromptStatus(), ClockReading()

    def see(self, status: PromptStatus) -> None:
        """Take a status. It was some time on its way: it tells of the clock only that it is not earlier."""
        now, pace = self._wall(), status.pace
        told = ClockReading(status.clock, None if pace is None or pace.paused else pace.rate, now)
        if told.rate is not None and pace == self._status.pace:
            told = replace(told, now=max(told.now, replace(self._clock, floor=-inf).at(now)))
        self._status, self._clock = status, self._clock.then(told, now)

    def forget_pace(self) -> None:
        """Let the clock stand: the robot may be another one, with its own clock."""
        self._status = replace(self._status, pace=None)
        self._clock = ClockReading(max(self._clock.now, self._clock.floor))

    def now(self) -> PromptStatus:
        """The status with the clock as it is now."""
        return replace(self._status, clock=self._clock.at(self._wall()))
