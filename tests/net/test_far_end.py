"""What is known of a robot afar, and what becomes of what was asked of it, whatever happens to the connection."""

from __future__ import annotations

from math import inf
from typing import Any

import pytest
from msgspec import structs

from tests.net.edits import Edits
from tests.net.test_mirror import bits
from vrs_cli.engine.feed import MissedEvents, Snapshot, TimelineReplaced
from vrs_cli.errors import FileDamaged, RequestRefused
from vrs_cli.kinematics.model_data import to_dict
from vrs_cli.kinematics.transform import Transform, translation
from vrs_cli.net import messages
from vrs_cli.net.delivery_log import DeliveryLog
from vrs_cli.net.far_end import CATCHING_UP, COMMAND_TIMEOUT_S, HELD_UP, QUIET, FarEnd
from vrs_cli.net.messages import At, Clock, Done, Line, Subscribe, Told
from vrs_cli.net.protocol import ServerConnection
from vrs_cli.values.acts import Rest
from vrs_cli.values.commands import JointOffsetTarget, Move
from vrs_cli.values.dragging import DragState
from vrs_cli.values.questions import LineWanted, PromptStatus
from vrs_cli.values.results import Message
from vrs_cli.wire.codec import Encoding
from vrs_cli.wire.messages import snapshot_record
from vrs_cli.wire.records import Motions, delta_record

HELLO = messages.Hello((messages.VERSION,), format=Encoding.MSGPACK)


class Wires:
    """A far end, and a server whose every word a test says; `now` is the time of the day here, `ahead` that there."""

    def __init__(self, follows: bool = True) -> None:
        self.now, self.ahead, self.life = 100.0, 0.0, "a"
        self.edits = Edits(3)
        self.engine = self.edits.engine
        self.events = self.engine.events.subscribe()
        self.model: dict[str, Any] = to_dict(self.engine.model)
        self.delivery_log, self.number = DeliveryLog("key"), 0
        self.far = FarEnd(HELLO, lambda: self.now)
        self.came: list[messages.ClientMessage] = []
        self.ends: list[messages.ServerMessage] = []
        self.connect()
        if follows:
            self.ask(lambda id: Subscribe(id, deltas=True))
            self.carry()
            self.events.take_all()
            self.say(messages.Replaced(snapshot_record(Snapshot.of(self.engine.timeline, self.engine.settings))))
            self.end(self.came[-1])

    def connect(self, clock: Clock | None = None) -> None:
        self.server = ServerConnection(self.now)
        self.far.connection.begin()
        self.carry()
        welcome = messages.Welcome(
            0, "", "cell1", self.life, "supervisor", "ada", clock or Clock(self.engine.now), self.model
        )
        self.server.welcome(welcome, self.delivery_log, self.now)
        self.answer()

    def cut(self) -> None:
        self.far.cut()
        self.server.cut(self.now)

    def ask(self, make: Any) -> int:
        return self.far.ask(make, self.ends.append)

    def carry(self) -> None:
        """What the far end has sent comes to the server."""
        for frame in self.far.connection.frames():
            self.came += self.server.receive(frame, self.now)

    def answer(self) -> None:
        """What the server has sent comes to the far end."""
        for frame in self.server.frames():
            self.far.receive(frame)

    def say(self, message: messages.ServerMessage) -> None:
        if isinstance(message, messages.Change):
            message = structs.replace(message, number=self.number)
        self.server.send(message, self.now)
        self.answer()

    def end(self, request: Any, **more: Any) -> None:
        self.say(Done(request.id, version=self.engine.timeline.version, **more))

    def tell_changes(self) -> None:
        for event in self.events.take_all():
            assert not isinstance(event, MissedEvents)
            self.number += 1
            if isinstance(event, TimelineReplaced):
                self.say(messages.Replaced(snapshot_record(Snapshot.of(event.timeline, event.settings))))
            else:
                self.say(messages.Delta(delta_record(event, Motions()), self.engine.now))

    @property
    def shown(self) -> str:
        assert self.far.mirror is not None
        return bits(self.far.mirror.timeline)


def test_the_mirror_follows() -> None:
    wires = Wires()
    for _ in range(20):
        wires.edits.edit()
    wires.tell_changes()
    assert wires.shown == bits(wires.engine.timeline)


