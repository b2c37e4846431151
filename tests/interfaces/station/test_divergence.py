"""What a robot does about a body that is not where the timeline says: alarms by setting, and RESYNC."""

from __future__ import annotations

from collections.abc import Callable
from threading import Thread

import numpy as np
import pytest

from tests.interfaces.terminals import RecordingTerminal
from vrs_cli.engine.clock import WallClock
from vrs_cli.errors import RequestRefused, UsageError
from vrs_cli.interfaces.session.session import Session
from vrs_cli.interfaces.station import divergence
from vrs_cli.interfaces.station.body import BodyChange, BodyNews
from vrs_cli.kinematics.joints import Joints
from vrs_cli.values.measured import BodyMode, DivergenceAlarm, DivergenceCause, OnAlarm, Report, ResyncReport
from vrs_cli.values.replies import Resynchronised

STEP = 0.02
OFF = 0.1  # [rad] of joint 2


class Bench:
    """A robot in virtual time, with a body that stands beside it."""

    def __init__(self) -> None:
        self.terminal = RecordingTerminal()
        self.session = Session(self.terminal)
        self.body, self.news = self.session.body, list[BodyNews]()
        self.body.told.append(self.news.append)
        self._random, self._t = np.random.default_rng(5), 0.0

    def joints(self, off: float = 0.0) -> Joints:
        here = np.array(self.session.engine.position().joints) + self._random.normal(0.0, 1e-4, 6)
        here[1] += off
        return tuple(here.tolist())

    def report(self, count: int, off: float = 0.0, mode: BodyMode = BodyMode.FOLLOWS) -> None:
        for _ in range(count):
            self._t += STEP
            self.body.take([Report(self._t, self.joints(off), mode=mode)], name=self.body.name)
        while self.session.actor.asked:
            self.session.actor.step()

    def alarms(self) -> list[DivergenceAlarm]:
        return [one for one in self.news if isinstance(one, DivergenceAlarm)]


@pytest.fixture
def bench() -> Bench:
    return Bench()


def test_an_alarm_is_told_and_nothing_else_is_done(bench: Bench) -> None:
    bench.report(300)
    bench.report(50, OFF)
    (alarm,) = bench.alarms()
    assert (alarm.joint, bench.body.order) == (2, BodyMode.FOLLOWS)
    assert bench.session.divergence.alarm is alarm


def test_a_body_that_holds_without_an_order_is_told(bench: Bench) -> None:
    bench.report(300)
    bench.report(50, OFF, BodyMode.HOLDS)
    (alarm,) = bench.alarms()
    assert alarm.cause is DivergenceCause.STOPPED
    bench.body.command(BodyMode.HOLDS, bench.session.engine.now)
    bench.report(50, OFF, BodyMode.HOLDS)
    bench.body.command(BodyMode.FOLLOWS, bench._t)
    bench.report(25, OFF, BodyMode.HOLDS)  # the order is on its way
    assert bench.alarms() == [alarm]


def test_nobody_looks_if_it_is_off(bench: Bench) -> None:
    bench.session.perform("BODY OFF")
    bench.report(300)
    bench.report(50, OFF)
    assert bench.alarms() == []
    assert bench.session.divergence.alarm is None


def test_the_body_is_told_to_hold(bench: Bench) -> None:
    bench.session.perform("BODY HOLD")
    assert bench.session.divergence.on_alarm is OnAlarm.HOLD
    bench.report(300)
    bench.report(50, OFF)
    assert len(bench.alarms()) == 1
    assert bench.body.order is BodyMode.HOLDS


def test_the_robot_is_stopped(bench: Bench) -> None:
    bench.session.perform("PARAMETER DIVERGENCE = ABORT")
    bench.report(300)
    stops = bench.session.stops
    bench.report(50, OFF)
    assert bench.session.stops == stops + 1


def test_it_is_brought_back_by_itself_when_its_stop_has_ended(bench: Bench) -> None:
    bench.session.perform("BODY RESYNC")
    bench.report(300)
    bench.report(50, OFF, BodyMode.STOPPED)
    assert bench.body.order is BodyMode.HOLDS
    assert not [one for one in bench.news if isinstance(one, ResyncReport)]
    bench.report(1, OFF, BodyMode.HOLDS)
    (done,) = [one for one in bench.news if isinstance(one, ResyncReport)]
    assert done.distances[1] == pytest.approx(OFF, abs=1e-3)
    assert bench.body.order is BodyMode.FOLLOWS
    assert bench.body.ordered_at == done.until


