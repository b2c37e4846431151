"""Anything at both ends of a connection: `python -m tests.net.fuzz 1000000 [SEED]` tells what came of so many inputs.

Inputs are messages of both sides as they are, cut short, damaged, put together from two, with values that do not
belong there, with numbers of the past and of the future; giants, deep nests, and bytes that are nothing at all. They
come before the hello, after it, after the end, and over connections that are cut and resumed. No exception may come of
them but RecordError where a record is read, and the memory that they hold on to is bounded.
"""

from __future__ import annotations

import gc
import random
import sys
from collections import Counter
from collections.abc import Callable
from functools import cache
from time import process_time
from types import FunctionType, ModuleType
from typing import Any, get_args

import msgspec
from hypothesis import HealthCheck, given, settings

from tests.by_hand import command
from tests.files.trajectories import form, planned, puma
from tests.sample_values import values
from vrs_cli.engine.feed import Snapshot
from vrs_cli.engine.settings import Settings
from vrs_cli.errors import RequestRefused
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.net.delivery_log import Bounds, DeliveryLog
from vrs_cli.net.messages import (
    Answer,
    Asked,
    Change,
    Clock,
    Command,
    Delta,
    Done,
    FromClient,
    FromServer,
    Hello,
    Line,
    Numbered,
    Positions,
    Replaced,
    Resume,
    Steered,
    Subscribe,
    Told,
    Welcome,
)
from vrs_cli.net.mirror import Mirror
from vrs_cli.net.protocol import ClientConnection, ConnectionState, ServerConnection
from vrs_cli.wire.codec import Encoding, Frame, encode
from vrs_cli.wire.messages import snapshot_of, snapshot_record
from vrs_cli.wire.records import Motions, RecordError, delta_of, delta_record

BOUNDS = Bounds(seconds=60.0, message_bytes=50_000, ended=50, waiting=50)
BACKLOG = 50_000  # bytes
MOST_HELD = 5_000_000  # bytes that both ends may hold on to, with all that Python adds
MOST = 20_000  # bytes of one message
ODD: tuple[Any, ...] = (
    *(
        None,
        True,
        False,
        0,
        -1,
        1,
        2**31,
        2**53,
        2**63,
        2**64 - 1,
        -(2**63),
        10**15,
        0.0,
        -0.0,
        1e-300,
        1e308,
        0.1,
        1.5,
    ),
    *("", "x" * 300, "\x00", "ä\u2028😀", "hello", "json", "commanded", [], [[]], {}, {"kind": "Message"}, [0.0] * 100),
)


@cache
def corpus(reader: Any) -> tuple[list[Any], list[Frame]]:
    """Messages of one side, and the same as frames of both forms."""
    found: list[Any] = []
    for kind in get_args(reader):

        @settings(
            max_examples=12, deadline=None, database=None, derandomize=True, suppress_health_check=list(HealthCheck)
        )
        @given(values(kind))
        def collect(message: Any) -> None:
            found.append(message)

        collect()
    if reader is FromServer:
        timeline, deltas = planned(8)
        found.append(Replaced(snapshot_record(Snapshot.of(timeline, Settings())), number=1))
        found += [Delta(delta_record(delta, Motions()), 0.0, number=n) for n, delta in enumerate(deltas, 2)]
    return found, [encode(message, encoding) for message in found for encoding in Encoding]


