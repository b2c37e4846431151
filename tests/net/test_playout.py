"""A playout buffer shows what comes unevenly as evenly as it was sent."""

from __future__ import annotations

from itertools import pairwise

import pytest

from vrs_cli.errors import IllegalValue
from vrs_cli.net.delay_line import Constant, DelayLine, Gamma
from vrs_cli.net.playout import Playout

TICK = 0.02


def test_a_line_without_jitter_delays_by_its_delay() -> None:
    line, playout = DelayLine(Constant(0.25)), Playout[int]()
    for k in range(100):
        playout.put(k * TICK, k, line.arrival(k * TICK))
    assert playout.delay == pytest.approx(0.25)
    assert playout.take(0.25 + 40 * TICK + 1e-9) == 40
    assert playout.take(0.25 + 40.5 * TICK) == 40


@pytest.mark.parametrize("percentile", [50.0, 95.0, 99.0])
def test_as_many_are_there_in_time_as_was_asked_for(percentile: float) -> None:
    """By the measure of 200 samples, which come in order, so that one that is late delays those after it."""
    line, playout = DelayLine(Gamma(0.2, 0.08), "1"), Playout[int](percentile)
    sent = [k * 0.5 for k in range(2000)]
    arrivals, in_time = [line.arrival(t) for t in sent], 0
    for k, (t, arrived) in enumerate(zip(sent, arrivals, strict=True)):
        in_time += k >= playout.window and arrived <= t + playout.delay
        playout.put(t, k, arrived)
    assert 100.0 * in_time / (len(sent) - playout.window) == pytest.approx(percentile, abs=3.0)


def test_what_is_shown_goes_on_evenly_and_never_back() -> None:
    line, playout, shown = DelayLine(Gamma(0.1, 0.05), "2"), Playout[int](), []
    waiting = [(line.arrival(k * TICK), k) for k in range(1000)]
    for look in range(1000):
        now = look * TICK
        while waiting and waiting[0][0] <= now:
            arrived, k = waiting.pop(0)
            playout.put(k * TICK, k, arrived)
        shown.append(playout.take(now) or 0)
    steps = [after - before for before, after in pairwise(shown[300:])]
    assert min(steps) >= 0
    assert sum(step == 1 for step in steps) / len(steps) > 0.85, "without a buffer it is far less"


def test_clocks_that_differ_do_no_harm() -> None:
    playout = Playout[str]()
    assert playout.take(1e6) is None, "nothing is known of the clocks so far"
    playout.put(1000.0, "a", 3.0)
    playout.put(1000.5, "b", 3.5)
    assert [playout.take(now) for now in (2.9, 3.0, 3.4, 3.5)] == [None, "a", "a", "b"]


def test_what_waits_is_bounded() -> None:
    playout = Playout[int](most=3)
    for k in range(10):
        playout.put(float(k), k, float(k))
    assert [playout.take(float(t)) for t in range(10)][-3:] == [7, 8, 9]
    assert Playout[int]().take(0.0) is None


def test_jitter_of_long_ago_is_forgotten() -> None:
    playout = Playout[int](window=10)
    for k in range(10):
        playout.put(float(k), k, k + 5.0)
    for k in range(10, 20):
        playout.put(float(k), k, k + 0.5)
    assert playout.delay == 0.5


@pytest.mark.parametrize("percentile", [0.0, 101.0, float("nan")])
def test_a_percentile_is_one(percentile: float) -> None:
    with pytest.raises(IllegalValue, match="percentile"):
        Playout[int](percentile)
