"""Operands of monitor commands: values of expressions and words that are typed at the prompt; and the questions that
commands ask before a program, a variable or a file is lost.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from vrs_cli.errors import IllegalValue, NoProgramSpecified, TypeMismatch
from vrs_cli.interfaces.dialogue import Dialogue
from vrs_cli.language.run.runtime import WatchedExpression, evaluate
from vrs_cli.language.run.variables import Reference
from vrs_cli.language.text.ast import BareWord, Call, Expression, Instruction, ProgramCall, Variable
from vrs_cli.language.words.monitor import MEASURED
from vrs_cli.language.words.values import kind_of_value, plain
from vrs_cli.values.numbers import Value
from vrs_cli.values.replies import Reply

if TYPE_CHECKING:
    from vrs_cli.interfaces.station.station import Station
from typing import TYPE_CHECKING

from vrs_cli.errors import FileError, FileExists
from vrs_cli.language.words.values import Kind, key_of
from vrs_cli.values.questions import Confirmation, Parting
from vrs_cli.values.replies import Farewell, Message, Tone

if TYPE_CHECKING:
    from vrs_cli.interfaces.station.station import Station


NO_REPORT = ("no body has reported", "a body reports to a server: vrs body; in Python: r.report(t, joints)")
MOST_ROWS = 100_000
DEFAULT_ROWS = 10
Handler = Callable[["Station", Instruction], Dialogue[None] | Iterable[Reply] | None]  # None: no answer


def value(station: Station, expression: Expression) -> Value:
    """The present value of an expression. Raises ProgramError."""
    return evaluate(station.environment, station.engine, expression)


def real(station: Station, expression: Expression) -> float:
    """The present value of a real expression. Raises TypeMismatch for another kind of value."""
    found = value(station, expression)
    if not isinstance(found, float):
        raise TypeMismatch(f"a {kind_of_value(found).value}", "a real is wanted here")
    return found


def sight(station: Station, expression: Expression) -> Callable[[], Value]:
    """Return a function that evaluates an expression as the program that has stopped sees it."""
    seen = WatchedExpression(station.environment, station.engine, expression)
    return lambda: seen.value(own(station))


def own(station: Station) -> Mapping[str, Reference]:
    """The own variables of the program that has stopped: its arguments, and the variables of AUTO and LOCAL."""
    return {} if station.task is None else station.task.own


def operand(it: Instruction, index: int) -> Expression | None:
    return it.arguments[index] if index < len(it.arguments) else None


def real_or(station: Station, it: Instruction, index: int, default: float) -> float:
    given = operand(it, index)
    return default if given is None else real(station, given)


def moment(station: Station, it: Instruction) -> float:
    """AT t, IN dt, or now [s]."""
    at, within = it.modifiers.at, it.modifiers.within
    if at is not None:
        return real(station, at)
    return station.engine.now + (0.0 if within is None else real(station, within))


def word(expression: Expression | None) -> str:
    """The name of a file or a program, or another bare word, as it was typed."""
    if isinstance(expression, BareWord):
        return expression.text
    if isinstance(expression, Variable | Call | ProgramCall):
        return expression.name
    raise NoProgramSpecified()


def path_of(station: Station, it: Instruction) -> Path:
    """Raises FileError, FileOutside."""
    return station.folder.path(word(operand(it, 0)))


def times(station: Station, it: Instruction) -> Iterator[float]:
    """FROM t1 TO t2 STEP dt, and the exact end [s]. Raises IllegalValue."""
    first = real_or(station, it, 1, 0.0)
    last = real_or(station, it, 2, station.engine.end)
    if last < first:
        raise IllegalValue(f"FROM {plain(first)} TO {plain(last)}", "the first time comes first")
    step = real_or(station, it, 3, (last - first) / DEFAULT_ROWS or 1.0)
    if not step > 0.0 or (last - first) / step > MOST_ROWS:
        raise IllegalValue(f"STEP {plain(step)}", f"more than 0 s, for at most {MOST_ROWS} rows")
    for k in range(int((last - first) / step - 1e-9) + 1):
        yield first + k * step
    if last > first:
        yield last


def is_measured(asked: Expression | None) -> bool:
    """Return whether an operand is MEASURED: the measured robot, and no part or branch."""
    return isinstance(asked, BareWord) and asked.text.upper() == MEASURED


def agreed(station: Station, question: str) -> Dialogue[bool]:
    """Ask whether something may be deleted; yes after DISABLE INTERACTIVE. Where it may not, the user is told."""
    answer = yield from confirmed(station, f"{question} Are you sure (Y/N)?")
    if answer is False:
        yield Message("Nothing is deleted")
    elif answer is None:
        what = "*Not confirmed* nothing is deleted (DISABLE INTERACTIVE deletes without a question)"
        yield Message(what, Tone.ERROR)
    return bool(answer)


def confirmed(station: Station, question: str) -> Dialogue[bool | None]:
    """Ask, and return the answer, None where there is none. After DISABLE INTERACTIVE yes, without a question."""
    if not station.engine.settings.switch("INTERACTIVE"):
        return True
    answer = yield Confirmation(question)
    return None if answer is None else bool(answer)


def leave(station: Station) -> Dialogue[None]:
    """EXIT: say Farewell, once the user knows what is not stored; at once where no person is there, or where the robot
    goes on for other users, with all that it has in memory.
    """
    if (
        station.user_state.attended
        and station.user_state is station.own_user_state
        and station.engine.settings.switch("INTERACTIVE")
    ):
        unstored, name_of = station.unstored, station.environment.name_of
        rows = [("program", unstored.programs())]
        for what, kinds in (("location", PLACES), ("real", (Kind.REAL,)), ("string", (Kind.STRING,))):
            rows.append((what, sorted(map(name_of, unstored.items(*kinds)))))
        named = "; ".join(listed(what, names) for what, names in rows if names and unstored.asked_about)
        told = [f"{station.task.program} is running"] if station.task is not None and station.running else []
        told += [f"Not stored: {named}. STORE file stores all"] if named else []
        leaves = "Leave without storing (Y/N)?" if named else "Leave (Y/N)?"
        if told and not (yield Parting(leaves, "\n".join(told))):
            return
    yield Farewell()


MOST_NAMED = 10
PLACES = (Kind.LOCATION, Kind.PRECISION)


def listed(what: str, names: list[str]) -> str:
    """`program pick`, `locations a, b`, the first few of many."""
    more = f" and {len(names) - MOST_NAMED} more" if len(names) > MOST_NAMED else ""
    return f"{what}{'s' if len(names) > 1 else ''} {', '.join(names[:MOST_NAMED])}{more}"


def may_replace(station: Station, program: str) -> Dialogue[bool | None]:
    """Return whether a program of that name may be put in memory: there is none, or the user agrees. None where nobody
    answers.
    """
    if key_of(program) not in station.programs:
        return True
    return (yield from confirmed(station, f"Program {program} exists. Replace it (Y/N)?"))


def may_write(station: Station, path: Path) -> Dialogue[None]:
    """Ask before a file is overwritten. Raises FileExists where the user does not agree or nobody answers, FileError
    for the journal of this session.
    """
    journal = station.journal
    if journal is not None and path.exists() and journal.exists() and path.samefile(journal):
        raise FileError(f"{path} holds all of this session already, and is being written", "name another file")
    if path.exists() and not (yield from confirmed(station, f"{path} exists. Overwrite it (Y/N)?")):
        raise FileExists(str(path), "answer Y or name another file; DISABLE INTERACTIVE overwrites")
