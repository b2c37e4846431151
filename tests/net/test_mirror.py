"""Mirrors: the robot to the bit, whatever comes, is missing, comes twice, or is asked for later."""

from __future__ import annotations

import tracemalloc
from math import inf
from statistics import median

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.engine.mirror import windowed
from tests.examples import some
from tests.net.edits import Edits
from tests.wire.test_steered import waves
from vrs_cli.engine.clock import WallClock
from vrs_cli.engine.engine import Engine, TimelineChange
from vrs_cli.engine.feed import MissedEvents, Snapshot, TimelineReplaced
from vrs_cli.interfaces.roles.playback import Audience
from vrs_cli.interfaces.roles.supervisor import Observer
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.net import messages
from vrs_cli.net.messages import Delta, FromServer
from vrs_cli.net.mirror import SLACK, ClockReading, Mirror
from vrs_cli.trajectory.timeline import Timeline, TimelineDelta
from vrs_cli.wire.codec import Encoding, Reader, encode
from vrs_cli.wire.messages import snapshot_of, snapshot_record
from vrs_cli.wire.records import Form, Motions, delta_of, delta_record
from vrs_cli.wire.steered import SteeredRecord, steered_record

READER: Reader[FromServer] = Reader(FromServer)


def bits(timeline: Timeline) -> str:
    return repr((timeline.version, list(timeline)))


class Line:
    """What a robot tells, as numbered values that went through bytes."""

    def __init__(self, engine: Engine, encoding: Encoding = Encoding.MSGPACK) -> None:
        self.engine, self.encoding, self.seq = engine, encoding, 0
        self.form = Form.of(engine.arm)
        self.heard = engine.events.subscribe(10**9)
        self.heard.take()

    def through(self, event: TimelineChange) -> Snapshot | TimelineDelta:
        if isinstance(event, TimelineReplaced):
            return self.sent(Snapshot.of(event.timeline, event.settings))
        delta = READER.read(encode(Delta(delta_record(event, Motions()), 0.0), self.encoding))
        assert isinstance(delta, Delta)
        return delta_of(delta.delta, Motions(), self.form)

    def sent(self, snapshot: Snapshot) -> Snapshot:
        replaced = READER.read(encode(messages.Replaced(snapshot_record(snapshot)), self.encoding))
        assert isinstance(replaced, messages.Replaced)
        return snapshot_of(replaced.snapshot, self.form)

    def news(self) -> list[tuple[int, Snapshot | TimelineDelta]]:
        """What has happened since the last time, with numbers."""
        told = []
        for event in self.heard.take_all():
            assert not isinstance(event, MissedEvents)
            self.seq += 1
            told.append((self.seq, self.through(event)))
        return told

    def mirror(self, begin: float = -inf, kept: float = inf) -> Mirror:
        """Of somebody who comes now, and keeps so many seconds of the past."""
        assert not self.heard.take_all(), "all news have been told"
        return Mirror(self.engine.arm, self.window(begin), self.seq, lambda: 0.0, kept)

    def window(self, begin: float, end: float = inf) -> Snapshot:
        snapshot = Snapshot.of(self.engine.timeline, self.engine.settings)
        return self.sent(snapshot if begin == -inf else windowed(snapshot, begin, end))


def tell(mirror: Mirror, news: list[tuple[int, Snapshot | TimelineDelta]]) -> None:
    for seq, value in news:
        if isinstance(value, Snapshot):
            mirror.replace(value, seq)
        else:
            mirror.change(value, seq)


@pytest.mark.parametrize("encoding", Encoding)
def test_a_mirror_is_the_timeline_to_the_bit(encoding: Encoding) -> None:
    edits = Edits(7)
    line = Line(edits.engine, encoding)
    mirrors = [line.mirror()]
    for number in range(some(150)):
        edits.edit()
        news = line.news()
        for mirror in mirrors:
            tell(mirror, news)
        if number % 40 == 0:
            mirrors.append(line.mirror())
    for mirror in mirrors:
        assert not mirror.lost
        assert bits(mirror.timeline) == bits(edits.engine.timeline)
        assert repr(Observer(mirror).at(1.234)) == repr(edits.engine.position(1.234))


def test_what_is_missing_is_noticed_and_made_up_for() -> None:
    """Any message may be left out, and any may come again: the mirror is right, or says that it is lost."""
    edits = Edits(11)
    line, lost = Line(edits.engine), 0
    mirror = line.mirror()
    for _ in range(some(300)):
        edits.edit()
        news = line.news()
        if news and edits.random.random() < 0.2:
            del news[edits.random.randrange(len(news))]
        tell(mirror, news + news[:1])
        if mirror.seq < line.seq and not mirror.lost:
            continue  # the last of them was left out: the next one tells
        if mirror.lost:
            lost += 1
            mirror.replace(line.window(-inf), line.seq)
        assert bits(mirror.timeline) == bits(edits.engine.timeline)
    assert lost > 2


