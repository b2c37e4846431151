"""A robot as those have it who are told of it from afar: a snapshot, and every change of the timeline after it.

Observers and viewers look at a mirror as they look at the robot itself. It is pure: what has come is put in, the wall
clock is an argument. What does not follow on what is known is not guessed at: the mirror is `lost`, and stays as it
was, until another snapshot comes.
"""

from __future__ import annotations

from collections.abc import Callable
from math import inf

from msgspec import Struct, structs

from vrs_cli.engine.engine import Event
from vrs_cli.engine.feed import Feed
from vrs_cli.engine.settings import Settings
from vrs_cli.engine.snapshot import Replaced, Snapshot
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.trajectory.instant import down_to_grid
from vrs_cli.trajectory.segment import Segment
from vrs_cli.trajectory.timeline import Timeline, TimelineDelta
from vrs_cli.wire.records import Form, RecordError
from vrs_cli.wire.steered import SteeredRecord, steered_delta


class ClockReading(Struct, frozen=True):
    """The clock of a robot: it was at `now` [s] when a wall clock was at `since` [s]. It goes on at `rate`, or (None)
    stands: the robot moves in virtual time, or the clock is paused.
    """

    now: float = 0.0
    rate: float | None = None
    since: float = 0.0

    def at(self, wall: float) -> float:
        """The robot's time [s] when that wall clock is at `wall` [s]."""
        if self.rate is None:
            return self.now
        return max(self.now, down_to_grid(self.now + self.rate * (wall - self.since)))


class _Held(Struct, frozen=True):
    """What is known at one moment: `base` is the snapshot that all was made from, `timeline` what it has become."""

    base: Snapshot
    timeline: Timeline
    seq: int


class Mirror:
    """One robot that others move. One thread puts in what comes, any thread reads.

    `begins` is the time from which on the timeline is known: before it the robot was elsewhere than the mirror says.
    `events` tells of every change as the robot itself does, of what is known here.
    """

    def __init__(self, arm: RobotArm, snapshot: Snapshot, seq: int, wall: Callable[[], float]) -> None:
        self.arm, self._wall = arm, wall
        self.clock = ClockReading()
        self.lost, self._form = False, Form.of(arm)
        self._held = _Held(snapshot, snapshot.timeline(), seq)
        self.events: Feed[Event] = Feed(lambda: Replaced(self.timeline, self.settings))

    # --- reading ---

    @property
    def timeline(self) -> Timeline:
        return self._held.timeline

    @property
    def settings(self) -> Settings:
        """Those in force when the last snapshot was taken."""
        return self._held.base.settings

    @property
    def now(self) -> float:
        """The robot's clock [s], by the last that was heard of it."""
        return self.clock.at(self._wall())

    @property
    def seq(self) -> int:
        """The number of the last change that is in the timeline."""
        return self._held.seq

    @property
    def begins(self) -> float:
        """From when on it is known where the robot is [s]: always, or since a window begins."""
        return self._held.timeline.start if self._held.base.first else -inf

    # --- what comes ---

    def replace(self, snapshot: Snapshot, seq: int) -> None:
        """The timeline as it is after change `seq`, all of it or a window up to its end: all is known again."""
        self._held, self.lost = _Held(snapshot, snapshot.timeline(), seq), False
        self.events.publish([Replaced(self.timeline, self.settings)])

    def change(self, delta: TimelineDelta, seq: int) -> None:
        """The change of that number, which follows on the last one. One that is known already changes nothing; any
        other makes the mirror `lost`, as does one that reaches back behind what is known.
        """
        held = self._held
        if self.lost or seq <= held.seq:
            return
        follows = seq == held.seq + 1 and delta.version == held.timeline.version
        fitted = held.base.fitted(held.timeline, delta) if follows else None
        if fitted is None:
            self.lost = True
            return
        self._held = _Held(held.base, held.timeline.apply(fitted), seq)
        self.events.publish([fitted])

    def steer(self, target: SteeredRecord, seq: int) -> None:
        """The change of that number, which is one target of steering, in short. Where it does not become what it was,
        the mirror is `lost`, and changes have to come in full.
        """
        held = self._held
        if self.lost or seq <= held.seq:
            return
        try:
            delta = steered_delta(target, held.timeline, self.arm, self._form, held.base.first)
        except RecordError:
            self.lost = True
        else:
            self.change(delta, seq)

    def extend(self, older: Snapshot) -> bool:
        """More of the past: an older window, which reaches up to what is known. False where it does not fit any more:
        it has to be asked for again.
        """
        held, count = self._held, self._held.base.first - older.first
        joint = older.segments[count : count + 1]
        if self.lost or count < 0 or not joint or not _continue_each_other(joint[0], held.timeline[0]):
            return False
        base = structs.replace(held.base, first=older.first)
        timeline = Timeline((*older.segments[:count], *held.timeline), held.timeline.version)
        self._held = _Held(base, timeline, held.seq)
        self.events.publish([Replaced(self.timeline, self.settings)])
        return True


def _continue_each_other(older: Segment, held: Segment) -> bool:
    """Whether it is the same segment, perhaps cut off by now."""
    return older.truncated(held.finish) == held
