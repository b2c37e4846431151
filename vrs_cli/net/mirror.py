"""Mirror a robot for its remote user: its timeline (a snapshot and all changes after it), its clock and its status.

Observers and viewers read a mirror like the robot itself. Pure: the caller passes messages in, and the wall clock is an
argument. If a change is missing, the mirror is `lost`: it stays as it is until a new snapshot arrives. It keeps only a
window of the past, so that it does not grow with time.
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

WINDOW = 600.0  # [s] length of the past that is kept by default
SLACK = 0.25  # old parts are dropped when longer than this fraction of the window, because each drop copies the rest


class ClockReading(Struct, frozen=True):
    """A reading of a robot's clock: `now` [s] when a wall clock showed `since` [s].

    The clock runs at `rate`; None: it does not run, because time is virtual or paused. A running clock shows at least
    `floor` [s].
    """

    now: float = 0.0
    rate: float | None = None
    since: float = 0.0
    floor: float = -inf

    def at(self, wall: float) -> float:
        """Return the robot's time [s] when the wall clock is at `wall` [s]."""
        if self.rate is None:
            return self.now
        return max(self.now, self.floor, down_to_grid(self.now + self.rate * (wall - self.since)))

    def then(self, later: ClockReading, wall: float) -> ClockReading:
        """Return the reading `later`, corrected so that the clock never goes back: if this clock was ahead of it, the
        clock stops until the later reading has caught up."""
        return replace(later, floor=self.at(wall)) if self.rate is not None and later.rate is not None else later


