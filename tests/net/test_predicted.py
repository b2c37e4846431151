"""What a predictive viewer is shown, what it is told was wrong, and what is not confirmed."""

from __future__ import annotations

from math import inf, radians

import pytest
from msgspec import structs

from tests.engine.wall import ManualWall
from tests.net.test_far_end import Wires
from vrs_cli.engine.engine import Engine
from vrs_cli.engine.feed import Snapshot
from vrs_cli.engine.position import joints_at
from vrs_cli.errors import IllegalValue
from vrs_cli.interfaces.streams import Steering
from vrs_cli.language.words.monitor import COMMANDS
from vrs_cli.net import messages
from vrs_cli.net.far_end import COMMAND_TIMEOUT_S, Ahead, Predicted
from vrs_cli.net.messages import Abort, At, Clock, Done, Line, Pong, Told
from vrs_cli.net.mirror import Mirror, first_difference
from vrs_cli.net.preview import CHANGING, Flags, changing_line
from vrs_cli.trajectory.timeline import TimelineDelta
from vrs_cli.values.acts import Execute, Go, Goal, ListMotions, Say, Undo
from vrs_cli.values.commands import JointTarget, Move, Stamp
from vrs_cli.values.results import Message
from vrs_cli.wire.messages import Refusal, snapshot_record
from vrs_cli.wire.records import Motions, delta_record
from vrs_cli.wire.steered import steered_record

FORWARD, BACKWARD = 0.375, 0.125  # [s]
THERE = 40.0  # [s] that the clock of the server is ahead


class Behind(Wires):
    """A robot in real time, so far away; its clock and that of the server begin with the time here."""

    def __init__(self, rate: float = 1.0, forward: float = FORWARD, backward: float = BACKWARD) -> None:
        super().__init__()
        self.rate, self.wall = rate, ManualWall(0.0)
        self.engine = Engine(self.engine.model, clock=self.wall.clock(rate))
        self.events = self.engine.events.subscribe()
        self.events.take_all()
        self.begin = self.now
        self.say(self.clock())
        self.pass_by(forward + backward)
        self.say(Pong(self.begin, self.begin + THERE + forward, self.begin + THERE + forward, self.there))
        self.number += 1
        self.say(messages.Replaced(snapshot_record(Snapshot.of(self.engine.timeline, self.engine.settings))))
        self.far.flags = Flags()  # another robot was there before

    def clock(self) -> Clock:
        return Clock(0.0, self.rate, realtime=True, wall=self.begin + THERE)

    @property
    def there(self) -> float:
        """What the clock of the robot shows now."""
        return self.rate * (self.now - self.begin)

    def pass_by(self, seconds: float) -> None:
        self.now += seconds
        self.wall.seconds = self.now - self.begin
        self.engine.clock.advance(self.engine.clock.reached)

    @property
    def mirror(self) -> Mirror:
        assert self.far.mirror is not None
        return self.far.mirror

    def moves(self, jt1: float, at: float) -> None:
        """The robot is commanded by somebody else."""
        ready = self.engine.model.poses["ready"]
        self.engine.begin(Move(JointTarget((radians(jt1), *ready[1:])), False, stamp=Stamp(at)), program=False)

    def lines(self, t: float) -> list[str]:
        return list(self.far.preview_now().lines(t))


@pytest.mark.parametrize("rate", [1.0, 2.0])
def test_what_is_shown_is_counted_from_the_clock_as_it_is_heard(rate: float) -> None:
    """t_c is the robot's clock D_b ago; D_f + D_b after it a command of now arrives, whatever D_f and D_b differ in."""
    wires = Behind(rate)
    far = wires.far
    assert far.round_trip == pytest.approx(rate * 0.5)
    assert far.heard_time == pytest.approx(wires.there - rate * BACKWARD)
    far.ahead = Ahead.AUTO
    assert far.shown_time == pytest.approx(wires.there + rate * FORWARD)
    far.ahead = 0.0
    assert far.shown_time == far.heard_time
    far.ahead = rate * BACKWARD
    assert far.shown_time == pytest.approx(wires.there)
    far.ahead = Ahead.PRESENT
    assert far.shown_time == pytest.approx(wires.there, abs=rate * (FORWARD - BACKWARD) / 2.0 + 1e-6)


