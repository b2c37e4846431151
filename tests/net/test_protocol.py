"""Two ends and a line between them that loses what is on its way: every command is done once at most, and what is told
is heard once, in order.
"""

from __future__ import annotations

import random
from typing import Any

import msgspec
import pytest

from tests.files.trajectories import planned
from vrs_cli.engine.feed import Snapshot
from vrs_cli.engine.settings import Settings
from vrs_cli.errors import RequestRefused
from vrs_cli.net.delivery_log import Bounds, DeliveryLog
from vrs_cli.net.messages import (
    Abort,
    Answer,
    Asked,
    Bye,
    ClientMessage,
    Clock,
    Closing,
    Command,
    Delta,
    Done,
    Fate,
    Hello,
    Line,
    Located,
    Outcome,
    Positions,
    Refused,
    Replaced,
    Resync,
    Sample,
    ServerMessage,
    Status,
    Subscribe,
    Told,
    Typed,
    Welcome,
    Withdrawn,
)
from vrs_cli.net.protocol import BACKLOG, HELLO_BYTES, MAX_PENDING, ClientConnection, ServerConnection
from vrs_cli.values.questions import LineWanted
from vrs_cli.values.questions import PromptStatus as Around
from vrs_cli.values.results import Message
from vrs_cli.wire.codec import Encoding, Frame, encode
from vrs_cli.wire.messages import SnapshotRecord
from vrs_cli.wire.records import Motions, delta_record, segment_records

HELLO = Hello((1,), format=Encoding.MSGPACK)


def welcome(life: str = "a") -> Welcome:
    return Welcome(0, "", "cell1", life, "supervisor", "ada", Clock(0.0), {"name": "puma560"})


class Pair:
    """A client, and the server that it talks to; `now` is the time of the day."""

    def __init__(self, hello: Hello = HELLO, bounds: Bounds | None = None) -> None:
        self.now = 0.0
        self.delivery_log = DeliveryLog("key", bounds or Bounds())
        self.client = ClientConnection(hello)
        self.connect()

    def connect(
        self, delivery_log: DeliveryLog | None = None, life: str = "a", backlog: int = BACKLOG
    ) -> list[ServerMessage]:
        self.delivery_log = delivery_log or self.delivery_log
        self.server = ServerConnection(self.now, backlog=backlog)
        self.client.begin()
        (hello,) = self.to_server()
        assert isinstance(hello, Hello)
        self.server.welcome(welcome(life), self.delivery_log, self.now)
        return self.to_client()

    def cut(self) -> None:
        self.server.cut(self.now)
        self.client.cut()

    def to_server(self) -> list[ClientMessage]:
        return [message for frame in self.client.frames() for message in self.server.receive(frame, self.now)]

    def to_client(self) -> list[ServerMessage]:
        return [message for frame in self.server.frames() for message in self.client.receive(frame)]

    def line(self, text: str) -> Line:
        line = Line(self.client.next_id(), text)
        self.client.send(line)
        return line

    def tell(self, *messages: ServerMessage) -> None:
        for message in messages:
            self.server.send(message, self.now)


# --- the beginning --------------------------------------------------------------------------------------------------


def test_hello_and_welcome() -> None:
    client, server = ClientConnection(HELLO), ServerConnection(0.0)
    client.begin()
    (frame,) = client.frames()
    assert frame == '{"type":"hello","versions":[1],"format":"msgpack"}'  # a client's first word is always JSON
    assert server.receive(frame, 0.0) == [HELLO]
    server.welcome(welcome(), DeliveryLog("key"), 0.0)
    (answer,) = server.frames()
    assert isinstance(answer, bytes)
    (greeting,) = client.receive(answer)
    assert isinstance(greeting, Welcome)
    assert (greeting.version, greeting.connection, greeting.resumed) == (1, "key", False)


def refused(frame: Frame) -> Closing:
    """What a server says to a first frame that is none."""
    server = ServerConnection(0.0)
    assert server.receive(frame, 0.0) == []
    assert server.closing
    (said,) = server.frames()
    assert isinstance(said, str)
    return msgspec.json.decode(said, type=Closing)


@pytest.mark.parametrize(
    ("frame", "why"),
    [
        ('{"type":"hello","versions":[2,3],"smell":"roses"}', "the client speaks version 2, 3, this server 1"),
        ('{"type":"hello","versions":[]}', "the client speaks version none, this server 1"),
        ('{"type":"abort","id":1}', "hello comes first"),
        (msgspec.msgpack.encode(HELLO), "hello comes first, as JSON"),
        ('{"type":"hologram"}', "a message of the unknown type 'hologram'"),
        ("GET / HTTP/1.1", "no message"),
        ('{"type":"hello","versions":[1],"token":"' + "x" * HELLO_BYTES + '"}', "a message of 320"),
    ],
)
def test_who_says_no_hello_is_told_why_and_not_heard(frame: Frame, why: str) -> None:
    closing = refused(frame)
    assert why in closing.why
    assert closing.refusal is not None


