"""A line that is cut a hundred times, in the middle of what it carries: who holds the robot at its end has the same
timeline to the bit, has heard everything once, and every command was done once at most.
"""

from __future__ import annotations

import random

import pytest

from tests.examples import some
from tests.net.edits import Edits
from tests.net.test_broadcast import RoomServices
from tests.net.test_mirror import bits
from vrs_cli.engine.feed import TimelineReplaced as Other
from vrs_cli.kinematics.model_data import to_dict
from vrs_cli.net.broadcast import Listener
from vrs_cli.net.delivery_log import DeliveryLog
from vrs_cli.net.far_end import FarEnd
from vrs_cli.net.messages import (
    Clock,
    Command,
    Done,
    Hello,
    Line,
    Replaced,
    Resync,
    ServerMessage,
    Subscribe,
    Told,
    Welcome,
)
from vrs_cli.net.protocol import ConnectionState, ServerConnection
from vrs_cli.net.stream import MessageForm, Packet
from vrs_cli.values.results import Message
from vrs_cli.wire.codec import Encoding, Frame


class Wire:
    """A robot, a holder of it afar, and what is on its way between them. Private frames and changes share the line."""

    def __init__(self, seed: int, encoding: Encoding) -> None:
        self.random, self.services, self.time = random.Random(seed), RoomServices(), 0.0
        self.edits = Edits(seed, self.services.engine)
        self.events = self.services.engine.events.subscribe(10**9)
        self.far = FarEnd(Hello((1,), format=encoding), lambda: self.time)
        self.far.news.append(self.heard)
        self.delivery_log = DeliveryLog("key")
        self.told: list[str] = []
        self.begun: list[int] = []
        self.ended: list[Done] = []
        self.snapshots = 0
        self.server: ServerConnection | None = None
        self.listener: Listener | None = None
        self.on_its_way: list[Frame] = []

    # --- the sink of the broadcast ---

    waiting = 0

    def send(self, *packets: Packet) -> None:
        self.on_its_way += [packet.data.decode() if packet.text else packet.data for packet in packets]

    # --- who hears ---

    def heard(self, message: ServerMessage) -> None:
        if isinstance(message, Told):
            assert isinstance(message.reply, Message)
            self.told.append(message.reply.text)
        self.snapshots += isinstance(message, Replaced)

    def ends(self, message: ServerMessage) -> None:
        if isinstance(message, Done):
            self.ended.append(message)

    # --- the line ---

    def connect(self) -> None:
        self.server = ServerConnection(self.time)
        self.far.connection.begin()
        self.to_server()
        self.to_client()

    def cut(self) -> None:
        """What is on its way arrives in part."""
        self.to_client(self.random.randint(0, 3))
        self.on_its_way.clear()
        assert self.server is not None
        self.server.cut(self.time)
        self.far.cut()
        if self.listener is not None:
            self.services.broadcast.leave(self.listener)
            self.listener = None

    def to_server(self) -> None:
        assert self.server is not None
        for frame in self.far.connection.frames():
            for message in self.server.receive(frame, self.time):
                self.take(message, self.server)

    def take(self, message: object, server: ServerConnection) -> None:
        form = MessageForm(self.far.connection.hello.format is Encoding.JSON)
        match message:
            case Hello():
                model = to_dict(self.services.arm.model)
                server.welcome(Welcome(0, "", "cell1", "a", "", "", Clock(0.0), model), self.delivery_log, self.time)
                self.listener = self.services.broadcast.join(self, form)
            case Subscribe() | Resync() if self.listener is not None:
                self.on_its_way += server.frames()
                if isinstance(message, Resync):
                    self.services.broadcast.resync(self.listener, full=message.full)
                else:
                    self.services.broadcast.subscribe(self.listener, message)
            case Command(id):
                self.begun.append(id)

    def to_client(self, most: int = 10**9) -> None:
        assert self.server is not None
        self.on_its_way += self.server.frames()
        now, self.on_its_way = self.on_its_way[:most], self.on_its_way[most:]
        for frame in now:
            self.far.receive(frame)

    @property
    def open(self) -> bool:
        return self.far.connection.state is ConnectionState.OPEN


@pytest.mark.parametrize("encoding", Encoding)
def test_a_hundred_cuts(encoding: Encoding) -> None:
    wire = Wire(5, encoding)
    wire.connect()
    wire.far.ask(lambda id: Subscribe(id, deltas=True), wire.ends)
    told = asked = cuts = 0
    while cuts < some(100):
        for _ in range(wire.random.randint(1, 12)):
            wire.edits.edit()
            wire.services.tell()
            told += 1
            wire.delivery_log.tell(Told(Message(str(told))), wire.time)
            wire.far.ask(lambda id: Line(id, "READY"), wire.ends)
            asked += 1
            if wire.random.random() < 0.6:
                wire.to_server()
            for id in [id for id in wire.begun if wire.random.random() < 0.5]:
                wire.delivery_log.tell(Done(id), wire.time)
            if wire.random.random() < 0.6:
                wire.to_client()
        wire.cut()
        cuts += 1
        wire.edits.edit()
        wire.services.tell()
        wire.connect()
    for _ in range(3):
        wire.to_server()
        for id in wire.begun:
            wire.delivery_log.tell(Done(id), wire.time)
        wire.to_client()
    assert wire.far.mirror is not None
    assert bits(wire.far.mirror.timeline) == bits(wire.services.timeline)
    assert wire.told == [str(number) for number in range(1, told + 1)]
    assert len(set(wire.begun)) == len(wire.begun)
    ended = [done.id for done in wire.ended]
    assert len(set(ended)) == len(ended)
    assert {done.id for done in wire.ended if done.ok} - {1} <= set(wire.begun)
    assert wire.snapshots <= sum(isinstance(event, Other) for event in wire.events.take_all())  # and none for a cut
    assert wire.begun
    assert len(wire.begun) < asked  # some lines were cut off, and not done