def test_in_virtual_time_there_is_nothing_to_be_ahead_of() -> None:
    wires = Wires()
    for wires.far.ahead in (Ahead.PRESENT, Ahead.AUTO, 3.0):
        assert wires.far.shown_time == wires.far.heard_time == wires.engine.now
        assert list(wires.far.preview_now().lines(0.0)) == []


def test_who_looks_ahead_sees_the_plan_and_is_told_of_what_was_wrong() -> None:
    wires = Behind()
    far, predicted = wires.far, Predicted(wires.far)
    far.ahead = Ahead.AUTO
    wires.moves(30.0, 1.0)
    wires.tell_changes()
    assert far.flags.windows == (), "it came before anybody was shown what it changes"
    wires.pass_by(1.0)
    assert joints_at(predicted.arm, predicted.timeline, predicted.now) == joints_at(
        wires.engine.arm, wires.engine.timeline, far.shown_time
    )
    wires.moves(-30.0, wires.there + 0.125)
    cut = wires.engine.book.deltas[-1].cut
    wires.pass_by(BACKWARD)
    wires.tell_changes()
    (window,) = far.flags.windows
    assert (window.begin, window.end) == (cut, pytest.approx(wires.there + FORWARD))
    ahead, flagged = wires.lines(cut + 0.1)
    assert ahead.endswith("s ahead of what is heard, D_f + D_b is 0.500 s")
    assert flagged == f"flagged: {window.begin:.3f} to {window.end:.3f} s was shown before a command changed it"
    assert len(wires.lines(cut - 0.1)) == 1
    assert len(wires.lines(window.end + 4.0)) == 1


def test_targets_of_steering_are_flagged_too() -> None:
    wires = Behind()
    cut = steered(wires)
    (window,) = wires.far.flags.windows
    assert window.begin == cut
    assert window.end == pytest.approx(wires.there, abs=(FORWARD - BACKWARD) / 2.0 + 1e-6)


@pytest.mark.parametrize("own", [True, False])
def test_nothing_is_flagged_of_a_robot_that_is_near(own: bool) -> None:
    """Nor of one's own, however late a busy machine makes it; but what is shown ahead of it is a guess."""
    wires = Behind(forward=0.2, backward=0.2) if own else Behind(forward=0.003, backward=0.003)
    wires.far.welcome = structs.replace(wires.far.welcome, one_user=own)
    steered(wires)
    assert wires.far.flags.windows == ()
    wires.far.ahead, wires.far.welcome = 0.5, structs.replace(wires.far.welcome, one_user=False)
    steered(wires)
    begin, end = wires.far.flags.windows[-1]
    assert end - begin > 0.4


def steered(wires: Behind) -> float:
    """From when on [s]: the robot is steered, and that is told of a while later."""
    steering, ready = Steering(wires.engine), wires.engine.model.poses["ready"]
    first = len(wires.engine.book.deltas)
    for k in range(5):
        steering.to((radians(float(k)), *ready[1:]))
        wires.pass_by(0.02)
    before = wires.mirror.timeline
    short = 0
    for event in wires.events.take_all():
        assert isinstance(event, TimelineDelta)
        wires.number += 1
        target = steered_record(event, before, wires.engine.arm)
        short += target is not None
        full = messages.Delta(delta_record(event, Motions()), wires.engine.now)
        wires.say(full if target is None else messages.Steered(target))
        before = before.apply(event)
    assert short > 2
    assert wires.mirror.timeline == wires.engine.timeline
    return wires.engine.book.deltas[first].cut


def test_another_timeline_is_flagged_from_where_it_parts() -> None:
    wires = Behind()
    wires.moves(30.0, 0.75)
    wires.moves(-30.0, 1.25)
    wires.events.take_all()
    wires.number += 1
    wires.pass_by(0.5)
    wires.say(messages.Replaced(snapshot_record(Snapshot.of(wires.engine.timeline, wires.engine.settings))))
    (window,) = wires.far.flags.windows
    assert window.begin == 0.75
    wires.number += 1
    wires.say(messages.Replaced(snapshot_record(Snapshot.of(wires.engine.timeline, wires.engine.settings))))
    assert wires.far.flags.windows == (window,), "the same again changes nothing"


