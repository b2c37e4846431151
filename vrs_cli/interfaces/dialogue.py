"""Dialogues: generators of replies and questions, which are sent the answers. The robot's actor drives them
(`interfaces/actor`); the robot's user shows, asks and answers.
"""

from __future__ import annotations

from collections.abc import Callable, Generator
from contextlib import AbstractContextManager
from enum import Enum
from typing import Protocol, TypeVar, cast

from msgspec import Struct

from vrs_cli.errors import EndOfInput
from vrs_cli.values.questions import Answer, Confirmation, LineWanted, Parting, Question
from vrs_cli.values.replies import Message, Reply


class Slice(Enum):
    """A part of the work is done, and whoever drives may do something else now. RUNNING: a program runs, and whoever
    drives lets the next thing happen; MORE: there is more to do.
    """

    RUNNING = "running"
    MORE = "more"


class Running(Struct, frozen=True):
    """A program has come to that time of the robot's clock [s]."""

    clock: float


class Reading(Struct, frozen=True):
    """The share of a long file that has been read, from 0 to 1."""

    path: str
    share: float


R = TypeVar("R", covariant=True)
W = TypeVar("W")


class Work:
    """On values that do not change: whoever drives may let another thread `run` it, and does other things
    meanwhile.
    """

    def __init__(self, work: Callable[[], object]) -> None:
        self._work = work
        self.done: object = None
        self.error: BaseException | None = None

    def run(self) -> None:
        try:
            self.done = self._work()
        except BaseException as error:  # raised in the dialogue
            self.error = error


Said = Reply | Question | Slice | Work
Dialogue = Generator[Said, Answer, R]
"""What comes of a line: each Question is sent its answer, everything else None."""


def quietly(act: Callable[[], W]) -> Dialogue[W]:
    """Make a dialogue of a function that says nothing."""
    yield from ()
    return act()


def beside(work: Callable[[], W]) -> Dialogue[W]:
    """Do work on values that do not change, perhaps in another thread, and return its result. Raises its errors."""
    it = Work(work)
    yield it
    if it.error is not None:
        try:
            raise it.error
        finally:
            it.error = None  # its traceback refers to this frame: no cycle is left
    return cast(W, it.done)


def beside_if(long: bool, work: Callable[[], W]) -> Dialogue[W]:
    """Do work on values that do not change, in another thread only where it is `long`; return its result."""
    return (yield from beside(work)) if long else work()


def within(context: Callable[[], AbstractContextManager[object]], dialogue: Dialogue[W]) -> Dialogue[W]:
    """Do each part of a dialogue within a context."""
    reaction: Answer | BaseException = None
    while True:
        with context():
            try:
                said = dialogue.throw(reaction) if isinstance(reaction, BaseException) else dialogue.send(reaction)
            except StopIteration as over:
                return cast(W, over.value)
        try:
            reaction = yield said
        except BaseException as error:  # for the dialogue, which puts in order what it leaves
            reaction = error


def in_parts(work: Generator[None, None, W]) -> Dialogue[W]:
    """Do work a part at a time, and return its result."""
    while True:
        try:
            next(work)
        except StopIteration as over:
            return cast(W, over.value)
        yield Slice.MORE


def at_once(dialogue: Dialogue[R]) -> R:
    """Carry out a dialogue that has no replies and no questions, and return its result."""
    try:
        while True:
            said = next(dialogue)
            if isinstance(said, Work):
                said.run()
    except StopIteration as over:
        return cast(R, over.value)


class Terminal(Protocol):
    """A terminal, at which a person or a program drives a session."""

    @property
    def attended(self) -> bool:
        """Return whether a person is there, who would lose what no file has."""

    def show(self, reply: Reply) -> None:
        """An answer to a command, or what the robot says by itself."""

    def type(self, text: str, newline: bool) -> None:
        """Show text that programs TYPE."""

    def ask(self, question: Question) -> Answer:
        """Ask a question, and return the answer; None where nobody answers. Raises VrsError where there is no more
        input, KeyboardInterrupt for Ctrl-C.
        """

    def progress(self, doing: Running | Reading) -> None:
        """Show how far long work has come."""


class Notes:
    """A terminal that keeps what is said."""

    attended = False

    def __init__(self) -> None:
        self.begin(no_answer)

    def begin(self, answer: Answers) -> None:
        self._said: list[Reply] = []
        self._answer, self._line = answer, ""

    def taken(self) -> tuple[Reply, ...]:
        """Return all replies since `begin`."""
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
        """Nobody watches."""

    def ask(self, question: Question) -> Answer:
        """Return the meaning of a typed answer. Raises EndOfInput where a program is not answered."""
        typed = self._answer(question)
        if isinstance(question, Confirmation | Parting):
            return None if typed is None else typed.strip().upper().startswith("Y")
        if typed is None and isinstance(question, LineWanted):
            raise EndOfInput(f"PROMPT {question.text!r} has nothing more to read", "give it one more answer")
        return typed


Answers = Callable[[Question], str | None]  # what is typed after a question; None where nobody answers


def no_answer(_question: Question) -> None:
    """Nobody is there to be asked."""