def test_a_hello_of_a_later_client_that_speaks_this_version_too_is_taken() -> None:
    server = ServerConnection(0.0)
    (hello,) = server.receive('{"type":"hello","versions":[2,1],"smell":"roses"}', 0.0)
    assert hello == Hello((2, 1))


def test_nothing_is_heard_between_hello_and_welcome_and_no_second_hello() -> None:
    server = ServerConnection(0.0)
    hello = encode(HELLO, Encoding.JSON)
    server.receive(hello, 0.0)
    assert server.receive('{"type":"abort","id":1}', 0.0) == []
    assert server.closing
    pair = Pair()
    assert pair.server.receive(hello, 0.0) == []
    assert pair.server.closing


def test_a_client_that_says_nothing_is_not_waited_for() -> None:
    server = ServerConnection(100.0)
    server.look(110.0)
    assert not server.closing
    server.look(110.1)
    assert server.closing
    assert "no hello" in server.why
    pair = Pair()
    pair.server.look(1e9)
    assert not pair.server.closing


# --- lines ----------------------------------------------------------------------------------------------------------


def test_a_repeated_command_is_done_once_and_answered_from_memory() -> None:
    pair = Pair()
    line = pair.line("MOVE a")
    (frame,) = pair.client.frames()
    assert pair.server.receive(frame, 0.0) == [line]
    assert pair.server.receive(frame, 0.0) == []  # it is under way
    assert pair.to_client() == []
    pair.tell(Done(line.id, version=3, status=Around(prompt="*")))
    assert [one.id for one in pair.to_client() if isinstance(one, Done)] == [line.id]
    assert pair.server.receive(frame, 0.0) == []
    assert pair.to_client() == [Done(line.id, version=3, seq=2)]


def test_ends_are_remembered_within_bounds() -> None:
    pair = Pair(bounds=Bounds(ended=2, waiting=2))
    frames = []
    for _ in range(3):
        line = pair.line("MOVE a")
        frames += pair.client.frames()
        assert pair.server.receive(frames[-1], 0.0) == [line]
        pair.tell(Done(line.id))
    pair.to_client()
    assert pair.server.receive(frames[0], 0.0) == []
    (said,) = pair.to_client()
    assert isinstance(said, Refused)
    assert (said.id, said.refusal.detail) == (1, "command 1 was there before; its end is forgotten")
    for _ in range(3):
        pair.line("MOVE b")
    assert len(pair.to_server()) == 2
    (said,) = pair.to_client()
    assert isinstance(said, Refused)
    assert said.refusal.detail == "2 commands wait already"


def test_abort_never_waits_for_room() -> None:
    pair = Pair(bounds=Bounds(waiting=2))
    for _ in range(MAX_PENDING):
        pair.line("MOVE a")
    with pytest.raises(RequestRefused, match="1000 requests wait already"):
        pair.line("MOVE a")
    stop = Abort(pair.client.next_id())
    pair.client.send(stop)
    assert [type(message) for message in pair.to_server()] == [Line, Line, Abort]


def test_more_than_a_server_takes_is_not_sent() -> None:
    """It would cut the connection, each time that it is given again."""
    pair = Pair()
    with pytest.raises(RequestRefused, match=r"bytes at once, 2000000 at most .*in parts"):
        pair.line("x" * 2_000_000)
    assert pair.to_server() == []
    line = pair.line("TYPE 1")
    assert pair.to_server() == [line]


def test_what_a_later_client_sends_is_refused_and_the_connection_stays() -> None:
    pair = Pair()
    for frame in ('{"type":"hologram","id":7}', '{"type":"line","id":7,"text":"MOVE a","colour":"red"}'):
        assert pair.server.receive(frame, 0.0) == []
        (said,) = pair.to_client()
        assert isinstance(said, Refused)
        assert said.id == 7
    assert pair.server.receive('{"type":"line","id":-7}', 0.0) == []
    assert [one.id for one in pair.to_client() if isinstance(one, Refused)] == [None]
    assert not pair.server.closing