def test_where_timelines_part() -> None:
    wires = Wires()
    versions = [wires.engine.timeline]
    for _ in range(40):
        wires.edits.edit()
        versions.append(wires.engine.timeline)
    for one in versions:
        for other in versions[::7]:
            t = first_difference(one, other)
            assert t == first_difference(other, one)
            assert (t == inf) is (one == other)
            for k in range(20):
                s = k / 20.0 * min(t, 30.0)
                assert joints_at(wires.engine.arm, one, s) == joints_at(wires.engine.arm, other, s)


def go(jt1: float, at: float, wires: Wires) -> Go:
    ready = wires.engine.model.poses["ready"]
    return Go(Goal(joints=(radians(jt1), *ready[1:])), executed=at, text=f"MOVE to {jt1:g}")


def test_what_is_on_its_way_is_named_until_it_is_confirmed() -> None:
    wires = Behind()
    far, at = wires.far, 1.5
    move = wires.ask(lambda id: At(id, go(30.0, at, wires)))
    line = wires.ask(lambda id: Line(id, "DO MOVE a"))
    wires.ask(lambda id: Line(id, "WHERE"))
    wires.carry()
    assert far.preview is not None
    planned, unknown = far.preview.plan.expected
    assert (planned.begin, planned.planned, planned.text) == (at, True, "MOVE to 30")
    assert (unknown.begin, unknown.planned, unknown.text) == (pytest.approx(far.now + 0.25), False, "DO MOVE a")
    assert far.preview_now().unconfirmed == unknown.begin, "what it does is not known here: all may change"
    assert wires.lines(2.0) == [f"unconfirmed from {unknown.begin:.3f} s on: MOVE to 30, DO MOVE a"]
    assert wires.lines(0.1) == []
    wires.say(Told(Message("begun"), line))
    assert far.preview_now().unconfirmed == at, "the robot is at it, and tells what it changes"
    wires.moves(30.0, at)
    wires.say(Done(move, version=wires.engine.timeline.version))
    assert far.preview_now().unconfirmed == at, "its change is on its way"
    wires.tell_changes()
    assert far.preview_now().unconfirmed == inf


def test_what_is_no_place_is_sent_and_not_previewed() -> None:
    wires = Behind()
    id = wires.ask(lambda id: At(id, Go(Goal())))
    wires.carry()
    assert wires.far.preview_now().expected == ()
    wires.end(wires.came[-1], ok=False, refusal=Refusal.of(IllegalValue("a motion to nowhere")))
    assert isinstance(wires.ends[-1], Done)
    assert wires.ends[-1].id == id, "who has asked is told"


def test_what_is_not_heard_is_not_confirmed() -> None:
    wires = Behind()
    wires.cut()
    heard = wires.far.heard_time
    wires.pass_by(5.0)
    assert wires.far.heard_time == wires.far.preview_now().unconfirmed == heard
    wires.now += COMMAND_TIMEOUT_S
    wires.far.look()
    assert wires.far.heard_time == heard, "also when nobody waits for it any more"
    assert wires.lines(heard + 1.0) == [f"unconfirmed from {heard:.3f} s on: the robot is not heard"]
    wires.connect(wires.clock())
    assert wires.far.preview_now().unconfirmed == inf


def test_what_may_change_the_timeline() -> None:
    assert CHANGING.issubset(COMMANDS)
    asked = {
        "MOVE a": True,
        "do depart 50": True,
        "EXECUTE p, 3": True,
        "UNDO": True,
        "JOG": True,
        "WHERE": False,
        "x = 3": False,
        "x": False,
        "MOVEE": False,
        "": False,
        ".PROGRAM p()\nMOVE a\n.END\n": False,
        "ready\nwhere\n": True,
    }
    for text, changes in asked.items():
        assert (changing_line(Line(1, text)) is not None) is changes, text
        assert (changing_line(At(1, Say(text))) is not None) is changes, text
    others = Abort(1), At(1, Undo()), At(1, Execute("p"))
    assert [changing_line(it) for it in others] == ["ABORT", "UNDO", "EXECUTE p"]
    assert changing_line(At(1, ListMotions())) is None


def test_a_motion_says_when_it_was_issued() -> None:
    wires = Behind()
    for issued, told in ((None, wires.far.now), (0.25, 0.25)):
        wires.ask(lambda id, issued=issued: At(id, go(10.0, 2.0, wires), issued))
        wires.carry()
        sent = wires.came[-1]
        assert isinstance(sent, At)
        assert structs.replace(sent, act=None).issued == told  # type: ignore[arg-type]
