"""One robot told to many: who hears what, when, in which bytes; in virtual time, without a socket."""

from __future__ import annotations

import gc
import zlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from random import Random
from typing import TypeVar

import pytest

from tests.net.edits import Edits
from vrs_cli.engine.approximation import JointPiece
from vrs_cli.engine.clock import WallClock
from vrs_cli.engine.engine import Engine
from vrs_cli.engine.feed import MissedEvents as LeftOut
from vrs_cli.engine.feed import TimelineReplaced as Other
from vrs_cli.engine.position import joints_at, position_at
from vrs_cli.errors import IllegalValue
from vrs_cli.interfaces.roles import playback as viewers
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import at_position
from vrs_cli.net import broadcast
from vrs_cli.net import stream as streams
from vrs_cli.net.broadcast import AGAIN, HOLD, MAX_WAITING_BYTES, SLICE, Broadcast, Listener
from vrs_cli.net.messages import (
    Activity,
    Clock,
    Delta,
    FromServer,
    Missed,
    Play,
    PlayStep,
    Replaced,
    Sample,
    ServerMessage,
    Subscribe,
)
from vrs_cli.net.mirror import Mirror
from vrs_cli.net.stream import Listening, MessageForm, Packet
from vrs_cli.trajectory.polynomial import value
from vrs_cli.trajectory.segment import Segment
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.commands import JointTarget, Move, PoseTarget, Stamp
from vrs_cli.values.results import Position
from vrs_cli.wire import steered
from vrs_cli.wire.codec import Reader
from vrs_cli.wire.messages import snapshot_of
from vrs_cli.wire.records import Form as RobotForm
from vrs_cli.wire.records import Motions, SegmentRecord, delta_of

JSON, MSGPACK = MessageForm(text=True), MessageForm(text=False)
READER: Reader[ServerMessage] = Reader(FromServer)
M = TypeVar("M", bound=ServerMessage)


@dataclass
class Line:
    """A connection, and who hears at its other end, with one context to inflate with. `stalled`: nothing is taken."""

    stalled: bool = False
    queue: list[Packet] = field(default_factory=list)
    heard: list[ServerMessage] = field(default_factory=list)
    packets: list[Packet] = field(default_factory=list)  # all that were taken
    writes: int = 0

    def __post_init__(self) -> None:
        self._inflate = zlib.decompressobj(-15)

    @property
    def waiting(self) -> int:
        return sum(len(packet.data) for packet in self.queue)

    def send(self, *packets: Packet) -> None:
        self.writes += 1
        self.queue += packets
        if not self.stalled:
            self.take()

    def take(self) -> None:
        for packet in self.queue:
            data = packet.data if packet.place is None else self._inflate.decompress(packet.data + b"\x00\x00\xff\xff")
            self.heard.append(READER.read(data.decode() if packet.text else data))
        self.packets += self.queue
        self.queue.clear()

    def news(self, kind: type[M]) -> list[M]:
        """What was heard since the last time, which is all of one kind."""
        heard, self.heard = self.heard, []
        assert {type(message) for message in heard} <= {kind}
        return heard  # type: ignore[return-value]


class RoomServices:
    """A robot that is edited, and its broadcast, in virtual time."""

    def __init__(self) -> None:
        self.engine, self.wall = Engine(load_robot("puma560")), 0.0
        self._events = self.engine.events.subscribe(10**9)
        begin = self._events.take()
        assert isinstance(begin, Other)
        self.broadcast = Broadcast(self, begin, lambda: self.wall)

    @property
    def arm(self) -> RobotArm:
        return self.engine.arm

    @property
    def timeline(self) -> Timeline:
        return self.engine.timeline

    @property
    def now(self) -> float:
        return self.engine.now

    def move(self, angle: float = 0.1) -> None:
        """One more motion, there or back, and all hear of it."""
        first, *others = self.engine.position(self.engine.end).joints
        turn = -angle if first > 0.0 else angle
        self.engine.perform(Move(JointTarget((first + turn, *others)), False))
        self.tell()

    def bend(self) -> None:
        """Go where straight lines can begin."""
        self.engine.perform(Move(JointTarget((0.0, -0.8, 3.0, 0.0, 0.8, 0.0)), False))
        self.tell()

    def line(self, up: float) -> None:
        """A straight line up or down [m], and all hear of it."""
        pose = self.engine.position(self.engine.end).T_world_tool
        target = PoseTarget(at_position(pose, pose.px, pose.py, pose.pz + up))
        self.engine.perform(Move(target, straight=True))
        self.tell()

    def tell(self) -> None:
        """All hear of what has happened."""
        for event in self._events.take_all():
            assert not isinstance(event, LeftOut)
            self.broadcast.tell(event, self.now)
        self.until(self.wall)

    def until(self, wall: float) -> None:
        """Time goes on; what becomes due is done when it is due."""
        while (due := self.broadcast.peek()) <= wall:
            self.wall = max(self.wall, due)
            self.broadcast.step()
        self.wall = wall

    def listen(
        self, wanted: Subscribe, form: MessageForm = MSGPACK, *, deflates: bool = False, stalled: bool = False
    ) -> tuple[Line, Listener]:
        line = Line(stalled)
        listener = self.broadcast.join(line, form, deflates=deflates)
        self.broadcast.subscribe(listener, wanted)
        return line, listener


