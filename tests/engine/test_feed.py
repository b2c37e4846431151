"""Tests of feeds: subscribers hear of everything in order, and none can harm the publisher or keep it waiting."""

from __future__ import annotations

import signal
import time
from collections.abc import Iterator
from gc import collect
from itertools import count
from math import radians
from threading import Thread
from types import FrameType

import pytest

from tests.engine.mirror import mirrored
from tests.live import PATIENCE
from vrs_cli.engine.branches import Branches
from vrs_cli.engine.engine import Engine
from vrs_cli.engine.feed import Feed, Inbox, MissedEvents, TimelineReplaced
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.values.commands import JointOffsetTarget, Move


def test_messages_are_taken_in_their_order() -> None:
    inbox: Inbox[int] = Inbox()
    for number in range(3):
        inbox.put(number)
    assert len(inbox) == 3
    assert inbox.take(0.0) == 0
    assert inbox.take_all() == [1, 2]
    assert inbox.take_all() == []
    assert inbox.take(0.0) is None


def test_a_message_ends_the_wait_of_another_thread() -> None:
    inbox: Inbox[str] = Inbox()
    heard: list[str | None] = []
    reader = Thread(target=lambda: heard.append(inbox.take(None)))
    reader.start()
    inbox.put("now")
    reader.join(PATIENCE)
    assert heard == ["now"]


def test_a_bell_that_rang_for_what_was_taken_ends_no_wait() -> None:
    inbox: Inbox[str] = Inbox()
    inbox.put("taken")
    inbox.take_all()
    begun = time.monotonic()
    inbox.wait(0.02)
    assert time.monotonic() - begun >= 0.02


@pytest.fixture
def alarm() -> Iterator[list[int]]:
    """Handle the first alarm longer than the wait lasts; another alarm ends a wait that does not end."""
    heard: list[int] = []

    def hear(number: int, _frame: FrameType | None) -> None:
        heard.append(number)
        if len(heard) > 1:
            raise TimeoutError("the wait goes on and on")
        end = time.monotonic() + 0.06
        while time.monotonic() < end:
            pass

    before = signal.signal(signal.SIGALRM, hear)
    yield heard
    signal.setitimer(signal.ITIMER_REAL, 0.0)
    signal.signal(signal.SIGALRM, before)


@pytest.mark.skipif(not hasattr(signal, "SIGALRM"), reason="Windows has no alarm")
def test_a_wait_ends_though_its_time_ran_out_while_a_signal_was_handled(alarm: list[int]) -> None:
    inbox: Inbox[str] = Inbox()
    signal.setitimer(signal.ITIMER_REAL, 0.01, PATIENCE)
    assert inbox.take(0.04) is None
    assert len(alarm) == 1


@pytest.fixture
def engine() -> Engine:
    return Engine(load_robot("puma560"))


def drive(engine: Engine, joint: int = 1) -> None:
    engine.perform(Move(JointOffsetTarget(joint, radians(1.0)), straight=False))


def numbers() -> Feed[int]:
    latest = count(100)
    return Feed(lambda: next(latest))


def test_a_subscriber_is_given_what_there_is_and_then_every_event_in_order() -> None:
    feed = numbers()
    subscription = feed.subscribe()
    for number in range(5):
        feed.publish([number])
    assert subscription.take_all() == [100, 0, 1, 2, 3, 4]


def test_who_is_too_slow_is_told_how_much_was_left_out_and_made_whole() -> None:
    feed = numbers()
    slow, quick = feed.subscribe(most=4), feed.subscribe(most=4)
    heard: list[int | MissedEvents] = []
    for number in range(7):
        feed.publish([number])
        heard += quick.take_all()
    assert heard == [101, 0, 1, 2, 3, 4, 5, 6]
    assert slow.take_all() == [MissedEvents(8), 103]


def test_what_was_left_out_is_counted_to_the_end() -> None:
    feed = numbers()
    slow = feed.subscribe(most=3)
    for number in range(50):
        feed.publish([number])
    heard = slow.take_all()
    left_out = sum(event.count for event in heard if isinstance(event, MissedEvents))
    told = [event for event in heard if isinstance(event, int) and event < 100]
    assert told == list(range(50 - len(told), 50))
    assert left_out >= 50 - len(told)


def test_what_has_happened_together_is_told_or_left_out_together() -> None:
    """The event that makes up for missed ones stands for all of them, so none of them may come after it."""
    feed = numbers()
    slow = feed.subscribe(most=3)
    feed.publish([1, 2])
    feed.publish([3, 4])
    assert slow.take_all() == [MissedEvents(5), 101]


def test_who_has_ended_or_is_gone_costs_nothing_more() -> None:
    feed = numbers()
    ended, gone = feed.subscribe(), feed.subscribe()
    ended.end()
    feed.publish([1])
    del gone
    collect()
    feed.publish([2])
    assert not tuple(feed._subscriptions)
    assert list(ended) == [100]


def test_a_reader_in_another_thread_waits_for_events_until_it_ends() -> None:
    feed = numbers()
    heard: list[int | MissedEvents] = []
    subscription = feed.subscribe()
    reader = Thread(target=lambda: heard.extend(subscription))
    reader.start()
    for number in range(3):
        feed.publish([number])
    while len(subscription._queue):
        pass
    subscription.end()
    reader.join(PATIENCE)
    assert not reader.is_alive()
    assert heard == [100, 0, 1, 2]


def test_what_was_told_before_the_end_is_heard_after_it() -> None:
    feed = numbers()
    subscription = feed.subscribe()
    feed.publish([1, 2])
    subscription.end()
    feed.publish([3])
    assert list(subscription) == [100, 1, 2]
    assert list(subscription) == []


def test_every_other_timeline_is_an_event_with_its_version(engine: Engine) -> None:
    branches = Branches(engine)
    events = engine.events.subscribe()
    drive(engine)
    branches.make("trial")
    drive(engine, 2)
    trial = engine.timeline
    branches.change_over("main")
    branches.merge("trial")
    engine.undo()
    heard = events.take_all()
    replaced = [event.version for event in heard if isinstance(event, TimelineReplaced)]
    assert replaced == [0, 1, 1]
    assert mirrored(heard[:-1]) == trial
    assert mirrored(heard) == engine.timeline


def test_a_slow_mirror_agrees_to_the_bit_after_it_was_left_behind(engine: Engine) -> None:
    slow = engine.events.subscribe(most=3)
    mirror = mirrored(slow.take_all())
    for _ in range(10):
        drive(engine)
    heard = slow.take_all()
    assert isinstance(heard[0], MissedEvents)
    mirror = mirrored(heard, mirror)
    assert repr(list(mirror)) == repr(list(engine.timeline))
    assert mirror.version == engine.timeline.version


def test_what_is_held_is_heard_when_it_is_released_and_by_nobody_twice() -> None:
    feed = numbers()
    early = feed.subscribe()
    feed.hold()
    feed.publish([1])
    assert early.take_all() == [100]
    late = feed.subscribe()  # is given a state that has the first event in it
    feed.publish([2])
    feed.release()
    assert early.take_all() == [1, 2]
    assert late.take_all() == [101, 2]
    feed.publish([3])
    assert early.take_all() == late.take_all() == [3]
