"""Targets of steering in short become the delta that they were, to the bit, for every profile, robot and stream."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from math import sin
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace

from tests.engine.mirror import windowed
from tests.examples import examples, some
from tests.laws.test_steering_laws import PROFILES, TICK, Stream, joints, parts, robot, stretches
from tests.robots import KINDS
from vrs_cli.engine.engine import Engine
from vrs_cli.engine.feed import Snapshot, TimelineReplaced
from vrs_cli.engine.settings import Settings
from vrs_cli.interfaces.streams import Steering
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.net.messages import Delta, FromServer, Steered
from vrs_cli.trajectory.state import Target
from vrs_cli.trajectory.timeline import Timeline, TimelineDelta
from vrs_cli.values.commands import MotionKind
from vrs_cli.wire.codec import Encoding, Reader, encode
from vrs_cli.wire.records import Form, Motions, RecordError, delta_record
from vrs_cli.wire.steered import SteeredRecord, steered_delta, steered_record

READER: Reader[FromServer] = Reader(FromServer)
SAMPLE = 56  # bytes: a time and the joints of six axes, as doubles


def changes(engine: Engine, act: Callable[[], object]) -> Iterator[tuple[Timeline, TimelineDelta]]:
    """Each change of steering that comes of an act, and the timeline before it."""
    told = engine.events.subscribe(10**6)
    act()
    timeline = engine.timeline
    for event in told.take_all():
        if isinstance(event, TimelineReplaced):
            timeline = event.timeline
        elif isinstance(event, TimelineDelta):
            if event.motion.kind is MotionKind.STEERED:
                yield timeline, event
            timeline = timeline.apply(event)


def waves(engine: Engine, count: int) -> None:
    """A smooth stream at 50 Hz."""
    steering, begin, model = Steering(engine), engine.now, engine.model
    ranges = [(0.5 * (low + high), 0.05 * (high - low)) for low, high in zip(model.lower, model.upper, strict=True)]
    for k in range(count):
        s = 0.02 * k
        steering.to(tuple(q + far * sin((0.6 + 0.3 * i) * s) for i, (q, far) in enumerate(ranges)), begin + s)


@pytest.mark.parametrize("profile", PROFILES)
@pytest.mark.parametrize("first", range(0, some(40), 10))
def test_any_stream_comes_back_to_the_bit(first: int, profile: str) -> None:
    short = total = 0
    for seed in range(first, first + 10):
        stream = Stream(seed, (profile,))
        arm, form = stream.engine.arm, Form.of(stream.engine.arm)
        for before, delta in changes(stream.engine, stream.run):
            record = steered_record(delta, before, arm)
            total += 1
            if record is not None:
                for encoding in Encoding:
                    sent = READER.read(encode(Steered(record), encoding))
                    assert sent == Steered(record)
                assert repr(steered_delta(record, before, arm, form)) == repr(delta)
                short += 1
    assert short > 0.8 * total  # of targets anywhere, with joints that go on as they were planned before


@pytest.mark.parametrize("profile", PROFILES)
@examples(40)
@given(parts, st.lists(stretches, min_size=1, max_size=4))
def test_every_stream_comes_back_to_the_bit(profile: str, start: Joints, stream: list[Any]) -> None:
    engine = robot(profile, start=joints(start))
    arm, form = engine.arm, Form.of(engine.arm)

    def run() -> None:
        for part, velocity, count, late, speed in stream:
            for _ in range(count):
                engine.steer(Target(joints(part), velocity), TICK, speed=speed)
                engine.clock.advance(engine.now + late * TICK)

    for before, delta in changes(engine, run):
        record = steered_record(delta, before, arm)
        assert record is None or repr(steered_delta(record, before, arm, form)) == repr(delta)


@pytest.mark.parametrize("profile", PROFILES)
@pytest.mark.parametrize("name", KINDS)
def test_a_robot_of_any_kind_is_steered_in_short(name: str, profile: str) -> None:
    engine = robot(profile, load_robot(name))
    arm, form = engine.arm, Form.of(engine.arm)
    for before, delta in changes(engine, lambda: waves(engine, 25)):
        record = steered_record(delta, before, arm)
        assert record is not None
        assert repr(steered_delta(record, before, arm, form)) == repr(delta)


@pytest.mark.parametrize("profile", PROFILES)
@pytest.mark.parametrize("name", ["puma560", "irb120", "cobra600"])
def test_a_smooth_stream_weighs_at_most_three_times_its_samples(name: str, profile: str) -> None:
    engine = robot(profile, load_robot(name))
    motions, size, full, count = Motions(), 0, 0, 0
    for before, delta in changes(engine, lambda: waves(engine, 300)):
        record = steered_record(delta, before, engine.arm)
        assert record is not None
        size += len(encode(Steered(record, number=1000 + count), Encoding.MSGPACK))
        full += len(encode(Delta(delta_record(delta, motions), 0.0, number=1000 + count), Encoding.MSGPACK))
        count += 1
    assert count == 299  # the first target is gone to
    assert size < 3 * SAMPLE * count
    assert size < full / 4


def test_a_window_of_the_timeline_is_enough() -> None:
    engine = robot("SCURVE")
    arm, form = engine.arm, Form.of(engine.arm)
    for before, delta in changes(engine, lambda: waves(engine, 40)):
        record = steered_record(delta, before, arm)
        assert record is not None
        window = windowed(Snapshot.of(before, Settings()), delta.executed - 0.1)
        assert repr(steered_delta(record, window.timeline(), arm, form, window.first)) == repr(delta)


def test_what_does_not_become_what_it_was_is_refused() -> None:
    engine = robot("LSPB")
    arm, form = engine.arm, Form.of(engine.arm)
    (_, _), (before, delta), *_ = changes(engine, lambda: waves(engine, 4))
    record = steered_record(delta, before, arm)
    assert isinstance(record, SteeredRecord)
    slower = tuple(0.5 * rate for rate in record.rates)
    for wrong, why in (
        (replace(record, rates=slower), "another version of vrs"),
        (replace(record, rates=(1e15,) * 6, tick=2**53), "another version of vrs"),
        (replace(record, crc=record.crc ^ 1), "another version of vrs"),
        (replace(record, rates=record.rates[:5]), "for a motion, or a robot, that has none"),
        (replace(record, tick=0), "for a motion, or a robot, that has none"),
        (replace(record, version=record.version + 1), "for timeline version"),
        (replace(record, executed=-1.0), "for timeline version"),
        (replace(record, executed=0.1), "no multiple"),
    ):
        with pytest.raises(RecordError, match=why):
            steered_delta(wrong, before, arm, form)
    with pytest.raises(RecordError, match="for a motion"):
        steered_delta(replace(record, version=0, motion=None), Engine(engine.model).timeline, arm, form)


def test_what_is_no_steering_has_no_short_form() -> None:
    engine = Engine(load_robot("puma560"))
    before = engine.timeline
    engine.redirect(tuple(0.5 * q for q in engine.position().joints))
    assert steered_record(engine.book.deltas[-1], before, engine.arm) is None
