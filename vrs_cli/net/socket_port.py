"""Use a served robot from any thread: the port runs its connection in an event loop, in a separate thread."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from concurrent.futures import CancelledError, Future
from contextlib import suppress
from functools import partial
from math import inf
from pathlib import Path
from threading import Lock, Thread, current_thread
from typing import TYPE_CHECKING, Any, TypeVar
from weakref import finalize

from vrs_cli.engine.engine import TimelineChange
from vrs_cli.engine.feed import Inbox, Subscription
from vrs_cli.errors import RequestRefused, VrsError
from vrs_cli.interfaces.port.port import Previewed
from vrs_cli.net import messages
from vrs_cli.net.client import Client
from vrs_cli.net.far_end import Outlet
from vrs_cli.net.mirror import WINDOW, Mirror
from vrs_cli.values.questions import PromptStatus
from vrs_cli.wire.messages import Refusal

if TYPE_CHECKING:
    from vrs_cli.world.course import World

PAST = 60.0  # [s] how much of the timeline's past is kept by default
CLOSING = 5.0  # [s] maximum time to close a connection
CLOSED = "it was let go", "connect again"  # message and hint of the error for a closed port
T = TypeVar("T")


class Loop:
    """An event loop in a separate thread. `ends`: whether it is closed or closing."""

    def __init__(self) -> None:
        self._loop = asyncio.new_event_loop()
        self._lock, self.ends = Lock(), False
        self._thread = Thread(target=self._loop.run_forever, name="vrs connection", daemon=True)
        self._thread.start()

    def wait(self, work: Coroutine[Any, Any, T], seconds: float | None = None) -> T:
        """Run a coroutine in the loop; return its result. Raises TimeoutError after `seconds`, and RequestRefused if
        the loop is closed before the coroutine ends.
        """
        future = self.begin(work)
        try:
            return future.result(seconds)
        except CancelledError:
            raise RequestRefused(*CLOSED) from None
        except BaseException:
            future.cancel()
            raise

    def begin(self, work: Coroutine[Any, Any, T]) -> Future[T]:
        """Start a coroutine in the loop. Raises RequestRefused if the loop is closed."""
        with self._lock:
            if not self.ends:
                return asyncio.run_coroutine_threadsafe(work, self._loop)
        work.close()
        raise RequestRefused(*CLOSED)

    def soon(self, act: Callable[[], object]) -> None:
        """Schedule a call of `act` in the loop. Safe in a signal handler. Does nothing if the loop is closed."""
        with suppress(RuntimeError):
            self._loop.call_soon_threadsafe(act)

    def do(self, act: Callable[[], T]) -> T:
        """Call `act` in the loop; return its result. Raises RequestRefused if the loop is closed."""
        if current_thread() is self._thread:
            return act()

        async def once() -> T:
            return act()

        return self.wait(once())

    def close(self) -> None:
        """Cancel all tasks, wait up to CLOSING for them, and stop the loop. Waiting threads get RequestRefused."""

        async def stop_tasks() -> None:
            tasks = asyncio.all_tasks() - {asyncio.current_task()}
            for task in tasks:
                task.cancel()
            if tasks:
                await asyncio.wait(tasks, timeout=CLOSING)

        with self._lock:
            self.ends = True
        # runs in the loop's thread, because the calling thread may run another loop (in a notebook)
        asyncio.run_coroutine_threadsafe(stop_tasks(), self._loop).result()
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()


class SocketPort:
    """A port to a served robot for one user. Any thread may call any method.

    The constructor opens the connection. Raises RequestRefused if no robot answers, or the error that the server sent.
    `window`: how much of the past timeline is kept [s], once the port follows the timeline. While the connection is
    cut, requests are refused immediately. `close` leaves the robot; so does dropping the last reference to the port.
    """

    def __init__(self, client: Client, window: float = PAST) -> None:
        self.client, self.far, self._window, self._loop = client, client.far, window, Loop()
        self._left = finalize(self, _leave, self._loop, client)
        try:
            self._loop.wait(client.open())
        except BaseException:
            self.close()
            raise

    @classmethod
    def connect(
        cls,
        url: str,
        hello: messages.Hello,
        *,
        ca: Path | None = None,
        window: float = WINDOW,
        notify: Callable[[str], None] = lambda _text: None,
    ) -> SocketPort:
        """Open a port that follows the timeline; return it. Raises UsageError if `url` is not an address,
        RequestRefused if no robot answers, or the error that the server sent.
        """
        try:
            port = cls(Client(url, hello, ca=ca, notify=notify), window)
            port.follow()
        except VrsError as error:
            raise error.with_traceback(None) from None
        return port

    # --- the connection ---

    @property
    def welcome(self) -> messages.Welcome:
        """Return the server's welcome on the newest connection."""
        assert self.far.welcome is not None, "the port is opened by its constructor"
        return self.far.welcome

    @property
    def name(self) -> str:
        """Return the name of this user, as other users see it."""
        return self.welcome.name

    @property
    def one_user(self) -> bool:
        """Return whether all clients of the robot belong to this user."""
        return self.welcome.one_user

    @property
    def open(self) -> bool:
        """Return whether the connection is open now."""
        return self.far.open

    def check_open(self) -> None:
        """Check that the connection is open. Raises RequestRefused, whose message says for how long the connection has
        been cut."""
        if not self.far.open:
            raise self.far.no_connection

    @property
    def cuts(self) -> int:
        """Return the number of times the connection was cut."""
        return self.far.cuts

    @property
    def stalls(self) -> int:
        """Return the number of silences that were so long that the connection may have been cut."""
        return self.far.stalls

    def close(self) -> None:
        self._left()

    # --- the timeline ---

    @property
    def world(self) -> World | None:
        """Return the object that computes the state of the cell around the robot; None without a cell."""
        return self.far.world

    def follow(self) -> Mirror:
        """Return the mirror of the robot's timeline and clock. The first call starts to follow the robot. Raises
        RequestRefused.
        """
        if self.far.mirror is None:
            self._loop.wait(self.client.follow(self._window)).before_measured = partial(
                _measure, self._loop, self.client
            )
        assert self.far.mirror is not None, "the timeline is followed"
        return self.far.mirror

    def preview_now(self) -> Previewed:
        """Return the robot's future motion, including the commands on their way. Raises RequestRefused if closed."""
        if self._loop.ends:
            raise RequestRefused(*CLOSED)
        return self.far.preview_now()  # in the caller's thread, which is faster: a window calls this 50 times a second

    def subscribe(self) -> Subscription[TimelineChange]:
        """Subscribe to the timeline and all its changes."""
        return self._loop.do(self.follow().events.subscribe)

    # --- messages ---

    def ask(self, make: Callable[[int], messages.Request]) -> messages.ServerMessage:
        """Send the request that `make` returns for an id; return its final answer. Raises the robot's error if the
        robot refuses the request, and RequestRefused if there is no connection.
        """
        return self._loop.wait(self.client.ask(make))

    def begin(self, make: Callable[[int], messages.Request], outlet: Outlet) -> int:
        """Send the request that `make` returns for an id; return the id. The outlet is called with all answers, in the
        thread of the connection; the last one ends the request. Raises RequestRefused if there is no connection."""
        return self._loop.do(lambda: self.client.begin(make, outlet))

    def post(self, make: Callable[[int], messages.Request], outlet: Outlet) -> None:
        """Send a request without waiting. Safe in a signal handler. If there is no connection, the outlet gets
        `Refused`."""

        def refused(error: RequestRefused) -> None:
            outlet(messages.Refused(Refusal.of(error)))

        self._try_soon(lambda: self.client.begin(make, outlet), refused)

    def tell(self, message: messages.ClientMessage) -> None:
        """Send a message that has no answer, without waiting. Safe in a signal handler. If the message cannot be sent,
        `client.notify` gets the reason.
        """

        self._try_soon(lambda: self.client.send(message), lambda error: self.client.notify(str(error)))

    def _try_soon(self, act: Callable[[], object], refused: Callable[[RequestRefused], None]) -> None:
        """Call `act` in the thread of the connection; if it raises RequestRefused, call `refused` with the error."""

        def attempt() -> None:
            try:
                act()
            except RequestRefused as error:
                refused(error)

        self._loop.soon(attempt)

    def take(self, inbox: Inbox[messages.ServerMessage], seconds: float | None = None) -> messages.ServerMessage | None:
        """Wait for the next message of an inbox, at most `seconds`; return it, or None if there is none."""
        return inbox.take(seconds)

    def interrupt(self) -> bool:
        """Interrupt the current request, which then ends; return True. Safe in a signal handler."""
        self.tell(messages.Interrupt())
        return True

    def give_up(self, error: BaseException) -> str:  # noqa: ARG002 (the robot knows nothing of the error)
        """Return the message for a user who no longer waits for a request."""
        return "it is not waited for any more: the robot may do it still"

    def status(self) -> PromptStatus:
        """Return the last status of the robot, with a clock that continues."""
        return self.far.status.now()

    def program(self, _key: str) -> None:
        """Return None: the programs are stored at the robot."""

    on_screen, due = None, inf

    def listen(self, outlet: Outlet) -> None:
        """Call the outlet, in the thread of the connection, with each message that answers no request."""
        self._loop.do(lambda: self.far.news.append(outlet))


def _measure(loop: Loop, client: Client) -> None:
    """Follow the measured positions of the real or simulated arm; do nothing if there is no connection."""
    if not client.measures:
        with suppress(RequestRefused):
            loop.wait(client.measure())


def _leave(loop: Loop, client: Client) -> None:
    """Close the connection and its loop."""
    with suppress(TimeoutError):
        loop.wait(client.close(), CLOSING)
    loop.close()