def test_a_blocked_joint_is_not_brought_back(bench: Bench) -> None:
    bench.session.perform("BODY RESYNC")
    bench.report(300)
    bench.report(50, OFF)  # for no cause that is known
    assert len(bench.alarms()) == 1
    assert bench.body.order is BodyMode.HOLDS
    bench.report(50, OFF, BodyMode.HOLDS)
    assert not [one for one in bench.news if isinstance(one, ResyncReport)]


def test_a_body_that_enters_away_from_the_timeline_is_brought_back(bench: Bench) -> None:
    bench.session.perform("BODY RESYNC")
    bench.body.embody("arm")
    assert bench.body.order is BodyMode.HOLDS
    bench.report(10, OFF, BodyMode.HOLDS)
    assert [one for one in bench.news if isinstance(one, ResyncReport)]
    assert bench.body.order is BodyMode.FOLLOWS


def test_a_body_that_enters_where_the_robot_stands_follows_at_once(bench: Bench) -> None:
    bench.session.perform("BODY RESYNC")
    bench.body.embody("arm")
    bench.report(10, 0.0, BodyMode.HOLDS)
    assert bench.body.order is BodyMode.FOLLOWS
    assert not [one for one in bench.news if isinstance(one, ResyncReport)]


def test_resync_goes_to_the_measured_joints_and_back_to_the_goal(bench: Bench) -> None:
    bench.report(1, OFF, BodyMode.HOLDS)
    before = bench.session.engine.position().joints
    bench.session.perform("RESYNC")
    reply = bench.terminal.replies[-1]
    assert isinstance(reply, Resynchronised)
    engine = bench.session.engine
    assert engine.position(reply.report.until).joints[1] == pytest.approx(before[1] + OFF, abs=1e-3)
    assert engine.position(engine.end).joints == pytest.approx(before)


def test_resync_stop_stays_there(bench: Bench) -> None:
    bench.report(1, OFF, BodyMode.STOPPED)
    before = bench.session.engine.position().joints
    bench.session.perform("RESYNC STOP")
    assert bench.session.engine.position().joints[1] == pytest.approx(before[1] + OFF, abs=1e-3)


def test_a_client_is_waited_for_until_it_stands(bench: Bench) -> None:
    """It is told to hold, and reports that from another thread."""
    bench.body.embody("arm")
    bench.report(5)

    def obey(news: BodyNews) -> None:
        if isinstance(news, BodyChange) and news.order is BodyMode.HOLDS:
            Thread(target=lambda: bench.report(10, OFF, BodyMode.HOLDS)).start()

    bench.body.told.append(obey)
    bench.session.perform("RESYNC")
    assert bench.body.order is BodyMode.FOLLOWS


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

    session.body.told.append(obey)
    session.perform("RESYNC STOP")
    assert session.body.order is BodyMode.FOLLOWS
    assert session.engine.timeline[-1].start >= 3.0


def _stopped(bench: Bench) -> None:
    bench.report(1, OFF, BodyMode.STOPPED)


def _left(bench: Bench) -> None:
    bench.body.embody("arm")
    bench.report(5)
    bench.body.leave("arm")


def _silent(bench: Bench) -> None:
    bench.body.embody("arm")
    bench.report(5)


def _nothing(bench: Bench) -> None:
    """Report nothing."""


def _branch(bench: Bench) -> None:
    bench.report(1)
    bench.session.perform("BRANCH trial")


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
    bench: Bench,
    prepare: Callable[[Bench], None],
    error: type[Exception],
    why: str,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(divergence, "STANDS_WITHIN", 0.01)
    prepare(bench)
    before = bench.session.engine.timeline
    with pytest.raises(error, match=why):
        bench.session.perform("RESYNC")
    assert bench.session.engine.timeline is before


def test_other_words_are_refused(bench: Bench) -> None:
    with pytest.raises(UsageError, match="RESYNC STOP"):
        bench.session.perform("RESYNC SOON")
