"""A served robot as Supervisor holds it: requests are made, and their ends waited for, over a socket port."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from threading import Lock
from typing import TypeVar, cast

from vrs_cli.engine.feed import Inbox
from vrs_cli.errors import RequestRefused
from vrs_cli.files.atomic import atomically
from vrs_cli.interfaces.dialogue import Answers, Notes
from vrs_cli.net import messages
from vrs_cli.net.client import Client, answer_to, checked
from vrs_cli.net.messages import Abort, At, Done, Drive, LeaseAct, Line, Request, ServerMessage
from vrs_cli.net.socket_port import SocketPort
from vrs_cli.values.acts import LeaveEntry, Record, Say
from vrs_cli.values.replies import Reply
from vrs_cli.values.results import Position
from vrs_cli.values.tagged import Act

T = TypeVar("T")


class _Ear:
    """Hears what belongs to no request, for who talks with the robot now."""

    def __init__(self) -> None:
        self.inbox: Inbox[ServerMessage] | None = None

    def hear(self, message: ServerMessage) -> None:
        if self.inbox is not None:
            self.inbox.put(message)


class RemoteRobot(SocketPort):
    """Any thread may call any method. Raises what the robot refuses, and RequestRefused where there is no connection:
    nothing waits for one.
    """

    def __init__(self, client: Client) -> None:
        super().__init__(client)
        self._notes, self._ear, self._talking = Notes(), _Ear(), Lock()
        self.listen(self._ear.hear)

    def past(self, times: Sequence[float]) -> tuple[Position, ...]:
        found: list[Position] = []
        for first in range(0, len(times), messages.MOST_TIMES):
            some = tuple(times[first : first + messages.MOST_TIMES])
            found += self._located(some).positions
        return tuple(found)

    def _located(self, times: tuple[float, ...]) -> messages.Located:
        located = self.ask(lambda id: messages.Positions(id, times))
        assert isinstance(located, messages.Located), "it answers Positions"
        return located

    # --- asking ---

    def act(self, act: Act[T], answer: Answers | None = None, issued: float | None = None) -> T:
        def make(id: int) -> Request:
            return At(id, act, issued)

        if answer is None:
            return cast(T, self._follow(make, Inbox()).found)
        with self._conversing(answer) as inbox:
            return cast(T, self._follow(make, inbox).found)

    def start(self, act: Act[T], issued: float | None = None) -> Callable[[], T]:
        inbox: Inbox[ServerMessage] = Inbox()
        self.begin(lambda id: At(id, act, issued), inbox.put)
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

    def save(self, path: Path) -> None:
        recorded = self.act(Record())
        with atomically(path) as stream:
            stream.write(recorded.data)

    # --- talking ---

    @contextmanager
    def _conversing(self, answer: Answers) -> Iterator[Inbox[ServerMessage]]:
        """What is said meanwhile is kept, and what is asked is answered. Raises RequestRefused where the connection is
        cut, also while an earlier request of this process is waited for.
        """
        far, cuts = self.far, self.far.cuts
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
        self.begin(make, inbox.put)
        return self._ended(inbox)

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