CHANGES = Subscribe(1, deltas=True)


def samples(rate: float) -> Subscribe:
    return Subscribe(1, rate=rate)


@pytest.fixture
def services() -> RoomServices:
    return RoomServices()


class Follower:
    """A mirror at the end of a line. `missed`: how many changes it was told of that it has missed."""

    def __init__(self, services: RoomServices, line: Line) -> None:
        self._arm, self._form, self._line = services.arm, RobotForm.of(services.arm), line
        self.mirror: Mirror | None = None
        self.missed = 0

    def hear(self) -> Mirror:
        for message in self._line.heard:
            match message:
                case Missed():
                    self.missed += message.count
                case Replaced():
                    snapshot = snapshot_of(message.snapshot, self._form)
                    if self.mirror is None:
                        self.mirror = Mirror(self._arm, snapshot, message.number, lambda: 0.0)
                    else:
                        self.mirror.replace(snapshot, message.number)
                case Delta():
                    assert self.mirror is not None
                    self.mirror.change(delta_of(message.delta, Motions(), self._form), message.number)
        self._line.heard.clear()
        assert self.mirror is not None
        return self.mirror


# --- changes --------------------------------------------------------------------------------------------------------


def test_who_comes_late_hears_a_snapshot_and_every_change_after_it(services: RoomServices) -> None:
    services.move()
    line, _ = services.listen(CHANGES)
    [snapshot] = line.news(Replaced)
    assert (snapshot.number, snapshot.snapshot.version) == (1, 1)
    services.move()
    first = services.now
    services.move()
    assert [(change.number, change.applied) for change in line.news(Delta)] == [(2, first), (3, services.now)]


def test_one_encoding_for_all_of_one_form(services: RoomServices) -> None:
    lines = [
        services.listen(CHANGES, form, deflates=deflates)[0] for form in (JSON, MSGPACK) for deflates in (0, 0, 1, 1)
    ]
    services.move()
    last = [line.packets[-1] for line in lines]
    assert len({id(packet) for packet in last}) == 4
    assert all(a is b for a, b in zip(last[::2], last[1::2], strict=True))
    assert len({repr(line.heard[-1]) for line in lines}) == 1


def test_what_is_deflated_is_a_third(services: RoomServices) -> None:
    plain, _ = services.listen(CHANGES)
    small, _ = services.listen(CHANGES, deflates=True)
    for _ in range(20):
        services.move()
    assert plain.heard[1:] == small.heard[1:]
    sizes = [sum(len(packet.data) for packet in line.packets[1:]) for line in (plain, small)]
    assert sizes[1] < sizes[0] / 3


def test_who_joins_later_can_inflate_what_is_deflated_for_all(services: RoomServices) -> None:
    early, _ = services.listen(CHANGES, deflates=True)
    services.move()
    services.move()
    late, _ = services.listen(CHANGES, deflates=True)
    services.move()
    services.move()
    assert early.heard[-2:] == late.heard[-2:]
    assert all(a is b for a, b in zip(early.packets[-2:], late.packets[-2:], strict=True))
    assert late.packets[-1].place is not None


def test_another_timeline_takes_the_place_of_the_one_before_for_all(services: RoomServices) -> None:
    (line, _), edits = services.listen(CHANGES), Edits(3, services.engine)
    services.tell()
    line.heard.clear()
    edits.load()
    services.tell()
    [other] = line.news(Replaced)
    assert other.number == services.broadcast.stream.number


