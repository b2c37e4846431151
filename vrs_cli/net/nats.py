"""Publish served robots over NATS for any number of viewers; the server sends each message once.

Each robot has a subject, `vrs.NAME`, and a JetStream stream that keeps its last messages: a welcome with the robot
model, a snapshot, and every change after it. Welcome and snapshot are repeated regularly, so that viewers can join
later. The messages are the same as on a connection (docs/protocol.md), in MessagePack. Viewers cannot send commands.
"""

from __future__ import annotations

import asyncio
import time
from collections import deque
from collections.abc import Callable
from contextlib import suppress

from nats.aio.client import Client as Connection
from nats.errors import Error
from nats.js.api import DiscardPolicy, StorageType, StreamConfig
from nats.js.client import JetStreamContext

from vrs_cli.errors import RequestRefused
from vrs_cli.net import messages
from vrs_cli.net.broadcast import Listener
from vrs_cli.net.client import hello_of, reason_of
from vrs_cli.net.far_end import FarEnd
from vrs_cli.net.mirror import Mirror
from vrs_cli.net.room import Room
from vrs_cli.net.stream import MessageForm, Packet, packet_of
from vrs_cli.wire.codec import Reader, marks_of
from vrs_cli.wire.records import RecordError

TAIL = 500  # number of changes after which a snapshot is repeated
KEPT = 4 * TAIL  # number of messages of a robot that JetStream keeps
AGAIN = 0.2  # [s] time between two attempts to subscribe to a robot
OPENING = 10.0  # [s] maximum time until NATS answers, and until a robot is found
FORM = MessageForm(text=False, full=True)

_reader: Reader[messages.FromServer] = Reader(messages.FromServer)


def subject_of(robot: str) -> str:
    return f"vrs.{robot}"


def _stream_of(robot: str) -> str:
    """Return the name of a robot's stream; NATS allows no dots in it."""
    return "vrs=" + robot.replace(".", "=")


async def _connect(url: str, notify: Callable[[str], None], again: Callable[[], None] = lambda: None) -> Connection:
    """Connect to NATS; the connection reopens itself when it is cut. Raises RequestRefused if NATS does not answer."""

    async def tell_lost() -> None:
        if not connection.is_closed and not connection.is_draining:
            notify(f"{url}: NATS does not answer; it is tried again")

    async def tell_found() -> None:
        notify(f"{url}: NATS answers again")
        again()

    async def wrong(error: Exception) -> None:
        """Raise an error that occurs while the connection opens; ignore later errors."""
        if opens:
            raise error

    connection, opens = Connection(), True
    try:
        async with asyncio.timeout(OPENING):
            await connection.connect(
                url,
                disconnected_cb=tell_lost,
                reconnected_cb=tell_found,
                error_cb=wrong,
                max_reconnect_attempts=-1,
                allow_reconnect=True,
                connect_timeout=int(OPENING),
            )
    except (Error, OSError, ValueError) as error:
        with suppress(AssertionError):  # nats-py raises this if the connection was never opened
            await connection.close()
        raise RequestRefused(f"{url}: NATS does not answer: {_reason(error)}", "is nats-server running?") from None
    opens = False
    return connection


def _reason(error: Exception) -> str:
    return reason_of(error) if isinstance(error, OSError) else str(error) or type(error).__name__


class Publisher:
    """A publisher of robots over NATS. `notify`: callback for messages about the connection to NATS. Call all methods
    in the thread of the event loop."""

    def __init__(self, url: str, notify: Callable[[str], None]) -> None:
        self._url, self._notify = url, notify
        self._robots: dict[str, _Robot] = {}
        self._connection: Connection | None = None

    async def open(self) -> None:
        """Connect. Raises RequestRefused if NATS does not answer, or has no JetStream."""

        def begin_anew() -> None:  # called when NATS is connected again: messages were lost, and perhaps the streams
            for robot in self._robots.values():
                robot.lost = True
                robot.woken.set()

        self._connection = await _connect(self._url, self._notify, begin_anew)
        try:
            await self._connection.jetstream().account_info()
        except Error:
            await self._connection.close()
            raise RequestRefused(f"{self._url}: this NATS keeps no streams", "start it as nats-server -js") from None

    def add(self, robot: Room) -> None:
        """Publish a robot."""
        assert self._connection is not None, "it is open"
        if robot.name not in self._robots:
            self._robots[robot.name] = _Robot(robot, self._connection, self._notify)

    async def close(self) -> None:
        """Send the waiting messages, and close the connection."""
        for robot in self._robots.values():
            await robot.close()
        if self._connection is not None:
            with suppress(Error, OSError, TimeoutError):
                async with asyncio.timeout(OPENING):
                    await self._connection.drain()


