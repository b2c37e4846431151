"""Time measured over a line: within half of what its two ways differ in, whatever the jitter, the drift, the jumps."""

from __future__ import annotations

from itertools import pairwise
from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.examples import examples
from vrs_cli.errors import IllegalValue
from vrs_cli.net.delay_line import Constant, DelayLine, Gamma
from vrs_cli.net.timesync import PARTS, Estimate, OneWay, Playout, TimeSync


class Clocks:
    """A clock there that is ahead and drifts, and delays of the way there and of the way back."""

    def __init__(self, seed: int, ahead: float = 100.0, drift: float = 0.0) -> None:
        self.random, self.ahead, self.drift = Random(seed), ahead, drift

    def there(self, t: float) -> float:
        return t + self.ahead + self.drift * t

    def exchange(self, t: float, forward: float, backward: float, works: float = 0.001) -> tuple[float, ...]:
        return t, self.there(t + forward), self.there(t + forward + works), t + forward + works + backward


def measured(sync: TimeSync) -> Estimate:
    assert sync.estimate is not None
    return sync.estimate


delays = st.floats(0.0, 2.0)


@examples(200)
@given(st.floats(-1e6, 1e6), st.lists(st.tuples(st.floats(0.1, 5.0), delays, delays), min_size=1, max_size=30))
def test_the_offset_is_wrong_by_half_of_the_asymmetry_at_most(
    ahead: float, exchanges: list[tuple[float, float, float]]
) -> None:
    clocks, sync, t = Clocks(0, ahead), TimeSync(), 0.0
    for gap, forward, backward in exchanges:
        t += gap + forward + backward
        sync.hear(*clocks.exchange(t, forward, backward))
    found = measured(sync)
    _, forward, backward = min(exchanges, key=lambda it: it[1] + it[2])
    assert abs(found.offset - ahead) <= found.round_trip / 2.0 + 1e-5
    assert found.round_trip == pytest.approx(forward + backward, abs=1e-5)
    asymmetry = max(abs(f - b) for _, f, b in exchanges if abs(f + b - forward - backward) < 1e-5)
    assert abs(found.offset - ahead) <= asymmetry / 2 + 1e-5


@pytest.mark.parametrize("seed", range(5))
def test_jitter_of_both_ways_is_filtered_out(seed: int) -> None:
    """Ways of 40 and 60 ms at least, with jitter of 80 ms: the offset is the asymmetry of the least delays off."""
    clocks, sync = Clocks(seed), TimeSync()
    for k in range(300):
        late = (0.04 + clocks.random.gammavariate(1, 0.08), 0.06 + clocks.random.gammavariate(1, 0.08))
        sync.hear(*clocks.exchange(float(k), *late))
    found = measured(sync)
    assert found.offset == pytest.approx(100.0 - 0.01, abs=0.01)
    assert found.round_trip == pytest.approx(0.1, abs=0.02)


@pytest.mark.parametrize("drift", [0.0, 50e-6, -50e-6, 400e-6])
def test_drift_is_measured(drift: float) -> None:
    clocks, sync = Clocks(1, drift=drift), TimeSync()
    for k in range(0, 600, 2):
        late = (0.02 + clocks.random.gammavariate(1, 0.005), 0.02 + clocks.random.gammavariate(1, 0.005))
        sync.hear(*clocks.exchange(float(k), *late))
    found, soon = measured(sync), 610.0
    assert found.drift == pytest.approx(drift, abs=6e-6)
    assert found.here(clocks.there(soon)) == pytest.approx(soon, abs=0.004)


def test_few_exchanges_tell_no_drift() -> None:
    clocks, sync = Clocks(1), TimeSync()
    for k in range(40):
        sync.hear(*clocks.exchange(0.1 * k, clocks.random.random(), clocks.random.random()))
    assert measured(sync).drift == 0.0


def test_a_clock_that_was_set_is_measured_anew() -> None:
    clocks, sync = Clocks(1), TimeSync()
    for k in range(10):
        sync.hear(*clocks.exchange(float(k), 0.01, 0.01))
    clocks.ahead = 40.0
    sync.hear(*clocks.exchange(10.0, 0.5, 0.5))
    assert measured(sync).offset == pytest.approx(40.0)
    sync.hear(12.0, 60.0, 60.001, 11.0)  # the clock here was set during the exchange
    assert measured(sync).offset == pytest.approx(40.0)


def test_old_exchanges_count_no_longer() -> None:
    clocks, sync = Clocks(1), TimeSync(window=10.0)
    sync.hear(*clocks.exchange(0.0, 0.01, 0.01))
    sync.hear(*clocks.exchange(20.0, 0.1, 0.2))
    assert measured(sync).round_trip == pytest.approx(0.3)


def test_shares_of_the_round_trip_tell_what_lead_is_enough() -> None:
    sync, there, back = TimeSync(1e9), DelayLine(Gamma(0.2, 0.08), "a"), DelayLine(Gamma(0.2, 0.08), "b")
    for k in range(500):
        t1 = there.arrival(10.0 * k)
        sync.hear(10.0 * k, t1, t1, back.arrival(t1))
    assert sync.round_trip(0.5) == pytest.approx(0.4, abs=0.03)
    assert sync.round_trip(0.0) < sync.round_trip(0.5) < sync.round_trip(0.95) < sync.round_trip(1.0)


def test_nothing_is_known_before_the_first() -> None:
    assert TimeSync().estimate is None


@pytest.mark.parametrize("drift", [0.0, -20e-6, 1e-3])
@pytest.mark.parametrize("seed", range(3))
def test_a_clock_is_known_from_one_way_within_half_a_round_trip(drift: float, seed: int) -> None:
    random, one_way, ahead = Random(seed), OneWay(), 3.0
    for number in range(6000):
        came = 100.0 + 0.01 * number
        delay = 0.1 + random.gammavariate(4.0, 0.02)
        one_way.hear((came - delay) * (1.0 + drift) + ahead, came, 0.25)
    estimate = one_way.estimate
    assert estimate is not None
    there = came * (1.0 + drift) + ahead
    assert abs(estimate.there(came) - there) < 0.125
    assert estimate.drift == pytest.approx(drift, abs=2e-4)


def test_a_clock_from_one_way_takes_no_more_memory_with_time() -> None:
    one_way = OneWay()
    for number in range(20_000):
        one_way.hear(number * 1.0, number * 1.0)
    assert len(one_way._best) <= PARTS
    one_way.hear(-1e15, 1e9)
    one_way.hear(1e15, 1e9)
    assert one_way.estimate is not None


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
