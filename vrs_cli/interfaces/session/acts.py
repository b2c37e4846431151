"""What is asked of a robot by value: what a line of the prompt says in words and digits, to the bit.

An act is data, and goes over a connection; `act_on` carries it out in a session. The role that it needs is that of the
word that does the same.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping
from math import isfinite
from typing import Any, NamedTuple, TypeVar, cast

from msgspec import Struct

from vrs_cli.dialogue.replies import BranchTable, ComparisonTable, ReachReport, TimelineTable
from vrs_cli.dialogue.runs import RunResult
from vrs_cli.dialogue.spoken import Act, Spoken
from vrs_cli.dialogue.talk import Talk, beside, in_parts
from vrs_cli.engine.commands import Break, JointTarget, Move, NamedTarget, PoseTarget, Stamp, Target
from vrs_cli.engine.history import CommandRecord
from vrs_cli.errors import IllegalValue, ProgramNotExecutable, UsageError
from vrs_cli.files.trajectory_file import trajectory_lines
from vrs_cli.interfaces.monitor.locations import explained
from vrs_cli.interfaces.monitor.timeline import branch_table, comparison, motions
from vrs_cli.interfaces.rights import CHANGE, check_goes_beside, role_of
from vrs_cli.interfaces.session.session import Session
from vrs_cli.interfaces.session.survey import BranchShown, ShowBranch, Survey, Surveyed, show_branch, survey
from vrs_cli.interfaces.tasks.holder_times import HolderTimes
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.transform import Transform
from vrs_cli.language.run.prompt import arguments_of, evaluate
from vrs_cli.language.text.ast import DoInstruction, Expression, Instruction, Variable
from vrs_cli.language.text.diagnostics import Severity
from vrs_cli.language.text.parser import parse_prompt
from vrs_cli.language.words.values import LIMIT, Value
from vrs_cli.language.words.word import Role
from vrs_cli.trajectory.motion import AlignedTarget, JointOffsetTarget, ToolOffsetTarget
from vrs_cli.wire.records import is_rotation

T = TypeVar("T", covariant=True)


# --- parts ----------------------------------------------------------------------------------------------------------


class Goal(Struct, frozen=True, omit_defaults=True):
    """Where a motion goes: exactly one of these. `joint` is changed by `change`; `offset` is that of DEPART."""

    pose: Transform | None = None
    joints: Joints | None = None
    named: str | None = None
    joint: int | None = None
    change: float = 0.0
    offset: Transform | None = None
    aligned: bool = False

    @classmethod
    def of(cls, target: Target) -> Goal:
        match target:
            case PoseTarget():
                return cls(pose=target.T_world_tool)
            case JointTarget():
                return cls(joints=target.joints)
            case NamedTarget():
                return cls(named=target.name)
            case JointOffsetTarget():
                return cls(joint=target.joint, change=target.change)
            case ToolOffsetTarget():
                return cls(offset=target.T_destination_target)
            case AlignedTarget():
                return cls(aligned=True)

    @property
    def target(self) -> Target:
        """Raises IllegalValue for what is no place."""
        if self.pose is not None:
            return PoseTarget(rotating(self.pose))
        if self.joints is not None:
            return JointTarget(_finite(self.joints))
        if self.named is not None:
            return NamedTarget(self.named)
        if self.joint is not None:
            return JointOffsetTarget(self.joint, *_finite((self.change,)))
        if self.offset is not None:
            return ToolOffsetTarget(rotating(self.offset))
        if self.aligned:
            return AlignedTarget()
        raise IllegalValue("a motion to nowhere", "a pose, joints, or the name of a pose")


class Valued(Spoken, frozen=True, omit_defaults=True):
    """The value of a variable or an expression: exactly one of these."""

    real: float | None = None
    text: str | None = None
    location: Transform | None = None
    joints: Joints | None = None

    @classmethod
    def of(cls, value: Value) -> Valued:
        if isinstance(value, Transform):
            return cls(location=value)
        if isinstance(value, tuple):
            return cls(joints=value)
        return cls(text=value) if isinstance(value, str) else cls(real=value)

    @property
    def value(self) -> Value:
        """Raises IllegalValue for what is no value."""
        if self.location is not None:
            return rotating(self.location)
        if self.joints is not None:
            return _finite(self.joints)
        if self.text is not None:
            return self.text
        if self.real is not None:
            return _finite((self.real,))[0]
        raise IllegalValue("no value at all", "a number, a text, a location or joints")


def _finite(numbers: Joints) -> Joints:
    """Raises IllegalValue for what is no number."""
    for number in numbers:
        if not isfinite(number):
            raise IllegalValue(f"{number}", "a finite number")
    return numbers


def rotating(T: Transform) -> Transform:
    """Raises IllegalValue for a matrix that is no location, or a place that no line could name."""
    if max(map(abs, _finite(T))) > LIMIT:
        raise IllegalValue("a location beyond all numbers", "reals go to about 3E38")
    if not is_rotation((T[0:3], T[4:7], T[8:11])):
        raise IllegalValue("a location whose axes are not at right angles, or not of length 1")
    return T


# --- acts -----------------------------------------------------------------------------------------------------------


class Say(Act[None], frozen=True):
    """A line of the prompt. What is refused is raised, and not answered."""

    line: str


class Go(Act[None], frozen=True, omit_defaults=True):
    """A motion: `executed` is t_exec [s], after the last motion where that is None; `speed` the fraction of nominal."""

    goal: Goal
    straight: bool = False
    executed: float | None = None
    speed: float | None = None
    text: str = ""


class Rest(Act[None], frozen=True):
    """In virtual time: go on to when the robot stands."""


class Undo(Act[None], frozen=True):
    count: int = 1


class Redo(Act[None], frozen=True):
    count: int = 1


class Explain(Act[ReachReport], frozen=True):
    """WHY; `name`: how the goal is called in the report."""

    goal: Goal
    name: str


class Compare(Act[ComparisonTable], frozen=True):
    """Two branches."""

    a: str
    b: str


class Evaluate(Act[Valued], frozen=True):
    expression: str


class Assign(Act[None], frozen=True):
    """Give a variable, or an element of an array, a value."""

    variable: str
    value: Valued


class Defined(Spoken, frozen=True):
    """The names of programs that were put in memory."""

    names: tuple[str, ...]


class Define(Act[Defined], frozen=True):
    """Put the programs and variables of a text in memory; `where` stands before the number of a wrong line."""

    text: str
    where: str = "line "


class Execute(Act[RunResult], frozen=True):
    """A program that is in memory, to its end."""

    program: str
    cycles: int = 1


class CommandList(Spoken, frozen=True):
    commands: tuple[CommandRecord, ...]


class ListCommands(Act[CommandList], frozen=True):
    """All motion commands that hold."""


class ListBranches(Act[BranchTable], frozen=True):
    """All branches, main first."""


class ListMotions(Act[TimelineTable], frozen=True):
    """The timeline as a table."""


class Recorded(Spoken, frozen=True):
    """A trajectory file."""

    data: bytes


class Record(Act[Recorded], frozen=True):
    """The trajectory as SAVE would write it to a file."""


RobotAct = (
    Say
    | Go
    | Rest
    | Undo
    | Redo
    | Explain
    | Compare
    | Evaluate
    | Assign
    | Define
    | Execute
    | ListCommands
    | ListBranches
    | ListMotions
    | Record
    | Survey
    | ShowBranch
)
RobotFound = (
    Valued
    | Defined
    | RunResult
    | CommandList
    | BranchTable
    | TimelineTable
    | ReachReport
    | ComparisonTable
    | Recorded
    | Surveyed
    | BranchShown
)


# --- how they are done ----------------------------------------------------------------------------------------------


def act_on(session: Session, act: Act[T]) -> Talk[T]:
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
    return cast(T, (yield from session.on_branch(row.role, row.talk(session, act))))


def move_of(act: Go, times: HolderTimes) -> Move:
    """What is asked of the robot, in its own time."""
    stamp = None if act.executed is None else Stamp(times.executed(act.executed))
    return Move(act.goal.target, act.straight, speed=act.speed, stamp=stamp, text=act.text)


def _go(session: Session, act: Go) -> None:
    for number in (act.executed, act.speed):
        _finite(() if number is None else (number,))
    if act.speed is not None and not 0.0 < act.speed <= 1.0:
        raise IllegalValue(f"{act.speed:g} of nominal speed", "more than 0, at most 1", value=act.speed)
    move = move_of(act, session.desk.times)
    session.engine.clock.advance(session.engine.begin(move, program=False, issued=session.desk.issued))


def _rest(session: Session, _act: Rest) -> None:
    clock = session.engine.clock
    if clock.paused or not clock.realtime:
        session.engine.perform(Break())


def _undo(session: Session, act: Undo) -> Talk[None]:
    yield from in_parts(session.engine.undoing(act.count))


def _redo(session: Session, act: Redo) -> Talk[None]:
    yield from in_parts(session.engine.redoing(act.count))


def _explain(session: Session, act: Explain) -> Talk[ReachReport]:
    target = act.goal.target
    if not isinstance(target, PoseTarget | JointTarget):
        raise UsageError("WHY of no place", "WHY explains a location")
    return explained(session, target, act.name)


def _evaluate(session: Session, act: Evaluate) -> Valued:
    return Valued.of(evaluate(session.environment, session.robot, _expression(session, act.expression)))


def _assign(session: Session, act: Assign) -> None:
    target = _expression(session, act.variable)
    if not isinstance(target, Variable) or target.grouped:
        raise UsageError(f"{act.variable} is no variable", "a name, or row[3]")
    (reference,) = arguments_of(session.environment, session.robot, (target,))
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


def _define(session: Session, act: Define) -> Defined:
    before = dict(session.programs)
    wrong = [one for one in session.load_text(act.text) if one.severity is Severity.ERROR]
    if wrong:
        more = f", and {len(wrong) - 1} more mistakes" if len(wrong) > 1 else ""
        raise ProgramNotExecutable(f"{act.where}{wrong[0].span.line}: {wrong[0].message}{more}")
    return Defined(tuple(stored.name for key, stored in session.programs.items() if before.get(key) is not stored))


def _record(session: Session, _act: Record) -> Talk[Recorded]:
    engine = session.engine
    course = engine.model, engine.initial, engine.deltas.copy()
    return Recorded((yield from beside(lambda: b"".join(trajectory_lines(*course)))))


class _Row(NamedTuple):
    """How an act is called, the role that it needs, and how it is done: what comes of it, or a talk that tells that."""

    said: str
    role: Role
    do: Callable[[Session, Any], object]

    def talk(self, session: Session, act: Act[Any]) -> Talk[object]:
        found = self.do(session, act)
        return (yield from found) if isinstance(found, Generator) else found


def _as(word: str, do: Callable[[Session, Any], object]) -> _Row:
    """An act that does what a word does."""
    return _Row(word, role_of(word), do)


ACTS: Mapping[type[Act[Any]], _Row] = {
    Go: _as("MOVE", _go),
    Rest: _as("BREAK", _rest),
    Undo: _as("UNDO", _undo),
    Redo: _as("REDO", _redo),
    Explain: _as("WHY", _explain),
    Compare: _as("COMPARE", lambda session, act: comparison(session, act.a, act.b)),
    Evaluate: _Row("a look at a value", Role.OBSERVER, _evaluate),
    Assign: _Row(CHANGE, Role.SUPERVISOR, _assign),
    Define: _as("LOAD", _define),
    Execute: _as("EXECUTE", lambda session, act: session.wait(session.begin(act.program, cycles=act.cycles))),
    ListCommands: _as("TIMELINE", lambda session, _act: CommandList(session.engine.records())),
    ListBranches: _Row("a look at the branches", Role.OBSERVER, lambda session, _act: branch_table(session)),
    ListMotions: _as("TIMELINE", lambda session, _act: motions(session)),
    Record: _Row("a look at the trajectory", Role.OBSERVER, _record),
    Survey: _Row("a survey", Role.OBSERVER, survey),
    ShowBranch: _Row("a look at a branch", Role.OBSERVER, show_branch),
}
