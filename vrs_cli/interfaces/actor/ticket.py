"""Requests on their way: as a user has one in any thread, and as the robot carries it out."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Collection
from contextlib import suppress
from functools import partial
from threading import Lock
from typing import Any, Generic, TypeVar, cast

from vrs_cli.errors import VrsError
from vrs_cli.interfaces.dialogue import Dialogue
from vrs_cli.values.questions import Answer, Question
from vrs_cli.values.replies import Reply

T = TypeVar("T")

Reaction = Answer | BaseException
"""What a user gives back for what was said: the answer to a question, or what went wrong with it."""

Outlet = Callable[["Ticket[Any]", "Reply | Question | None"], None]
"""Called in the robot's thread with each reply and question of a request, and with None at its end."""


class Ticket(Generic[T]):
    """A request. `result` waits for its end, and raises what went wrong. All that is said goes to the `outlet`, where
    there is one, or waits here to be read.

    For the robot's thread: `dialogue` is what the request does, `by` the user who asks. `reaction`: what the dialogue
    is sent when it goes on. `asked`: the id of its last question. `place`: the queue that it is in; None while it does
    its part, and once it has ended. `put` puts what the robot's thread is to do into its inbox: `react`, `withdraw`.
    """

    def __init__(
        self,
        dialogue: Dialogue[T],
        by: object,
        outlet: Outlet | None,
        put: Callable[[Callable[[], None]], None],
        react: Callable[[Ticket[Any], Reaction, int], None],
        withdraw: Callable[[Ticket[Any]], None],
    ) -> None:
        self.dialogue, self.by, self._outlet = dialogue, by, outlet
        self.reaction: Reaction = None
        self.asked = 0
        self.place: list[Ticket[Any]] | Waiting | None = None
        self._said: deque[Reply | Question] = deque()
        self._put, self._react, self._withdraw = put, react, withdraw
        self._ended = False
        self._bell = Lock()  # held until the end: an Event would take fourteen calls for each request
        self._bell.acquire()
        self._result: T | None = None
        self._error: BaseException | None = None

    # --- the user's side, in any thread ---

    def heard(self) -> list[Reply | Question]:
        """Take what has been said and was not taken yet."""
        there: list[Reply | Question] = []
        with suppress(IndexError):  # nothing is left: another thread may take some, too
            while True:
                there.append(self._said.popleft())
        return there

    def done(self) -> bool:
        """Return whether the request has ended."""
        return self._ended

    def error(self, timeout: float | None = None) -> BaseException | None:
        """Wait for the end, and return what went wrong. Raises TimeoutError after so many seconds."""
        if not self._bell.acquire(timeout=-1 if timeout is None else timeout):
            raise TimeoutError("the request has not ended")
        self._bell.release()
        return self._error

    def result(self, timeout: float | None = None) -> T:
        """Wait for the end, and return the result. Raises what went wrong, and TimeoutError as `error` does."""
        error = self.error(timeout)
        if error is not None:
            raise error
        return cast(T, self._result)

    def answer(self, question: int, answer: Answer) -> None:
        """Answer the question with that id. An answer that comes late has no effect."""
        self._put(partial(self._react, self, answer, question))

    def throw(self, error: BaseException, question: int = 0) -> None:
        """Raise an error in the request, which may go on: what was said could not be shown, or the question with that
        id could not be asked.
        """
        self._put(partial(self._react, self, error, question))

    def withdraw(self) -> None:
        """End the request: what is not done yet is left."""
        self._put(partial(self._withdraw, self))

    # --- the robot's side ---

    def say(self, said: Reply | Question | None) -> None:
        if self._outlet is not None:
            self._outlet(self, said)
        elif said is not None:
            self._said.append(said)

    def end(self, result: T | None, error: BaseException | None = None) -> None:
        """End with a result or an error. The traceback of a VrsError is dropped: the frames in it refer to this ticket,
        and such a cycle would keep all that they hold (tokens, programs) in a server that does not look for cycles of
        old values.
        """
        self._result, self._error = result, error.with_traceback(None) if isinstance(error, VrsError) else error
        self._ended = True
        self._bell.release()
        self.say(None)


class Waiting:
    """Requests that wait to begin. Each user has a turn, one after the other, and begins the requests in order."""

    def __init__(self) -> None:
        self._by_user: dict[object, deque[Ticket[Any]]] = {}  # the user whose turn it is comes first
        self.count = 0

    def append(self, ticket: Ticket[Any]) -> None:
        self._by_user.setdefault(ticket.by, deque()).append(ticket)
        self.count += 1

    def next(self, busy: Collection[object] = ()) -> Ticket[Any] | None:
        """The request whose turn it is, of the users who are not busy."""
        return next((own[0] for by, own in self._by_user.items() if by not in busy), None)

    def remove(self, ticket: Ticket[Any]) -> None:
        """Remove a request: its user has had a turn."""
        own = self._by_user.pop(ticket.by)
        own.remove(ticket)
        self.count -= 1
        if own:
            self._by_user[ticket.by] = own

    def all(self) -> list[Ticket[Any]]:
        return [ticket for own in self._by_user.values() for ticket in own]