def test_a_window_is_what_it_was_asked_for(services: RoomServices) -> None:
    for _ in range(10):
        services.move()
    line, _ = services.listen(Subscribe(1, deltas=True, window=0.5))
    [message] = line.news(Replaced)
    snapshot = snapshot_of(message.snapshot, RobotForm.of(services.arm))
    assert 1 < len(snapshot.segments) < len(services.timeline)
    for t in (services.now - 0.5, services.now - 0.1, services.now):
        assert joints_at(services.arm, snapshot.timeline(), t) == joints_at(services.arm, services.timeline, t)


def test_older_parts_are_to_be_had_and_long_ones_begin_later(
    services: RoomServices, monkeypatch: pytest.MonkeyPatch
) -> None:
    for _ in range(10):
        services.move()
    record = services.broadcast.stream.part(1.0, 2.0)
    part = snapshot_of(record, RobotForm.of(services.arm))
    for t in (1.0, 1.5, 2.0):
        assert joints_at(services.arm, part.timeline(), t) == joints_at(services.arm, services.timeline, t)
    again = services.broadcast.stream.part(1.0, 2.0)
    assert again is record, "it is encoded once for all who ask"
    monkeypatch.setattr(streams, "SEGMENTS", 5)
    last = snapshot_of(services.broadcast.stream.part(0.0), RobotForm.of(services.arm))
    assert last.segments == tuple(services.timeline)[-5:]
    line, _ = services.listen(CHANGES)
    [message] = line.news(Replaced)
    assert len(message.snapshot.segments) == 5
    assert message.snapshot.first == len(services.timeline) - 5


def test_a_snapshot_is_bounded_in_bytes(services: RoomServices, monkeypatch: pytest.MonkeyPatch) -> None:
    for _ in range(40):
        services.move()
    monkeypatch.setattr(streams, "SNAPSHOT_BYTES", 10_000)
    line, _ = services.listen(CHANGES, JSON)
    assert 2000 < len(line.packets[-1].data) <= 10_000
    [message] = line.news(Replaced)
    assert message.snapshot.first > 0
    assert len(services.broadcast.stream.part(-1.0).segments) == len(message.snapshot.segments)


# --- pieces of lines ---


def evaluated(segments: Iterable[SegmentRecord], t: float) -> Joints:
    """The joints at t as a client without inverse kinematics computes them, between the first segment and the last."""
    segment = [one for one in segments if one.start <= t][-1]
    s = min(t, segment.finish) - segment.start
    rows = segment.joints
    for piece in segment.pieces:
        rows = piece.joints
        if s <= piece.duration:
            break
        s -= piece.duration
    assert rows is not None
    return tuple(value(tuple(a), s) for a in rows)


def check_pieces(services: RoomServices, segments: Sequence[SegmentRecord], tolerance: float) -> None:
    assert any(segment.pieces for segment in segments)
    assert all(bool(segment.pieces) == (segment.line is not None) for segment in segments)
    begin, end = segments[0].start, segments[-1].finish
    for k in range(200):
        t = begin + (end - begin) * k / 199
        q = joints_at(services.arm, services.timeline, t)
        assert evaluated(segments, t) == pytest.approx(q, abs=tolerance)


def test_lines_come_as_pieces_in_snapshots_windows_and_changes(services: RoomServices) -> None:
    services.bend()
    services.line(0.1)
    lines = [services.listen(Subscribe(1, deltas=True, joints=2e-3), form)[0] for form in (JSON, MSGPACK)]
    plain, _ = services.listen(CHANGES)
    for line in lines:
        [message] = line.news(Replaced)
        check_pieces(services, message.snapshot.segments, 1e-3)
    [message] = plain.news(Replaced)
    assert not any(segment.pieces for segment in message.snapshot.segments)
    check_pieces(services, services.broadcast.stream.part(0.0, joints=1e-4).segments, 1e-4)
    services.line(-0.1)
    for line in lines:
        [change] = line.news(Delta)
        check_pieces(services, change.delta.segments, 1e-3)
    [change] = plain.news(Delta)
    assert not any(segment.pieces for segment in change.delta.segments)


