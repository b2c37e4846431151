"""The supervisor: observer and designer in one, with programs, settings, branches and ABORT."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Protocol, TypeVar

from vrs_cli.dialogue.questions import Answer, Confirmation, LineWanted, Parting, Question
from vrs_cli.dialogue.replies import Message, Reply
from vrs_cli.dialogue.talk import Reading, Running
from vrs_cli.engine.commands import Break, Request
from vrs_cli.errors import EndOfInput, ProgramNotExecutable, UsageError
from vrs_cli.files.program_file import find_program_file, read_program_file
from vrs_cli.interfaces.roles.designer import Designer
from vrs_cli.interfaces.roles.observer import Observer
from vrs_cli.interfaces.session.session import Session
from vrs_cli.interfaces.tasks.runs import RunResult
from vrs_cli.language.run.prompt import arguments_of, evaluate
from vrs_cli.language.text.ast import DoInstruction, Expression, Instruction, Variable
from vrs_cli.language.text.diagnostics import Severity
from vrs_cli.language.text.parser import parse_prompt
from vrs_cli.language.words.values import Value

T = TypeVar("T")


Answers = Callable[[Question], str | None]  # what is typed after a question; None where nobody answers


def no_answer(_question: Question) -> None:
    """Nobody is there to be asked."""


class Lends(Protocol):
    """Lets one piece of work at a time have the session of a robot, and gives back what comes of it."""

    def __call__(self, work: Callable[[Session], T], /) -> T: ...


class Notes:
    """A terminal that keeps what is said."""

    attended = False

    def __init__(self) -> None:
        self.begin(no_answer)

    def begin(self, answer: Answers) -> None:
        self.said: list[Reply] = []
        self._answer, self._line = answer, ""

    def show(self, reply: Reply) -> None:
        self.said.append(reply)

    def type(self, text: str, newline: bool) -> None:
        self._line += text
        if newline:
            self.said.append(Message(self._line))
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
    """Metres, radians, seconds. What the robot refuses is raised as VrsError."""

    def __init__(self, session: Session, notes: Notes, lends: Lends) -> None:
        Observer.__init__(self, session.engine)
        Designer.__init__(self, self._perform)
        self.alone, self._notes = lends, notes

    def _perform(self, request: Request, issued: float | None) -> None:
        def work(session: Session) -> None:
            engine = session.engine
            engine.clock.advance(engine.begin(request, program=False, issued=issued))

        self.alone(work)

    def wait(self) -> None:
        """Wait until the robot stands: in real time as long as that takes."""
        self.perform(Break(), None)

    def abort(self) -> None:
        """Stop the program and the motion now."""
        self.alone(Session.abort)

    def say(self, line: str, answer: Answers) -> tuple[Reply, ...]:
        """A line of the prompt; what is answered, and typed. `answer`: to what it asks. Raises LineRefused."""
        return self.talk(lambda session: session.perform(line), answer)

    def talk(self, work: Callable[[Session], object], answer: Answers) -> tuple[Reply, ...]:
        """Do something with the session; all that is answered and typed meanwhile."""

        def noted(session: Session) -> tuple[Reply, ...]:
            self._notes.begin(answer)
            work(session)
            return tuple(self._notes.said)

        return self.alone(noted)

    def define(self, text: str) -> tuple[str, ...]:
        """Put the programs and variables of a text in memory; the names of its programs.

        Raises ProgramNotExecutable for a text with mistakes, which names the first.
        """
        return self.alone(lambda session: _defined(session, text, "line "))

    def load(self, path: str | Path) -> tuple[str, ...]:
        """Put the programs and variables of a file in memory; the names of its programs.

        Raises NonexistentFile, FileError, and ProgramNotExecutable for a file with mistakes.
        """
        found = find_program_file(Path(path))
        text = read_program_file(found)
        return self.alone(lambda session: _defined(session, text, f"{found}:"))

    def execute(self, program: str, cycles: int, answer: Answers) -> RunResult:
        """Execute a program in memory; `answer`: to its PROMPTs. What goes wrong in it is in the result.

        Raises UndefinedName, ProgramNotExecutable, ArgumentMismatch.
        """

        def work(session: Session) -> RunResult:
            self._notes.begin(answer)
            return session.execute(program, cycles=cycles)

        return self.alone(work)

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


def _defined(session: Session, text: str, where: str) -> tuple[str, ...]:
    before = dict(session.programs)
    wrong = [one for one in session.load_text(text) if one.severity is Severity.ERROR]
    if wrong:
        more = f", and {len(wrong) - 1} more mistakes" if len(wrong) > 1 else ""
        raise ProgramNotExecutable(f"{where}{wrong[0].span.line}: {wrong[0].message}{more}")
    return tuple(stored.name for key, stored in session.programs.items() if before.get(key) is not stored)