class Source:
    """Frames from a seed."""

    def __init__(self, side: Any, source: random.Random) -> None:
        self.random = source
        self.messages, self.frames = corpus(side)
        self.last: list[Frame] = []

    def frame(self) -> Frame:
        made = self.random.choices(
            (self.right, self.again, self.damaged, self.join_parts, self.odd, self.nest, self.giant, self.noise),
            (30, 10, 25, 5, 25, 1, 0.1, 5),
        )[0]()
        self.last = [*self.last[-20:], made]
        return made

    def right(self) -> Frame:
        """A message as it is, some of the time with other numbers."""
        if self.random.random() < 0.5:
            return self.random.choice(self.frames)
        message = self.random.choice(self.messages)
        names = {"id", "seq", "number", "question"} & set(message.__struct_fields__)
        told = {name: self.random.randint(0, 60) for name in names}
        return encode(msgspec.structs.replace(message, **told), self.random.choice(list(Encoding)))

    def again(self) -> Frame:
        return self.random.choice(self.last or self.frames)

    def damaged(self) -> Frame:
        frame, source = self.random.choice(self.frames), self.random
        data = bytearray(frame.encode() if isinstance(frame, str) else frame)
        for _ in range(source.randint(1, 3)):
            at = source.randrange(len(data) + 1)
            data[at : at + source.choice((0, 0, 1, 2, len(data)))] = source.randbytes(source.randint(0, 2))
        return data.decode(errors="surrogateescape") if isinstance(frame, str) else bytes(data)

    def join_parts(self) -> Frame:
        """The beginning of one, and the end of another."""
        one, other = self.random.choice(self.frames), self.random.choice(self.frames)
        at = self.random.randrange(len(one))
        if isinstance(one, str):
            return one[:at] + (other if isinstance(other, str) else repr(other))[at:]
        return one[:at] + (other if isinstance(other, bytes) else other.encode())[at:]

    def odd(self) -> Frame:
        """With a value that does not belong there."""
        frame = self.random.choice(self.frames)
        decode: Callable[[Any], Any] = msgspec.json.decode if isinstance(frame, str) else msgspec.msgpack.decode
        tree = self._odd(decode(frame))
        return msgspec.json.encode(tree).decode() if isinstance(frame, str) else msgspec.msgpack.encode(tree)

    def _odd(self, tree: Any) -> Any:
        keys = list(tree) if isinstance(tree, dict) else range(len(tree)) if isinstance(tree, list) else ()
        if not keys or self.random.random() < 0.1:
            return self.random.choice(ODD)
        key = self.random.choice(keys)
        if isinstance(tree, dict) and self.random.random() < 0.1:
            del tree[key]
        else:
            tree[key] = self._odd(tree[key])
        return tree

    def nest(self) -> Frame:
        depth = self.random.choice((10, 1000, MOST - 50))
        return self.random.choice(('{"type":"line","id":' + "[" * depth, "[" * depth, b"\x91" * depth, '{"a":' * 900))

    def giant(self) -> Frame:
        return self.random.choice(("x", '"')) * (MOST + 1) if self.random.random() < 0.5 else bytes(MOST + 1)

    def noise(self) -> Frame:
        data = self.random.randbytes(self.random.randint(0, 40))
        return data if self.random.random() < 0.5 else data.decode("latin-1")


class Server:
    """The end of a server, whatever comes."""

    def __init__(self, source: random.Random, counts: Counter[str]) -> None:
        self.random, self.counts, self.now = source, counts, 0.0
        self.delivery_log = DeliveryLog("key", BOUNDS)
        self.source = Source(FromClient, source)
        self.connection = ServerConnection(0.0, MOST, BACKLOG)

    def step(self) -> None:
        source, connection = self.random, self.connection
        self.now += source.choice((0.0, 0.01, 1.0))
        hello = connection.state is ConnectionState.HELLO and source.random() < 0.5
        right = connection.state is ConnectionState.OPEN and source.random() < 0.9
        frame = self.hello() if hello else self.source.right() if right else self.source.frame()
        for message in connection.receive(frame, self.now):
            self.counts[f"server: {type(message).__name__}"] += 1
            self.take(message)
        if source.random() < 0.2:
            told = source.choice(
                (Told(source.choice(replies())), Asked(source.randint(0, 20), source.choice(questions())))
            )
            self.delivery_log.tell(told, self.now)
        if source.random() < 0.3:
            assert all(isinstance(frame, str | bytes) for frame in connection.frames())
        if connection.closing or source.random() < 0.002:
            self.counts["server: closed"] += 1
            connection.cut(self.now)
            if source.random() < 0.1 or self.delivery_log.is_expired(self.now):
                self.delivery_log = DeliveryLog("key", BOUNDS)
            self.connection = ServerConnection(self.now, MOST, BACKLOG)

    def hello(self) -> Frame:
        source = self.random
        ids = tuple(source.randint(0, 100) for _ in range(3))
        resume = Resume(
            source.choice(("key", "other")), source.choice((self.delivery_log.seq, source.randint(0, 200))), ids
        )
        return encode(Hello((1,), resume=source.choice((None, resume))), Encoding.JSON)

    def take(self, message: Any) -> None:
        if isinstance(message, Hello):
            self.connection.welcome(Welcome(0, "", "cell1", "a", "", "", Clock(0.0), {}), self.delivery_log, self.now)
        elif isinstance(message, Command) and self.random.random() < 0.9:
            self.connection.send(Done(message.id, ok=self.random.random() < 0.5), self.now)


@cache
def replies() -> list[Any]:
    return [message.reply for message in corpus(FromServer)[0] if isinstance(message, Told)]


