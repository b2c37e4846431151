"""Random sessions of motions and dated events, and the laws that hold after every command of them.

The timeline is what all deltas make, its events are those of a plain list, and so are those of mirrors: of one that has
all of it and of one that has a window, both from records as they go over a connection. UNDO and REDO give back every
bit, also over branches and MERGE. Inputs from outside never move. A file gives the same timeline and the same history.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from math import inf
from pathlib import Path
from random import Random

import msgspec

from tests.engine.mirror import windowed
from vrs_cli.engine.branches import MAIN, Branches
from vrs_cli.engine.clock import VirtualClock, WallClock
from vrs_cli.engine.engine import Engine
from vrs_cli.engine.feed import MissedEvents, Snapshot, TimelineReplaced
from vrs_cli.engine.position import joints_at
from vrs_cli.errors import VrsError
from vrs_cli.files.rebuild import apply, history_of
from vrs_cli.files.trajectory_file import read_trajectory, write_trajectory
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.net.mirror import ClockReading, Mirror
from vrs_cli.trajectory.instant import on_grid
from vrs_cli.trajectory.timeline import Timeline, TimelineDelta
from vrs_cli.values.commands import (
    FIRST_INPUT,
    HAND,
    Delay,
    Event,
    EventEdit,
    JointTarget,
    Move,
    OperateHand,
    SetChannels,
    SetParameter,
    Stamp,
)
from vrs_cli.wire.messages import SnapshotRecord, snapshot_of, snapshot_record
from vrs_cli.wire.records import DeltaRecord, Form, Motions, delta_of, delta_record

MODEL = load_robot("puma560")
READY = MODEL.poses["ready"]
CHANNELS = (HAND, 1, 2, 3, FIRST_INPUT, FIRST_INPUT + 1)
Image = tuple[tuple[object, ...], tuple[Event, ...]]


def image(timeline: Timeline) -> Image:
    return tuple(timeline), tuple(timeline.events)


def plain(events: list[Event], edit: EventEdit | None) -> list[Event]:
    if edit is None:
        return events
    behind = (event.shift_by(edit.shift) for event in events[edit.keep + edit.drop :])
    return [*events[: edit.keep], *edit.events, *behind]


def plain_value(events: list[Event], channel: int, t: float) -> float:
    changes = (e for e in reversed(events) if e.channel == channel and e.time <= t and not e.observed)
    return next((event.value for event in changes), 0.0)


def same_delta(delta: TimelineDelta, form: Form) -> TimelineDelta:
    """The delta as it comes out of a connection."""
    line = msgspec.json.encode(delta_record(delta, Motions()))
    return delta_of(msgspec.json.decode(line, type=DeltaRecord), Motions(), form)


def same_snapshot(snapshot: Snapshot, form: Form) -> Snapshot:
    line = msgspec.json.encode(snapshot_record(snapshot))
    return snapshot_of(msgspec.json.decode(line, type=SnapshotRecord), form)


class EventSession:
    """One random session. `walks`: time is real, and goes on between the commands."""

    def __init__(self, seed: int, *, walks: bool = False) -> None:
        self.random, self.wall = Random(seed), 0.0
        self.engine = Engine(MODEL, clock=WallClock(lambda: self.wall, self._sleep) if walks else VirtualClock())
        self.walks, self.form = walks, Form.of(self.engine.arm)
        self.branches = Branches(self.engine)
        self.changes = self.engine.events.subscribe(10**6)
        self.events = list[Event]()
        self.timeline = self.engine.timeline
        self.mirrors = [self._mirror(-inf, inf), self._mirror(0.0, 3.0)]
        self.seq, self.deltas, self.most = 0, 0, 0
        self.stack = list[Image]()  # before each step that is done, on the present branch, where this is known
        self.lost, self.forgot, self.clock = 0, 0, 0.0

    def _sleep(self, seconds: float) -> None:
        self.wall += seconds

    def _mirror(self, begin: float, window: float) -> Mirror:
        whole = Snapshot.of(self.engine.timeline, self.engine.settings)
        part = same_snapshot(whole if begin == -inf else self.part(whole, begin), self.form)
        return Mirror(self.engine.arm, part, 0, lambda: self.engine.now, window)

    def part(self, whole: Snapshot, begin: float) -> Snapshot:
        """The window of a snapshot from a time on [s]."""
        return windowed(whole, begin)

    # --- what is asked ---

    def run(self, length: int) -> None:
        for _ in range(length):
            before, done = image(self.engine.timeline), len(self.engine.book.history.done)
            self.clock = on_grid(self.engine.now)
            with suppress(VrsError):
                self.command()
            self._stacked(before, done)
            self.check()
            if self.walks:
                self.wall += self.random.choice((0.0, self.random.uniform(0.0, 0.4)))
                self.engine.clock.advance(self.wall)

    def command(self) -> None:
        r, engine = self.random, self.engine
        kind = r.random()
        if kind < 0.30:
            goal = (r.uniform(-2.0, 2.0), *READY[1:3], r.uniform(-1.0, 1.0), *READY[4:])
            hand = r.choice((None, None, 0.0, 1.0))
            engine.perform(
                Move(JointTarget(goal), False, hand, stamp=self.stamp(0.6), text="MOVE"), program=r.random() < 0.5
            )
        elif kind < 0.62:
            self.set_channels()
        elif kind < 0.70:
            engine.perform(
                OperateHand(r.choice((0.0, 1.0, None)), r.random() < 0.6, "HAND", None, self.stamp(0.3)), program=True
            )
        elif kind < 0.74:
            engine.perform(Delay(r.choice((0.0, r.uniform(0.0, 0.4)))), program=True)
        elif kind < 0.78:
            engine.perform(SetParameter("INSERT", r.choice(("ON", "ON", "OFF"))))
        elif kind < 0.80:
            engine.stop()
        elif kind < 0.90:
            engine.undo(r.randint(1, min(3, engine.book.history.commands or 1)))
        elif kind < 0.94:
            engine.redo(r.randint(1, 2))
        elif not self.walks:
            self.branch()

    def set_channels(self) -> None:
        r = self.random
        changes = tuple((r.choice(CHANNELS[1:]), float(r.randint(0, 1))) for _ in range(r.choice((1, 1, 2))))
        kind = r.random()
        if kind < 0.2:  # from outside
            inputs = tuple((r.choice(CHANNELS[4:]), value) for _, value in changes)
            self.engine.perform(SetChannels(inputs, Stamp(self.engine.now)), program=True)
        elif kind < 0.4:
            self.engine.perform(SetChannels(changes, text="WAIT SIG(1)", observed=True), program=True)
        else:
            self.engine.perform(SetChannels(changes, self.stamp(0.6), "SIGNAL"), program=True)

    def stamp(self, share: float) -> Stamp | None:
        r, end = self.random, max(self.engine.timeline.last, 1.0)
        if r.random() > share:
            return None
        return Stamp(r.uniform(0.0, 0.5), relative=True) if r.random() < 0.3 else Stamp(r.uniform(0.0, end * 1.2))

    def branch(self) -> None:
        r, branches = self.random, self.branches
        kind = r.random()
        if kind < 0.4 and len(branches.names) < 4:
            branches.make(f"b{r.randint(0, 10**6)}")
            return  # its commands are those of the branch that it comes from
        self.stack.clear()
        if kind < 0.7:
            branches.change_over(r.choice(branches.names))
        elif len(branches.names) > 1:
            branches.merge(r.choice(branches.names[1:]))

    # --- laws ---

    def _stacked(self, before: Image, done: int) -> None:
        """UNDO gives back every bit: the state before the first step that it takes back."""
        steps = self.engine.book.history.done
        if self.walks or (not self.stack and done):
            self.stack.clear()
            return
        if len(steps) == done + 1:
            self.stack.append(before)
        elif len(steps) < done:
            assert image(self.engine.timeline) == self.stack[len(steps)]
            del self.stack[len(steps) :]
        elif len(steps) > done:
            self.stack.clear()  # REDO of several: tried by `end`

    def check(self) -> None:
        engine = self.engine
        for event in self.changes.take_all():
            assert not isinstance(event, MissedEvents)
            self.seq += 1
            self.hear(event)
        timeline = engine.timeline
        assert list(timeline.events) == self.events
        assert image(self.timeline) == image(timeline)
        assert all(a.time <= b.time for a, b in zip(self.events, self.events[1:], strict=False))
        assert all(not event.time * 2.0**30 % 1.0 for event in self.events)
        self.most = max(self.most, len(self.events))
        book = engine.book
        if not self.random.randrange(8):
            replayed = book.initial
            for delta in book.deltas:
                replayed = apply(replayed, delta)  # which checks the order
            assert image(replayed) == image(timeline)
        for _ in range(4):
            t, channel = self.instant(), self.random.choice(CHANNELS)
            value = plain_value(self.events, channel, t)
            assert timeline.value_at(channel, t) == value
            for mirror in self.mirrors:
                assert t < mirror.begins or mirror.timeline.value_at(channel, t) == value
        self.check_mirrors(timeline)

    def check_mirrors(self, timeline: Timeline) -> None:
        assert image(self.mirrors[0].timeline) == image(timeline)
        window = self.mirrors[1].timeline
        begin = self.mirrors[1].begins
        self.forgot += begin > 0.0
        assert tuple(window) == tuple(timeline)[-len(window) :]
        known = tuple(event for event in window.events if event.time >= begin)
        assert known == tuple(event for event in timeline.events if event.time >= begin)
        t = self.instant()
        assert t < begin or self.mirrors[1].timeline.value_at(HAND, t) == self.engine.position(t).hand

    def instant(self) -> float:
        r = self.random
        near = [event.time for event in self.events[-8:]]
        return r.choice(near) if near and r.random() < 0.4 else r.uniform(-0.1, self.engine.timeline.last * 1.1 + 0.1)

    def hear(self, event: TimelineDelta | TimelineReplaced) -> None:
        for mirror in self.mirrors:
            mirror.clock = ClockReading(self.engine.now)
        if isinstance(event, TimelineReplaced):
            self.timeline, self.events = event.timeline, list(event.timeline.events)
            snapshot = Snapshot.of(event.timeline, event.settings)
            for mirror in self.mirrors:
                mirror.replace(same_snapshot(snapshot, self.form), self.seq)
            return
        self.deltas += 1
        self.check_outside(event)
        before, past = self.timeline, [one for one in self.events if one.time < self.clock]
        self.timeline, self.events = self.timeline.apply(event), plain(self.events, event.events)
        for mirror in self.mirrors:
            mirror.change(same_delta(event, self.form), self.seq)
            if mirror.lost:
                self.lost += 1
                whole = Snapshot.of(self.timeline, self.engine.settings)
                begin = self.random.uniform(0.0, self.timeline.end)
                mirror.replace(same_snapshot(self.part(whole, begin), self.form), self.seq)
        if self.walks:  # what is before the clock stays
            t = self.random.uniform(0.0, self.clock)
            assert joints_at(self.engine.arm, self.timeline, t) == joints_at(self.engine.arm, before, t)
            assert [one for one in self.events if one.time < self.clock] == past

    def check_outside(self, delta: TimelineDelta) -> None:
        """Inputs from outside stand at their times, unless they are dropped."""
        edit = delta.events
        if edit is None:
            return
        is_outside: Callable[[Event], bool] = lambda event: event.channel >= FIRST_INPUT and not event.tied  # noqa: E731
        after = plain(self.events, edit)
        for event in filter(is_outside, self.events):
            there = [one for one in after if one.number == event.number and one.channel == event.channel]
            assert not there or event in there

    def end(self, path: Path | None = None) -> None:
        """UNDO of all and REDO of all, and a file."""
        engine = self.engine
        self.branches.change_over(MAIN)
        self.check()
        if path is not None:
            write_trajectory(path, engine.model, engine.book.initial, engine.book.deltas)
            recording = read_trajectory(path)
            assert image(recording.timeline) == image(engine.timeline)
            assert repr(recording.deltas) == repr(tuple(engine.book.deltas))
        history = history_of(engine.book.initial, engine.book.deltas)
        ours = engine.book.history
        assert [step.delta.motion.number for step in history.done] == [step.delta.motion.number for step in ours.done]
        assert history.commands == ours.commands
        if self.walks or not ours.commands:
            return
        now, count = image(engine.timeline), ours.commands
        first = ours.done.index(ours.known_commands[0])
        engine.undo(count)
        assert len(ours.done) == first
        if not first:
            assert image(engine.timeline) == image(engine.book.initial)
        engine.redo(count)
        assert image(engine.timeline) == now


def session(seed: int, length: int, path: Path | None = None) -> EventSession:
    """Run one session, every fourth of them in real time."""
    it = EventSession(seed, walks=seed % 4 == 3)
    it.run(length)
    it.end(path)
    return it
