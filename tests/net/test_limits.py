"""What a client may take of a server."""

from __future__ import annotations

import pytest

from vrs_cli.errors import LimitReached, RequestRefused
from vrs_cli.net.limits import (
    HIGH_WATER_BYTES,
    LOW_WATER_BYTES,
    MIN_PROGRESS_BYTES,
    SEND_TIMEOUT_S,
    WRONG_TOKENS,
    Allowance,
    Bucket,
    Crowd,
    Meter,
    SendPace,
    advice,
    check_growth,
)


def test_a_rate_in_the_long_run_and_at_once() -> None:
    rate = Bucket(10.0, 5, 0.0)
    assert [rate.take(0.0) for _ in range(6)] == [True] * 5 + [False]
    assert rate.take(0.1)
    assert not rate.take(0.1)
    assert sum(rate.take(0.1 + 0.01 * n) for n in range(1, 1001)) in (99, 100)
    assert sum(rate.take(1000.0) for _ in range(100)) == 5


def test_so_many_of_one_name_and_so_many_in_all() -> None:
    crowd = Crowd(Allowance(connections_each=2, connections=3))
    crowd.enter("ada")
    crowd.enter("ada")
    with pytest.raises(RequestRefused, match="ada has 2 connections"):
        crowd.enter("ada")
    crowd.enter("bob")
    with pytest.raises(RequestRefused, match="this server has 3 connections"):
        crowd.enter("carl")
    crowd.leave("ada")
    crowd.enter("carl")
    assert len(crowd) == 3


def test_without_a_name_there_is_no_limit_for_one() -> None:
    crowd = Crowd(Allowance(connections_each=1, connections=3))
    for _ in range(3):
        crowd.enter("")
    assert len(crowd) == 3


def test_wrong_tokens_from_one_address() -> None:
    crowd = Crowd(Allowance())
    for _ in range(WRONG_TOKENS):
        assert not crowd.guesses("10.0.0.7", 0.0)
        crowd.guess("10.0.0.7", 0.0)
    assert crowd.guesses("10.0.0.7", 1.0)
    assert not crowd.guesses("10.0.0.8", 1.0)
    assert not crowd.guesses("10.0.0.7", 61.0)


def test_who_guesses_is_remembered_in_bounded_memory() -> None:
    crowd = Crowd(Allowance(connections=100))
    for number in range(1000):
        crowd.guess(str(number), 0.0)
    assert len(crowd._wrong) <= 100


def test_a_program_has_its_share_of_the_machine() -> None:
    meter = Meter(Allowance(cpu=0.5, cpu_window=10.0), 0.0)
    assert all(meter.look(0.5 * t, float(t)) is None for t in range(1, 1000)), "its share, for ever"
    meter = Meter(Allowance(cpu=0.5, cpu_window=10.0), 0.0)
    stopped = [t for t in range(1, 30) if isinstance(meter.look(1.0 * t, float(t)), LimitReached)]
    assert stopped == [11, 22], "twice its share: after ten seconds, and again where it goes on"


def test_what_has_grown_too_large_takes_no_more() -> None:
    check_growth(Allowance(names=10), 10)
    with pytest.raises(LimitReached, match=r"11 variables and programs, 10 at most \(KILL, then ZERO"):
        check_growth(Allowance(names=10), 11)


def test_a_run_in_real_time_may_go_on_for_ever() -> None:
    allowance = Allowance(steps=1000, elements=7, folder=5)
    assert allowance.of_run(realtime=True).max_time is None
    run = allowance.of_run(realtime=False)
    assert run.max_time == 86_400.0
    assert run.max_steps == 1000
    assert run.max_elements == 7
    assert run.max_disk == 5
    assert "server" in advice("max_steps")
    assert "KILL, then ZERO" in advice("max_elements")


def test_who_looks_has_a_share_of_the_machine() -> None:
    share = Bucket(0.1, 2.0, 0.0)
    for t in range(1000):
        assert share.wait(float(t)) == 0.0
        share.spend(0.1, float(t))
    assert share.wait(2000.0) == 0.0
    share.spend(2.5, 2000.0)
    assert share.wait(2000.0) == pytest.approx(5.0)
    assert share.wait(2005.0) == pytest.approx(0.0)


def test_looking_may_cost_its_share_of_the_window_at_once() -> None:
    assert Allowance(looking_window=4.0).of_looking(0.1, 0.0).remaining(0.0) == pytest.approx(0.4)


def test_who_is_little_behind_is_not_waited_for() -> None:
    pace = SendPace()
    pace.waiting = HIGH_WATER_BYTES
    assert not pace.lags(0.0)
    pace.waiting += 1
    assert pace.lags(0.0)


def test_who_takes_what_is_typed_is_waited_for_until_little_is_left() -> None:
    pace, waited = SendPace(), 0
    pace.waiting = HIGH_WATER_BYTES + MIN_PROGRESS_BYTES
    while pace.lags(0.9 * SEND_TIMEOUT_S * waited):
        pace.waiting -= MIN_PROGRESS_BYTES
        waited += 1
    assert pace.waiting == LOW_WATER_BYTES
    assert waited == (HIGH_WATER_BYTES + MIN_PROGRESS_BYTES - LOW_WATER_BYTES) / MIN_PROGRESS_BYTES


def test_who_takes_nothing_is_waited_for_once() -> None:
    pace = SendPace()
    pace.waiting = HIGH_WATER_BYTES + 1
    assert pace.lags(0.0)
    assert pace.lags(SEND_TIMEOUT_S)
    assert not pace.lags(SEND_TIMEOUT_S + 0.01)
    pace.waiting = 10 * HIGH_WATER_BYTES
    assert not pace.lags(100.0)
    pace.waiting = HIGH_WATER_BYTES
    assert not pace.lags(101.0), "it has not caught up"
    pace.waiting = LOW_WATER_BYTES
    assert not pace.lags(102.0)
    pace.waiting = HIGH_WATER_BYTES + 1
    assert pace.lags(103.0), "it has: it is waited for again"


def test_who_takes_a_byte_now_and_then_takes_nothing() -> None:
    pace, waited = SendPace(), 0
    pace.waiting = 2 * HIGH_WATER_BYTES
    while pace.lags(0.1 * waited):
        pace.waiting -= 100
        waited += 1
    assert 0.1 * waited <= SEND_TIMEOUT_S + 0.2
