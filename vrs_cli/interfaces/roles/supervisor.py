"""The supervisor: observer and designer in one, with programs, settings, branches and ABORT."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from threading import Lock
from typing import TypeVar
from weakref import finalize

from vrs_cli.dialogue.questions import Answer, Confirmation, LineWanted, Parting, Question
from vrs_cli.dialogue.replies import Message, Reply
from vrs_cli.dialogue.runs import RunResult
from vrs_cli.dialogue.talk import Reading, Running, Talk
from vrs_cli.engine.clock import SLICE, WallClock
from vrs_cli.engine.commands import Break, Request
from vrs_cli.engine.engine import Event
from vrs_cli.engine.feed import Subscription
from vrs_cli.errors import EndOfInput, ProgramNotExecutable, UsageError, VrsError
from vrs_cli.files.program_file import find_program_file, read_program_file
from vrs_cli.interfaces.actor.ticket import Ticket
from vrs_cli.interfaces.holders.holder import Holder
from vrs_cli.interfaces.roles.designer import Designer
from vrs_cli.interfaces.roles.observer import Observer
from vrs_cli.interfaces.session.session import Session
from vrs_cli.language.run.prompt import arguments_of, evaluate
from vrs_cli.language.text.ast import DoInstruction, Expression, Instruction, Variable
from vrs_cli.language.text.diagnostics import Severity
from vrs_cli.language.text.parser import parse_prompt
from vrs_cli.language.words.values import Value

PATIENCE = 0.005  # [s] between two looks whether another thread, which drives the robot, has done what was asked for
T = TypeVar("T")

Answers = Callable[[Question], str | None]  # what is typed after a question; None where nobody answers


def no_answer(_question: Question) -> None:
    """Nobody is there to be asked."""


class Notes:
    """A terminal that keeps what is said."""

    attended = False

    def __init__(self) -> None:
        self.begin(no_answer)

    def begin(self, answer: Answers) -> None:
        self._said: list[Reply] = []
        self._answer, self._line = answer, ""

    def taken(self) -> tuple[Reply, ...]:
        """All that was said since."""
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
        """Raises EndOfInput where a program is not answered."""
        answer = self._answer(question)
        if isinstance(question, Confirmation | Parting):
            return None if answer is None else answer.strip().upper().startswith("Y")
        if answer is None and isinstance(question, LineWanted):
            raise EndOfInput(f"PROMPT {question.text!r} has nothing more to read", "give it one more answer")
        return answer


class Supervisor(Observer, Designer):
    """Holds a robot. Metres, radians, seconds. What the robot refuses is raised as VrsError.

    Any thread may call any method: one thing is done at a time, in the order in which it was asked for. Who waits for
    the end of something drives the robot meanwhile, unless another thread does already.
    """

    def __init__(self, session: Session, notes: Notes) -> None:
        holder = Holder(session)
        holder.desk = session.desk
        Observer.__init__(self, holder)
        Designer.__init__(self, self._perform)
        self._holder, self._session, self._notes = holder, session, notes
        self._driving = Lock()
        self._talking = Lock()  # what is typed has one place

    def alone(self, work: Callable[[Session], T]) -> T:
        """Do something with the session while nobody else changes anything; what comes of it."""
        return self._end(self._holder.call(work))

    def done(self, work: Callable[[Session], Talk[T]]) -> T:
        """What comes of a talk with the session."""
        return self._end(self._holder.submit(work(self._session)))

    def _end(self, ticket: Ticket[T]) -> T:
        """Wait until a request is over; what comes of it. A refusal does not show how the robot works inside."""
        try:
            return self._drive(ticket)
        except VrsError as refusal:
            raise refusal.with_traceback(None) from None

    def _drive(self, ticket: Ticket[T]) -> T:
        """Let the robot do what is due, unless another thread does, until a request is over."""
        while not ticket.done():
            if self._driving.acquire(timeout=PATIENCE):
                try:
                    return self._session.actor.finish(ticket, self._notes)
                finally:
                    self._driving.release()
            self._hear(ticket)
        self._hear(ticket)
        return ticket.result()

    def _hear(self, ticket: Ticket[T]) -> None:
        """What was said while another thread drove."""
        for said in ticket.heard():
            self._session.actor.put(said, ticket, self._notes)

    def _perform(self, request: Request, issued: float | None) -> None:
        def work(session: Session) -> None:
            engine = session.engine
            engine.clock.advance(engine.begin(request, program=False, issued=issued))

        self.alone(work)

    def wait(self) -> None:
        """Wait until the robot stands: in real time as long as that takes. Others may ask for something meanwhile.

        Raises ClockPaused where the clock stands.
        """
        clock = self._session.engine.clock
        while isinstance(clock, WallClock) and not clock.paused and (left := self.timeline.end - clock.reached) > 0.0:
            time.sleep(min(left / clock.rate, SLICE))
        self.perform(Break(), None)

    def abort(self) -> None:
        """Stop the program and the motion now, before all else that was asked for."""
        self._end(self._holder.call(Session.abort, urgent=True))

    def say(self, line: str, answer: Answers) -> tuple[Reply, ...]:
        """A line of the prompt; what is answered, and typed. `answer`: to what it asks. Raises LineRefused."""
        with self._talking:
            self._notes.begin(answer)
            self._end(self._holder.ask(line))
            return self._notes.taken()

    def talk(self, work: Callable[[Session], object], answer: Answers) -> tuple[Reply, ...]:
        """Drive the session from outside, as a prompt does; all that is answered and typed meanwhile."""
        with self._talking, self._driving:
            self._notes.begin(answer)
            work(self._session)
            return self._notes.taken()

    def define(self, text: str) -> tuple[str, ...]:
        """Put the programs and variables of a text in memory; the names of its programs.

        Raises ProgramNotExecutable for a text with mistakes, which names the first.
        """
        return self.alone(lambda session: _define(session, text, "line "))

    def load(self, path: str | Path) -> tuple[str, ...]:
        """Put the programs and variables of a file in memory; the names of its programs.

        Raises NonexistentFile, FileError, and ProgramNotExecutable for a file with mistakes.
        """
        found = find_program_file(Path(path))
        text = read_program_file(found)
        return self.alone(lambda session: _define(session, text, f"{found}:"))

    def execute(self, program: str, cycles: int, answer: Answers) -> RunResult:
        """Execute a program in memory; `answer`: to its PROMPTs. What goes wrong in it is in the result.

        Raises UndefinedName, ProgramNotExecutable, ArgumentMismatch.
        """

        def until_its_end(session: Session) -> Talk[RunResult]:
            return (yield from session.wait(session.begin(program, cycles=cycles)))

        with self._talking:
            self._notes.begin(answer)
            return self.done(until_its_end)

    def subscribe(self) -> Subscription[Event]:
        """The timeline, and every change of it from then on; it ends with the robot."""
        subscription = self._end(self._holder.subscribe())
        finalize(self, subscription.end)
        return subscription

    def value(self, expression: str) -> Value:
        """What an expression is now. Raises LineRefused, ProgramError."""

        def work(session: Session) -> Value:
            return evaluate(session.environment, session.robot, _expression(session, expression))

        return self.alone(work)

    def assign(self, variable: str, value: Value) -> None:
        """Give a variable, or an element of an array, a value. Raises UsageError, LineRefused, TypeMismatch."""

        def work(session: Session) -> None:
            target = _expression(session, variable)
            if not isinstance(target, Variable) or target.grouped:
                raise UsageError(f"{variable} is no variable", "a name, or row[3]")
            (reference,) = arguments_of(session.environment, session.robot, (target,))
            assert reference is not None
            reference.assign(value)

        self.alone(work)


def _expression(session: Session, text: str) -> Expression:
    """Raises LineRefused, and UsageError for what is a command."""
    line = parse_prompt(f"TYPE {text}", session.names())
    typed = line.statement if isinstance(line, DoInstruction) else None
    arguments = typed.arguments if isinstance(typed, Instruction) else ()
    if len(arguments) != 1 or arguments[0] is None:
        raise UsageError(f"{text} is no expression", "one variable or one expression")
    return arguments[0]


def _define(session: Session, text: str, where: str) -> tuple[str, ...]:
    before = dict(session.programs)
    wrong = [one for one in session.load_text(text) if one.severity is Severity.ERROR]
    if wrong:
        more = f", and {len(wrong) - 1} more mistakes" if len(wrong) > 1 else ""
        raise ProgramNotExecutable(f"{where}{wrong[0].span.line}: {wrong[0].message}{more}")
    return tuple(stored.name for key, stored in session.programs.items() if before.get(key) is not stored)
