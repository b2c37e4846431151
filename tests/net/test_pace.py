"""For whom a robot waits, and for how long."""

from __future__ import annotations

from vrs_cli.net.pace import LITTLE, LUMP, MUCH, PATIENCE, SendPace


def test_who_is_little_behind_is_not_waited_for() -> None:
    pace = SendPace()
    pace.waiting = MUCH
    assert not pace.lags(0.0)
    pace.waiting += 1
    assert pace.lags(0.0)


def test_who_takes_what_is_typed_is_waited_for_until_little_is_left() -> None:
    pace, waited = SendPace(), 0
    pace.waiting = MUCH + LUMP
    while pace.lags(0.9 * PATIENCE * waited):
        pace.waiting -= LUMP
        waited += 1
    assert pace.waiting == LITTLE
    assert waited == (MUCH + LUMP - LITTLE) / LUMP


def test_who_takes_nothing_is_waited_for_once() -> None:
    pace = SendPace()
    pace.waiting = MUCH + 1
    assert pace.lags(0.0)
    assert pace.lags(PATIENCE)
    assert not pace.lags(PATIENCE + 0.01)
    pace.waiting = 10 * MUCH
    assert not pace.lags(100.0)
    pace.waiting = MUCH
    assert not pace.lags(101.0), "it has not caught up"
    pace.waiting = LITTLE
    assert not pace.lags(102.0)
    pace.waiting = MUCH + 1
    assert pace.lags(103.0), "it has: it is waited for again"


def test_who_takes_a_byte_now_and_then_takes_nothing() -> None:
    pace, waited = SendPace(), 0
    pace.waiting = 2 * MUCH
    while pace.lags(0.1 * waited):
        pace.waiting -= 100
        waited += 1
    assert 0.1 * waited <= PATIENCE + 0.2