@cache
def questions() -> list[Any]:
    return [message.question for message in corpus(FromServer)[0] if isinstance(message, Asked)]


class Client:
    """The end of a client, whatever comes; what is a change is put into a mirror."""

    def __init__(self, source: random.Random, counts: Counter[str]) -> None:
        self.random, self.counts = source, counts
        self.source = Source(FromServer, source)
        self.connection = ClientConnection(Hello((1,)), MOST)
        self.connection.begin()
        self.seq = self.number = 0  # the last that were heard
        self.changes = [message for message in self.source.messages if isinstance(message, Change)][-9:]
        self.arm = arm_for(puma())
        self.mirror = Mirror(self.arm, Snapshot.of(planned(3)[0], Settings()), 0, lambda: 0.0)

    def step(self) -> None:
        source, connection = self.random, self.connection
        welcome = connection.state is ConnectionState.WELCOME and source.random() < 0.5
        fitting = connection.state is ConnectionState.OPEN and source.random() < 0.9
        frame = self.welcome() if welcome else self.fitting() if fitting else self.source.frame()
        for message in connection.receive(frame):
            self.counts[f"client: {type(message).__name__}"] += 1
            self.take(message)
        if source.random() < 0.1:
            self.say()
        if source.random() < 0.3:
            assert all(isinstance(frame, str | bytes) for frame in connection.frames())
        if connection.closing or source.random() < 0.002:
            self.counts["client: closed"] += 1
            connection.cut()
            connection.begin()

    def welcome(self) -> Frame:
        resumed = self.random.random() < 0.5
        fates = [message for message in self.source.messages if isinstance(message, Welcome)]
        told = Welcome(1, "key", "cell1", self.random.choice("ab"), "", "", Clock(0.0), {}, resumed=resumed)
        return encode(msgspec.structs.replace(told, fates=self.random.choice(fates).fates), Encoding.JSON)

    def fitting(self) -> Frame:
        """What may come next, most of the time."""
        message = self.random.choice([self.random.choice(self.source.messages), *self.changes])
        if isinstance(message, Numbered):
            message = msgspec.structs.replace(message, seq=self.seq + self.random.choice((0, 1, 1, 1, 1)))
        elif isinstance(message, Change):
            message = msgspec.structs.replace(message, number=self.number + self.random.choice((0, 1, 1, 1, 1, 2)))
        return encode(message, self.random.choice(list(Encoding)))

    def say(self) -> None:
        connection, source = self.connection, self.random
        id = connection.next_id()
        said = (Line(id, "MOVE a"), Positions(id, (1.0,)), Subscribe(id, deltas=True), Answer(source.randint(0, 20)))
        try:
            connection.send(source.choice(said))
        except RequestRefused:
            self.counts["client: refused"] += 1

    def take(self, message: Any) -> None:
        if isinstance(message, Numbered | Welcome):
            self.seq = self.seq if isinstance(message, Welcome) and message.resumed else message.seq
        elif isinstance(message, Change):
            self.number = message.number
        try:
            match message:
                case Replaced(snapshot):
                    self.mirror.replace(snapshot_of(snapshot, form()), message.number)
                case Delta(delta):
                    self.mirror.change(delta_of(delta, Motions(), form()), message.number)
                case Steered(target):
                    self.mirror.steer(target, message.number)
        except RecordError:
            self.counts["client: no record"] += 1


def held(*things: object) -> int:
    """Bytes of all that these hold on to, but for code and what is there anyway."""
    seen, left, size = set[int](), list(things), 0
    while left:
        one = left.pop()
        if id(one) not in seen and not isinstance(one, type | ModuleType | FunctionType | random.Random):
            seen.add(id(one))
            size += sys.getsizeof(one)
            left += gc.get_referents(one)
    return size


def run(count: int, seed: int) -> Counter[str]:
    """So many inputs to each end; how often what came of them."""
    source, counts = random.Random(seed), Counter[str]()
    server, client = Server(source, counts), Client(source, counts)
    for number in range(count):
        server.step()
        client.step()
        if number % (count // 4 + 1) == 0:
            assert held(server.connection, server.delivery_log, client.connection) < MOST_HELD
    assert held(server.connection, server.delivery_log, client.connection) < MOST_HELD
    return counts


def main(count: int = 100_000, seed: int = 1) -> None:
    begun = process_time()
    for what, often in sorted(run(count, seed).items()):
        print(f"{often:9} {what}")
    print(f"{2 * count} inputs in {process_time() - begun:.0f} s of CPU: no exception, memory within its bounds")


if __name__ == "__main__":
    command(main)