def drive(wires: Wires, change: float) -> None:
    """A motion that cannot be refused."""
    wires.engine.perform(Move(JointOffsetTarget(1, change), False))


def test_who_commands_sees_what_it_has_changed() -> None:
    """The answer comes before the change; its end is told after it."""
    wires = Wires()
    for replaced in (False, True, False):
        drive(wires, 0.1)
        wires.ends.clear()
        id = wires.ask(lambda id: Line(id, "something"))
        wires.carry()
        wires.say(Told(Message("answered"), id))
        wires.say(Done(id, version=wires.engine.timeline.version))
        assert [type(one) for one in wires.ends] == [Told], "the change is on its way"
        if replaced:
            wires.events.take_all()
            wires.number += 1
            wires.say(messages.Replaced(snapshot_record(Snapshot.of(wires.engine.timeline, wires.engine.settings))))
        else:
            wires.tell_changes()
        assert [type(one) for one in wires.ends] == [Told, Done]
        assert wires.shown == bits(wires.engine.timeline)


def test_a_branch_is_another_timeline_of_perhaps_the_same_version() -> None:
    wires = Wires()
    branches = wires.edits.branches
    branches.make("trial")
    drive(wires, 0.5)
    there = wires.engine.timeline
    branches.change_over("main")
    drive(wires, 0.1)
    wires.tell_changes()
    branches.change_over("trial")
    assert wires.engine.timeline.version == there.version
    id = wires.ask(lambda id: Line(id, "BRANCH trial"))
    wires.carry()
    wires.ends.clear()
    status = PromptStatus(prompt=".", clock=wires.engine.now, end=wires.engine.end)
    wires.say(Done(id, version=there.version, status=status))
    assert not wires.ends
    wires.tell_changes()
    assert len(wires.ends) == 1
    assert wires.far.mirror is not None
    assert wires.far.mirror.timeline == there


def test_what_changes_nothing_has_its_end_at_once() -> None:
    wires = Wires()
    wires.ask(lambda id: At(id, Rest()))
    wires.carry()
    wires.end(wires.came[-1])
    assert isinstance(wires.ends[-1], Done)


def test_a_change_that_never_comes_is_not_waited_for() -> None:
    wires = Wires()
    wires.ask(lambda id: Line(id, "something"))
    wires.carry()
    before = len(wires.ends)
    wires.say(Done(wires.came[-1].id, version=77))  # type: ignore[attr-defined]
    wires.now += CATCHING_UP - 0.01
    wires.far.look()
    assert len(wires.ends) == before
    assert wires.far.due <= wires.now + 0.02
    wires.now += 0.02
    wires.far.look()
    assert len(wires.ends) == before + 1


def refused(end: messages.ServerMessage) -> str:
    assert isinstance(end, Done)
    assert not end.ok
    assert end.refusal is not None
    assert isinstance(end.refusal.error(), RequestRefused)
    return end.refusal.message


def test_what_did_not_come_to_the_robot_was_not_done() -> None:
    wires = Wires(follows=False)
    wires.ask(lambda id: Line(id, "MOVE a"))
    wires.far.connection.frames()  # they are lost
    wires.cut()
    with pytest.raises(RequestRefused, match="there is no connection"):
        wires.ask(lambda id: Line(id, "MOVE b"))
    assert not wires.ends
    wires.connect()
    (end,) = wires.ends
    assert "it was not done" in refused(end)
    wires.carry()
    assert not any(isinstance(message, Line) for message in wires.came), "nothing is repeated"


@pytest.mark.parametrize("answered", [True, False])
def test_what_came_to_the_robot_is_told_to_be_done(answered: bool) -> None:
    wires = Wires(follows=False)
    wires.ask(lambda id: Line(id, "MOVE a"))
    wires.carry()
    (line,) = [message for message in wires.came if isinstance(message, Line)]
    if answered:
        wires.server.send(Done(line.id), wires.now)
    wires.server.frames()  # they are lost
    wires.cut()
    wires.connect()
    if not answered:
        assert not wires.ends, "it is being done"
        wires.say(Done(line.id))
    (end,) = wires.ends
    assert isinstance(end, Done)
    assert end.ok


