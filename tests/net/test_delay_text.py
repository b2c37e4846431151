"""Delays as people write them: each kind, and what is said of what is none."""

from __future__ import annotations

from pathlib import Path

import pytest

from vrs_cli.errors import NonexistentFile
from vrs_cli.net.delay_line import Bursty, Constant, Delays, Gamma, Lossy, Normal, Trace
from vrs_cli.net.delay_text import DelayError, parse_delays, parse_duration, parse_loss, read_trace, with_loss


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
