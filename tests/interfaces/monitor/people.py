"""People at the prompt, what they are told, and programs for them."""

from __future__ import annotations

from typing import Any, TypeVar

from tests.interfaces.terminals import RecordingTerminal
from vrs_cli.interfaces.dialogue import Reading, Running
from vrs_cli.interfaces.session.session import Session
from vrs_cli.language.words.values import Kind, numbers_of
from vrs_cli.values.questions import Amendment, Answer, Question

R = TypeVar("R")
PART = "POINT part = TRANS(500,150,-100,90,90,0)"


PROGRAMS = """\
.PROGRAM main
    CALL helper
    CALL shared
    x = 1
.END
.PROGRAM helper
    y = x
    MOVE only.here
.END
.PROGRAM shared
    z = 1
.END
.PROGRAM other
    CALL shared
    z = x
.END
"""


class Person(RecordingTerminal):
    """Somebody at the terminal; None among the answers is Ctrl-C."""

    attended = True

    def __init__(self, *changes: str | None, sure: bool = True) -> None:
        super().__init__(sure=sure)
        self.changes = list(changes)
        self.progressed: list[Running | Reading] = []

    def progress(self, doing: Running | Reading) -> None:
        self.progressed.append(doing)

    def ask(self, question: Question) -> Answer:
        if not isinstance(question, Amendment):
            return bool(super().ask(question))
        self.asked.append(question.text)
        return self.changes.pop(0)


def at(terminal: RecordingTerminal, *lines: str) -> Session:
    session = Session(terminal)
    for line in lines:
        session.perform(line)
    return session


def last(session: Session, kind: type[R]) -> R:
    """The latest reply, which is of that kind."""
    reply = session.terminal.replies[-1]  # type: ignore[attr-defined]
    assert isinstance(reply, kind)
    return reply


def location(session: Session, name: str) -> list[float]:
    values = {variable.name: variable.value for kind in Kind for variable in session.environment.variables(kind)}
    value: Any = values[name]
    return [round(number, 6) for number in numbers_of(value)]


def loaded(terminal: RecordingTerminal) -> Session:
    session = Session(terminal)
    session.load_text(PROGRAMS)
    for line in ("x = 1", "y = 2", "z = 3", "SET only.here = TRANS(1,2,3)"):
        session.perform(line)
    return session
