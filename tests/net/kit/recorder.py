"""Record conversations: the server's end of a connection and its changes are those of a server, the client is ours."""

from __future__ import annotations

import base64
import json
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import msgspec

from tests.net.kit.conversation import Conversation, Message, Step
from tests.net.kit.reference import Reference
from vrs_cli.engine.engine import Engine
from vrs_cli.engine.feed import MissedEvents, TimelineReplaced
from vrs_cli.engine.position import joints_at, position_at
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.model_data import to_dict
from vrs_cli.net.broadcast import Broadcast, Listener
from vrs_cli.net.delivery_log import DeliveryLog
from vrs_cli.net.messages import (
    At,
    Clock,
    Done,
    Embody,
    Hello,
    Line,
    Play,
    Resync,
    ServerMessage,
    Shown,
    Subscribe,
    Welcome,
    Window,
)
from vrs_cli.net.protocol import ServerConnection
from vrs_cli.net.stream import MessageForm, Packet
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.wire.codec import Encoding, Frame
from vrs_cli.wire.messages import Answer, ClientMessage, Command, Numbered

KEY, LIFE = "the key of the kit", "the life of the kit"
LEFT_OUT = ("shapes", "collision")  # of a model: what nobody computes with


class Recorder:
    """Records one conversation with a robot in virtual time. `wall`: the server's clock [s]."""

    def __init__(self, name: str, about: str, needs: Iterable[str], engine: Engine) -> None:
        self.name, self.about, self.needs, self.engine = name, about, tuple(needs), engine
        self.steps: list[Step] = []
        self.wall = 0.0
        self.life, self.log = LIFE, DeliveryLog(KEY)
        self._client = Reference()
        self._server: ServerConnection | None = None
        self._listener: Listener | None = None
        self._names: dict[int, str] = {}
        self._naming = ""  # the name of the id in the next message of the client
        self._lines: list[str] = []  # the names of commands
        self._follow(engine)

    def _follow(self, engine: Engine) -> None:
        self._events = engine.events.subscribe(10**9)
        begin = self._events.take()
        assert isinstance(begin, TimelineReplaced)
        self._broadcast = Broadcast(self, begin, lambda: self.wall)

    def conversation(self) -> Conversation:
        return Conversation(self.name, self.about, self.needs, tuple(self.steps))

    # --- what a broadcast asks of a robot, and of a socket ---

    @property
    def arm(self) -> RobotArm:
        return self.engine.arm

    @property
    def timeline(self) -> Timeline:
        return self.engine.timeline

    @property
    def now(self) -> float:
        return self.engine.now

    waiting = 0

    def send(self, *packets: Packet) -> None:
        for packet in packets:
            self._arrive(packet.data.decode() if packet.text else packet.data)

    # --- the connection ---

    def open(self, **fields: Any) -> None:
        """A socket is there: the client says hello, and the server welcomes it."""
        self.steps.append({"open": fields})
        self._server = ServerConnection(self.wall)
        self._ask({"open": fields})
        hello = self._server.hello
        assert hello is not None
        model = {key: one for key, one in to_dict(self.engine.model).items() if key not in LEFT_OUT}
        clock = Clock(self.engine.now, wall=self.wall)
        welcome = Welcome(1, "", "kit", self.life, "supervisor", "ada", clock, model, server="the kit")
        self._server.welcome(welcome, self.log, self.wall)
        form = MessageForm(text=hello.format is Encoding.JSON, full=hello.full)
        self._listener = self._broadcast.join(self, form)
        self.deliver()

    def cut(self) -> None:
        """The socket is gone."""
        assert self._server is not None
        assert self._listener is not None
        self._broadcast.leave(self._listener)
        self._server.cut(self.wall)
        self._server = self._listener = None
        self.steps.append({"cut": True})
        self._ask({"cut": True})

    def begin_anew(self, engine: Engine) -> None:
        """The server is started again, with a robot that has another life. Nobody is connected."""
        self.engine, self.life, self.log = engine, "another life", DeliveryLog("another key")
        self._follow(engine)

    def do(self, message: Message, name: str = "", *, arrives: bool = True) -> None:
        """The user of the client has it send a message. `name`: of its id; `arrives`: at the server."""
        self.steps.append({"do": message, "as": name} if name else {"do": message})
        self._naming = name
        self._lines += [name] if message["type"] == "line" else []
        self._ask({"do": message}, arrives=arrives)

    def _ask(self, step: Step, *, arrives: bool = True) -> None:
        """Have the client take a step, note what it sends, and give that to the server."""
        for sent in self._client(step)["send"]:
            frame: Frame = base64.b64decode(sent["base64"]) if "base64" in sent else json.dumps(sent)
            if "id" in sent and not self._naming:  # a subscription comes again after a cut, under any id
                self._naming = f"again{len(self.steps)}"
            pattern = self._named(frame)
            if self._naming:
                self._names[pattern["id"]] = self._naming
                pattern["id"], self._naming = f"${self._naming}", ""
            self.steps.append({"sent": {key: one for key, one in pattern.items() if key != "name"}})
            for message in self._server.receive(frame, self.wall) if self._server and arrives else ():
                self._carry_out(message)
        self.deliver()

    def id_of(self, name: str) -> int:
        """Return the id that our client has given to a message."""
        return next(id for id, one in reversed(self._names.items()) if one == name)

    def lose(self, *messages: ServerMessage) -> None:
        """The server sends messages, which never come."""
        assert self._server is not None
        for message in messages:
            self._server.send(message, self.wall)
        self._server.frames()

    def _carry_out(self, message: ClientMessage) -> None:
        listener, broadcast = self._listener, self._broadcast
        match message:
            case Subscribe(id):
                assert listener is not None
                broadcast.subscribe(listener, message)
                self.tell(Done(id, version=self.timeline.version))
            case Resync(full):
                assert listener is not None
                broadcast.resync(listener, full=full)
            case Window(id, begin, end):
                assert listener is not None
                part = broadcast.stream.part(begin, end, listener.form.joints)
                self.tell(Shown(id, part, broadcast.stream.number, part.segments[0].start))
            case Hello() | Line() | At() | Answer() | Play() | Command() | Embody():
                pass  # the script says how it ends
            case _:
                raise AssertionError(message)

    def tell(self, message: ServerMessage) -> None:
        """The server sends a message to the client, now or when it resumes."""
        if isinstance(message, Numbered):
            self.log.tell(message, self.wall)
        elif self._server is not None:
            self._server.send(message, self.wall)
        self.deliver()

    def deliver(self) -> None:
        """All that the server has said comes to the client."""
        for frame in self._server.frames() if self._server else ():
            self._arrive(frame)

    def raw(self, message: Message) -> None:
        """A message of a later version comes."""
        self._arrive(json.dumps(message))

    def _arrive(self, frame: Frame) -> None:
        step: Step = {"received": self._named(frame)}
        if isinstance(frame, bytes):
            step["binary"] = True
        self.steps.append(step)
        coded = {"base64": base64.b64encode(frame).decode()} if isinstance(frame, bytes) else json.loads(frame)
        self._ask({"received": coded})

    def _named(self, frame: Frame) -> Message:
        """A frame as an object, with names in place of the numbers that the client has chosen."""
        message = json.loads(frame) if isinstance(frame, str) else msgspec.msgpack.decode(frame)
        if message.get("id") in self._names:
            message["id"] = f"${self._names[message['id']]}"
        for fate in message.get("fates", ()):
            fate["id"] = f"${self._names[fate['id']]}"
        if ids := message.get("resume", {}).get("unanswered"):
            message["resume"]["unanswered"] = [f"${self._names[id]}" for id in ids]
        return message

    # --- the robot ---

    def tell_changes(self, lose: int = 0) -> None:
        """All that has happened to the robot comes to the client, but for the first `lose` changes."""
        for event in self._events.take_all():
            assert not isinstance(event, MissedEvents)
            listener = self._listener
            if lose and listener is not None:
                lose -= 1
                self._listener, kept = None, listener.sink
                listener.sink = _Nowhere()
                self._tell(event)
                listener.sink, self._listener = kept, listener
            else:
                self._tell(event)

    def _tell(self, event: Any) -> None:
        self._broadcast.tell(event, self.now)
        while self._broadcast.peek() <= self.wall:
            self._broadcast.step()

    # --- what the client has to know ---

    def joints(self, times: Sequence[float], within: float) -> None:
        rows = [list(joints_at(self.arm, self.timeline, t)) for t in times]
        self.steps.append({"joints": {"times": list(times), "joints": rows, "within": within}})

    def tools(self, times: Sequence[float], within: float) -> None:
        rows = [list(position_at(self.arm, self.timeline, t).T_world_tool) for t in times]
        self.steps.append({"tools": {"times": list(times), "tools": rows, "within": within}})

    def values(self, channel: int, times: Sequence[float]) -> None:
        values = [self.timeline.value_at(channel, t) for t in times]
        self.steps.append({"values": {"channel": channel, "times": list(times), "values": values, "within": 0.0}})

    def ends(self, ends: Mapping[str, str]) -> None:
        """How the lines of the user have ended; those that are not named have not."""
        self.steps.append({"ends": {name: ends.get(name) for name in self._lines}})

    def asked(self, *numbers: int) -> None:
        self.steps.append({"asked": list(numbers)})

    def clock(self, clock: Clock, walls: Sequence[float], now: Sequence[float]) -> None:
        """The clock comes, and shows `now` at these times of the server's clock [s]."""
        self._broadcast.announce(clock)
        while self._broadcast.peek() <= self.wall:
            self._broadcast.step()
        self.steps.append({"now": {"walls": list(walls), "now": list(now), "within": 1e-9}})


class _Nowhere:
    """A socket that takes all, and nothing arrives."""

    waiting = 0

    def send(self, *packets: Packet) -> None:
        pass