def test_nothing_old_makes_a_mirror_lost() -> None:
    edits = Edits(3)
    line = Line(edits.engine)
    mirror, everything = line.mirror(), list[tuple[int, Snapshot | TimelineDelta]]()
    for _ in range(30):
        edits.edit()
        everything += line.news()
        tell(mirror, [one for one in everything if not isinstance(one[1], Snapshot)][:-1])
        mirror.replace(line.window(-inf), line.seq)
        tell(mirror, [one for one in everything if not isinstance(one[1], Snapshot)])
        assert not mirror.lost
        assert bits(mirror.timeline) == bits(edits.engine.timeline)


def test_a_window_and_its_past() -> None:
    """A late joiner knows the end; the past that it asks for is the robot's to the bit."""
    edits, joined = Edits(5), 0
    line = Line(edits.engine)
    for _ in range(some(90)):
        mirror = line.mirror(edits.engine.end * 0.8)
        for _ in range(3):
            edits.edit()
            tell(mirror, line.news())
        if mirror.lost or mirror.begins == -inf:
            continue
        joined += 1
        whole = edits.engine.timeline
        for t in (mirror.begins, (mirror.begins + whole.end) / 2.0, whole.end + 1.0):
            assert repr(Observer(mirror).at(t)) == repr(edits.engine.position(t))
        past = line.window(mirror.begins / 2.0, mirror.begins)
        edits.edit()  # while the past is on its way
        news = line.news()
        tell(mirror, news)
        if mirror.lost or any(isinstance(value, Snapshot) for _, value in news):
            continue
        assert mirror.extend(past)
        assert mirror.extend(line.window(-1.0, mirror.begins))
        assert mirror.begins == -inf
        assert bits(mirror.timeline) == bits(edits.engine.timeline)
    assert joined > 1


@pytest.mark.parametrize("seed", range(some(5)))
def test_a_mirror_that_forgets_is_right_to_the_bit_within_its_window(seed: int) -> None:
    edits = Edits(20 + seed)
    line, kept = Line(edits.engine), 4.0
    mirror = line.mirror(kept=kept)
    heard, forgot, latest = mirror.events.subscribe(), False, 0.0
    for _ in range(some(200)):
        edits.edit()
        mirror.clock = ClockReading(edits.engine.now)
        news = line.news()
        tell(mirror, news)
        if mirror.lost:
            mirror.replace(line.window(-inf), line.seq)
        engine, begin = edits.engine, mirror.now - kept
        latest, forgot = max(latest, begin), forgot or mirror.begins > 0.0
        assert mirror.begins <= latest, "UNDO may set the clock back, before what is known"
        last = list(engine.timeline)[-len(mirror.timeline) :]
        assert repr(list(mirror.timeline)) == repr(last)
        assert not news or not [it for it in last[1:] if it.finish < begin - SLACK * kept], "what is older is forgotten"
        for t in (max(t, mirror.begins) for t in (begin, begin + 1.0, engine.now, engine.end)):
            assert repr(Observer(mirror).at(t)) == repr(engine.position(t))
    assert forgot
    timeline = None
    for event in heard.take_all():
        assert not isinstance(event, MissedEvents)
        timeline = event.timeline if isinstance(event, TimelineReplaced) else timeline.apply(event)  # type: ignore[union-attr]
    assert timeline is not None
    assert bits(timeline) == bits(mirror.timeline)


def test_who_watches_steering_keeps_no_more_the_longer_it_lasts() -> None:
    """At 50 Hz, targets in short: after the first windows neither segments nor memory grow."""
    engine = Engine(load_robot("puma560"))
    line, kept = Line(engine), 1.0
    mirror, before = line.mirror(kept=kept), engine.timeline
    most, held = [], []
    tracemalloc.start()
    for _ in range(10):
        waves(engine, 50)
        told = []
        for event in line.heard.take_all():
            assert isinstance(event, TimelineDelta)
            told.append(steered_record(event, before, engine.arm) or event)
            before = before.apply(event)
        sizes, begin = [], tracemalloc.get_traced_memory()[0]
        for one in told:
            line.seq += 1
            mirror.clock = ClockReading(one.executed)
            (mirror.steer if isinstance(one, SteeredRecord) else mirror.change)(one, line.seq)  # type: ignore[operator]
            sizes.append(len(mirror.timeline))
        held.append(tracemalloc.get_traced_memory()[0] - begin)
        most.append(max(sizes))
    tracemalloc.stop()
    assert not mirror.lost
    assert repr(list(mirror.timeline)) == repr(list(engine.timeline)[-len(mirror.timeline) :])
    assert max(most) < 1.5 * kept * 50.0
    assert median(held[4:]) < 5_000, "[bytes] what comes is as much as what goes; other threads take memory too"