def test_pieces_are_computed_and_encoded_once_for_all_who_want_them(
    services: RoomServices, monkeypatch: pytest.MonkeyPatch
) -> None:
    services.bend()
    joints_of, asked = steered.joint_pieces, list[float]()

    def counted(arm: RobotArm, segment: Segment, tolerance: float) -> tuple[JointPiece, ...]:
        asked.append(tolerance)
        return joints_of(arm, segment, tolerance)

    monkeypatch.setattr(steered, "joint_pieces", counted)
    lines = [services.listen(Subscribe(1, deltas=True, joints=joints))[0] for joints in (1e-3, 2e-3, 9e-3)]
    services.line(0.1)
    first, second, third = (line.packets[-1] for line in lines)
    assert first is second is third
    count = len(asked)
    change = lines[0].heard[-1]
    assert isinstance(change, Delta)
    assert count == len(change.delta.segments), "all three are served within 1e-3"
    services.listen(Subscribe(1, deltas=True, joints=5e-3))
    services.broadcast.stream.part(0.0, joints=1e-3)
    assert len(asked) == count, "a later snapshot has the pieces that were computed"


def test_a_snapshot_with_many_new_lines_begins_later(services: RoomServices, monkeypatch: pytest.MonkeyPatch) -> None:
    services.bend()
    for k in range(4):
        services.line(0.05 * (-1) ** k)
    monkeypatch.setattr(streams, "NEW_LINES", 4)
    line, _ = services.listen(Subscribe(1, deltas=True, joints=1e-3))
    [message] = line.news(Replaced)
    assert len(message.snapshot.segments) == 4
    assert message.snapshot.first == len(services.timeline) - 4
    check_pieces(services, message.snapshot.segments, 1e-3)
    whole = services.broadcast.stream.part(-1.0, joints=1e-3)
    assert len(whole.segments) == len(services.timeline), "the last four are known now, and four are new"


@pytest.mark.parametrize("joints", [0.0, -1.0, 1e-9, 3.0])
def test_a_tolerance_without_sense_is_refused_and_leaves_the_subscription(
    services: RoomServices, joints: float
) -> None:
    line, listener = services.listen(CHANGES)
    with pytest.raises(IllegalValue, match=r"a tolerance from 1e-05 to 0.1 rad"):
        services.broadcast.subscribe(listener, Subscribe(2, deltas=True, joints=joints))
    line.news(Replaced)
    services.move()
    assert len(line.news(Delta)) == 1


# --- what is kept ---


def timelines() -> int:
    gc.collect()
    return sum(type(one) is Timeline for one in gc.get_objects())


def remembered(services: RoomServices) -> list[int]:
    """The numbers of the changes that the stream has in memory."""
    stream = services.broadcast.stream
    return [n + 1 for n in range(stream.number) if stream.after(n, Listening(MSGPACK), None) is not None]


