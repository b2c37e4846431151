"""One direction of a line: delays as they are described, the same for the same seed, and nothing overtakes."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from random import Random
from statistics import fmean, pstdev

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.examples import examples
from vrs_cli.errors import NonexistentFile
from vrs_cli.net.delay_line import (
    RETRANSMIT,
    Bursty,
    Constant,
    DelayError,
    DelayLine,
    Delays,
    DelayWays,
    Gamma,
    Lossy,
    Normal,
    Trace,
    parse_delays,
    parse_duration,
    parse_loss,
    read_trace,
    with_loss,
)

MANY = 20_000
nanoseconds = st.integers(0, 3600 * 10**9) | st.integers(0, 10)
seconds = nanoseconds.map(lambda count: count * 1e-9)
lasting = nanoseconds.map(lambda count: (count + 1) * 1e-9)
delays = st.one_of(
    st.builds(Constant, seconds),
    st.builds(Normal, seconds, seconds),
    st.builds(Gamma, seconds, seconds),
    st.builds(Bursty, seconds, seconds, lasting, lasting),
    st.builds(Trace, st.lists(seconds, min_size=1, max_size=5).map(tuple)),
    st.builds(Lossy, st.builds(Gamma, seconds, seconds), st.floats(0.0, 0.5)),
)


def drawn(delays: Delays, step: float = 1.0, count: int = MANY) -> list[float]:
    delay = delays.source(Random(1))
    return [delay(step * k) for k in range(count)]


@examples(200)
@given(delays, st.integers(), st.lists(st.floats(0.0, 2.0), max_size=50))
def test_nothing_overtakes_and_nothing_arrives_before_it_is_sent(kind: Delays, seed: int, gaps: list[float]) -> None:
    line, again, t, arrivals = DelayLine(kind, str(seed)), DelayLine(kind, str(seed)), 0.0, []
    for gap in gaps:
        t += gap
        arrivals.append(line.arrival(t))
        assert arrivals[-1] >= t
        assert again.arrival(t) == arrivals[-1], "the same seed, the same delays"
    assert all(one <= next_ for one, next_ in pairwise(arrivals))


def test_constant() -> None:
    assert set(drawn(Constant(0.2), count=10)) == {0.2}


@pytest.mark.parametrize("kind", [Normal(0.2, 0.04), Gamma(0.2, 0.08), Gamma(0.05, 0.1)])
def test_mean_and_deviation_are_those_asked_for(kind: Normal | Gamma) -> None:
    found = drawn(kind)
    assert fmean(found) == pytest.approx(kind.mean, rel=0.03)
    assert pstdev(found) == pytest.approx(kind.deviation, rel=0.05)


def test_a_normal_delay_is_never_negative() -> None:
    assert min(drawn(Normal(0.01, 0.1))) == 0.0


@pytest.mark.parametrize("kind", [Gamma(0.2, 0.0), Gamma(0.0, 0.1)])
def test_a_gamma_delay_without_mean_or_deviation_is_constant(kind: Gamma) -> None:
    assert set(drawn(kind, count=10)) == {kind.mean}


def test_bursts_are_as_frequent_and_as_long_as_asked_for() -> None:
    step, kind = 0.05, Bursty(0.05, 0.4, calm_lasts=5.0, burst_lasts=0.5)
    found = drawn(kind, step, 200_000)
    bursts = sum(before == kind.calm and now == kind.burst for before, now in pairwise(found))
    share = found.count(kind.burst) / len(found)
    assert share == pytest.approx(0.5 / 5.5, rel=0.1)
    assert share * len(found) * step / bursts == pytest.approx(0.5, rel=0.1)


def test_bursts_are_as_frequent_for_messages_that_are_rare() -> None:
    found = drawn(Bursty(0.05, 0.4, calm_lasts=0.5, burst_lasts=0.5), step=1000.0)
    assert found.count(0.4) / len(found) == pytest.approx(0.5, abs=0.02)


def test_a_trace_without_times_is_one_message_after_the_other() -> None:
    assert drawn(Trace((0.1, 0.2, 0.3)), count=5) == [0.1, 0.2, 0.3, 0.1, 0.2]


def test_a_trace_with_times_begins_with_the_first_message_and_again_at_its_end() -> None:
    delay = Trace((0.1, 0.2, 0.3), times=(100.0, 101.0, 104.0)).source(Random(1))  # the last lasts 2 s, as on average
    assert [delay(50.0 + t) for t in (0.0, 0.9, 1.0, 3.9, 4.0, 5.9, 6.0, 7.0)] == [
        *(0.1, 0.1, 0.2, 0.2, 0.3, 0.3),
        *(0.1, 0.2),
    ]


def test_what_is_lost_comes_after_one_wait_then_after_twice_that() -> None:
    found = drawn(Lossy(Constant(0.1), 0.5))
    assert found.count(0.1) / MANY == pytest.approx(0.5, rel=0.05)
    for losses, late in ((1, RETRANSMIT), (2, 3 * RETRANSMIT), (3, 7 * RETRANSMIT)):
        share = sum(delay == pytest.approx(0.1 + late) for delay in found) / MANY
        assert share == pytest.approx(0.5 ** (losses + 1), rel=0.1)


def test_a_ways_gives_each_connection_lines_of_its_own() -> None:
    def drawn_of(ways: DelayWays, connection: int) -> tuple[float, float]:
        forward, backward = ways.lines(connection)
        return forward.arrival(0.0), backward.arrival(0.0)

    ways = DelayWays(Gamma(0.2, 0.08), Gamma(0.2, 0.08), seed=1)
    assert drawn_of(ways, 1) == drawn_of(ways, 1)
    assert len({*drawn_of(ways, 1), *drawn_of(ways, 2), *drawn_of(DelayWays(ways.forward, ways.backward, 2), 1)}) == 6


@pytest.mark.parametrize(
    ("text", "kind"),
    [
        ("200ms", Constant(0.2)),
        ("0", Constant(0.0)),
        (".5", Constant(0.5)),
        ("constant 2s", Constant(2.0)),
        ("normal 200ms 40ms", Normal(0.2, 0.04)),
        ("gamma 200ms 80ms", Gamma(0.2, 0.08)),
        (" GAMMA  0.2   80MS ", Gamma(0.2, 0.08)),
        ("bursty 50ms 400ms 5s 500ms", Bursty(0.05, 0.4, 5.0, 0.5)),
    ],
)
def test_each_kind_is_read(text: str, kind: Delays) -> None:
    assert parse_delays(text) == kind


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "which delays? (200ms, or one of constant, normal, gamma, bursty, trace)"),
        ("gama 200ms 80ms", "'gama 200ms 80ms' is no kind of delays (did you mean gamma?)"),
        ("pareto 1 2", "'pareto 1 2' is no kind of delays (one of constant, normal, gamma, bursty, trace)"),
        ("gamma 200ms", "'gamma 200ms' is not gamma MEAN DEVIATION (a duration for each, as 200ms or 0.2s)"),
        ("200ms 3", "'200ms 3' is not constant DELAY (a duration for each, as 200ms or 0.2s)"),
        ("gamma 200ms much", "'much' is no duration (as 200ms, 0.2s or 0.2)"),
        ("-200ms", "'-200ms' is no delay (from 0 to 3600 s)"),
        ("gamma nan 1", "'nan' is no delay (from 0 to 3600 s)"),
        ("gamma 1 infs", "'infs' is no delay (from 0 to 3600 s)"),
        ("bursty 1 1 1 0s", "'bursty 1 1 1 0s' has a state that lasts 0 s (how long a state lasts is above 0)"),
        ("trace ", "a trace is in a file (trace FILE)"),
    ],
)
def test_what_is_none_is_told(text: str, said: str) -> None:
    with pytest.raises(DelayError) as raised:
        parse_delays(text)
    assert str(raised.value) == f"*No delay* {said}"


@pytest.mark.parametrize(
    ("text", "value"), [("1us", 1e-6), ("1.5ms", 0.0015), ("1e-3", 0.001), ("2S", 2.0), ("3600", 3600.0)]
)
def test_durations(text: str, value: float) -> None:
    assert parse_duration(text) == pytest.approx(value)


@pytest.mark.parametrize(("text", "share"), [("1%", 0.01), ("0.02", 0.02), ("0", 0.0), ("50%", 0.5)])
def test_loss(text: str, share: float) -> None:
    assert parse_loss(text) == pytest.approx(share)


@pytest.mark.parametrize("text", ["51%", "-1%", "nan", "much", "%"])
def test_what_is_no_loss_is_told(text: str) -> None:
    with pytest.raises(DelayError, match="is no share"):
        parse_loss(text)


def test_a_loss_of_nothing_changes_nothing() -> None:
    assert with_loss(Constant(0.1), 0.0) == Constant(0.1)
    assert with_loss(Constant(0.1), 0.1) == Lossy(Constant(0.1), 0.1)


@pytest.mark.parametrize(
    ("text", "trace"),
    [
        ("100ms\n0.2\n", Trace((0.1, 0.2))),
        ("# measured on a Monday\n\n1 100ms # late\n 2.5\t0.2\n", Trace((0.1, 0.2), (1.0, 2.5))),
    ],
)
def test_a_trace_is_read(text: str, trace: Trace, tmp_path: Path) -> None:
    file = tmp_path / "a line.txt"
    file.write_text(text)
    assert parse_delays(f"trace {file}") == trace


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("# nothing\n", "holds no delay (a line is a delay, or a time and a delay)"),
        ("1 2 3\n", ":1 has 3 values (a line is a delay, or a time and a delay)"),
        ("0.1\nlate\n", ":2: 'late' is no duration (as 200ms, 0.2s or 0.2)"),
        ("now 0.1\n", ":1: 'now' is no time (a number of seconds)"),
        ("1 0.1\n0.2\n", ":2 has no time, and others have (a time on each line, or on none)"),
        ("1 0.1\n1 0.2\n", ":2 is not later than the line before (times grow from line to line)"),
    ],
)
def test_what_is_no_trace_is_told(text: str, said: str, tmp_path: Path) -> None:
    file = tmp_path / "trace"
    file.write_text(text)
    with pytest.raises(DelayError) as raised:
        read_trace(str(file))
    assert str(raised.value).endswith(said)


def test_a_trace_that_is_not_there_is_told(tmp_path: Path) -> None:
    with pytest.raises(NonexistentFile, match="nowhere cannot be read: No such file"):
        parse_delays(f"trace {tmp_path}/nowhere")
