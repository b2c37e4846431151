"""The body of a robot: which client it is, which reports are new, lost, late or wrong, alarms, and RESYNC."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from math import nan
from random import Random
from threading import Thread

import numpy as np
import pytest

from tests.interfaces.terminals import RecordingTerminal
from vrs_cli.engine.clock import WallClock
from vrs_cli.errors import IllegalValue, RequestRefused, UsageError, VrsError
from vrs_cli.interfaces.session.session import Session
from vrs_cli.interfaces.station import body as body_module
from vrs_cli.interfaces.station.body import AHEAD, PAST, SILENT, BodyChange, BodyNews, ReportNumbers, RobotBody
from vrs_cli.interfaces.users import STOPPED, StreamKind, TargetStream
from vrs_cli.kinematics.joints import Joints
from vrs_cli.trajectory.measured import MeasuredRecord
from vrs_cli.values.measured import BodyMode, DivergenceAlarm, DivergenceCause, OnAlarm, Report, ReportCounts
from vrs_cli.values.replies import Resynchronised
from vrs_cli.values.results import ResyncReport


class Bench:
    """A body with clocks that a test sets. `told`: what it was told; `heard`: what was taken of it."""

    def __init__(self) -> None:
        self.now = self.wall = 0.0
        self.body = RobotBody(MeasuredRecord(2), lambda: self.now, lambda: self.wall)
        self.told: list[BodyChange | DivergenceAlarm] = []
        self.heard: list[Report] = []
        self.body.listeners.append(self.told.append)
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
    assert bench.body.view is not None
    assert bench.body.view.counts == ReportCounts(5, lost=2)
    bench.report(7.3, 7.4, first=3)
    assert bench.body.view.counts == ReportCounts(7, lost=0, reordered=2)
    bench.report(7.5, 7.6, 7.7, first=5)
    assert bench.body.view.counts == ReportCounts(10, lost=0, reordered=2, duplicate=2)
    bench.report(7.7, first=8)
    assert bench.body.view.counts == ReportCounts(11, lost=0, reordered=2, duplicate=3)
    bench.report(3.0, first=9)
    assert bench.body.view.counts == ReportCounts(12, lost=0, late=1, reordered=2, duplicate=3)
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
    assert bench.body.view is not None
    assert bench.body.view.counts == ReportCounts()
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
    assert bench.body.view is not None
    assert (bench.body.view.order, bench.body.view.mode) == (BodyMode.HOLDS, BodyMode.FOLLOWS)


def test_the_rate_is_that_of_arrivals(bench: Bench) -> None:
    for number in range(300):
        bench.now = bench.wall = number * 0.02
        bench.report(bench.now)
    assert bench.body.view is not None
    assert bench.body.view.rate == pytest.approx(50.0, rel=0.02)


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


STEP = 0.02
OFF = 0.1  # [rad] of joint 2


class GuardedRobot:
    """A robot in virtual time, with a body that stands beside it."""

    def __init__(self) -> None:
        self.terminal = RecordingTerminal()
        self.session = Session(self.terminal)
        self.body, self.news = self.session.body, list[BodyNews]()
        self.body.listeners.append(self.news.append)
        self._random, self._t = np.random.default_rng(5), 0.0

    def joints(self, off: float = 0.0) -> Joints:
        here = np.array(self.session.engine.position().joints) + self._random.normal(0.0, 1e-4, 6)
        here[1] += off
        return tuple(here.tolist())

    def report(self, count: int, off: float = 0.0, mode: BodyMode = BodyMode.FOLLOWS) -> None:
        for _ in range(count):
            self._t += STEP
            self.body.take([Report(self._t, self.joints(off), mode=mode)], name=self.body.name)
        while self.session.actor.has_requests:
            self.session.actor.step()

    def alarms(self) -> list[DivergenceAlarm]:
        return [one for one in self.news if isinstance(one, DivergenceAlarm)]


@pytest.fixture
def guarded() -> GuardedRobot:
    return GuardedRobot()


def test_an_alarm_is_told_and_nothing_else_is_done(guarded: GuardedRobot) -> None:
    guarded.report(300)
    guarded.report(50, OFF)
    (alarm,) = guarded.alarms()
    assert (alarm.joint, guarded.body.order) == (2, BodyMode.FOLLOWS)
    assert guarded.session.divergence.alarm is alarm


def test_a_body_that_holds_without_an_order_is_told(guarded: GuardedRobot) -> None:
    guarded.report(300)
    guarded.report(50, OFF, BodyMode.HOLDS)
    (alarm,) = guarded.alarms()
    assert alarm.cause is DivergenceCause.STOPPED
    guarded.body.command(BodyMode.HOLDS, guarded.session.engine.now)
    guarded.report(50, OFF, BodyMode.HOLDS)
    guarded.body.command(BodyMode.FOLLOWS, guarded._t)
    guarded.report(25, OFF, BodyMode.HOLDS)  # the order is on its way
    assert guarded.alarms() == [alarm]


def test_nobody_looks_if_it_is_off(guarded: GuardedRobot) -> None:
    guarded.session.perform("BODY OFF")
    guarded.report(300)
    guarded.report(50, OFF)
    assert guarded.alarms() == []
    assert guarded.session.divergence.alarm is None


def test_the_body_is_told_to_hold(guarded: GuardedRobot) -> None:
    guarded.session.perform("BODY HOLD")
    assert guarded.session.divergence.on_alarm is OnAlarm.HOLD
    guarded.report(300)
    guarded.report(50, OFF)
    assert len(guarded.alarms()) == 1
    assert guarded.body.order is BodyMode.HOLDS


def test_the_robot_is_stopped(guarded: GuardedRobot) -> None:
    guarded.session.perform("PARAMETER DIVERGENCE = ABORT")
    guarded.report(300)
    stream = TargetStream(StreamKind.STEER, guarded.session.user_state)
    guarded.session.user_state.streams[StreamKind.STEER] = stream
    guarded.report(50, OFF)
    assert stream.ended == STOPPED


def test_it_is_brought_back_by_itself_when_its_stop_has_ended(guarded: GuardedRobot) -> None:
    guarded.session.perform("BODY RESYNC")
    guarded.report(300)
    guarded.report(50, OFF, BodyMode.STOPPED)
    assert guarded.body.order is BodyMode.HOLDS
    assert not [one for one in guarded.news if isinstance(one, ResyncReport)]
    guarded.report(1, OFF, BodyMode.HOLDS)
    (done,) = [one for one in guarded.news if isinstance(one, ResyncReport)]
    assert done.distances[1] == pytest.approx(OFF, abs=1e-3)
    assert guarded.body.order is BodyMode.FOLLOWS
    assert guarded.body.ordered_at == done.until


def test_a_blocked_joint_is_not_brought_back(guarded: GuardedRobot) -> None:
    guarded.session.perform("BODY RESYNC")
    guarded.report(300)
    guarded.report(50, OFF)  # for no cause that is known
    assert len(guarded.alarms()) == 1
    assert guarded.body.order is BodyMode.HOLDS
    guarded.report(50, OFF, BodyMode.HOLDS)
    assert not [one for one in guarded.news if isinstance(one, ResyncReport)]


def test_a_body_that_enters_away_from_the_timeline_is_brought_back(guarded: GuardedRobot) -> None:
    guarded.session.perform("BODY RESYNC")
    guarded.body.embody("arm")
    assert guarded.body.order is BodyMode.HOLDS
    guarded.report(10, OFF, BodyMode.HOLDS)
    assert [one for one in guarded.news if isinstance(one, ResyncReport)]
    assert guarded.body.order is BodyMode.FOLLOWS


def test_a_body_that_enters_where_the_robot_stands_follows_at_once(guarded: GuardedRobot) -> None:
    guarded.session.perform("BODY RESYNC")
    guarded.body.embody("arm")
    guarded.report(10, 0.0, BodyMode.HOLDS)
    assert guarded.body.order is BodyMode.FOLLOWS
    assert not [one for one in guarded.news if isinstance(one, ResyncReport)]


def test_resync_goes_to_the_measured_joints_and_back_to_the_goal(guarded: GuardedRobot) -> None:
    guarded.report(1, OFF, BodyMode.HOLDS)
    before = guarded.session.engine.position().joints
    guarded.session.perform("RESYNC")
    reply = guarded.terminal.replies[-1]
    assert isinstance(reply, Resynchronised)
    engine = guarded.session.engine
    assert engine.position(reply.report.until).joints[1] == pytest.approx(before[1] + OFF, abs=1e-3)
    assert engine.position(engine.end).joints == pytest.approx(before)


def test_resync_stop_stays_there(guarded: GuardedRobot) -> None:
    guarded.report(1, OFF, BodyMode.STOPPED)
    before = guarded.session.engine.position().joints
    guarded.session.perform("RESYNC STOP")
    assert guarded.session.engine.position().joints[1] == pytest.approx(before[1] + OFF, abs=1e-3)


def test_a_client_is_waited_for_until_it_stands(guarded: GuardedRobot) -> None:
    """It is told to hold, and reports that from another thread."""
    guarded.body.embody("arm")
    guarded.report(5)

    def obey(news: BodyNews) -> None:
        if isinstance(news, BodyChange) and news.order is BodyMode.HOLDS:
            Thread(target=lambda: guarded.report(10, OFF, BodyMode.HOLDS)).start()

    guarded.body.listeners.append(obey)
    guarded.session.perform("RESYNC")
    assert guarded.body.order is BodyMode.FOLLOWS


def test_resync_begins_when_the_body_stands_and_not_when_it_was_asked() -> None:
    wall = [0.0]
    session = Session(RecordingTerminal(), clock=WallClock(lambda: wall[0], lambda _seconds: None))
    session.body.embody("arm")
    here = session.engine.position().joints
    session.body.take([Report(0.0, here)], name="arm")

    def obey(news: BodyNews) -> None:
        if isinstance(news, BodyChange) and news.order is BodyMode.HOLDS:
            wall[0] = 3.0
            session.body.take([Report(t, here, mode=BodyMode.HOLDS) for t in (2.8, 2.9)], name="arm")

    session.body.listeners.append(obey)
    session.perform("RESYNC STOP")
    assert session.body.order is BodyMode.FOLLOWS
    assert session.engine.timeline[-1].start >= 3.0


def _stopped(guarded: GuardedRobot) -> None:
    guarded.report(1, OFF, BodyMode.STOPPED)


def _left(guarded: GuardedRobot) -> None:
    guarded.body.embody("arm")
    guarded.report(5)
    guarded.body.leave("arm")


def _silent(guarded: GuardedRobot) -> None:
    guarded.body.embody("arm")
    guarded.report(5)


def _nothing(guarded: GuardedRobot) -> None:
    """Report nothing."""


def _branch(guarded: GuardedRobot) -> None:
    guarded.report(1)
    guarded.session.perform("BRANCH trial")


@pytest.mark.parametrize(
    ("prepare", "error", "why"),
    [
        (_nothing, RequestRefused, "nothing measures this robot"),
        (_left, RequestRefused, "nothing was measured since"),
        (_silent, RequestRefused, "has not reported within 0.01 s that it stands"),
        (_stopped, RequestRefused, "has stopped by itself"),
        (_branch, UsageError, "which is main"),
    ],
)
def test_what_resync_cannot_do(
    guarded: GuardedRobot,
    prepare: Callable[[GuardedRobot], None],
    error: type[Exception],
    why: str,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(body_module, "STANDS_WITHIN", 0.01)
    prepare(guarded)
    before = guarded.session.engine.timeline
    with pytest.raises(error, match=why):
        guarded.session.perform("RESYNC")
    assert guarded.session.engine.timeline is before


def test_other_words_are_refused(guarded: GuardedRobot) -> None:
    with pytest.raises(UsageError, match="RESYNC STOP"):
        guarded.session.perform("RESYNC SOON")
