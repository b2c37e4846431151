"""A robot afar, held by threads that wait: the loop of its connection has a thread of its own."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine, Iterator, Sequence
from concurrent.futures import CancelledError, Future
from contextlib import contextmanager, suppress
from pathlib import Path
from threading import Lock, Thread, current_thread
from typing import Any, TypeVar, cast
from weakref import finalize

from vrs_cli.engine.engine import Event
from vrs_cli.engine.feed import Inbox, Subscription
from vrs_cli.errors import RequestRefused, VrsError
from vrs_cli.files.atomic import atomically
from vrs_cli.interfaces.dialogue import Answers, Notes
from vrs_cli.interfaces.roles.preview import Previewed
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.transform import Transform
from vrs_cli.net import messages
from vrs_cli.net.client import Client, answer_to, checked
from vrs_cli.net.far_end import Ahead
from vrs_cli.net.messages import Abort, At, Done, Drive, LeaseAct, Line, Request, RobotAct, ServerMessage
from vrs_cli.net.mirror import WINDOW, Mirror
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.acts import LeaveEntry, Record, Say
from vrs_cli.values.replies import Reply
from vrs_cli.values.results import Position
from vrs_cli.values.tagged import Act

LEAVING = 5.0  # [s] that the end of a connection takes at most
LET_GO = "it was let go", "connect again"
T = TypeVar("T")


class Loop:
    """An event loop in a thread of its own."""

    def __init__(self) -> None:
        self._loop = asyncio.new_event_loop()
        self._lock, self._ends = Lock(), False
        self._thread = Thread(target=self._loop.run_forever, name="vrs connection", daemon=True)
        self._thread.start()

    def wait(self, work: Coroutine[Any, Any, T], seconds: float | None = None) -> T:
        """What comes of it. Raises TimeoutError where that takes longer, RequestRefused where the loop is closed, also
        before it comes to an end.
        """
        future = self.begin(work)
        try:
            return future.result(seconds)
        except CancelledError:
            raise RequestRefused(*LET_GO) from None
        except BaseException:
            future.cancel()
            raise

    def begin(self, work: Coroutine[Any, Any, T]) -> Future[T]:
        """Something that goes on. Raises RequestRefused where the loop is closed."""
        with self._lock:
            if not self._ends:
                return asyncio.run_coroutine_threadsafe(work, self._loop)
        work.close()
        raise RequestRefused(*LET_GO)

    @property
    def ends(self) -> bool:
        """Whether it is closed, or is about to be."""
        return self._ends

    def soon(self, act: Callable[[], object]) -> None:
        """Something that nobody waits for. Safe in a signal handler."""
        self._loop.call_soon_threadsafe(act)

    def do(self, act: Callable[[], T]) -> T:
        """Something that takes no time."""
        if current_thread() is self._thread:
            return act()

        async def once() -> T:
            return act()

        return self.wait(once())

    def close(self) -> None:
        """Whoever still waits for something waits no longer."""
        with self._lock:
            self._ends = True
        # in the loop's own thread: this one may run another loop, as that of a notebook does
        asyncio.run_coroutine_threadsafe(_stopped(), self._loop).result()
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()


async def _stopped() -> None:
    """Cancel all other tasks of this loop, and wait for their end, but for no longer than LEAVING."""
    tasks = asyncio.all_tasks() - {asyncio.current_task()}
    for task in tasks:
        task.cancel()
    if tasks:
        await asyncio.wait(tasks, timeout=LEAVING)


class _Ear:
    """Hears what belongs to no request, for who talks with the robot now."""

    def __init__(self) -> None:
        self.inbox: Inbox[ServerMessage] | None = None

    def hear(self, message: ServerMessage) -> None:
        if self.inbox is not None:
            self.inbox.put(message)


class RemoteRobot:
    """Any thread may call any method. Raises what the robot refuses, and RequestRefused where there is no connection:
    nothing waits for one. `close` lets the robot go, as does who drops the last reference to it.
    """

    def __init__(self, client: Client, loop: Loop, mirror: Mirror) -> None:
        self.client, self._loop, self._mirror = client, loop, mirror
        self._notes, self._ear, self._talking = Notes(), _Ear(), Lock()
        client.far.news.append(self._ear.hear)
        self._left = finalize(self, _leave, loop, client)

    @classmethod
    def connect(
        cls,
        url: str,
        hello: messages.Hello,
        *,
        ca: Path | None = None,
        window: float = WINDOW,
        told: Callable[[str], None] = lambda _text: None,
    ) -> RemoteRobot:
        """`window`: so many seconds of the past are kept here. Raises UsageError for what is no address, RequestRefused
        where no robot answers, and what that refuses.
        """
        client, loop = Client(url, hello, ca=ca, told=told), Loop()
        try:
            return cls(client, loop, loop.wait(_followed(client, window)))
        except BaseException as error:
            _leave(loop, client)
            if isinstance(error, VrsError):
                raise error.with_traceback(None) from None
            raise

    # --- reading ---

    @property
    def arm(self) -> RobotArm:
        return self._mirror.arm

    @property
    def timeline(self) -> Timeline:
        return self._mirror.timeline

    @property
    def now(self) -> float:
        return self._mirror.now

    @property
    def rate(self) -> float | None:
        return self._mirror.clock.rate

    @property
    def begins(self) -> float:
        return self._mirror.begins

    def past(self, times: Sequence[float]) -> tuple[Position, ...]:
        found: list[Position] = []
        for first in range(0, len(times), messages.MOST_TIMES):
            some = tuple(times[first : first + messages.MOST_TIMES])
            found += self._located(some).positions
        return tuple(found)

    def _located(self, times: tuple[float, ...]) -> messages.Located:
        end = self._loop.wait(self.client.ask(lambda id: messages.Positions(id, times)))
        assert isinstance(end, messages.Located), "it answers Positions"
        return end

    @property
    def welcome(self) -> messages.Welcome:
        """Which robot it is, and as whom one holds it."""
        welcome = self.client.far.welcome
        assert welcome is not None, "there is a mirror"
        return welcome

    @property
    def ahead(self) -> float | Ahead:
        """How much after the clock that is heard a viewer is shown [s]."""
        return self.client.far.ahead

    @ahead.setter
    def ahead(self, ahead: float | Ahead) -> None:
        self.client.far.ahead = ahead

    @property
    def near(self) -> bool:
        """Whether what is shown of it is as good as what is: there are no delays to tell of."""
        return self.client.far.near

    def previewed(self) -> Previewed:
        if self._loop.ends:
            raise RequestRefused(*LET_GO)
        return self.client.far.previewed()  # in the thread of who looks, fifty times a second

    # --- asking ---

    def act(self, act: Act[T], answer: Answers | None = None, issued: float | None = None) -> T:
        def make(id: int) -> Request:
            return At(id, cast(RobotAct, act), issued)

        if answer is None:
            return cast(T, self._follow(make, Inbox()).found)
        with self._conversing(answer) as inbox:
            return cast(T, self._follow(make, inbox).found)

    def send(self, act: Act[T], issued: float | None = None) -> Callable[[], T]:
        inbox = self._sent(lambda id: At(id, cast(RobotAct, act), issued), Inbox())
        return lambda: cast(T, self._ended(inbox).found)

    def say(self, line: str, answer: Answers) -> tuple[Reply, ...]:
        with self._conversing(answer) as inbox:
            self._follow(lambda id: At(id, Say(line)), inbox)
            return self._notes.taken()

    def type(self, text: str, answer: Answers) -> tuple[Reply, ...]:
        with self._conversing(answer) as inbox:
            done = self._follow(lambda id: Line(id, text), inbox)
            if done.status is not None and done.status.in_program:
                self._follow(lambda id: At(id, LeaveEntry("the text ends; ")), inbox)
            return self._notes.taken()

    def abort(self) -> None:
        self._follow(Abort, Inbox())

    def drive(self, act: LeaseAct, to: str = "") -> None:
        """Ask for the lease, which says who moves the robot; take, give or release it. Raises LeaseHeld."""
        self._follow(lambda id: Drive(id, act, to), Inbox())

    def drag(self, T_world_tool: Transform | None) -> None:
        """The tool is wished there from now on; None lets it go. To be said again while it is held, ten times a second.
        Nobody waits for the robot; `Pulled` tells what becomes of it. Without a connection nothing is sent.
        """

        def send() -> None:
            with suppress(RequestRefused):
                self.client.drag(T_world_tool)

        self._loop.soon(send)

    def save(self, path: Path) -> None:
        recorded = self.act(Record())
        with atomically(path) as stream:
            stream.write(recorded.data)

    def listen(self, outlet: Callable[[ServerMessage], None]) -> None:
        """Have all told that belongs to no request, in the thread of the connection."""
        self._loop.do(lambda: self.client.far.news.append(outlet))

    def begin(self, make: Callable[[int], Request], outlet: Callable[[ServerMessage], None]) -> int:
        """Send a request, made for an id, and do not wait: all that comes of it goes to the outlet, its end last."""
        return self._loop.do(lambda: self.client.begin(make, outlet))

    def look(self, make: Callable[[int], Request], outlet: Callable[[ServerMessage], None]) -> None:
        """The same of what is asked again anyway: not even its sending is waited for, and no connection, no answer."""

        def begin() -> None:
            with suppress(RequestRefused):
                self.client.begin(make, outlet)

        with suppress(RuntimeError):  # it was let go meanwhile
            self._loop.soon(begin)

    def tell(self, message: messages.ClientMessage) -> None:
        """What has no answer; what does not come to the robot any more is missed by nobody."""
        self._loop.do(lambda: self._send_now(message))

    @property
    def open(self) -> bool:
        """Whether there is a connection now."""
        return self.client.far.open

    @property
    def unheard(self) -> float | None:
        """For how long nothing was heard of the robot [s]; None while it is heard as usual."""
        return self.client.far.unheard

    @property
    def breaks(self) -> int:
        """The number of cuts of the connection, silences that may be cuts among them."""
        return self.client.far.cuts + self.client.far.stalls

    def subscribe(self) -> Subscription[Event]:
        return self._loop.do(self._mirror.events.subscribe)

    def close(self) -> None:
        self._left()

    # --- talking ---

    @contextmanager
    def _conversing(self, answer: Answers) -> Iterator[Inbox[ServerMessage]]:
        """What is said meanwhile is kept, and what is asked is answered. Raises RequestRefused where the connection is
        cut, also while an earlier request of this process is waited for.
        """
        far, cuts = self.client.far, self.client.far.cuts
        if not far.open:
            raise far.no_connection
        with self._talking:
            if far.cuts != cuts:
                raise RequestRefused("the connection was cut before its turn came: it was not sent", "give it again")
            self._notes.begin(answer)
            self._ear.inbox = Inbox()
            try:
                yield self._ear.inbox
            finally:
                self._ear.inbox = None

    def _follow(self, make: Callable[[int], Request], inbox: Inbox[ServerMessage]) -> Done:
        """Send a command, and wait for its end."""
        return self._ended(self._sent(make, inbox))

    def _sent(self, make: Callable[[int], Request], inbox: Inbox[ServerMessage]) -> Inbox[ServerMessage]:
        """Send a command; what comes of it goes to the inbox."""
        self._loop.do(lambda: self.client.begin(make, inbox.put))
        return inbox

    def _ended(self, inbox: Inbox[ServerMessage]) -> Done:
        """Wait for the end of a command. Ctrl-C stops it; a second one, or one that cannot be sent, waits no longer."""
        interrupted = False
        while True:
            try:
                message = inbox.take(None)
                if isinstance(message, Done | messages.Refused):
                    break
                self._hear(message)
            except KeyboardInterrupt:
                if interrupted or not self.open:
                    raise  # nobody waits for a robot that does not answer
                interrupted = True
                self.tell(messages.Interrupt())
        if interrupted:
            raise KeyboardInterrupt
        done = checked(message)
        assert isinstance(done, Done), "what is refused is raised"
        return done

    def _hear(self, message: ServerMessage | None) -> None:
        match message:
            case messages.Told(reply):
                self._notes.show(reply)
            case messages.Typed(text, newline):
                self._notes.type(text, newline)
            case messages.Asked():
                self.tell(answer_to(message, self._notes.ask))

    def _send_now(self, message: messages.ClientMessage) -> None:
        with suppress(RequestRefused):
            self.client.send(message)


async def _followed(client: Client, window: float) -> Mirror:
    await client.open()
    return await client.follow(window)


def _leave(loop: Loop, client: Client) -> None:
    """Nobody holds the robot any more."""
    with suppress(TimeoutError):
        loop.wait(client.close(), LEAVING)
    loop.close()