def test_a_robot_that_does_not_come_back_leaves_nobody_waiting() -> None:
    wires = Wires(follows=False)
    wires.ask(lambda id: Line(id, "MOVE a"))
    wires.carry()
    wires.cut()
    wires.now += COMMAND_TIMEOUT_S - 1.0
    wires.far.look()
    assert not wires.ends
    wires.now = wires.far.due
    wires.far.look()
    (end,) = wires.ends
    assert "nobody knows whether it was done" in refused(end)
    wires.connect()
    assert len(wires.ends) == 1, "one end"


def pinged(wires: Wires, ahead: float, round_trip: float) -> None:
    """The far end knows the server's clock, which is so far ahead of its own [s]."""
    sent = wires.now
    wires.now += round_trip
    there = sent + round_trip / 2.0 + ahead
    wires.server.send(messages.Pong(sent, there, there, 0.0), wires.now)
    wires.answer()


def test_commands_and_answers_are_good_for_a_while_by_the_clock_of_the_server() -> None:
    wires = Wires(follows=False)
    pinged(wires, 5000.0, 0.2)
    until = pytest.approx(wires.now + 5000.0 + 0.2 + HELD_UP)
    wires.ask(lambda id: Line(id, "MOVE a"))
    wires.ask(lambda id: messages.Positions(id, (1.0,)))
    wires.ask(lambda id: messages.Put(id, "p.v2", b""))
    wires.say(messages.Asked(1, LineWanted("? ")))
    wires.far.send(messages.Answer(1, "5"))
    wires.carry()
    assert [getattr(it, "until", None) for it in wires.came[-4:]] == [until, None, None, until]


def test_another_run_of_the_robot_may_be_on_a_machine_with_another_clock() -> None:
    wires = Wires(follows=False)
    pinged(wires, 5000.0, 0.2)
    wires.cut()
    wires.delivery_log = DeliveryLog("another")
    wires.life = "b"
    wires.connect()
    wires.ask(lambda id: Line(id, "MOVE a"))
    wires.carry()
    assert getattr(wires.came[-1], "until", 0.0) is None


def test_a_cut_says_since_when() -> None:
    wires = Wires(follows=False)
    wires.say(Told(Message("heard")))
    wires.now += QUIET - 0.5
    wires.now += 1.0
    wires.say(Told(Message("heard again")))
    assert wires.far.stalls == 1
    wires.now += 1.0
    wires.cut()
    wires.now += 7.5
    assert str(wires.far.no_connection) == (
        "*Request refused* there is no connection (cut 7.5 s ago): this was not sent (give it again when it is back)"
    )
    wires.connect()
    assert wires.far.cuts == 1


def test_the_clock_of_the_robot_is_read_here() -> None:
    """Whatever the clock of the server shows, and however long its words are on the way."""
    wires = Wires()
    wires.now += 10.0
    wires.far.look()  # sends a ping
    (ping,) = wires.far.connection.frames()
    wires.now += 0.2
    (message,) = wires.server.receive(ping, wires.now)
    assert isinstance(message, messages.Ping)
    there = wires.now + 5000.0
    wires.server.send(messages.Pong(message.sent, there, there, 0.0), wires.now)
    wires.server.send(Clock(40.0, 2.0, False, True, there), wires.now)
    told = wires.now
    wires.now += 0.2
    wires.answer()
    assert wires.far.mirror is not None
    for _ in range(3):
        assert wires.far.mirror.now == pytest.approx(40.0 + 2.0 * (wires.now - told))
        wires.now += 1.5
    wires.say(Clock(50.0, 2.0, True, True, there))
    assert wires.far.mirror.now == 50.0


def test_a_lost_mirror_asks_once_for_a_snapshot() -> None:
    wires = Wires()
    drive(wires, 0.1)
    wires.events.take_all()  # nobody is told
    for _ in range(3):
        drive(wires, 0.1)
    for event in wires.events.take_all():
        if not isinstance(event, TimelineReplaced | MissedEvents):
            wires.number += 1  # without a gap
            wires.say(messages.Delta(delta_record(event, Motions()), 0.0))
    wires.carry()
    assert [type(one) for one in wires.came].count(messages.Resync) == 1
    wires.number += 1
    wires.say(messages.Replaced(snapshot_record(Snapshot.of(wires.engine.timeline, wires.engine.settings))))
    assert wires.shown == bits(wires.engine.timeline)