def test_a_past_that_fits_no_more_is_refused() -> None:
    edits = Edits(5)
    line = Line(edits.engine)
    for _ in range(40):
        edits.edit()
    line.news()
    mirror = line.mirror(edits.engine.end * 0.9)
    assert mirror.begins > 0.0
    early = line.window(0.0, mirror.begins / 2.0)
    before = bits(mirror.timeline)
    assert not mirror.extend(early), "there is a gap between"
    other = Edits(6)
    assert not mirror.extend(Line(other.engine).window(0.0, inf)), "it is of another robot"
    assert bits(mirror.timeline) == before


def test_who_hears_of_changes_hears_what_is_known_here() -> None:
    edits = Edits(9)
    line = Line(edits.engine)
    for _ in range(20):
        edits.edit()
    line.news()
    mirror = line.mirror(edits.engine.end * 0.5)
    heard, timeline = mirror.events.subscribe(), None
    for _ in range(30):
        edits.edit()
        tell(mirror, line.news())
        if mirror.lost:
            mirror.replace(line.window(-inf), line.seq)
    for event in heard.take_all():
        assert not isinstance(event, MissedEvents)
        timeline = event.timeline if isinstance(event, TimelineReplaced) else timeline.apply(event)  # type: ignore[union-attr]
    assert timeline is not None
    assert bits(timeline) == bits(mirror.timeline)


def test_the_clock_of_the_robot_is_read_here() -> None:
    wall = [100.0]
    clock = WallClock(lambda: wall[0], lambda _s: None, rate=2.0)
    wall[0] = 101.0
    reading = ClockReading(clock.reached, clock.rate, wall[0])
    for wall[0] in (101.0, 101.3, 107.77):
        assert reading.at(wall[0]) == clock.reached
    assert reading.at(50.0) == reading.now, "time does not go back"
    assert ClockReading(3.0, None, 0.0).at(99.0) == 3.0


STEPS = st.tuples(st.floats(0.0, 2.0), st.floats(-0.3, 0.3), st.sampled_from((0.5, 1.0, 2.0)))


@given(st.lists(STEPS, min_size=1, max_size=20))
def test_a_clock_that_is_known_better_later_does_not_go_back(steps: list[tuple[float, float, float]]) -> None:
    reading, wall, now, rate, shown = ClockReading(0.0, 1.0, 0.0), 0.0, 0.0, 1.0, 0.0
    for passed, wrong, rate_then in steps:
        wall, now, rate = wall + passed, now + rate * passed, rate_then
        reading = reading.then(ClockReading(now, rate, wall + wrong), wall)
        assert reading.at(wall) >= shown
        shown = reading.at(wall)
    assert reading.at(wall + 100.0) == pytest.approx(now + rate * (100.0 - wrong), abs=1e-5), "it does not stay wrong"
    assert reading.then(ClockReading(1.0, None), wall).at(wall) == 1.0, "a clock that was stopped shows where it stands"


def test_viewers_look_at_a_mirror_as_at_the_robot() -> None:
    edits, wall = Edits(2), [0.0]
    for _ in range(10):
        edits.edit()
    mirror = Mirror(edits.engine.arm, Snapshot.of(edits.engine.timeline, edits.engine.settings), 0, lambda: wall[0])
    mirror.clock = ClockReading(0.0, 1.0, 0.0)
    audience = Audience(mirror, lambda: wall[0])
    audience.join(10.0)
    wall[0] = 0.55
    (look,) = audience.step()
    assert repr(look.position) == repr(edits.engine.position(0.5))
    assert look.version == edits.engine.timeline.version


def test_targets_of_steering_in_short_make_the_same_timeline() -> None:
    engine = Engine(load_robot("puma560"))
    line, arm = Line(engine), engine.arm
    waves(engine, 20)
    line.news()
    before = engine.timeline
    mirrors = line.mirror(), line.mirror(0.3)
    waves(engine, 40)
    short = 0
    for event in line.heard.take_all():
        assert isinstance(event, TimelineDelta)
        target = steered_record(event, before, arm)
        before, line.seq, short = before.apply(event), line.seq + 1, short + (target is not None)
        for mirror in mirrors:
            if target is None:
                mirror.change(event, line.seq)
            else:
                mirror.steer(target, line.seq)
                mirror.steer(target, line.seq)  # again
    assert short == 39  # but for the first, which is gone to
    whole, part = mirrors
    assert bits(whole.timeline) == bits(engine.timeline)
    assert repr(list(part.timeline)) == repr(list(engine.timeline)[-len(part.timeline) :])
    wrong = SteeredRecord(engine.timeline.version, engine.timeline.end, 2**24, (0.1,) * 6, 1)
    whole.steer(wrong, line.seq + 1)
    assert whole.lost
