"""What is asked of a robot by value: what a line of the prompt says in words and digits, to the bit.

An act is data, and goes over a connection; `act_on` carries it out in a session. The role that it needs is that of the
word that does the same.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping
from typing import Any, NamedTuple, TypeVar, cast

from vrs_cli.engine.book import Parts
from vrs_cli.errors import IllegalValue, ProgramNotExecutable, UsageError
from vrs_cli.files.trajectory_file import trajectory_lines
from vrs_cli.interfaces.dialogue import Dialogue, beside, in_parts
from vrs_cli.interfaces.monitor.locations import explained
from vrs_cli.interfaces.monitor.timeline import branch_table, comparison, motions
from vrs_cli.interfaces.rights import CHANGE, check_goes_beside, role_of
from vrs_cli.interfaces.session.session import Session
from vrs_cli.interfaces.session.survey import show_branch, survey
from vrs_cli.interfaces.tasks.holder_times import move_of
from vrs_cli.language.run.runtime import arguments_of, evaluate
from vrs_cli.language.text.ast import DoInstruction, Expression, Instruction, Variable
from vrs_cli.language.text.parser import parse_prompt
from vrs_cli.language.words.word import Role
from vrs_cli.values.acts import (
    Assign,
    CommandList,
    Compare,
    Define,
    Defined,
    Evaluate,
    Execute,
    Explain,
    Go,
    ListBranches,
    ListCommands,
    ListMotions,
    Record,
    Recorded,
    Redo,
    Rest,
    Say,
    Survey,
    Undo,
    Valued,
    _finite,
)
from vrs_cli.values.commands import Break
from vrs_cli.values.diagnostics import Severity
from vrs_cli.values.motion import (
    JointTarget,
    PoseTarget,
)
from vrs_cli.values.replies import ReachReport
from vrs_cli.values.results import RunResult
from vrs_cli.values.tagged import Act
from vrs_cli.wire.snapshots import ShowBranch

T = TypeVar("T", covariant=True)


def act_on(session: Session, act: Act[T]) -> Dialogue[T]:
    """Do it; what comes of it. Raises RoleWanted, LeaseHeld, and UsageError for what has to wait until the program
    stops, as a line does; VrsError.
    """
    if isinstance(act, Say):
        return cast(T, (yield from session.answers(act.line)))
    row = ACTS[type(act)]
    session.check_may(row.said, row.role)
    session.settle()  # what is before now has happened
    if session.running or session.elsewhere:
        check_goes_beside(row.said, row.role, elsewhere=session.elsewhere)
    return cast(T, (yield from session.on_branch(row.role, row.dialogue(session, act))))


def _go(session: Session, act: Go) -> None:
    for number in (act.executed, act.speed):
        _finite(() if number is None else (number,))
    if act.speed is not None and not 0.0 < act.speed <= 1.0:
        raise IllegalValue(f"{act.speed:g} of nominal speed", "more than 0, at most 1", value=act.speed)
    move = move_of(act, session.user_state.times)
    session.engine.clock.advance(session.engine.begin(move, program=False, issued=session.user_state.issued))


def _rest(session: Session, _act: Rest) -> None:
    clock = session.engine.clock
    if clock.paused or not clock.realtime:
        session.engine.perform(Break())


def _through_history(work: Parts[tuple[str, ...]]) -> Dialogue[None]:
    """UNDO, REDO."""
    yield from in_parts(work)


def _explain(session: Session, act: Explain) -> Dialogue[ReachReport]:
    target = act.goal.target
    if not isinstance(target, PoseTarget | JointTarget):
        raise UsageError("WHY of no place", "WHY explains a location")
    return explained(session, target, act.name)


def _evaluate(session: Session, act: Evaluate) -> Valued:
    return Valued.of(evaluate(session.environment, session.engine, _expression(session, act.expression)))


def _assign(session: Session, act: Assign) -> None:
    target = _expression(session, act.variable)
    if not isinstance(target, Variable) or target.grouped:
        raise UsageError(f"{act.variable} is no variable", "a name, or row[3]")
    (reference,) = arguments_of(session.environment, session.engine, (target,))
    assert reference is not None
    reference.assign(act.value.value)


def _expression(session: Session, text: str) -> Expression:
    """Raises LineRefused, and UsageError for what is a command."""
    line = parse_prompt(f"TYPE {text}", session.names())
    typed = line.statement if isinstance(line, DoInstruction) else None
    arguments = typed.arguments if isinstance(typed, Instruction) else ()
    if len(arguments) != 1 or arguments[0] is None:
        raise UsageError(f"{text} is no expression", "one variable or one expression")
    return arguments[0]


def _define(session: Session, act: Define) -> Dialogue[Defined]:
    loaded = yield from session.loaded(act.text)
    before = dict(session.programs)
    session.take(loaded)
    wrong = [one for one in loaded.diagnostics if one.severity is Severity.ERROR]
    if wrong:
        more = f", and {len(wrong) - 1} more mistakes" if len(wrong) > 1 else ""
        raise ProgramNotExecutable(f"{act.where}{wrong[0].span.line}: {wrong[0].message}{more}")
    return Defined(tuple(stored.name for key, stored in session.programs.items() if before.get(key) is not stored))


def _execute(session: Session, act: Execute) -> Dialogue[RunResult]:
    yield from session.compiled(act.program)
    return (yield from session.wait(session.begin(act.program, cycles=act.cycles)))


def _record(session: Session, _act: Record) -> Dialogue[Recorded]:
    engine = session.engine
    course = engine.model, engine.book.initial, engine.book.deltas.copy()
    return Recorded((yield from beside(lambda: b"".join(trajectory_lines(*course)))))


def _list_commands(session: Session, _act: ListCommands) -> Dialogue[CommandList]:
    return CommandList((yield from beside(session.engine.book.all_records())))


class _Row(NamedTuple):
    """How an act is called, the role that it needs, and how it is done: what comes of it, or a talk that tells that."""

    said: str
    role: Role
    do: Callable[[Session, Any], object]

    def dialogue(self, session: Session, act: Act[Any]) -> Dialogue[object]:
        found = self.do(session, act)
        return (yield from found) if isinstance(found, Generator) else found


def _as(word: str, do: Callable[[Session, Any], object]) -> _Row:
    """An act that does what a word does."""
    return _Row(word, role_of(word), do)


ACTS: Mapping[type[Act[Any]], _Row] = {
    Go: _as("MOVE", _go),
    Rest: _as("BREAK", _rest),
    Undo: _as("UNDO", lambda session, act: _through_history(session.engine.undoing(act.count))),
    Redo: _as("REDO", lambda session, act: _through_history(session.engine.redoing(act.count))),
    Explain: _as("WHY", _explain),
    Compare: _as("COMPARE", lambda session, act: comparison(session, act.a, act.b)),
    Evaluate: _Row("a look at a value", Role.OBSERVER, _evaluate),
    Assign: _Row(CHANGE, Role.SUPERVISOR, _assign),
    Define: _as("LOAD", _define),
    Execute: _as("EXECUTE", _execute),
    ListCommands: _as("TIMELINE", _list_commands),
    ListBranches: _Row("a look at the branches", Role.OBSERVER, lambda session, _act: branch_table(session)),
    ListMotions: _as("TIMELINE", lambda session, _act: motions(session)),
    Record: _Row("a look at the trajectory", Role.OBSERVER, _record),
    Survey: _Row("a survey", Role.OBSERVER, survey),
    ShowBranch: _Row("a look at a branch", Role.OBSERVER, show_branch),
}