def test_a_part_of_the_past_that_was_overtaken_is_asked_for_again() -> None:
    wires = Wires()
    for turn in (0.1, -0.1, 0.1):
        wires.engine.perform(Move(JointOffsetTarget(1, turn), False))
    wires.tell_changes()
    whole, (first, *_) = Snapshot.of(wires.engine.timeline, wires.engine.settings), wires.engine.timeline
    window = structs.replace(whole, segments=whole.segments[2:], first=2)
    wires.number += 1
    wires.say(messages.Replaced(snapshot_record(window)))
    older = snapshot_record(structs.replace(whole, segments=whole.segments[:3]))
    assert not wires.far.extend(messages.Shown(1, older, wires.number - 1))
    assert wires.far.extend(messages.Shown(2, older, wires.number))
    assert wires.far.mirror is not None
    assert wires.far.mirror.timeline[0] == first


def test_a_robot_that_cannot_be_is_refused() -> None:
    wires = Wires(follows=False)
    wires.far = FarEnd(HELLO, lambda: wires.now)
    wires.model = {"name": "puma561"}
    wires.connect()
    assert isinstance(wires.far.refusal, FileDamaged)


class Afar(Wires):
    """In real time, behind a line that takes 0.1 s forward and 0.1 s back; the robot's clock shows `now`."""

    def __init__(self) -> None:
        super().__init__()
        self.say(Clock(self.now, realtime=True, wall=self.now))
        self.carry()
        for _ in range(8):
            sent = self.now
            self.now += 0.2
            self.say(messages.Pong(sent, sent + 0.1, sent + 0.1, sent + 0.1))

    def drag(self, pose: Transform | None) -> messages.Drag:
        self.far.send(messages.Drag(pose))
        self.carry()
        (*_, sent) = self.came
        assert isinstance(sent, messages.Drag)
        return sent

    def pulled(self, by: str, wish: messages.Drag) -> None:
        self.say(messages.Pulled(DragState(by, issued=wish.issued)))


def test_a_wish_is_unconfirmed_from_its_arrival_on_until_the_robot_goes_after_it() -> None:
    wires = Afar()
    far, begin = wires.far, wires.far.now
    wish = wires.drag(translation(0.1, 0.0, 0.0))
    assert wish.issued == begin
    assert far.preview_now().unconfirmed == pytest.approx(begin + 0.1, abs=1e-3)
    assert list(far.preview_now().lines(inf))[-1].endswith("on: DRAG")
    wires.now += 0.15
    assert far.preview_now().unconfirmed == pytest.approx(begin + 0.1, abs=1e-3)
    wires.pulled("ada", wish)
    assert far.preview_now().unconfirmed == inf, "the arm stands there"
    wires.drag(translation(0.1, 0.0, 0.0))
    assert far.preview_now().unconfirmed == inf, "it is the same wish"


def test_while_somebody_drags_what_moves_is_unconfirmed_from_what_is_heard_on() -> None:
    wires = Afar()
    far, engine = wires.far, wires.engine
    engine.clock.advance(max(engine.now, far.now))
    drive(wires, 0.5)
    wires.tell_changes()
    assert far.preview_now().unconfirmed == inf
    wires.say(messages.Pulled(DragState("bob")))
    assert far.preview_now().unconfirmed == pytest.approx(far.heard_time)
    wires.say(messages.Pulled(DragState(why="bob has gone")))
    assert far.preview_now().unconfirmed == inf


def test_wishes_that_a_cut_has_swallowed_are_in_doubt_no_longer() -> None:
    wires = Afar()
    wires.drag(translation(0.1, 0.0, 0.0))
    wires.cut()
    wires.connect(Clock(wires.now, realtime=True, wall=wires.now))
    assert wires.far.preview_now().unconfirmed == inf


def test_next_to_the_robot_no_wish_is_in_doubt() -> None:
    wires = Wires()
    wires.say(Clock(wires.now, realtime=True, wall=wires.now))
    wires.far.send(messages.Drag(translation(0.1, 0.0, 0.0)))
    assert wires.far.preview_now().unconfirmed == inf