def test_where_nobody_listens_no_change_is_encoded_or_kept(
    services: RoomServices, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(streams, "delta_record", None)  # nothing is encoded
    _, listener = services.listen(samples(10.0))
    services.move()
    before = timelines()
    for _ in range(50):
        services.move()
    assert timelines() <= before
    services.broadcast.leave(listener)
    assert remembered(services) == []


def test_a_change_that_is_kept_holds_no_old_timeline(services: RoomServices) -> None:
    line, _ = services.listen(CHANGES)
    services.move()
    before = timelines()
    for _ in range(50):
        services.move()
    assert timelines() <= before
    assert len(line.heard) == 52
    assert remembered(services) == [*range(1, 52)]


def test_the_timeline_of_the_robot_is_held_and_no_other_with_rows_of_its_own(services: RoomServices) -> None:
    for number in range(20):
        for _ in range(1 + number % 3):  # changes that are told together
            first, *others = services.engine.position(services.engine.end).joints
            services.engine.perform(Move(JointTarget((first + 0.01, *others)), False))
        services.tell()
        assert services.broadcast.stream.timeline is services.timeline


def test_changes_are_kept_for_a_while_for_who_may_come_back(
    services: RoomServices, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(streams, "REMEMBERED", 20)
    _, listener = services.listen(CHANGES)
    services.broadcast.leave(listener)
    for _ in range(20):
        services.move()
    assert remembered(services) == [*range(1, 21)]
    services.move()
    assert remembered(services) == []


# --- after a cut ----------------------------------------------------------------------------------------------------


def test_who_was_cut_off_hears_what_it_has_missed_and_nothing_twice(services: RoomServices) -> None:
    _, listener = services.listen(CHANGES)
    services.move()
    services.broadcast.leave(listener)
    services.move()
    services.move()
    again, _ = services.listen(Subscribe(2, deltas=True, after=1), deflates=True)
    assert [change.number for change in again.news(Delta)] == [2, 3]
    services.move()
    assert [change.number for change in again.news(Delta)] == [4]


def test_what_is_not_remembered_is_missed_and_made_up_for(
    services: RoomServices, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(streams, "REMEMBERED", 3)
    services.listen(CHANGES)
    for _ in range(10):
        services.move()
    line, _ = services.listen(Subscribe(1, deltas=True, after=2))
    missed, replaced = line.heard
    assert missed == Missed(8)
    assert isinstance(replaced, Replaced)
    line, _ = services.listen(Subscribe(1, deltas=True, after=7))
    assert [change.number for change in line.news(Delta)] == [8, 9, 10]


def test_a_number_of_another_life_gets_a_snapshot(services: RoomServices) -> None:
    line, _ = services.listen(Subscribe(1, deltas=True, after=99))
    assert len(line.news(Replaced)) == 1


def test_resync_gives_a_snapshot(services: RoomServices) -> None:
    line, listener = services.listen(CHANGES)
    services.move()
    line.heard.clear()
    services.broadcast.resync(listener, full=True)
    [snapshot] = line.news(Replaced)
    assert snapshot.number == 1
    assert listener.form.full


def test_what_happens_at_once_is_one_write(services: RoomServices) -> None:
    lines = [
        services.listen(CHANGES, form, deflates=deflates)[0] for form in (JSON, MSGPACK) for deflates in (True, False)
    ]
    for line in lines:
        line.writes, line.heard = 0, []
    for number in (1, 2):
        services.engine.perform(Move(JointTarget((0.1 * number, *services.engine.position().joints[1:])), False))
    services.broadcast.announce(Clock(1.0))
    services.broadcast.announce(Activity("ada", ("wig",)))
    services.tell()
    for line in lines:
        assert line.writes == 1
        assert [type(message) for message in line.heard] == [Delta, Delta, Clock, Activity]


# --- who is slow ----------------------------------------------------------------------------------------------------


def test_a_line_that_takes_nothing_holds_little_and_delays_nobody(
    services: RoomServices, monkeypatch: pytest.MonkeyPatch
) -> None:
    little, moves = MAX_WAITING_BYTES // 8, 400
    monkeypatch.setattr(broadcast, "MAX_WAITING_BYTES", little)
    slow, listener = services.listen(CHANGES, JSON, stalled=True)
    fast, _ = services.listen(CHANGES, JSON)
    most = 0
    for _ in range(moves):
        services.move()
        most = max(most, slow.waiting)
    assert little / 2 < most <= little
    assert len(fast.heard) == moves + 1
    got = listener.number
    slow.take()
    slow.stalled = False
    slow.heard.clear()
    services.until(services.wall + AGAIN)
    missed, replaced = slow.heard
    assert missed == Missed(moves - got)
    assert isinstance(replaced, Replaced)
    assert replaced.number == moves
    services.move()
    assert slow.heard[-1] == fast.heard[-1]


def test_a_crowd_that_has_stalled_is_served_slice_by_slice(services: RoomServices) -> None:
    lines = [services.listen(CHANGES, stalled=True)[0] for _ in range(3 * SLICE)]
    services.broadcast.tell(Other(services.timeline, services.engine.settings), 0.0)
    services.until(services.wall)
    for line in lines:
        line.stalled = False
        line.take()
    for number in range(1, 4):
        services.until(services.wall + AGAIN)
        assert sum(len(line.packets) == 2 for line in lines) == number * SLICE
    assert services.broadcast.peek() == float("inf")


def test_who_stalls_for_a_moment_misses_nothing(services: RoomServices, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(broadcast, "MAX_WAITING_BYTES", 3000)
    line, _ = services.listen(CHANGES)
    line.stalled = True
    for _ in range(10):
        services.move()
    assert 0 < line.waiting <= 3000
    line.stalled = False
    line.take()
    services.until(services.wall + AGAIN)
    numbers = [message.number for message in line.heard[1:] if isinstance(message, Delta)]
    assert numbers == list(range(1, 11))


def test_what_is_sent_at_once_is_bounded_unless_one_packet_is_more(
    services: RoomServices, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whoever has stalled hears many changes in writes of two packets, as three are too many."""
    line, _ = services.listen(CHANGES)
    services.move()
    size = len(line.packets[-1].data)
    line.stalled = True
    monkeypatch.setattr(broadcast, "MAX_WAITING_BYTES", 0)  # no more is taken
    for _ in range(9):
        services.move()
    line.take()
    line.stalled, before, writes = False, len(line.packets), list[int]()
    monkeypatch.setattr(line, "send", lambda *packets: (writes.append(len(packets)), type(line).send(line, *packets)))
    monkeypatch.setattr(broadcast, "MAX_WAITING_BYTES", int(2.5 * size))
    services.until(services.wall + AGAIN)
    assert sum(writes) == 11 - before
    assert max(writes[:-1]) == 2


def test_a_line_that_takes_nothing_is_looked_at_again_after_a_while_and_not_at_once(
    services: RoomServices, monkeypatch: pytest.MonkeyPatch
) -> None:
    line, _ = services.listen(CHANGES, stalled=True)
    assert services.broadcast.peek() == float("inf"), "it takes a first packet"
    monkeypatch.setattr(broadcast, "MAX_WAITING_BYTES", 0)
    services.wall = 5.0
    services.broadcast.tell(Other(services.timeline, services.engine.settings), 0.0)
    for look in range(3):
        services.broadcast.step()
        assert services.broadcast.peek() == services.wall + AGAIN, look
        services.wall += AGAIN
    assert len(line.queue) == 1


def test_a_snapshot_in_another_form_is_counted_in_place_of_the_one_before(services: RoomServices) -> None:
    """Changes are encoded in the forms that somebody hears, and in no other."""
    line, listener = services.listen(CHANGES, JSON)
    services.broadcast.resync(listener, full=True)
    services.move()
    assert listener.form.full
    assert {packet.text for packet in line.packets} == {True}
    hearing = {form for form, count in services.broadcast.stream._listeners.items() if count}
    assert hearing == {listener.form}
    services.broadcast.leave(listener)
    assert not any(services.broadcast.stream._listeners.values())


@pytest.mark.parametrize("seed", range(3))
def test_mirrors_are_equal_to_the_bit_however_slow_their_lines_are(
    services: RoomServices, seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(broadcast, "MAX_WAITING_BYTES", 5000)
    monkeypatch.setattr(streams, "REMEMBERED", 5)
    edits = Edits(seed, services.engine)
    services.tell()
    random = edits.random
    lines = [
        services.listen(CHANGES, form, deflates=deflates)[0] for form in (JSON, MSGPACK) for deflates in (True, False)
    ]
    followers = [Follower(services, line) for line in lines]
    for _ in range(100):
        edits.edit()
        line = random.choice(lines)
        line.stalled = not line.stalled
        if not line.stalled:
            line.take()
        services.tell()
    for line in lines:
        line.stalled = False
        line.take()
    services.until(services.wall + AGAIN)
    for follower in followers:
        assert repr(list(follower.hear().timeline)) == repr(list(services.timeline))
        assert follower.missed


# --- samples --------------------------------------------------------------------------------------------------------


def test_samples_come_at_the_rate_of_each(services: RoomServices) -> None:
    services.move()
    (slow, _), (fast, _) = services.listen(samples(5.0)), services.listen(samples(20.0), JSON)
    services.until(2.0)
    assert len(slow.news(Sample)) == 10
    seen = fast.news(Sample)
    assert len(seen) == 40
    for sample in seen:
        assert sample.joints == joints_at(services.arm, services.timeline, sample.t)
    assert {(sample.version, sample.clock) for sample in seen} == {(1, services.now)}


class ServicesInRealTime(RoomServices):
    """The same, while the clock on the wall is the robot's."""

    def __init__(self) -> None:
        super().__init__()
        self.engine.clock = WallClock(lambda: self.wall, lambda _seconds: None)

    @property
    def now(self) -> float:
        return self.engine.clock.reached

    def command(self, random: Random) -> None:
        """A motion that begins a little later, and may interrupt another."""
        self.engine.clock.advance(self.now)
        goal = tuple(q + random.uniform(-0.5, 0.5) for q in self.engine.model.poses["ready"])
        stamp = Stamp(random.uniform(0.0, 0.4), relative=True)
        self.engine.begin(Move(JointTarget(goal), False, stamp=stamp), program=False)
        self.tell()


def test_who_looks_ahead_is_told_what_was_wrong() -> None:
    services, random, ahead = ServicesInRealTime(), Random(3), 0.5
    (line, _), (now, _) = services.listen(Subscribe(1, rate=50.0, ahead=ahead)), services.listen(samples(50.0))
    for _ in range(40):
        services.until(services.wall + random.uniform(0.1, 0.6))
        services.command(random)
    services.until(services.wall + 2.0)
    seen = line.news(Sample)
    assert all(sample.t == pytest.approx(sample.clock + ahead, abs=0.021) for sample in seen)
    wrong = [k for k, it in enumerate(seen) if joints_at(services.arm, services.timeline, it.t) != it.joints]
    told = [
        k
        for k, it in enumerate(seen)
        if any(later.wrong is not None and later.wrong <= it.t for later in seen[k + 1 : k + 30])
    ]
    assert len(wrong) > 100
    assert set(wrong) <= set(told)
    assert not [it for it in now.news(Sample) if it.wrong is not None], "the present is never made wrong"


def test_who_follows_at_one_rate_shares_one_evaluation_and_one_encoding(
    services: RoomServices, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = []

    def counted(arm: RobotArm, timeline: Timeline, t: float) -> Position:
        asked.append(t)
        return position_at(arm, timeline, t)

    monkeypatch.setattr(viewers, "position_at", counted)
    lines = []
    for moment in (0.0, 0.003, 0.017):  # they come at any time, and look together
        services.until(moment)
        lines.append(services.listen(samples(50.0))[0])
    asked.clear()
    services.until(1.0)
    assert len(asked) == 50
    assert all(
        len({id(packet) for packet in packets}) == 1
        for packets in zip(*[line.packets[-40:] for line in lines], strict=True)
    )


def test_who_comes_while_looks_are_late_shares_them_too(services: RoomServices) -> None:
    services.engine.clock.set(0.0)
    lines = []
    for moment in (0.0, 0.5, 2.5):  # in real time, and nothing was done meanwhile
        services.wall = moment
        services.engine.clock.set(moment)
        lines.append(services.listen(samples(50.0))[0])
    services.until(2.6)
    assert len({id(line.packets[-1]) for line in lines}) == 1


def test_a_viewer_plays_by_itself_and_follows_again(services: RoomServices) -> None:
    services.move(2.0)
    (line, listener), (other, _) = services.listen(samples(4.0)), services.listen(samples(4.0))

    def shown() -> list[float]:
        line.heard.clear()
        services.until(services.wall + 0.5)
        return [sample.t for sample in line.news(Sample)]

    services.broadcast.play(listener, Play(PlayStep.REWIND))
    assert shown() == [0.25, 0.5]
    services.broadcast.play(listener, Play(PlayStep.PAUSE))
    assert shown() == [0.5, 0.5]
    services.broadcast.play(listener, Play(PlayStep.RATE, 0.1))
    services.broadcast.play(listener, Play(PlayStep.PLAY))
    assert shown() == pytest.approx([0.525, 0.55])
    services.broadcast.play(listener, Play(PlayStep.SEEK, 0.1))
    assert shown() == pytest.approx([0.125, 0.15])
    assert {sample.t for sample in other.news(Sample)} == {services.now}
    services.broadcast.play(listener, Play(PlayStep.FOLLOW))
    assert shown() == [services.now, services.now]
    assert line.packets[-1] is other.packets[-1]


def test_who_follows_later_does_not_wait_for_those_whom_virtual_time_has_left_behind(services: RoomServices) -> None:
    early, _ = services.listen(samples(4.0))
    services.until(1.0)
    services.move(1.0)
    late, _ = services.listen(samples(4.0))
    services.until(1.25)
    assert early.news(Sample)[-1].t == 0.25
    assert late.news(Sample)[-1].t == services.now


def test_a_stalled_viewer_gets_the_newest_sample_and_no_burst(services: RoomServices) -> None:
    line, _ = services.listen(samples(50.0), stalled=True)
    services.until(10.0)
    assert len(line.queue) == 1
    line.stalled = False
    line.take()
    line.heard.clear()
    services.until(10.1)
    assert len(line.news(Sample)) == 5


def test_a_server_that_stalls_sends_no_burst(services: RoomServices) -> None:
    line, _ = services.listen(samples(50.0))
    services.wall = 10.0
    services.until(10.0)
    assert len(line.news(Sample)) == 1


@pytest.mark.parametrize("rate", [201.0, -1.0, float("nan")])
def test_a_rate_that_is_none_is_refused_and_changes_nothing(services: RoomServices, rate: float) -> None:
    line, listener = services.listen(samples(50.0))
    with pytest.raises(IllegalValue, match="samples a second"):
        services.broadcast.subscribe(listener, samples(rate))
    services.until(1.0)
    assert len(line.heard) == 50


def test_nothing_is_due_where_nobody_listens(services: RoomServices) -> None:
    _, listener = services.listen(Subscribe(1, deltas=True, rate=50.0))
    services.broadcast.leave(listener)
    services.broadcast.tell(Other(services.timeline, services.engine.settings), 0.0)
    assert services.broadcast.peek() == float("inf")


# --- slices ---------------------------------------------------------------------------------------------------------


def test_a_step_is_a_slice(services: RoomServices) -> None:
    lines = [services.listen(CHANGES)[0] for _ in range(3 * SLICE)]
    services.engine.perform(Move(JointTarget((0.1, -1.0, 1.0, 0.0, 0.5, 0.0)), False))
    services.broadcast.tell(services.engine.book.deltas[-1:][0], 0.0)
    for number in range(1, 4):
        services.broadcast.step()
        assert sum(len(line.packets) == 2 for line in lines) == number * SLICE
    assert services.broadcast.peek() > services.wall


def test_where_there_is_no_time_for_all_each_misses_the_same(services: RoomServices) -> None:
    lines = [services.listen(samples(50.0))[0] for _ in range(3 * SLICE)]
    for number in range(1, 31):
        services.wall = number / 50.0
        services.broadcast.step()
        services.broadcast.step()
    assert {len(line.packets) for line in lines} == {20}


def test_who_leaves_in_the_middle_of_a_round_costs_nobody_a_turn(services: RoomServices) -> None:
    joined = [services.listen(samples(50.0)) for _ in range(2 * SLICE)]
    services.wall = 0.02
    services.broadcast.step()
    for _, listener in (*joined[:10], *joined[-10:]):
        services.broadcast.leave(listener)
    services.until(0.02)
    assert {len(line.packets) for line, _ in joined[:-10]} == {1}
    assert {len(line.packets) for line, _ in joined[-10:]} == {0}


def test_nothing_is_sent_before_an_answer_and_not_much_later(services: RoomServices) -> None:
    line, _ = services.listen(samples(50.0))
    services.broadcast.hold()
    services.until(HOLD - 0.001)
    assert not line.heard
    services.broadcast.release()
    services.until(HOLD)
    assert len(line.heard) == 1
    services.until(1.0)
    services.broadcast.hold()
    services.until(1.0 + HOLD)
    assert len(line.heard) == 51


def test_half_of_the_time_is_left_for_those_who_listen(services: RoomServices) -> None:
    line, _ = services.listen(samples(200.0))
    while services.wall < 2.0:
        services.broadcast.hold()
        services.until(services.wall + 0.001)
    assert len(line.heard) > 150


# --- news -----------------------------------------------------------------------------------------------------------


def test_news_are_heard_by_all_and_by_who_comes_later(services: RoomServices) -> None:
    line, _ = services.listen(samples(1.0))
    services.broadcast.announce(Clock(1.0, rate=2.0))
    services.broadcast.announce(Clock(2.0, rate=3.0))
    services.tell()
    assert [clock.now for clock in line.news(Clock)] == [2.0]
    later, _ = services.listen(CHANGES)
    assert later.heard[0] == Clock(2.0, rate=3.0)


def test_who_is_stalled_hears_the_last_news_of_a_type(services: RoomServices, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(broadcast, "MAX_WAITING_BYTES", 10)
    line, _ = services.listen(Subscribe(1), stalled=True)
    for number in range(10):
        services.broadcast.announce(Clock(float(number)))
        services.tell()
    assert len(line.queue) == 1
    line.stalled = False
    line.take()
    services.until(AGAIN)
    assert [clock.now for clock in line.news(Clock)] == [0.0, 9.0]