@pytest.mark.parametrize("frame", ["x", b"\xc1", "[" * 100_000, '{"type":5}', b"\x91" * 100_000, "x" * 2_000_001])
def test_garbage_closes_a_connection_with_the_reason(frame: Frame) -> None:
    pair = Pair()
    assert pair.server.receive(frame, 0.0) == []
    assert pair.server.closing
    assert any(isinstance(one, Closing) for one in pair.to_client())
    assert pair.client.closing
    assert pair.server.receive('{"type":"abort","id":1}', 0.0) == []


def test_bye_is_the_last_word() -> None:
    pair = Pair()
    pair.client.send(Bye())
    pair.client.send(Bye())
    assert pair.to_server() == [Bye()]
    assert pair.server.closing


# --- cuts -----------------------------------------------------------------------------------------------------------


def test_what_was_told_meanwhile_is_heard_once() -> None:
    pair = Pair()
    pair.tell(Told(Message("1")), Told(Message("2")))
    first, _lost = pair.server.frames()
    pair.client.receive(first)
    pair.cut()
    pair.tell(Told(Message("3")))
    welcomed, *told = pair.connect()
    assert isinstance(welcomed, Welcome)
    assert welcomed.resumed
    assert told == [Told(Message("2"), seq=2), Told(Message("3"), seq=3)]
    pair.tell(Told(Message("4")))
    assert pair.to_client() == [Told(Message("4"), seq=4)]


@pytest.mark.parametrize("bounds", [Bounds(message_bytes=60), Bounds(seconds=5.0)])
def test_too_much_or_too_old_is_told_to_be_missing(bounds: Bounds) -> None:
    pair = Pair(bounds=bounds)
    line = pair.line("MOVE a")
    pair.to_server()
    pair.tell(Asked(9, LineWanted("? ")), Told(Message("lost")))
    pair.now = 6.0
    pair.tell(Done(line.id, version=2))
    pair.server.frames()
    pair.cut()
    welcomed, *rest = pair.connect()
    assert isinstance(welcomed, Welcome)
    assert not welcomed.resumed
    assert welcomed.fates == (Fate(line.id, Outcome.DONE),)
    assert rest == [Done(line.id, version=2, seq=4), Asked(9, LineWanted("? "), seq=5)]


def test_a_command_that_never_came_ends_with_a_refusal_and_is_not_repeated() -> None:
    pair = Pair()
    came, lost, other = pair.line("MOVE a"), pair.line("MOVE b"), pair.line("MOVE c")
    frame, *_ = pair.client.frames()
    assert pair.server.receive(frame, 0.0) == [came]
    pair.cut()
    with pytest.raises(RequestRefused, match="there is no connection"):
        pair.line("MOVE d")
    pair.client.next_id()
    welcomed, *ends = pair.connect()
    assert isinstance(welcomed, Welcome)
    assert [fate.outcome for fate in welcomed.fates] == [Outcome.TAKEN, Outcome.UNSEEN, Outcome.UNSEEN]
    assert pair.to_server() == []
    assert [(end.id, end.ok) for end in ends if isinstance(end, Done)] == [(lost.id, False), (other.id, False)]
    after = pair.line("MOVE e")
    assert pair.to_server() == [after]


def test_nobody_knows_what_became_of_a_command_when_the_server_begins_anew() -> None:
    pair = Pair()
    line = pair.line("MOVE a")
    pair.to_server()
    pair.cut()
    welcomed, done = pair.connect(DeliveryLog("another"), life="b")
    assert isinstance(welcomed, Welcome)
    assert welcomed.fates == (Fate(line.id, Outcome.FORGOTTEN),)
    assert isinstance(done, Done)
    assert (done.id, done.ok) == (line.id, False)
    assert done.refusal is not None
    assert done.refusal.detail == "nobody knows whether it was done"
    assert done.refusal.hint.startswith("look before you give it again")


def test_a_question_is_asked_until_its_answer_has_come() -> None:
    pair = Pair()
    question = LineWanted("? ")
    pair.tell(Asked(1, question))
    assert pair.to_client() == [Asked(1, question, seq=1)]
    pair.cut()
    assert len(pair.connect()) == 1  # it is still being asked
    pair.client.send(Answer(1, "left"))
    pair.client.frames()
    pair.cut()
    assert pair.connect()[1:] == [Asked(1, question, seq=3)]  # the answer was lost
    pair.client.send(Answer(1, "right"))
    pair.client.send(Answer(1, "right"))
    assert pair.to_server() == [Answer(1, "right")]
    assert pair.to_client() == [Withdrawn(1, seq=4)]
    pair.cut()
    assert len(pair.connect()) == 1


