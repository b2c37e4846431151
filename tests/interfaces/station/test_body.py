"""The body of a robot: who is it, which reports are new, lost, late or wrong, and what it is told."""

from __future__ import annotations

from contextlib import suppress
from math import nan
from random import Random

import pytest

from vrs_cli.errors import IllegalValue, RequestRefused, VrsError
from vrs_cli.interfaces.station.body import AHEAD, PAST, SILENT, BodyChange, ReportNumbers, RobotBody
from vrs_cli.trajectory.measured import MeasuredRecord
from vrs_cli.values.measured import BodyMode, DivergenceAlarm, DivergenceCause, Report, ReportCounts


class Bench:
    """A body with clocks that a test sets. `told`: what it was told; `heard`: what was taken of it."""

    def __init__(self) -> None:
        self.now = self.wall = 0.0
        self.body = RobotBody(MeasuredRecord(2), lambda: self.now, lambda: self.wall)
        self.told: list[BodyChange | DivergenceAlarm] = []
        self.heard: list[Report] = []
        self.body.told.append(self.told.append)
        self.body.record.listeners.append(self.heard.extend)

    def report(self, *times: float, first: int | None = None, name: str = "arm") -> ReportCounts:
        return self.body.take([Report(t, (t, 0.0)) for t in times], first, name)


@pytest.fixture
def bench() -> Bench:
    made = Bench()
    made.body.embody("arm")
    return made


def test_one_client_at_a_time_is_the_body(bench: Bench) -> None:
    body = bench.body
    with pytest.raises(RequestRefused, match="arm is the body"):
        body.embody("other")
    with pytest.raises(RequestRefused, match="a report of other, but arm is the body"):
        bench.report(0.0, name="other")
    assert not body.leave("other")
    assert body.leave("arm")
    with pytest.raises(RequestRefused, match="nobody is the body"):
        bench.report(0.0)
    assert body.embody("other", 7) == 7
    names = [(one.before, one.name) for one in bench.told if isinstance(one, BodyChange)]
    assert names == [("", "arm"), ("arm", ""), ("", "other")]


def test_who_is_the_body_already_goes_on_counting(bench: Bench) -> None:
    bench.report(0.0, 0.1, 0.2, first=0)
    assert bench.body.embody("arm", 0) == 3


def test_a_local_robot_reports_without_a_client() -> None:
    bench = Bench()
    assert bench.report(0.0, 0.1, name="") == ReportCounts(received=2)
    assert bench.body.record.view.joints_at(0.05) == pytest.approx((0.05, 0.0))


def test_reports_are_counted_as_what_becomes_of_them(bench: Bench) -> None:
    bench.now = 10.0
    bench.report(7.0, 7.1, 7.2, first=0)
    bench.report(7.5, 7.6, first=5)
    assert bench.body.seen is not None
    assert bench.body.seen.counts == ReportCounts(5, lost=2)
    bench.report(7.3, 7.4, first=3)
    assert bench.body.seen.counts == ReportCounts(7, lost=0, reordered=2)
    bench.report(7.5, 7.6, 7.7, first=5)
    assert bench.body.seen.counts == ReportCounts(10, lost=0, reordered=2, duplicate=2)
    bench.report(7.7, first=8)
    assert bench.body.seen.counts == ReportCounts(11, lost=0, reordered=2, duplicate=3)
    bench.report(3.0, first=9)
    assert bench.body.seen.counts == ReportCounts(12, lost=0, late=1, reordered=2, duplicate=3)
    assert [one.t for one in bench.body.record.view] == [7.0, 7.1, 7.2, 7.3, 7.4, 7.5, 7.6, 7.7]


@pytest.mark.parametrize("seed", range(20))
def test_numbers_are_those_that_a_set_knows(seed: int) -> None:
    random, numbers, came = Random(seed), ReportNumbers(0), set[int]()
    at = Report(0.0, (0.0,))
    for _ in range(200):
        first, count = random.randrange(300), random.randrange(1, 9)
        new = numbers.new(first, [at] * count)
        numbers.note(first, count)
        span = set(range(first, first + count))
        assert len(new) == len(span - came)
        came |= span
        assert numbers.next == max(came) + 1
        assert numbers.lost == numbers.next - len(came)


@pytest.mark.parametrize(
    ("report", "told"),
    [
        (Report(4999.1, (0.0,)), "joints"),
        (Report(4999.1, (0.0, nan)), "joint 2"),
        (Report(4999.1, (0.0, 0.0), (nan, 0.0)), "velocity of joint 1"),
        (Report(nan, (0.0, 0.0)), "a report of nan s, when the robot's clock is at 5000.000 s"),
        (Report(5000.0 + AHEAD + 1.0, (0.0, 0.0)), "a report of 5011 s"),
        (Report(5000.0 - PAST - 1.0, (0.0, 0.0)), "a report of 1399 s"),
    ],
)
def test_what_is_no_report_is_refused_and_changes_nothing(bench: Bench, report: Report, told: str) -> None:
    bench.now = 5000.0
    with pytest.raises(IllegalValue, match=told):
        bench.body.take([Report(4999.0, (0.0, 0.0)), report], 0, "arm")
    assert (len(bench.body.record), bench.heard) == (0, [])
    assert bench.body.seen is not None
    assert bench.body.seen.counts == ReportCounts()
    assert bench.body.embody("arm") == 0


def test_a_body_that_is_silent_is_unknown_and_stays_the_body(bench: Bench) -> None:
    assert bench.body.unknown_since is None
    bench.report(0.0, 0.5)
    assert bench.body.unknown_since is None
    bench.wall = SILENT + 0.1
    assert bench.body.unknown_since == 0.5
    assert bench.body.name == "arm"
    bench.report(0.6)
    assert bench.body.unknown_since is None
    bench.body.leave("arm")
    assert bench.body.unknown_since == 0.6


def test_an_order_and_an_alarm_are_told(bench: Bench) -> None:
    bench.now = 3.0
    bench.body.command(BodyMode.HOLDS)
    alarm = DivergenceAlarm(3.0, 1, 0.1, 0.02, DivergenceCause.BLOCKED, "joint 1 is blocked", 2.5)
    bench.body.tell(alarm)
    assert bench.told[1:] == [BodyChange("arm", "arm", BodyMode.HOLDS, 3.0), alarm]
    assert bench.body.seen is not None
    assert (bench.body.seen.order, bench.body.seen.mode) == (BodyMode.HOLDS, BodyMode.FOLLOWS)


def test_the_rate_is_that_of_arrivals(bench: Bench) -> None:
    for number in range(300):
        bench.now = bench.wall = number * 0.02
        bench.report(bench.now)
    assert bench.body.seen is not None
    assert bench.body.seen.rate == pytest.approx(50.0, rel=0.02)


def test_all_errors_are_ours(bench: Bench) -> None:
    """Random reports, as a client that is wrong may send them."""
    random = Random(3)
    values = [0.0, 1.0, -1e300, 1e300, nan, float("inf"), 5.0]
    for _ in range(500):
        rows = [tuple(random.choices(values, k=random.randrange(4))) for _ in range(random.randrange(4))]
        reports = [Report(random.choice(values), row, random.choice([None, row])) for row in rows]
        with suppress(VrsError):
            bench.body.take(reports, random.randrange(2**53), "arm")
    assert all(abs(one.t) <= AHEAD for one in bench.body.record.view)
