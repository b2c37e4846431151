"""The inbox: messages in order, and a wait that ends when its time has come, whatever happens meanwhile."""

import signal
import time
from collections.abc import Iterator
from threading import Thread
from types import FrameType

import pytest

from tests.live import PATIENCE
from vrs_cli.engine.inbox import Inbox


def test_messages_are_taken_in_their_order() -> None:
    inbox: Inbox[int] = Inbox()
    for number in range(3):
        inbox.put(number)
    assert len(inbox) == 3
    assert inbox.take(0.0) == 0
    assert inbox.taken() == [1, 2]
    assert inbox.taken() == []
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
    inbox.taken()
    begun = time.monotonic()
    inbox.wait(0.02)
    assert time.monotonic() - begun >= 0.02


@pytest.fixture
def alarm() -> Iterator[list[int]]:
    """The first alarm is handled for longer than the wait lasts; another one ends a wait that does not end."""
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