class _Robot:
    """The publisher of one robot, which listens to the robot's broadcast. `lost`: NATS has lost messages, so a new
    stream with a welcome and a snapshot is needed."""

    def __init__(self, robot: Room, connection: Connection, notify: Callable[[str], None]) -> None:
        self._robot, self._connection, self._notify = robot, connection, notify
        self._waiting: deque[bytes] = deque()
        self._size, self._changes = 0, 0
        self.woken, self.lost = asyncio.Event(), False
        self._listener: Listener = robot.broadcast.join(self, FORM)
        self._task = asyncio.create_task(self._publish())
        robot.broadcast.subscribe(self._listener, messages.Subscribe(0, deltas=True))
        robot.wake()

    # --- as a sink of the broadcast ---

    @property
    def waiting(self) -> int:
        return self._size

    def send(self, *packets: Packet) -> None:
        for packet in packets:
            marks = marks_of(packet.data)
            kind = "" if marks is None else marks.type
            if kind == "replaced":
                self._changes = 0
                self._put(packet_of(self._robot.greeting(), FORM).data)
            self._put(packet.data)
            self._changes += kind == "delta"
            if kind == "delta" and self._changes == TAIL:
                asyncio.get_running_loop().call_soon(self._begin_anew)

    def _begin_anew(self) -> None:
        """Let the next publications be a welcome and a full snapshot, from which clients can start again."""
        self._robot.broadcast.resync(self._listener)
        self._robot.wake()

    def _put(self, data: bytes) -> None:
        self._waiting.append(data)
        self._size += len(data)
        self.woken.set()

    # --- to NATS ---

    async def _publish(self) -> None:
        await self._make_stream()
        while True:
            await self.woken.wait()
            self.woken.clear()
            if self.lost:
                self.lost = False
                await self._make_stream()
                self._begin_anew()
            while self._waiting:
                data = self._waiting.popleft()
                self._size -= len(data)
                with suppress(Error):  # everything is published again when NATS is back
                    await self._connection.publish(subject_of(self._robot.name), data)

    async def _make_stream(self) -> None:
        """Create a new, empty stream; it replaces an existing stream of this robot."""
        name, streams = self._robot.name, self._connection.jetstream()
        with suppress(Error, TimeoutError):
            await streams.delete_stream(_stream_of(name))
        config = StreamConfig(
            _stream_of(name),
            subjects=[subject_of(name)],
            max_msgs=KEPT,
            storage=StorageType.MEMORY,
            discard=DiscardPolicy.OLD,
        )
        try:
            await streams.add_stream(config)
        except (Error, TimeoutError) as error:
            self._notify(f"{name}: NATS keeps no stream of it ({_reason(error)})")

    async def close(self) -> None:
        self._robot.broadcast.leave(self._listener)
        while self._waiting and not self._task.done():
            await asyncio.sleep(0)
        self._task.cancel()


class PublishedRobot:
    """A published robot on the side of a viewer: `mirror` follows it."""

    def __init__(self, robot: str) -> None:
        self._robot = robot
        self._far = FarEnd(hello_of(), time.monotonic)
        self._shown, self._anew = asyncio.Event(), True
        self._connection: Connection | None = None
        self._task: asyncio.Task[None] | None = None

    @classmethod
    async def open(cls, url: str, robot: str, notify: Callable[[str], None] = lambda _text: None) -> PublishedRobot:
        """Follow a robot. Raises RequestRefused if NATS does not answer, or no such robot is published."""
        watching = cls(robot)
        watching._connection = await _connect(url, notify, watching._begin)
        watching._begin()
        try:
            async with asyncio.timeout(OPENING):
                await watching._shown.wait()
        except TimeoutError:
            await watching.close()
            raise RequestRefused(
                f"{url}: no robot {robot} is published there", "vrs serve --nats URL publishes it"
            ) from None
        return watching

    @property
    def mirror(self) -> Mirror:
        assert self._far.mirror is not None, "it was shown"
        return self._far.mirror

    async def close(self) -> None:
        if self._task is not None:
            self._task.cancel()
        if self._connection is not None:
            await self._connection.close()

    def _begin(self) -> None:
        """Follow the robot's messages from the start of the stream. Called at the start and when NATS answers again."""
        if self._task is not None:
            self._task.cancel()
        assert self._connection is not None, "it is open"
        self._task = asyncio.create_task(self._follow(self._connection.jetstream()))

    async def _follow(self, streams: JetStreamContext) -> None:
        subscription = None
        while subscription is None:
            try:
                subscription = await streams.subscribe(subject_of(self._robot), ordered_consumer=True)
            except (Error, TimeoutError):  # the stream does not exist yet
                await asyncio.sleep(AGAIN)
        async for heard in subscription.messages:
            with suppress(RecordError):  # the message is from a later version
                self._hear(_reader.read(heard.data))

    def _hear(self, message: messages.ServerMessage) -> None:
        """Take a message. Ignore messages before the first welcome, which are changes without a snapshot."""
        before = self._far.welcome
        if isinstance(message, messages.Welcome):
            self._anew = self._anew or before is None or before.life != message.life
        elif before is None:
            return
        elif isinstance(message, messages.Replaced) and not self._anew:
            mirror = self._far.mirror
            if mirror is not None and not mirror.lost and mirror.seq == message.number:
                return  # a snapshot repeated for later viewers
        self._far.learn(message)
        if isinstance(message, messages.Replaced):
            self._anew = False
            self._shown.set()