def test_the_question_of_another_run_of_the_robot_is_a_new_one() -> None:
    pair = Pair()
    pair.tell(Asked(1, LineWanted("first? ")))
    pair.to_client()
    pair.cut()
    pair.connect(DeliveryLog("other", Bounds()), life="b")
    pair.tell(Asked(1, LineWanted("second? ")))
    assert pair.to_client() == [Asked(1, LineWanted("second? "), seq=1)]


def test_a_question_is_asked_again_where_its_answer_was_held_up_or_not_sent() -> None:
    pair = Pair()
    question = LineWanted("? ")
    pair.tell(Asked(1, question))
    pair.to_client()
    pair.client.send(Answer(1, "late", until=-0.1))
    assert pair.to_server() == []
    assert pair.to_client() == [Asked(1, question, seq=2)]
    pair.cut()
    with pytest.raises(RequestRefused):
        pair.client.send(Answer(1, "while there is no connection"))
    assert pair.connect()[1:] == [Asked(1, question, seq=3)]
    pair.client.send(Answer(1, "in time", until=0.0))
    assert pair.to_server() == [Answer(1, "in time", until=0.0)]


def test_what_changes_nothing_is_asked_again() -> None:
    pair = Pair()
    wanted = Positions(pair.client.next_id(), (1.0,))
    pair.client.send(wanted)
    pair.to_server()
    pair.cut()
    pair.connect()
    assert pair.to_server() == [wanted]
    pair.tell(Located(wanted.id, 1, ()))
    assert pair.to_client() == [Located(wanted.id, 1, ())]
    pair.cut()
    pair.connect()
    assert pair.to_server() == []


def test_a_connection_that_is_resumed_elsewhere_is_over() -> None:
    pair = Pair()
    pair.line("MOVE a")
    (late,) = pair.client.frames()
    old = pair.server
    pair.client.cut()  # the server has not noticed
    _, end = pair.connect()
    assert isinstance(end, Done)
    assert not end.ok
    assert old.receive(late, 0.0) == []  # the client was told that it never came
    assert old.closing
    pair.tell(Told(Message("here")))
    assert pair.to_client() == [Told(Message("here"), seq=1)]
    assert len(old.frames()) == 1  # that it is closed
    old.cut(0.0)
    assert not pair.delivery_log.is_expired(1e9)
    pair.cut()
    assert not pair.delivery_log.is_expired(60.0)
    assert pair.delivery_log.is_expired(60.1)


def test_random_cuts_lose_and_double_nothing() -> None:
    for seed in range(30):
        rng = random.Random(seed)
        pair = Pair(HELLO if seed % 2 else Hello((1,)))
        done: list[int] = []
        told, heard = 0, []
        for _ in range(300):
            match rng.randrange(6):
                case 0:
                    pair.line("MOVE a")
                case 1:
                    done += [one.id for one in pair.to_server() if isinstance(one, Command)]
                case 2:
                    told += 1
                    pair.tell(Told(Message(str(told))))
                case 3 if done:
                    pair.tell(Done(rng.choice(done)))
                case 4:
                    heard += pair.to_client()
                case 5 if rng.random() < 0.2:
                    lost = rng.randrange(3)  # frames that arrive before the cut
                    for frame in pair.client.frames()[:lost]:
                        done += [one.id for one in pair.server.receive(frame, 0.0) if isinstance(one, Command)]
                    for frame in pair.server.frames()[:lost]:
                        heard += pair.client.receive(frame)
                    pair.cut()
                    pair.tell(Told(Message(str(told := told + 1))))
                    heard += pair.connect()
        heard += pair.to_client()
        assert [one.reply for one in heard if isinstance(one, Told)] == [Message(str(n)) for n in range(1, told + 1)]
        assert len(set(done)) == len(done)


# --- a slow client --------------------------------------------------------------------------------------------------


def test_the_newest_sample_wins_and_all_else_is_kept() -> None:
    pair = Pair()
    for number in range(1000):
        pair.tell(Sample(float(number), (0.0,)))
    pair.tell(Told(Message("1")), Status(Around()), Clock(1.0), Clock(2.0))
    assert pair.to_client() == [Sample(999.0, (0.0,)), Told(Message("1"), seq=1), Status(Around()), Clock(2.0)]


def test_who_takes_nothing_is_cut_off_with_bounded_memory() -> None:
    pair = Pair(bounds=Bounds(message_bytes=100_000))
    pair.connect(backlog=100_000)
    for _ in range(300):
        pair.tell(Told(Message("x" * 1000)))
    assert pair.server.closing
    assert pair.server.frames() == []
    pair.cut()
    welcomed, *rest = pair.connect()
    assert isinstance(welcomed, Welcome)
    assert not welcomed.resumed
    assert rest == []


