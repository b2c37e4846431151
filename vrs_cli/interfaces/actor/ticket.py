"""What a holder has of a request: what is said of it, as it comes, and how it ended."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from queue import Empty, SimpleQueue
from threading import Event
from typing import Any, Generic, TypeVar, cast

from vrs_cli.errors import VrsError
from vrs_cli.values.questions import Answer, Question
from vrs_cli.values.replies import Reply

T = TypeVar("T")

Reaction = Answer | BaseException
"""What a holder gives back for what was said: the answer to a question, or what went wrong with it."""

Outlet = Callable[["Ticket[Any]", "Reply | Question | None"], None]
"""Hears of a request, in the robot's thread: what is said of it as it is said, and None at its end."""


class Ticket(Generic[T]):
    """A request on its way, in any thread. `result` waits for its end, and raises what went wrong. With an `outlet` all
    that is said goes there, and nowhere else.
    """

    def __init__(
        self,
        react: Callable[[Ticket[Any], Reaction, int], None],
        withdraw: Callable[[Ticket[Any]], None],
        outlet: Outlet | None = None,
    ) -> None:
        self._outlet = outlet
        self._said: SimpleQueue[Reply | Question | None] = SimpleQueue()
        self._react, self._withdraw = react, withdraw
        self._over = Event()
        self._result: T | None = None
        self._error: BaseException | None = None

    # --- the holder's side, in any thread ---

    def __iter__(self) -> Iterator[Reply | Question]:
        """Each reply and each question when it comes, until the request has ended."""
        return iter(self._said.get, None)

    def heard(self) -> list[Reply | Question]:
        """What has been said and not been taken yet."""
        there: list[Reply | Question] = []
        if self._said.empty():
            return there
        try:
            while (said := self._said.get_nowait()) is not None:
                there.append(said)
        except Empty:
            pass
        return there

    def done(self) -> bool:
        """Whether it has ended."""
        return self._over.is_set()

    def error(self, timeout: float | None = None) -> BaseException | None:
        """What went wrong with it, once it has ended. Raises TimeoutError where it has not, so many seconds later."""
        if not self._over.wait(timeout):
            raise TimeoutError("the request has not ended")
        return self._error

    def result(self, timeout: float | None = None) -> T:
        """What comes of it, once it has ended. Raises what went wrong, and TimeoutError as `error` does."""
        error = self.error(timeout)
        if error is not None:
            raise error
        return cast(T, self._result)

    def answer(self, question: int, answer: Answer) -> None:
        """To the question with that id. Nothing comes of it where that one waits no longer."""
        self._react(self, answer, question)

    def throw(self, error: BaseException, question: int = 0) -> None:
        """What was said could not be shown, or the question with that id not be asked: it is raised in the request,
        which may go on.
        """
        self._react(self, error, question)

    def withdraw(self) -> None:
        """Nobody wants it any more: what is not done yet is left."""
        self._withdraw(self)

    # --- the robot's side ---

    def say(self, said: Reply | Question) -> None:
        self._put(said)

    def end(self, result: T) -> None:
        self._result = result
        self._end()

    def refuse(self, error: BaseException) -> None:
        """End with an error. Its traceback is dropped: the frames in it refer to this ticket, and such a cycle would
        keep all that they hold (tokens, programs) in a server that does not look for cycles of old values.
        """
        self._error = error.with_traceback(None) if isinstance(error, VrsError) else error
        self._end()

    def _end(self) -> None:
        self._over.set()
        self._put(None)

    def _put(self, said: Reply | Question | None) -> None:
        if self._outlet is None:
            self._said.put(said)
        else:
            self._outlet(self, said)
