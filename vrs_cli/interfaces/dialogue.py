"""Dialogues: generators that carry out a request of a user; they yield replies and questions, and receive the answers.
The robot's actor (`interfaces/actor`) runs them; the user's front end shows the replies and asks the questions. A
ticket is the user's handle for one request: any thread may use it while the robot carries out the request."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Collection, Generator
from contextlib import AbstractContextManager, suppress
from enum import Enum
from functools import partial
from threading import Lock
from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeAlias, TypeVar, cast

from msgspec import Struct

from vrs_cli.errors import EndOfInput, VrsError
from vrs_cli.values.questions import Answer, Confirmation, LineWanted, Parting, Question
from vrs_cli.values.results import Message, Tone

if TYPE_CHECKING:
    from vrs_cli.values.replies import Reply


class Slice(Enum):
    """A mark that a dialogue yields between two parts of its work, so that the actor can do other work. RUNNING: a
    program runs; the actor carries out the next event. MORE: the dialogue has more work to do."""

    RUNNING = "running"
    MORE = "more"


class Running(Struct, frozen=True):
    """Progress of a running program. `clock`: the time of the robot's clock that the program has reached [s]."""

    clock: float


class Reading(Struct, frozen=True):
    """Progress of reading a long file. `share`: the fraction that has been read, from 0 to 1."""

    path: str
    share: float


R = TypeVar("R", covariant=True)
W = TypeVar("W")


class Work:
    """A function call whose inputs do not change, so that another thread may `run` it while the actor does other work.
    `done`: the result; `error`: the exception of the function, if any."""

    def __init__(self, work: Callable[[], object]) -> None:
        self._work = work
        self.done: object = None
        self.error: BaseException | None = None

    def run(self) -> None:
        try:
            self.done = self._work()
        except BaseException as error:  # kept: `beside` raises it again inside the dialogue
            self.error = error


Said: TypeAlias = "Reply | Question | Slice | Work"
# a generator that yields replies and questions; it receives the answer to each Question, and None after all else
Dialogue = Generator[Said, Answer, R]


def quietly(act: Callable[[], W]) -> Dialogue[W]:
    """Turn a function into a dialogue that yields no replies and no questions."""
    yield from ()
    return act()


def beside(work: Callable[[], W]) -> Dialogue[W]:
    """Call a function whose inputs do not change, and return its result. If many users are served, another thread calls
    it. Raises the errors of the function."""
    it = Work(work)
    yield it
    if it.error is not None:
        try:
            raise it.error
        finally:
            # the traceback of the error refers to this frame: break the reference cycle, so that memory is freed
            it.error = None
    return cast(W, it.done)


def beside_if(long: bool, work: Callable[[], W]) -> Dialogue[W]:
    """Call a function whose inputs do not change, and return its result; by `beside` (maybe in another thread) if the
    work is `long`, otherwise directly."""
    return (yield from beside(work)) if long else work()


def within(context: Callable[[], AbstractContextManager[object]], dialogue: Dialogue[W]) -> Dialogue[W]:
    """Run a dialogue so that each part between two yields is inside its own context manager."""
    reaction: Answer | BaseException = None
    while True:
        with context():
            try:
                said = dialogue.throw(reaction) if isinstance(reaction, BaseException) else dialogue.send(reaction)
            except StopIteration as over:
                return cast(W, over.value)
        try:
            reaction = yield said
        except BaseException as error:  # the loop raises it inside the dialogue, so that the dialogue can clean up
            reaction = error


def in_parts(work: Generator[None, None, W]) -> Dialogue[W]:
    """Do work in parts, so that the actor can do other work in between. Return the result."""
    while True:
        try:
            next(work)
        except StopIteration as over:
            return cast(W, over.value)
        yield Slice.MORE


def at_once(dialogue: Dialogue[R]) -> R:
    """Run a dialogue that yields no replies and no questions. Return its result."""
    try:
        while True:
            said = next(dialogue)
            if isinstance(said, Work):
                said.run()
    except StopIteration as over:
        return cast(R, over.value)


class Terminal(Protocol):
    """A terminal: it shows the replies and asks the questions of a session to a person or a program, who types the
    lines."""

    @property
    def attended(self) -> bool:
        """Return whether a person is present, who would have to be asked before unsaved work is lost."""

    def show(self, reply: Reply) -> None:
        """Show a reply to a command, or a message from the robot."""

    def type(self, text: str, newline: bool) -> None:
        """Show text that a program prints with TYPE. `newline`: whether the line ends after the text."""

    def ask(self, question: Question) -> Answer:
        """Ask a question. Return the answer; None if nobody answers. Raises VrsError at the end of the input,
        KeyboardInterrupt for Ctrl-C."""

    def progress(self, doing: Running | Reading) -> None:
        """Show the progress of long work."""


class Notes:
    """A terminal for programs in Python: it collects replies instead of showing them, and gets answers from a
    function."""

    attended = False

    def __init__(self) -> None:
        self.begin(no_answer)

    def begin(self, answer: Answers) -> None:
        self._said: list[Reply] = []
        self._answer, self._line = answer, ""

    def take_all(self) -> tuple[Reply, ...]:
        """Return and remove all replies collected since `begin`."""
        if self._line:
            self.type("", newline=True)
        return tuple(self._said)

    def show(self, reply: Reply) -> None:
        self._said.append(reply)

    def type(self, text: str, newline: bool) -> None:
        self._line += text
        if newline:
            self._said.append(Message(self._line))
            self._line = ""

    def progress(self, doing: Running | Reading) -> None:
        """Show nothing, because nobody watches."""

    def ask(self, question: Question) -> Answer:
        """Return the answer to a question, parsed from its text. Raises EndOfInput if a program asks for a line
        (PROMPT) and there is no answer."""
        typed = self._answer(question)
        if isinstance(question, Confirmation | Parting):
            return None if typed is None else typed.strip().upper().startswith("Y")
        if typed is None and isinstance(question, LineWanted):
            raise EndOfInput(f"PROMPT {question.text!r} has nothing more to read", "give it one more answer")
        return typed


