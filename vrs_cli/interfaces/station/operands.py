"""The registry of handlers of monitor commands, functions that evaluate the operands of commands (values of
expressions, words typed at the prompt), and the questions asked before a program, a variable or a file is lost."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from vrs_cli.errors import FileError, FileExists, IllegalValue, NoProgramSpecified, TypeMismatch
from vrs_cli.interfaces.dialogue import Dialogue
from vrs_cli.language.run import runtime, variables
from vrs_cli.language.text.ast import BareWord, Call, Expression, Instruction, ProgramCall, Variable
from vrs_cli.language.words import monitor, values
from vrs_cli.values import numbers, questions, replies, results

if TYPE_CHECKING:
    from vrs_cli.interfaces.station.station import Station

NO_REPORT = ("no body has reported", "a body reports to a server: vrs body; in Python: r.report(t, joints)")
MAX_ROWS = 100_000  # refuse to make a table of times with more rows
MAX_NAMES = 10  # name at most this many programs or variables in a question
LONG_LIST = 100  # let another thread list more programs or variables than this
PLACES = (values.Kind.LOCATION, values.Kind.PRECISION)


# --- handlers --------------------------------------------------------------------------------------------------------

Handler = Callable[..., Dialogue[None] | Iterable[replies.Reply] | None]
"""A function that carries out a monitor command. Its arguments are the station, the checked instruction, and the
settings given to `handles`; it returns the replies and questions, or None for no reply.
"""
H = TypeVar("H", bound=Handler)
HANDLERS: dict[str, Handler] = {}  # the handler of each monitor command, by its name


def handles(*names: str, **settings: object) -> Callable[[H], H]:
    """Return a decorator that makes a function the handler of the monitor commands `names`. The handler is called with
    `settings` as additional arguments. Raises KeyError for a name without a row in `COMMANDS`."""

    def register(handler: H) -> H:
        HANDLERS.update({monitor.COMMANDS[name].name: partial(handler, **settings) for name in names})
        return handler

    return register


# --- operands --------------------------------------------------------------------------------------------------------


def real(station: Station, expression: Expression) -> float:
    """Return the current value of a real expression. Raises TypeMismatch for another kind of value, and
    ProgramError."""
    found = runtime.evaluate(station.environment, station.engine, expression)
    if not isinstance(found, float):
        raise TypeMismatch(f"a {values.kind_of_value(found).value}", "a real is wanted here")
    return found


def evaluator(station: Station, expression: Expression) -> Callable[[], numbers.Value]:
    """Return a function that evaluates an expression with the variables of the robot program."""
    watched = runtime.WatchedExpression(station.environment, station.engine, expression)
    return lambda: watched.value(own_variables(station))


def own_variables(station: Station) -> Mapping[str, variables.Reference]:
    """Return the arguments and the AUTO and LOCAL variables of the robot program (usually stopped), by key."""
    return {} if station.task is None else station.task.own


def operand(it: Instruction, index: int) -> Expression | None:
    """Return the argument with an index from 0; None if it was left out."""
    return it.arguments[index] if index < len(it.arguments) else None


def real_or(station: Station, it: Instruction, index: int, default: float) -> float:
    """Return the value of the real argument with an index from 0; `default` if it was left out."""
    given = operand(it, index)
    return default if given is None else real(station, given)


def moment(station: Station, it: Instruction) -> float:
    """Return the time given by AT t or IN dt [s]; the current time if no time is given."""
    at, within = it.modifiers.at, it.modifiers.within
    if at is not None:
        return real(station, at)
    return station.engine.now + (0.0 if within is None else real(station, within))


def word(expression: Expression | None) -> str:
    """Return a bare word (a file name, a program name) as typed. Raises NoProgramSpecified if there is none."""
    if isinstance(expression, BareWord):
        return expression.text
    if isinstance(expression, Variable | Call | ProgramCall):
        return expression.name
    raise NoProgramSpecified()


def word_or(it: Instruction, index: int, default: str = "") -> str:
    """Return the word at an index among the arguments; `default` if it was left out."""
    given = operand(it, index)
    return default if given is None else word(given)


def words(it: Instruction) -> list[str]:
    return [word(argument) for argument in it.arguments if argument is not None]


def path_of(station: Station, it: Instruction) -> Path:
    """Return the path of the file named by the first argument. Raises FileError, FileOutside."""
    return station.folder.path(word(operand(it, 0)))


def has_times(it: Instruction) -> bool:
    """Return whether a command has FROM, TO or STEP."""
    return any(operand(it, index) is not None for index in (1, 2, 3))


def times(station: Station, it: Instruction) -> Iterator[float]:
    """Yield the times t1, t1 + dt ... of FROM t1 TO t2 STEP dt, and t2 itself [s]. Raises IllegalValue."""
    first = real_or(station, it, 1, 0.0)
    last = real_or(station, it, 2, station.engine.end)
    if last < first:
        raise IllegalValue(f"FROM {values.plain(first)} TO {values.plain(last)}", "the first time comes first")
    step = real_or(station, it, 3, (last - first) / 10 or 1.0)
    if not step > 0.0 or (last - first) / step > MAX_ROWS:
        raise IllegalValue(f"STEP {values.plain(step)}", f"more than 0 s, for at most {MAX_ROWS} rows")
    for k in range(int((last - first) / step - 1e-9) + 1):
        yield first + k * step
    if last > first:
        yield last


def is_measured(operand: Expression | None) -> bool:
    """Return whether an operand is the word MEASURED, which selects the measured robot instead of a part or a
    branch."""
    return isinstance(operand, BareWord) and operand.text.upper() == monitor.MEASURED


# --- questions -------------------------------------------------------------------------------------------------------


def may_delete(station: Station, question: str) -> Dialogue[bool]:
    """Ask whether something may be deleted. If not, tell the user that nothing is deleted. After DISABLE INTERACTIVE
    return True without asking."""
    answer = yield from ask_yes_no(station, f"{question} Are you sure (Y/N)?")
    if answer is False:
        yield results.Message("Nothing is deleted")
    elif answer is None:
        yield results.Message(
            "*Not confirmed* nothing is deleted (DISABLE INTERACTIVE deletes without a question)", results.Tone.ERROR
        )
    return bool(answer)


def ask_yes_no(station: Station, question: str) -> Dialogue[bool | None]:
    """Ask a yes/no question. Return the answer; None if nobody answers. After DISABLE INTERACTIVE return True without
    asking."""
    if not station.engine.settings.switch("INTERACTIVE"):
        return True
    answer = yield questions.Confirmation(question)
    return None if answer is None else bool(answer)


@handles("EXIT", "QUIT")
def leave(station: Station, _it: Instruction | None = None) -> Dialogue[None]:
    """End the session. A person who is the only user of the robot is first asked about running and unsaved programs. A
    robot with other users continues, and keeps its memory."""
    if (
        station.user_state.attended
        and station.user_state is station.own_user_state
        and station.engine.settings.switch("INTERACTIVE")
    ):
        unstored, name_of = station.unstored, station.environment.name_of
        kinds_of = {"location": PLACES, "real": (values.Kind.REAL,), "string": (values.Kind.STRING,)}
        of_kinds = ((what, sorted(map(name_of, unstored.items(*kinds)))) for what, kinds in kinds_of.items())
        rows = (("program", unstored.programs()), *of_kinds)
        named = "; ".join(name_some(what, names) for what, names in rows if names and unstored.asked_about)
        lines = [f"{station.task.program} is running"] if station.task is not None and station.running else []
        lines += [f"Not stored: {named}. STORE file stores all"] if named else []
        leaves = "Leave without storing (Y/N)?" if named else "Leave (Y/N)?"
        if lines and not (yield questions.Parting(leaves, "\n".join(lines))):
            return
    yield replies.Farewell()


def name_some(what: str, names: list[str]) -> str:
    """Return a string such as `program pick` or `locations a, b`. If there are many names, it contains the first ones
    and says how many more there are."""
    more = f" and {len(names) - MAX_NAMES} more" if len(names) > MAX_NAMES else ""
    return f"{what}{'s' if len(names) > 1 else ''} {', '.join(names[:MAX_NAMES])}{more}"


def may_replace(station: Station, program: str) -> Dialogue[bool | None]:
    """Return whether a program may be stored under a name: none has the name yet, or the user agrees to replace it.
    Return None if nobody answers."""
    there = values.key_of(program) in station.programs
    return not there or (yield from ask_yes_no(station, f"Program {program} exists. Replace it (Y/N)?"))


def may_write(station: Station, path: Path) -> Dialogue[None]:
    """Ask before a file is overwritten. Raises FileExists if the user does not agree or nobody answers, FileError if
    the file is the journal of this session."""
    journal = station.journal
    if journal is not None and path.exists() and journal.exists() and path.samefile(journal):
        raise FileError(f"{path} holds all of this session already, and is being written", "name another file")
    if path.exists() and not (yield from ask_yes_no(station, f"{path} exists. Overwrite it (Y/N)?")):
        raise FileExists(str(path), "answer Y or name another file; DISABLE INTERACTIVE overwrites")