class _Held(Struct, frozen=True):
    """The state of a mirror after change `seq`: the timeline from segment number `first` on, with the `known` part of
    its events."""

    timeline: Timeline
    first: int
    settings: Settings
    seq: int
    known: KnownEvents

    @classmethod
    def of(cls, snapshot: Snapshot, seq: int) -> _Held:
        return cls(snapshot.timeline(), snapshot.first, snapshot.settings, seq, snapshot.known_events)

    def since(self, t: float, world: World | None) -> _Held:
        """Return the state without the segments that ended before t [s], and without events before the remaining
        segments, except the last value of each channel."""
        timeline, known = self.timeline, self.known
        gone = timeline.index_at(t)
        events = max(timeline.events_by(timeline[gone].start, before=True), known.values)
        values, later = last_values(timeline, events), timeline.event_slice(events, timeline.event_count)
        state = None if world is None else world.course(timeline).state_at(timeline[gone].start)
        kept = Timeline(islice(timeline, gone, None), timeline.version, (*values, *later), state)
        known = KnownEvents(known.first + events - known.values, len(values))
        return replace(self, timeline=kept, first=self.first + gone, known=known)

    def with_older(self, older: Snapshot) -> _Held:
        """Return the state extended by the segments and events of an older window."""
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
    """A copy of a remote robot. One thread passes messages in; any thread may read. `window`: how much of the past is
    kept, before the robot's clock [s]. `begins`: the start of the known part of the timeline [s]; joints for earlier
    times are invalid. `events`: the changes of the known timeline, as for a local robot. `world`: computes the state of
    the cell around the robot; None without a cell. `record`: the reports of the body."""

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
        self.before_measured: Callable[[], None] = lambda: None  # called before reports are read
        self._held = _Held.of(snapshot, seq)
        self.events: Feed[TimelineChange] = Feed(lambda: TimelineReplaced(self.timeline, self.settings))

    # --- reading ---

    @property
    def timeline(self) -> Timeline:
        return self._held.timeline

    @property
    def measured(self) -> MeasuredTimeline:
        """Return the known reports of the robot's body."""
        self.before_measured()
        return self.record.view

    @property
    def settings(self) -> Settings:
        """Return the settings at the time of the last snapshot."""
        return self._held.settings

    @property
    def now(self) -> float:
        """Return the robot's clock [s], estimated from its last reading."""
        return self.clock.at(self._wall())

    @property
    def rate(self) -> float | None:
        """Return the seconds of the robot's clock per real second; None if the clock is paused or virtual."""
        return self.clock.rate

    @property
    def seq(self) -> int:
        """Return the number of the last change contained in the timeline."""
        return self._held.seq

    def whole(self, delta: TimelineDelta) -> TimelineDelta:
        """Return a delta of the known timeline as a delta of the robot's whole timeline."""
        return unfit_delta(delta, self._held.first, self._held.known)

    @property
    def begins(self) -> float:
        """Return the start [s] of the known part of the timeline; -infinity if all of it is known."""
        return self._held.timeline.start if self._held.first else -inf

    # --- changes ---

    def replace(self, snapshot: Snapshot, seq: int) -> None:
        """Replace the timeline by a snapshot taken after change `seq`: the whole timeline, or a window up to its end.
        The mirror is no longer `lost`."""
        self._held, self.lost = self._drop_old(_Held.of(snapshot, seq)), False
        self.events.publish([TimelineReplaced(self.timeline, self.settings)])

    def change(self, delta: TimelineDelta, seq: int) -> None:
        """Apply change number `seq`; ignore it if it is old. If a change before it is missing, or it changes an unknown
        part of the past, the mirror is `lost`.
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
        """Apply change number `seq`, given by one steering target. If the change cannot be computed from the target,
        the mirror is `lost`, and the server must send later changes in full."""
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
        """Add an older window, which ends where the known part begins. Return False if it no longer fits; the caller
        then asks again."""
        held, count = self._held, self._held.first - older.first
        joint = older.segments[count : count + 1]  # the first known segment, which a later change may have shortened
        if self.lost or count < 0 or not joint or joint[0].truncate(held.timeline[0].finish) != held.timeline[0]:
            return False
        self._held = held.with_older(older)
        self.events.publish([TimelineReplaced(self.timeline, self.settings)])
        return True

    def _drop_old(self, held: _Held) -> _Held:
        """Return the state without the parts older than the window, or the same state if these are short."""
        begin = self.now - self.window
        old = held.timeline.start < begin - SLACK * self.window and held.timeline.index_at(begin)
        return held.since(begin, self.world) if old else held


def first_difference(before: Timeline, after: Timeline) -> float:
    """Return the first time [s] at which two timelines differ, of the times that both contain; infinity if the
    timelines are equal."""
    begin = max(before.start, after.start)
    for one, other in zip_longest(*(islice(one, one.index_at(begin), None) for one in (before, after))):
        if one is None or other is None:
            return float((other or one).start)
        if one != other:
            end = min(one.finish, other.finish)
            same = one.truncate(end) == other.truncate(end)
            return end if same else max(min(one.start, other.start), begin)
    return inf


class LastStatus:
    """The last received status of the robot, with a clock that continues. In real time this clock never goes back."""

    def __init__(self, wall: Callable[[], float]) -> None:
        self._wall = wall
        self._status, self._clock = PromptStatus(), ClockReading()

    def see(self, status: PromptStatus) -> None:
        """Take a status. The robot's clock is now at or after the time in it, because the message was delayed."""
        now, pace = self._wall(), status.pace
        reading = ClockReading(status.clock, None if pace is None or pace.paused else pace.rate, now)
        if reading.rate is not None and pace == self._status.pace:
            reading = replace(reading, now=max(reading.now, replace(self._clock, floor=-inf).at(now)))
        self._status, self._clock = status, self._clock.then(reading, now)

    def forget_pace(self) -> None:
        """Stop the clock, because the robot may have been restarted with a different clock."""
        self._status = replace(self._status, pace=None)
        self._clock = ClockReading(max(self._clock.now, self._clock.floor))

    def now(self) -> PromptStatus:
        """Return the status, with the current time of the robot's clock."""
        return replace(self._status, clock=self._clock.at(self._wall()))
