"""Tests of steering: a stream of targets, each an edit at the present instant that the next one replaces."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from math import cos, pi, radians, sin, sqrt

import pytest
from msgspec import structs

from tests.engine.mirror import mirrored
from tests.laws.motion_laws import check_continuous, check_limits
from vrs_cli.engine.book import Book
from vrs_cli.engine.engine import Bookmark, Engine
from vrs_cli.engine.position import joints_at
from vrs_cli.errors import JointOutOfRange, PowerOff, StreamIsOver
from vrs_cli.kinematics.joints import Joints, Profile, largest_change
from vrs_cli.kinematics.model import PROFILES
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.trajectory.state import Target
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.commands import JointTarget, Move, SetParameter, SetSwitch, Stamp

MODEL = load_robot("puma560")
READY = MODEL.poses["ready"]
STILL = (0.0,) * 6
TICK = 0.02  # 50 Hz
AWAY = tuple(q + radians(10.0) for q in READY)


@pytest.fixture(params=PROFILES)
def engine(request: pytest.FixtureRequest) -> Engine:
    engine = Engine(MODEL)
    engine.perform(SetParameter("PROFILE", request.param))
    return engine


def follow(engine: Engine, want: Callable[[float], Joints], seconds: float, speed: float = 1.0) -> None:
    """Feed targets at 50 Hz, each with the velocity since the one before."""
    before, begun = want(0.0), engine.now
    for k in range(round(seconds / TICK)):
        target = want(k * TICK)
        velocity = tuple((b - a) / TICK for a, b in zip(before, target, strict=True))
        engine.clock.advance(begun + k * TICK)
        engine.steer(Target(target, velocity), TICK, speed=speed)
        before = target


def swinging(degrees: float, period: float) -> Callable[[float], Joints]:
    return lambda t: tuple(q + radians(degrees) * (1.0 - cos(2.0 * pi * t / period)) / 2.0 for q in READY)


def test_it_follows_a_swinging_target_closely(engine: Engine) -> None:
    want = swinging(40.0, 4.0)
    follow(engine, want, 8.0)
    errors = [
        largest_change(joints_at(engine.arm, engine.timeline, t), want(t)) for t in (k * 0.0173 for k in range(60, 460))
    ]
    assert sqrt(sum(e * e for e in errors) / len(errors)) < radians(0.15)
    assert max(errors) < radians(0.2)


def test_a_target_that_stands_is_reached_without_going_beyond(engine: Engine) -> None:
    follow(engine, lambda _t: AWAY, 3.0)
    assert largest_change(joints_at(engine.arm, engine.timeline, 3.0), AWAY) < radians(1e-6)
    first = [joints_at(engine.arm, engine.timeline, k * 0.01)[0] for k in range(300)]
    beyond = 0.0 if engine.settings.profile is Profile.LSPB else radians(0.002)
    assert max(first) <= AWAY[0] + beyond
    assert all(earlier <= later + beyond for earlier, later in pairwise(first))


def test_it_waits_at_the_end_of_a_range_and_comes_back(engine: Engine) -> None:
    """The target swings at full speed to the very end of a range, and stays there for a while."""
    end = MODEL.upper[0]

    def want(t: float) -> Joints:
        return (min(end, end + radians(60.0) * sin(2.0 * t)), *READY[1:])

    engine.take_up(Bookmark(Book.at(want(0.0)), engine.settings, 0.0))
    follow(engine, want, 6.0)
    reached = [joints_at(engine.arm, engine.timeline, k * 0.01)[0] for k in range(600)]
    assert all(q <= end + 1e-9 for q in reached)
    assert end - reached[100] < radians(0.1)
    assert end - reached[600 - 20] > radians(20.0)


def test_a_target_that_comes_while_the_arm_has_no_room_to_stop_waits(engine: Engine) -> None:
    """A motion with parabolic blends that slows down to the end of a range has no room for a jerk-limited stop."""
    profile = engine.settings.profile.name
    engine.perform(SetParameter("PROFILE", "LSPB"))
    engine.perform(Move(JointTarget((MODEL.upper[0], *READY[1:])), straight=False), program=True)
    engine.perform(SetParameter("PROFILE", profile))
    engine.clock.advance(engine.end - 0.1)
    for _ in range(40):
        engine.steer(Target(READY, STILL), TICK)
        engine.clock.advance(engine.now + TICK)
    check_continuous(engine, engine.timeline)
    check_limits(engine, engine.timeline)
    assert engine.position().joints[0] < MODEL.upper[0] - radians(10.0)


def test_the_slowest_robot_keeps_within_its_speed(engine: Engine) -> None:
    follow(engine, swinging(40.0, 4.0), 2.0, speed=1e-4)
    fastest = max(abs(engine.position(k * 0.01).velocity[0]) for k in range(200))
    assert 0.5e-4 * MODEL.max_velocity[0] < fastest <= 1.001e-4 * MODEL.max_velocity[0]


def test_without_a_next_target_the_arm_brakes(engine: Engine) -> None:
    follow(engine, swinging(40.0, 4.0), 1.0)
    assert engine.now < engine.end < engine.now + 0.4
    assert max(map(abs, engine.position(engine.end).velocity)) == 0.0


def test_redirect_goes_there_and_stops(engine: Engine) -> None:
    follow(engine, swinging(40.0, 4.0), 1.0)
    engine.redirect(AWAY)
    assert engine.position(engine.end).joints == pytest.approx(AWAY)


def test_speed_is_a_part_of_full_speed(engine: Engine) -> None:
    follow(engine, lambda _t: tuple(q + 0.5 for q in READY), 1.0, speed=0.2)
    fastest = max(abs(engine.position(k * 0.01).velocity[0]) for k in range(100))
    assert fastest == pytest.approx(0.2 * MODEL.max_velocity[0], rel=1e-6)


def test_a_stream_is_one_segment_a_target(engine: Engine) -> None:
    follow(engine, swinging(40.0, 4.0), 20.0)
    assert len(engine.timeline) <= 20.0 / TICK + 4
    assert len(engine.book.deltas) == 20.0 / TICK


def test_what_was_scheduled_is_dropped(engine: Engine) -> None:
    engine.perform(Move(JointTarget(swinging(60.0, 2.0)(1.0)), straight=False), program=True)
    end = engine.end
    engine.clock.advance(0.2)
    engine.steer(Target(READY, STILL), TICK)
    assert engine.end < end
    engine.clock.advance(engine.now + 0.5 * TICK)
    engine.stop()
    assert engine.position(engine.end).velocity == STILL


# --- what is kept ----------------------------------------------------------------------------------------------------


def replayed(engine: Engine) -> Timeline:
    timeline = engine.book.initial
    for delta in engine.book.deltas:
        timeline = timeline.apply(delta)
    return timeline


def test_deltas_and_events_give_the_timeline(engine: Engine) -> None:
    events = engine.events.subscribe()
    engine.perform(Move(JointTarget(AWAY), straight=False), program=True)
    follow(engine, swinging(20.0, 2.0), 1.0)
    engine.steer(Target(READY, STILL), TICK)  # twice at one instant
    engine.redirect(AWAY)
    follow(engine, swinging(20.0, 2.0), 0.5)
    assert replayed(engine) == engine.timeline == mirrored(events.take_all())


def test_undo_takes_back_the_stream_as_a_whole(engine: Engine) -> None:
    engine.perform(Move(JointTarget(AWAY), straight=False), program=True)
    before = engine.timeline
    engine.clock.advance(0.1)
    follow(engine, swinging(20.0, 2.0), 1.0)
    assert [record.text for record in engine.book.records()] == ["", "STEER"]
    streamed = engine.timeline
    engine.redirect(AWAY)
    engine.undo()
    assert engine.timeline == streamed
    engine.undo()
    assert engine.timeline == before
    assert replayed(engine) == before


def test_a_stream_is_not_planned_again_from_elsewhere(engine: Engine) -> None:
    engine.clock.advance(5.0)
    follow(engine, swinging(20.0, 2.0), 1.0)
    timeline = engine.timeline
    with pytest.raises(StreamIsOver, match="when STEER, scheduled later, is planned again"):
        engine.perform(Move(JointTarget(AWAY), straight=False, stamp=Stamp(1.0)))
    assert engine.timeline is timeline
    engine.perform(Move(JointTarget(READY), straight=False, stamp=Stamp(1.0)))
    assert engine.position(5.5) == structs.replace(engine.position(5.5), joints=joints_at(engine.arm, timeline, 5.5))


# --- what is refused -------------------------------------------------------------------------------------------------


def test_a_target_outside_the_range_is_refused(engine: Engine) -> None:
    with pytest.raises(JointOutOfRange):
        engine.steer(Target((radians(200.0), *READY[1:]), STILL), TICK)
    with pytest.raises(JointOutOfRange):
        engine.redirect((radians(200.0), *READY[1:]))
    assert engine.timeline == engine.book.initial


def test_no_power_no_steering(engine: Engine) -> None:
    engine.perform(SetSwitch("POWER", on=False))
    with pytest.raises(PowerOff):
        engine.steer(Target(READY, STILL), TICK)
    with pytest.raises(PowerOff):
        engine.redirect(READY)


def test_a_joint_outside_the_part_of_its_range_that_a_target_allows_stays(engine: Engine) -> None:
    """No tick keeps that part, and the arm does not move."""
    upper = (READY[0] - 0.1, *MODEL.upper[1:])
    engine.steer(Target(AWAY, STILL, MODEL.lower, upper), TICK)
    assert engine.position(engine.end).joints[0] == READY[0]