Answers = Callable[[Question], str | None]  # returns the typed answer to a question; None if there is no answer


def no_answer(_question: Question) -> None:
    """Return None for every question, because nobody is present to answer."""


T = TypeVar("T")

# the response of the user's side to a reply or question: the answer, or the error that occurred while showing it
Reaction = Answer | BaseException

# a function that the robot's thread calls with each reply and question of a request, and with None at its end
Outlet = Callable[["Ticket[Any]", "Reply | Question | None"], None]


class Ticket(Generic[T]):
    """A request of a user. `result` waits for the end of the request, and raises its error. Its replies and questions
    go to the `outlet`; without an outlet they are kept here until `take_said` reads them. The other fields are for the
    robot's thread. `dialogue` carries out the request; `by` is the user who sent it. `reaction`: the answer or error
    that is sent into the dialogue when it continues. `asked`: the id of its last question. `place`: the queue that
    holds the request; None while the request is running, and after its end. `put` queues calls of `react` and
    `withdraw` for the robot's thread."""

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
        # locked until the request ends (a Lock is faster than an Event, which makes fourteen calls)
        self._bell = Lock()
        self._bell.acquire()
        self._result: T | None = None
        self._error: BaseException | None = None

    # --- the user's side, in any thread ---

    def take_said(self) -> list[Reply | Question]:
        """Return and remove the replies and questions that have not been read yet."""
        there: list[Reply | Question] = []
        with suppress(IndexError):  # another thread may also take replies
            for _ in range(len(self._said)):
                there.append(self._said.popleft())
        return there

    def done(self) -> bool:
        return self._ended

    def error(self, timeout: float | None = None) -> BaseException | None:
        """Wait until the request has ended. Return its error, or None. Raises TimeoutError after `timeout` [s]."""
        if not self._bell.acquire(timeout=-1 if timeout is None else timeout):
            raise TimeoutError("the request has not ended")
        self._bell.release()
        return self._error

    def result(self, timeout: float | None = None) -> T:
        """Wait until the request has ended. Return its result. Raises the error of the request, and TimeoutError after
        `timeout` [s]."""
        if (error := self.error(timeout)) is not None:
            raise error
        return cast(T, self._result)

    def answer(self, question: int, answer: Answer) -> None:
        """Answer the question with the id `question`. An answer that arrives too late has no effect."""
        self._put(partial(self._react, self, answer, question))

    def throw(self, error: BaseException, question: int = 0) -> None:
        """Raise an error inside the dialogue of the request, because a reply could not be shown, or because the
        question with the id `question` could not be asked. The dialogue may handle the error and continue."""
        self._put(partial(self._react, self, error, question))

    def withdraw(self) -> None:
        """End the request early: its remaining work is not done."""
        self._put(partial(self._withdraw, self))

    # --- the robot's side ---

    def say(self, said: Reply | Question | None) -> None:
        if self._outlet is not None:
            self._outlet(self, said)
        elif said is not None:
            self._said.append(said)

    def end(self, result: T | None, error: BaseException | None = None) -> None:
        """End the request with a result or an error. The traceback of a VrsError is removed, because its frames refer
        to this ticket. This reference cycle would keep values (tokens, programs) in memory in a server, where the
        garbage collector does not visit old objects."""
        self._result, self._error = result, error.with_traceback(None) if isinstance(error, VrsError) else error
        self._ended = True
        self._bell.release()
        self.say(None)


class Waiting:
    """Requests that have not begun. The users take turns; the requests of one user begin in the order in which they
    were sent."""

    def __init__(self) -> None:
        # the users in the order of their turns
        self._by_user: dict[object, deque[Ticket[Any]]] = {}
        self.count = 0

    def append(self, ticket: Ticket[Any]) -> None:
        self._by_user.setdefault(ticket.by, deque()).append(ticket)
        self.count += 1

    def next(self, busy: Collection[object] = ()) -> Ticket[Any] | None:
        """Return the request to begin next, which is not from a `busy` user; None if there is none."""
        return next((own[0] for by, own in self._by_user.items() if by not in busy), None)

    def remove(self, ticket: Ticket[Any]) -> None:
        """Remove a request. The next turn of its user comes after the turns of all other users."""
        own = self._by_user.pop(ticket.by)
        own.remove(ticket)
        self.count -= 1
        if own:
            self._by_user[ticket.by] = own

    def all(self) -> list[Ticket[Any]]:
        return [ticket for own in self._by_user.values() for ticket in own]


def internal_error(error: BaseException, *, afar: bool = False) -> Message:
    """Write the traceback of an unexpected exception to a file, and return a message about it; the shell continues
    afterwards. `afar`: the user is remote, so the message gives only the name of that file, without its folder."""
    import tempfile  # imported only here, because these load many modules that few processes need
    import traceback

    report = "".join(traceback.format_exception(error))
    try:
        with tempfile.NamedTemporaryFile("w", prefix="vrs-", suffix=".txt", delete=False, encoding="utf-8") as file:
            file.write(report)
        place = (
            f"please tell whoever runs the server: {os.path.basename(file.name)}"
            if afar
            else f"please report it with {file.name}"
        )
    except OSError:
        place = "please report it"
    return Message(f"internal error: {type(error).__name__}: {error}; {place}", Tone.ERROR)
