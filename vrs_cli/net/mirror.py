"""A robot as those have it who are told of it from afar: a snapshot, and every change of the timeline after it.

Observers and viewers look at a mirror as they look at the robot itself. It is pure: what has come is put in, the wall
clock is an argument. What does not follow on what is known is not guessed at: the mirror is `lost`, and stays as it
was, until another snapshot comes. Of the past it keeps a window, so that it does not grow with the time that it is
there.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import islice, zip_longest
from math import inf

from msgspec import Struct
from msgspec.structs import replace

from vrs_cli.engine.engine import Event
from vrs_cli.engine.feed import Feed
from vrs_cli.engine.settings import Settings
from vrs_cli.engine.snapshot import Snapshot, TimelineReplaced, fitted
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.trajectory.instant import down_to_grid
from vrs_cli.trajectory.timeline import Timeline, TimelineDelta
from vrs_cli.wire.records import Form, RecordError
from vrs_cli.wire.steered import SteeredRecord, steered_delta

WINDOW = 600.0  # [s] of the past that are kept, unless somebody wants more or less
SLACK = 0.25  # of the window may be there beside it: what has become too old goes together, at the cost of what stays


class ClockReading(Struct, frozen=True):
    """The clock of a robot: it was at `now` [s] when a wall clock was at `since` [s]. It goes on at `rate`, or (None)
    stands: the robot moves in virtual time, or the clock is paused. While it goes it shows no time before `floor` [s].
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
        """A later reading of the same clock, which does not go back: if it was thought to be ahead, it stands until its
        time has come.
        """
        goes_on = self.rate is not None and later.rate is not None
        return replace(later, floor=self.at(wall)) if goes_on else later


class _Held(Struct, frozen=True):
    """What is known at one moment: the timeline from its segment number `first` on, after change `seq`."""

    timeline: Timeline
    first: int
    settings: Settings
    seq: int

    @classmethod
    def of(cls, snapshot: Snapshot, seq: int) -> _Held:
        return cls(snapshot.timeline(), snapshot.first, snapshot.settings, seq)

    def since(self, t: float) -> _Held:
        """The same without what was before time t [s]."""
        gone = self.timeline.index_at(t)
        kept = Timeline(islice(self.timeline, gone, None), self.timeline.version)
        return replace(self, timeline=kept, first=self.first + gone)


class Mirror:
    """One robot that others move. One thread puts in what comes, any thread reads.

    `window`: so many seconds before the robot's clock are kept. `begins` is the time from which on the timeline is
    known: before it the robot was elsewhere than the mirror says. `events` tells of every change as the robot itself
    does, of what is known here.
    """

    def __init__(
        self, arm: RobotArm, snapshot: Snapshot, seq: int, wall: Callable[[], float], window: float = inf
    ) -> None:
        self.arm, self.window, self._wall = arm, window, wall
        self.clock = ClockReading()
        self.lost, self._form = False, Form.of(arm)
        self._held = _Held.of(snapshot, seq)
        self.events: Feed[Event] = Feed(lambda: TimelineReplaced(self.timeline, self.settings))

    # --- reading ---

    @property
    def timeline(self) -> Timeline:
        return self._held.timeline

    @property
    def settings(self) -> Settings:
        """Those in force when the last snapshot was taken."""
        return self._held.settings

    @property
    def now(self) -> float:
        """The robot's clock [s], by the last that was heard of it."""
        return self.clock.at(self._wall())

    @property
    def rate(self) -> float | None:
        """Seconds of the robot's clock in one second; None if its time does not pass by itself."""
        return self.clock.rate

    @property
    def seq(self) -> int:
        """The number of the last change that is in the timeline."""
        return self._held.seq

    @property
    def begins(self) -> float:
        """From when on it is known where the robot is [s]: always, or since a window begins."""
        return self._held.timeline.start if self._held.first else -inf

    # --- what comes ---

    def replace(self, snapshot: Snapshot, seq: int) -> None:
        """The timeline as it is after change `seq`, all of it or a window up to its end: all is known again."""
        self._held, self.lost = self._kept(_Held.of(snapshot, seq)), False
        self.events.publish([TimelineReplaced(self.timeline, self.settings)])

    def change(self, delta: TimelineDelta, seq: int) -> None:
        """The change of that number, which follows on the last one. One that is known already changes nothing; any
        other makes the mirror `lost`, as does one that reaches back behind what is known.
        """
        held = self._held
        if self.lost or seq <= held.seq:
            return
        follows = seq == held.seq + 1 and delta.version == held.timeline.version
        here = fitted(delta, held.timeline, held.first) if follows else None
        if here is None:
            self.lost = True
            return
        held = replace(held, timeline=held.timeline.apply(here), seq=seq)
        self._held = self._kept(held)
        forgot = self._held is not held
        self.events.publish([here, TimelineReplaced(self.timeline, self.settings)] if forgot else [here])

    def steer(self, target: SteeredRecord, seq: int) -> None:
        """The change of that number, which is one target of steering, in short. Where it does not become what it was,
        the mirror is `lost`, and changes have to come in full.
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
        """More of the past: an older window, which reaches up to what is known. False where it does not fit any more:
        it has to be asked for again.
        """
        held, count = self._held, self._held.first - older.first
        joint = older.segments[count : count + 1]  # the first that is held, perhaps cut off by now
        if self.lost or count < 0 or not joint or joint[0].truncated(held.timeline[0].finish) != held.timeline[0]:
            return False
        timeline = Timeline((*older.segments[:count], *held.timeline), held.timeline.version)
        self._held = replace(held, timeline=timeline, first=older.first)
        self.events.publish([TimelineReplaced(self.timeline, self.settings)])
        return True

    def _kept(self, held: _Held) -> _Held:
        """What is older than the window goes, where that is enough to be worth it."""
        begin = self.now - self.window
        old = held.timeline.start < begin - SLACK * self.window and held.timeline.index_at(begin)
        return held.since(begin) if old else held


def parting(before: Timeline, after: Timeline) -> float:
    """From when on two timelines differ, of what both know [s]; infinity where they do not."""
    begin = max(before.start, after.start)
    pairs = zip_longest(*(islice(one, one.index_at(begin), None) for one in (before, after)))
    for one, other in pairs:
        if one is None or other is None:
            return float((other or one).start)
        if one != other:
            end = min(one.finish, other.finish)
            same = one.truncated(end) == other.truncated(end)
            return end if same else max(min(one.start, other.start), begin)
    return inf