def test_all_that_is_remembered_gets_through_after_a_cut() -> None:
    pair = Pair()
    pair.cut()
    for _ in range(300):
        pair.delivery_log.tell(Told(Message("x" * 1000)), 0.0)
    assert len(pair.connect(backlog=100_000)) == 301
    assert not pair.server.closing


def test_a_long_reply_gets_through_and_many_do_not() -> None:
    pair = Pair()
    pair.connect(backlog=1000)
    pair.tell(Told(Message("x" * 5000)), Done(1))
    assert len(pair.to_client()) == 2
    pair.tell(*[Told(Message("x" * 5000))] * 3)
    assert pair.server.closing


# --- changes --------------------------------------------------------------------------------------------------------


def changes() -> list[Any]:
    """A snapshot, and the deltas after it, numbered."""
    timeline, deltas = planned(5, seed=3)
    snapshot = Snapshot.of(timeline, Settings())
    segments = segment_records(snapshot.segments, Motions(), None)
    replaced = Replaced(SnapshotRecord(snapshot.version, segments, snapshot.settings), number=7)
    told = [replaced, *(Delta(delta_record(one, Motions()), 0.0, number=8 + n) for n, one in enumerate(deltas))]
    return [msgspec.convert(msgspec.to_builtins(one), type(one)) for one in told]  # with lists, as decoding makes them


def followed() -> tuple[Pair, list[Any]]:
    pair, sent = Pair(), changes()
    pair.client.send(Subscribe(pair.client.next_id(), deltas=True))
    assert len(pair.to_server()) == 1
    pair.tell(*sent[:3])
    assert pair.to_client() == sent[:3]
    return pair, sent


def test_changes_go_on_after_a_cut_where_they_ended() -> None:
    pair, sent = followed()
    pair.cut()
    pair.connect()
    (again,) = pair.to_server()
    assert again == Subscribe(1, deltas=True, after=9)
    pair.tell(*sent[1:5])
    assert pair.to_client() == sent[3:5]  # those that were there are not heard again


def test_another_life_of_the_robot_begins_with_a_snapshot() -> None:
    pair, sent = followed()
    pair.cut()
    pair.connect(DeliveryLog("another"), life="b")
    assert pair.to_server() == [Subscribe(1, deltas=True)]
    pair.tell(sent[3], sent[0])
    assert pair.to_client() == [sent[0]]


def test_a_gap_is_noticed_and_made_good() -> None:
    pair, sent = followed()
    pair.tell(sent[4])
    assert pair.to_client() == []
    assert pair.to_server() == [Resync()]
    pair.tell(sent[5], sent[0], sent[1])
    assert pair.to_client() == sent[:2]


# --- a server that is none ------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "frame", ['{"type":"told"}', "x", '{"type":"told","reply":{"kind":"Farewell"},"seq":9}', '{"type":"welcome"}', b"x"]
)
def test_a_client_closes_when_what_it_hears_is_nothing(frame: Frame) -> None:
    pair = Pair()
    (closing,) = pair.client.receive(frame)
    assert isinstance(closing, Closing)
    assert pair.client.closing
    assert pair.client.receive(frame) == []


def test_a_client_passes_over_what_a_later_server_adds() -> None:
    pair = Pair()
    assert pair.client.receive('{"type":"hologram","colour":"red"}') == []
    line = pair.line("MOVE a")
    for seq, said in enumerate(
        ('"hologram"', '"told","reply":{"kind":"Smell"}', f'"done","id":{line.id},"found":{{"kind":"Smell"}}'), 1
    ):
        (message,) = pair.client.receive(f'{{"type":{said},"seq":{seq}}}')
        assert isinstance(message, Refused)
        assert message.id == (line.id if seq == 3 else None)  # it has ended, one way or another
    assert pair.client.receive('{"type":"told","reply":{"kind":"Smell"},"seq":3}') == []
    assert pair.client.receive('{"type":"typed","text":"a","seq":4}') == [Typed("a", seq=4)]
    assert not pair.client.closing


def test_commands_without_an_answer_are_bounded() -> None:
    pair = Pair()
    for _ in range(MAX_PENDING):
        pair.line("MOVE a")
    with pytest.raises(RequestRefused, match="wait already"):
        pair.line("MOVE b")
    pair.cut()
    assert len(pair.connect()) == 1 + MAX_PENDING
    pair.line("MOVE b")
    assert len(pair.to_server()) == 1
