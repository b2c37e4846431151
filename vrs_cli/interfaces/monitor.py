"""The monitor commands: one handler a row of the table, from a checked instruction to replies. Nothing is printed here.

A handler is a generator where it asks questions between its replies: each reply is shown before the next question.
"""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from fnmatch import fnmatchcase
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, cast, runtime_checkable

from vrs_cli import __version__
from vrs_cli.engine.branches import MAIN
from vrs_cli.engine.commands import JointTarget, PoseTarget, SetMonitorSpeed
from vrs_cli.engine.parameters import PARAMETERS, SWITCHES, ParameterRow, row_of
from vrs_cli.errors import (
    FileError,
    FileExists,
    IllegalValue,
    InvalidName,
    NoProgramSpecified,
    ProgramExists,
    TypeMismatch,
    UndefinedValue,
    UsageError,
    VrsError,
)
from vrs_cli.files.layout import Layout
from vrs_cli.interfaces.jogging import jog
from vrs_cli.interfaces.next_motion import said_for_next_motion
from vrs_cli.interfaces.operands import real as _real
from vrs_cli.interfaces.plotting import plotted, selected
from vrs_cli.interfaces.realtime import clock, clock_report
from vrs_cli.interfaces.replies import (
    BranchRow,
    BranchTable,
    ComparisonTable,
    Diagnosed,
    DiagnosticsReport,
    Farewell,
    FileRow,
    FileTable,
    FileText,
    FreeReport,
    Identification,
    ListedStep,
    LocationTable,
    Message,
    NamedLocation,
    ProgramName,
    ProgramNames,
    ProgramStopped,
    ProgramText,
    Progress,
    ReachReport,
    RealTable,
    Replay,
    Reply,
    SettingRow,
    SettingTable,
    SignalBank,
    SignalTable,
    StatusReport,
    StringTable,
    TimelineTable,
    Tone,
    Whereabouts,
    WhereaboutsTable,
)
from vrs_cli.interfaces.runs import Outcome, RunResult
from vrs_cli.interfaces.session import Dialogue
from vrs_cli.interfaces.track import ROBOT_PROGRAM
from vrs_cli.kinematics.joints import TURNING, Joints, JointUnits
from vrs_cli.kinematics.transform import IDENTITY, Transform
from vrs_cli.language.analyzer import is_reserved
from vrs_cli.language.ast import (
    NAME_LENGTH,
    BadLine,
    Call,
    Expression,
    Instruction,
    Kind,
    Number,
    Program,
    Variable,
    Word,
)
from vrs_cli.language.environment import INPUTS, INTERNAL, OUTPUTS, Index, Reference, StoredProgram, key_of, subscript
from vrs_cli.language.semantics.tasks import PROCESS_CONTROL, checked_task
from vrs_cli.language.values import (
    Value,
    kind_of_value,
    numbers_of,
    plain,
    precision_point,
    read_number,
    transformation,
    whole,
)

if TYPE_CHECKING:
    from vrs_cli.files.store import Part
    from vrs_cli.files.trajectory_file import Recording
    from vrs_cli.interfaces.session import Session
    from vrs_cli.language.diagnostics import Diagnostic

Handler = Callable[["Session", Instruction], Iterable[Reply]]


@runtime_checkable
class Watched(Protocol):
    """A terminal where somebody may watch how a long file is read."""

    def begin_progress(self) -> None:
        """The file is opened."""

    def reading(self, path: str, share: float) -> None:
        """So much of it has been read, from 0 to 1."""

    def end_progress(self) -> None:
        """It has been read."""


# --- operands ------------------------------------------------------------------------------------------------------


def _sight(session: Session, expression: Expression) -> Callable[[], Value]:
    """Looks at an expression as the program that has stopped sees it."""
    from vrs_cli.language.prompt import Sight

    sight = Sight(session.environment, session.robot, expression)
    return lambda: sight.value(_own(session))


def _own(session: Session) -> Mapping[str, Reference]:
    """What the program that has stopped has for itself: its arguments, and the variables of AUTO and LOCAL."""
    return {} if session.task is None else session.task.own


def _argument(it: Instruction, index: int) -> Expression | None:
    return it.arguments[index] if index < len(it.arguments) else None


def _real_or(session: Session, it: Instruction, index: int, default: float) -> float:
    given = _argument(it, index)
    return default if given is None else _real(session, given)


def _text(expression: Expression | None) -> str:
    """A file, a program or another bare word, as it was typed."""
    if isinstance(expression, Word):
        return expression.text
    if isinstance(expression, Variable | Call):
        return expression.name
    raise NoProgramSpecified()


def _path(it: Instruction) -> Path:
    return Path(_text(_argument(it, 0))).expanduser()


def _shown(expression: Expression) -> str:
    from vrs_cli.language.printer import expression_text

    return expression_text(expression)


# --- where the robot is --------------------------------------------------------------------------------------------

MOST_ROWS = 100_000
TORN = "its last line was not written to the end, and was left out"
DEFAULT_ROWS = 10


def _where(session: Session, it: Instruction) -> Iterator[Reply]:
    _only_robot(session, it, 0)
    engine, at, units = session.engine, it.modifiers, session.environment.units
    over_time = any(_argument(it, index) is not None for index in (1, 2, 3))
    if over_time and (at.at is not None or at.within is not None):
        raise UsageError("AT and FROM do not go together", "WHERE AT t, or WHERE FROM t1 TO t2 STEP dt")
    if at.at is not None:
        yield Whereabouts(engine.position(_real(session, at.at)), stamped=True, units=units)
    elif at.within is not None:
        yield Whereabouts(engine.position(engine.now + _real(session, at.within)), stamped=True, units=units)
    elif over_time:
        yield WhereaboutsTable(tuple(engine.position(t) for t in _times(session, it)), units)
    else:
        yield Whereabouts(engine.position(), units=units)


def _only_robot(session: Session, it: Instruction, index: int) -> None:
    number = _real_or(session, it, index, 1.0)
    if whole(number) != 1:
        raise IllegalValue(f"robot {plain(number)}", "there is one robot, number 1")


def _times(session: Session, it: Instruction) -> Iterator[float]:
    """FROM t1 TO t2 STEP dt, and the exact end."""
    first = _real_or(session, it, 1, 0.0)
    last = _real_or(session, it, 2, session.engine.end)
    if last < first:
        raise IllegalValue(f"FROM {plain(first)} TO {plain(last)}", "the first time comes first")
    step = _real_or(session, it, 3, (last - first) / DEFAULT_ROWS or 1.0)
    if not step > 0.0 or (last - first) / step > MOST_ROWS:
        raise IllegalValue(f"STEP {plain(step)}", f"more than 0 s, for at most {MOST_ROWS} rows")
    for k in range(int((last - first) / step - 1e-9) + 1):
        yield first + k * step
    if last > first:
        yield last


# --- locations -----------------------------------------------------------------------------------------------------


def _here(session: Session, it: Instruction) -> Iterator[Reply]:
    session.do(it)
    yield from _defined(session, it)


def _point(session: Session, it: Instruction) -> Iterator[Reply]:
    if it.value is not None:
        session.do(it)
    yield from _defined(session, it)


def _teach(session: Session, it: Instruction) -> Iterator[Reply]:
    """HERE without a question, under the next name of a series: there is no pendant whose button records."""
    expression = _argument(it, 0)
    if not isinstance(expression, Variable):
        raise IllegalValue(_shown(expression) if expression else "TEACH", "the name of a location, as TEACH part")
    name = next_in_series(session, expression)
    session.do(replace(it, word="HERE", arguments=(name,)))
    reference = _defined_by(session, replace(it, arguments=(name,)))
    yield _one_location(session, reference.name, cast("Transform | Joints", reference.value()))


def next_in_series(session: Session, first: Variable) -> Variable:
    """The name itself while it has no value, then the next one: part, part1, part2; row[3], row[4].

    Raises InvalidName for a name that cannot be counted up.
    """
    from vrs_cli.language.prompt import definable

    environment, name = session.environment, first
    while definable(environment, session.robot, name).reference.defined():
        name = _counted_up(session, name)
    return name


def _counted_up(session: Session, name: Variable) -> Variable:
    if name.indexes:
        *others, last = name.indexes
        following = _real(session, last) + 1.0
        return replace(name, indexes=(*others, Number(following, plain(following), last.span)))
    letters = name.name.rstrip("0123456789")
    longer = f"{letters}{int(name.name[len(letters) :] or 0) + 1}"
    if len(longer) > NAME_LENGTH:
        raise InvalidName(f"{name.sigil}{longer}", f"at most {NAME_LENGTH} characters; TEACH a shorter name")
    return replace(name, name=longer)


def _defined(session: Session, it: Instruction) -> Iterator[Reply]:
    """Show a location, and where somebody is there, ask for changes until an empty line."""
    reference = _defined_by(session, it)
    terminal = session.terminal
    if not isinstance(terminal, Dialogue):
        if not reference.defined():
            raise UndefinedValue(reference.name, f"POINT {reference.name} = location gives it one")
        yield _one_location(session, reference.name, cast("Transform | Joints", reference.value()))
        return
    value = _present(session, reference)
    while True:
        yield _one_location(session, reference.name, value)
        answer = terminal.change("Change?")
        if answer is None:
            yield Message(f"{reference.name} is left as it was")
            return
        answer = answer.partition(";")[0].strip()
        if not answer:
            reference.assign(value)
            return
        try:
            value = changed(value, answer, session.environment.units)
        except VrsError as error:
            yield Message(str(error), Tone.ERROR)


def _defined_by(session: Session, it: Instruction) -> Reference:
    from vrs_cli.language.prompt import definable

    expression = _argument(it, 0)
    assert expression is not None
    return definable(session.environment, session.robot, expression).reference


def _present(session: Session, reference: Reference) -> Transform | Joints:
    """The value; where there is none, what the six zeros of VAL stand for."""
    if reference.defined():
        return cast("Transform | Joints", reference.value())
    return (0.0,) * session.engine.model.joint_count if reference.cells.kind is Kind.PRECISION else IDENTITY


def changed(value: Transform | Joints, answer: str, units: JointUnits = TURNING) -> Transform | Joints:
    """A location with the numbers that were typed; commas skip those that stay. Raises IllegalValue."""
    numbers = list(numbers_of(value, units))
    fields = answer.split(",")
    if len(fields) > len(numbers):
        raise IllegalValue(f"{len(fields)} numbers", f"at most {len(numbers)}, commas between them")
    for i, field in enumerate(fields):
        if field.strip():
            number = read_number(field)
            if number is None:
                raise IllegalValue(field.strip(), "numbers with commas between them; ,,50 changes the third alone")
            numbers[i] = number
    return transformation(numbers) if isinstance(value, Transform) else precision_point(numbers, units)


def _one_location(session: Session, name: str, value: Transform | Joints) -> LocationTable:
    return LocationTable((NamedLocation(name, value),), session.environment.units)


def _tool(session: Session, it: Instruction) -> Iterator[Reply]:
    session.do(it)
    yield _one_location(session, "TOOL", session.engine.frames.tool)


def _base(session: Session, it: Instruction) -> Iterator[Reply]:
    session.do(it)
    yield _one_location(session, "BASE", session.engine.frames.base)


# --- listings of variables -----------------------------------------------------------------------------------------


def _listl(session: Session, it: Instruction) -> Iterator[Reply]:
    rows = _rows(session, it, (Kind.LOCATION, Kind.PRECISION), "LISTR lists reals, LISTS strings")
    named = tuple(NamedLocation(name, cast("Transform | Joints", value)) for name, value in rows)
    yield LocationTable(named, session.environment.units)


def _why(session: Session, it: Instruction) -> Iterator[Reply]:
    asked = _argument(it, 0)
    assert asked is not None
    value = _sight(session, asked)()
    if not isinstance(value, tuple):
        raise TypeMismatch(f"{_shown(asked)} is a {kind_of_value(value).value}", "WHY explains a location")
    target = PoseTarget(value) if isinstance(value, Transform) else JointTarget(value)
    yield ReachReport(_shown(asked), session.engine.explain(target), session.environment.units)


def _listr(session: Session, it: Instruction) -> Iterator[Reply]:
    rows = _rows(session, it, (Kind.REAL,), "LISTL lists locations, LISTS strings")
    yield RealTable(tuple((name, cast(float, value)) for name, value in rows))


def _lists(session: Session, it: Instruction) -> Iterator[Reply]:
    rows = _rows(session, it, (Kind.STRING,), "LISTL lists locations, LISTR reals")
    yield StringTable(tuple((name, cast(str, value)) for name, value in rows))


def _rows(session: Session, it: Instruction, kinds: tuple[Kind, ...], otherwise: str) -> Iterator[tuple[str, Value]]:
    """What was asked for, each with its name or text; everything of these kinds when nothing was."""
    asked = [argument for argument in it.arguments if argument is not None]
    if not asked:
        for kind in kinds:
            yield from session.environment.variables(kind)
    for expression in asked:
        for name, value in _elements(session, expression) or ((_shown(expression), _sight(session, expression)()),):
            if kind_of_value(value) not in kinds:
                raise TypeMismatch(f"{name} is a {kind_of_value(value).value}", otherwise)
            yield name, value


def _elements(session: Session, expression: Expression) -> tuple[tuple[str, Value], ...]:
    """What a name alone stands for: the simple variable and all elements of the array of that name."""
    if not isinstance(expression, Variable) or expression.indexes:
        return ()
    if expression.key in _own(session):
        return tuple(_own_elements(session, expression, _own(session)[expression.key]))
    rows = (row for kind in Kind for row in session.environment.variables(kind))
    return tuple(row for row in rows if key_of(row.name.partition("[")[0]) == expression.key)


def _own_elements(session: Session, asked: Variable, reference: Reference) -> Iterator[tuple[str, Value]]:
    """The same of a variable of the program that has stopped. Raises UndefinedValue where there is none."""
    program, name = session.task.program if session.task is not None else "", asked.sigil + asked.name
    if reference.key is not None:
        yield f"{name} ({program})", reference.value()
        return
    for cells in (reference.cells, reference.locations):
        indexes = [index for index in cells if not isinstance(index, str)]
        for index in sorted(indexes, key=lambda index: index if isinstance(index, tuple) else (index,)):
            yield f"{name}[{subscript(index)}] ({program})", cells[index]


# --- programs in memory --------------------------------------------------------------------------------------------


def _listp(session: Session, it: Instruction) -> Iterator[Reply]:
    environment = session.environment
    names = [_text(argument) for argument in it.arguments if argument is not None]
    stored = [environment.program(name) for name in names] or list(environment.programs.values())
    if not stored:
        yield ProgramNames(())
    for program in stored:
        yield listing(program)


def listing(stored: StoredProgram) -> ProgramText:
    """The canonical text of a program, its steps numbered."""
    from vrs_cli.language.printer import program_header, step_texts

    program = stored.program
    steps = tuple(
        ListedStep(number, text, bad=isinstance(step.statement, BadLine))
        for number, (step, text) in enumerate(zip(program.steps, step_texts(program), strict=True), 1)
    )
    return ProgramText(program_header(program), steps)


def _directory(session: Session, it: Instruction) -> Iterator[Reply]:
    pattern = _text(it.arguments[0]).lower() if _argument(it, 0) is not None else "*"
    stored = session.environment.programs
    yield ProgramNames(
        tuple(
            ProgramName(
                row.name,
                row.analysis.executable,
                len(row.program.steps),
                f"; {row.program.comment.strip()}" if row.program.comment else "",
            )
            for key, row in sorted(stored.items())
            if fnmatchcase(row.name.lower(), pattern)
        )
    )


def _copy(session: Session, it: Instruction) -> Iterator[Reply]:
    copied(session, it)
    yield from ()


def copied(session: Session, it: Instruction) -> StoredProgram:
    """COPY new = old. Returns the old one. Raises ProgramExists, UndefinedName."""
    new, old = _text(it.arguments[0]), session.environment.program(_text(it.value))
    if key_of(new) in session.environment.programs:
        raise ProgramExists(new, f"DELETEP {new} deletes it")
    if is_reserved(new):
        raise InvalidName(f"{new.upper()} is a word of the language", "a program has a name of its own")
    program = replace(old.program, name=new)
    session.environment.store(replace(old.analysis, program=program), "\n".join(old.lines))
    return old


def _rename(session: Session, it: Instruction) -> Iterator[Reply]:
    session.check_free(_text(it.value))
    old = copied(session, it)
    session.layout = session.layout.renamed(old.name, _text(it.arguments[0]))
    del session.environment.programs[old.program.key]
    if session.last_program is not None and key_of(session.last_program) == old.program.key:
        session.last_program = _text(it.arguments[0])
    yield from ()


# --- deleting ------------------------------------------------------------------------------------------------------


def _refused(session: Session, question: str) -> Message | None:
    """None where the user agrees, or has said DISABLE INTERACTIVE; otherwise what is said of it."""
    if not session.engine.parameters.switch("INTERACTIVE"):
        return None
    if session.terminal.confirm(f"{question} Are you sure (Y/N)?"):
        return None
    if isinstance(session.terminal, Dialogue):
        return Message("Nothing is deleted")
    return Message("*Not confirmed* nothing is deleted (DISABLE INTERACTIVE deletes without a question)", Tone.ERROR)


def _delete(session: Session, it: Instruction) -> Iterator[Reply]:
    """Programs, what only they call, and the variables that only these use."""
    from vrs_cli.files.store import variables_used, with_called

    environment = session.environment
    named = {environment.program(_text(argument)).program.key for argument in it.arguments}
    under = {program.key for program in with_called(environment, sorted(named))}
    outside = [key for key in environment.programs if key not in under]
    kept = {program.key for program in with_called(environment, outside)} - named
    doomed = [environment.programs[key] for key in environment.programs if key in under - kept]
    for program in doomed:
        session.check_free(program.name)
    refused = _refused(session, f"{_listed(program.name for program in doomed)} and what only they use go.")
    if refused:
        yield refused
        return
    still_used = variables_used(environment.programs[key].program for key in kept)
    for name in variables_used(program.program for program in doomed) - still_used:
        environment.delete(name)
    _drop_programs(session, doomed)


def _deletep(session: Session, it: Instruction) -> Iterator[Reply]:
    doomed = [session.environment.program(_text(argument)) for argument in it.arguments]
    for program in doomed:
        session.check_free(program.name)
    refused = _refused(session, f"{_listed(program.name for program in doomed)} will be deleted.")
    if refused:
        yield refused
    else:
        _drop_programs(session, doomed)


def _drop_programs(session: Session, doomed: Iterable[StoredProgram]) -> None:
    for program in doomed:
        session.environment.programs.pop(program.program.key, None)
        session.layout = session.layout.with_part(program.program.key, ())
        if session.last_program is not None and key_of(session.last_program) == program.program.key:
            session.last_program = None


def _delete_variables(*kinds: Kind) -> Handler:
    def delete(session: Session, it: Instruction) -> Iterator[Reply]:
        doomed = [_variable_of(session, argument, kinds) for argument in it.arguments]
        refused = _refused(session, f"{_listed(name for name, _ in doomed)} will be deleted.")
        if refused:
            yield refused
            return
        for name, index in doomed:
            session.environment.delete(name, index)

    return delete


def _variable_of(session: Session, expression: Expression | None, kinds: tuple[Kind, ...]) -> tuple[str, Index | None]:
    """The name, and the index of one element. Raises UndefinedValue, TypeMismatch."""
    if not isinstance(expression, Variable):
        raise TypeMismatch("an expression", "the name of a variable is wanted")
    name = expression.sigil + expression.name
    kind = session.environment.kind_of(name)
    if kind is None:
        raise UndefinedValue(name, "there is nothing to delete")
    if kind not in kinds:
        raise TypeMismatch(f"{name} is a {kind.value}")
    indexes = tuple(whole(_real(session, index)) for index in expression.indexes or ())
    return name, None if not indexes else indexes[0] if len(indexes) == 1 else indexes


def _zero(session: Session, _it: Instruction) -> Iterator[Reply]:
    for stored in session.environment.programs.values():
        session.check_free(stored.name)
    refused = _refused(session, "All programs and variables will be deleted.")
    if refused:
        yield refused
        return
    session.environment.programs.clear()
    session.environment.clear_variables()
    session.layout = Layout()
    session.last_program = None
    session.driver.tasks.forget_all()


def _listed(names: Iterable[str]) -> str:
    return ", ".join(names)


# --- files ---------------------------------------------------------------------------------------------------------


def _load(session: Session, it: Instruction) -> Iterator[Reply]:
    yield from load(session, _path(it))


def load(session: Session, named: Path) -> Iterator[Reply]:
    """Programs that are there already are replaced where the user agrees, else they stay as they are; variables are
    overwritten. Where no program was run yet, EXECUTE alone runs the first of the file.

    Raises NonexistentFile, FileError, FileDamaged.
    """
    from vrs_cli.files.program_file import find_program_file, read_program_file
    from vrs_cli.files.trajectory_file import EXTENSION

    path = find_program_file(named)
    if path.suffix.lower() == EXTENSION:
        yield from _load_trajectory(session, path)
        return
    text = read_program_file(path)
    programs = session.environment.programs
    before, layout = dict(programs), session.layout
    diagnostics = session.load_text(text)
    if diagnostics:
        yield report(diagnostics, text, str(path))
    brought = [stored for key, stored in programs.items() if before.get(key) is not stored]
    old = [stored for stored in brought if stored.program.key in before and not may_replace(session, stored.name)]
    for stored in old:
        programs[stored.program.key] = before[stored.program.key]
        session.layout = session.layout.with_part(stored.program.key, layout.parts.get(stored.program.key, ()))
        if not isinstance(session.terminal, Dialogue):
            hint = "DELETEP deletes it, DISABLE INTERACTIVE lets it be replaced"
            yield Message(str(ProgramExists(stored.name, hint)), Tone.ERROR)
    new = [stored for stored in brought if stored not in old]
    if session.last_program is None and new:
        session.last_program = new[0].name
    names = [_loaded(stored, replaced=stored.program.key in before) for stored in new]
    stay = f"; {_listed(stored.name for stored in old)} {'stays' if len(old) == 1 else 'stay'} as before" if old else ""
    yield Message(f"{path} loaded" + (f": {_listed(names)}" if names else "") + stay)


def _load_trajectory(session: Session, path: Path) -> Iterator[Reply]:
    """A trajectory becomes a branch of its own: it can be gone on with, compared, and merged into main."""
    from vrs_cli.files.continuing import line_of

    branches = session.branches
    name = re.sub(r"\W", ".", path.stem)
    name = name if name[0].isalpha() else f"t{name}"
    if name in branches:
        raise UsageError(f"there is a branch {name} already", f"DELETEB {name}, then LOAD again; or rename the file")
    _tasks_stand(session)
    recording = _recording(session, path)
    branches.add(name, line_of(path, recording, session.engine))
    branches.change_over(name)
    if recording.dropped_tail:
        yield Message(TORN, Tone.WARNING)
    commands = len(session.engine.history.done)
    counted = f"{commands} command{'s' if commands != 1 else ''}"
    yield Message(f"On {name}, a branch of {counted} from {path}; the clock is at {session.engine.now:.3f} s")


def _recording(session: Session, path: Path) -> Recording:
    """Read a trajectory file, with progress where somebody watches."""
    from vrs_cli.files.trajectory_file import read_trajectory

    terminal = session.terminal
    if not isinstance(terminal, Watched):
        return read_trajectory(path)
    terminal.begin_progress()
    try:
        return read_trajectory(path, partial(terminal.reading, str(path)))
    finally:
        terminal.end_progress()


def _loaded(stored: StoredProgram, *, replaced: bool) -> str:
    marks = ["replaced"] * replaced + ["not executable"] * (not stored.analysis.executable)
    return f"{stored.name} ({_listed(marks)})" if marks else stored.name


def may_replace(session: Session, program: str) -> bool:
    """Whether a program of that name may be put in memory: none is there, or the user lets it go."""
    if key_of(program) in session.environment.programs and session.engine.parameters.switch("INTERACTIVE"):
        return session.terminal.confirm(f"Program {program} exists. Replace it (Y/N)?")
    return True


def _store(extension: str, *parts: str) -> Handler:
    """Parts by the names of `files.store.Part`."""

    def store(session: Session, it: Instruction) -> Iterator[Reply]:
        from vrs_cli.files import store as files
        from vrs_cli.files.program_file import write_atomically

        path = _with_extension(_path(it), extension)
        what: list[Part] = [files.Part[name] for name in parts]
        programs = [_text(argument) for argument in it.arguments[1:]]
        text = files.store(session.environment, what, programs, session.layout)
        if not text.strip():
            yield Message("There is nothing to store", Tone.WARNING)
            return
        _may_write(session, path)
        write_atomically(path, text)
        yield Message(f"{path} stored")

    return store


def _with_extension(path: Path, extension: str) -> Path:
    return path if path.suffix else path.with_name(path.name + extension)


def _may_write(session: Session, path: Path) -> None:
    """Raises FileExists where the user does not want a file overwritten, or nobody can be asked, FileError for the
    journal of this session."""
    if session.journal is not None and path.exists() and session.journal.exists() and path.samefile(session.journal):
        raise FileError(f"{path} holds all of this session already, and is being written", "name another file")
    if path.exists() and session.engine.parameters.switch("INTERACTIVE"):  # noqa: SIM102
        if not session.terminal.confirm(f"{path} exists. Overwrite it (Y/N)?"):
            raise FileExists(str(path), "answer Y or name another file; DISABLE INTERACTIVE overwrites")


def _save(session: Session, it: Instruction) -> Iterator[Reply]:
    from vrs_cli.files.trajectory_file import EXTENSION, write_trajectory

    engine = session.engine
    path = _with_extension(_path(it), EXTENSION)
    _may_write(session, path)
    write_trajectory(path, engine.model, engine.initial, engine.deltas)
    commands = len(engine.records())
    yield Message(f"{path} saved: {commands} command{'s' if commands != 1 else ''}, {engine.end:.3f} s")


def _replay(session: Session, it: Instruction) -> Iterator[Reply]:
    from vrs_cli.files.trajectory_file import EXTENSION

    path = _path(it)
    path = path if path.exists() else _with_extension(path, EXTENSION)
    recording = _recording(session, path)
    yield Replay(path, recording.model, recording.timeline, len(recording.deltas), recording.dropped_tail)


def report(diagnostics: Iterable[Diagnostic], text: str, path: str | None = None) -> DiagnosticsReport:
    """Findings in a text with their lines, in order."""
    lines = ["", *text.split("\n")]
    ordered = sorted(diagnostics, key=lambda one: (one.span.line, one.span.column))
    return DiagnosticsReport(tuple(Diagnosed(one, _line(lines, one.span.line), path) for one in ordered))


def _line(lines: Sequence[str], number: int) -> str:
    """A line, counted from 1; empty behind the end."""
    return lines[number] if number < len(lines) else ""


# --- editors ---------------------------------------------------------------------------------------------------------


def _edit(session: Session, it: Instruction) -> Iterator[Reply]:
    from vrs_cli.interfaces.editor import Editor, opened, refuse_running

    program, step = _to_edit(session, it)
    refuse_running(session, program.name)
    session.editor = Editor(session, opened(session, program, step))
    session.last_edited = program.name
    yield from session.editor.draft.screen()


def _see(session: Session, it: Instruction) -> Iterator[Reply]:
    from vrs_cli.interfaces.editor import refuse_running
    from vrs_cli.interfaces.screen import ScreenDraft, ScreenTerminal

    program, step = _to_edit(session, it)
    terminal = session.terminal
    if not isinstance(terminal, ScreenTerminal):
        raise UsageError("SEE fills a terminal, and there is none", f"EDIT {program.name} edits line by line")
    refuse_running(session, program.name)
    session.last_edited = program.name
    yield from terminal.see(ScreenDraft(session, program, step))


def _to_edit(session: Session, it: Instruction) -> tuple[Program, int]:
    """The program that is asked for, or the last one, and the step. Raises NoProgramSpecified, IllegalValue."""
    from vrs_cli.interfaces.editor import asked_program, named_program

    asked = _argument(it, 0)
    last = session.last_edited or session.last_program
    if asked is None and last is None:
        raise NoProgramSpecified("none was edited before", f"{it.word} name")
    step = whole(_real_or(session, it, 1, 1.0))
    if step < 1:
        raise IllegalValue(f"step {step}", "steps count from 1")
    return (named_program(last or "") if asked is None else asked_program(asked)), step


# --- files of the disk -----------------------------------------------------------------------------------------------


def _flist(_session: Session, it: Instruction) -> Iterator[Reply]:
    from vrs_cli.files.program_file import read_program_file

    yield FileText(tuple(read_program_file(_path(it)).splitlines()))


def _fdirectory(_session: Session, it: Instruction) -> Iterator[Reply]:
    from vrs_cli.files.folder import listed

    asked = Path(".") if _argument(it, 0) is None else _path(it)
    yield FileTable(str(asked), tuple(FileRow(entry.name, entry.size) for entry in listed(asked)))


def _fdelete(session: Session, it: Instruction) -> Iterator[Reply]:
    from vrs_cli.files.folder import delete, existing

    path = existing(_path(it))
    refused = _refused(session, f"The file {path} will be deleted.")
    if refused:
        yield refused
        return
    delete(path)
    yield Message(f"{path} deleted")


def _fcopy(session: Session, it: Instruction) -> Iterator[Reply]:
    from vrs_cli.files.folder import copy

    old, new = _two_files(session, it)
    copy(old, new)
    yield Message(f"{old} copied to {new}")


def _frename(session: Session, it: Instruction) -> Iterator[Reply]:
    from vrs_cli.files.folder import rename

    old, new = _two_files(session, it)
    rename(old, new)
    yield Message(f"{old} renamed to {new}")


def _two_files(session: Session, it: Instruction) -> tuple[Path, Path]:
    """`new = old`: the old file, and the new one, which may be written. Raises FileError and what is under it."""
    from vrs_cli.files.folder import existing, target

    old = existing(Path(_text(it.value)).expanduser())
    new = target(old, _path(it))
    _may_write(session, new)
    return old, new


def _commands(session: Session, it: Instruction) -> Iterator[Reply]:
    from vrs_cli.interfaces.command_file import carried_out

    yield from carried_out(session, _path(it))


# --- running programs ----------------------------------------------------------------------------------------------


def _execute(session: Session, it: Instruction) -> Iterator[Reply]:
    number = whole(_real_or(session, it, 3, 0.0))
    if number:
        _start(session, it, checked_task(number))
        return
    name, arguments, cycles, step = _asked_program(session, it)
    yield from _run(session, lambda progress: session.execute(name, arguments, cycles, step, progress=progress))


def _asked_program(session: Session, it: Instruction) -> tuple[str | None, tuple[Reference | None, ...], int, int]:
    """Program, arguments, cycles and first step of EXECUTE and its like."""
    from vrs_cli.language.prompt import arguments_of

    asked = _argument(it, 0)
    name = None if asked is None else _text(asked)
    given = asked.arguments if isinstance(asked, Call) else ()
    arguments = arguments_of(session.environment, session.robot, given)
    return name, arguments, whole(_real_or(session, it, 1, 1.0)), whole(_real_or(session, it, 2, 1.0))


def _start(session: Session, it: Instruction, number: int) -> None:
    """A task beside the robot program."""
    name, arguments, cycles, step = _asked_program(session, it)
    if name is None:
        raise NoProgramSpecified(f"task {number} needs a program", "name it")
    session.start(number, name, arguments, cycles, step)


def _pc_execute(session: Session, it: Instruction) -> Iterator[Reply]:
    _start(session, it, PROCESS_CONTROL)
    yield from ()


def _prime(session: Session, it: Instruction) -> Iterator[Reply]:
    task = session.prime(*_asked_program(session, it)).task
    yield ProgramStopped("(PRIMED)", task.program, task.step)


def _step(over: bool) -> Handler:
    """SSTEP, XSTEP: of a program that is named, or of the one that has stopped."""

    def step(session: Session, it: Instruction) -> Iterator[Reply]:
        if _argument(it, 0) is not None:
            session.prime(*_asked_program(session, it))
        yield from _run(session, lambda progress: session.step(over=over, progress=progress))

    return step


def _task_number(session: Session, it: Instruction) -> int:
    return checked_task(_real_or(session, it, 0, 0.0))


def _proceed(session: Session, it: Instruction) -> Iterator[Reply]:
    yield from _go_on(session, _task_number(session, it), retry=False)


def _retry(session: Session, it: Instruction) -> Iterator[Reply]:
    yield from _go_on(session, _task_number(session, it), retry=True)


def _go_on(session: Session, number: int, retry: bool) -> Iterator[Reply]:
    if number:
        session.driver.tasks.proceed(number, retry=retry)
        session.settle()
    else:
        yield from _run(session, session.retry if retry else session.proceed)


def _kill(session: Session, it: Instruction) -> Iterator[Reply]:
    session.driver.tasks.kill(_task_number(session, it))
    yield from ()


def _cycle_end(session: Session, it: Instruction) -> Iterator[Reply]:
    yield _ends(session, _task_number(session, it))


def _ends(session: Session, number: int) -> Reply:
    track = session.driver.tasks.end_cycles(number)
    return Message(f"{track.task.program} ends after its present cycle")


def _process_control(act: Callable[[Session, int], Iterable[Reply]]) -> Handler:
    """A command for the process control program."""
    return lambda session, _it: act(session, PROCESS_CONTROL)


def _bpt(session: Session, it: Instruction) -> Iterator[Reply]:
    debugging, asked, step = session.driver.debugging, _argument(it, 0), whole(_real_or(session, it, 1, 0.0))
    if asked is not None:
        stored = session.environment.program(_text(asked))
        key, last = stored.program.key, len(stored.program.steps)
        if abs(step) > last:
            raise IllegalValue(f"step {abs(step)}", f"{stored.name} has the steps 1 to {last}")
        if step > 0:
            debugging.breakpoints.add((key, _breakable(stored, step)))
        else:
            gone = {point for point in debugging.breakpoints if point[0] == key and step in (0, -point[1])}
            debugging.breakpoints -= gone
    for key, number in sorted(debugging.breakpoints):
        yield Message(f"Breakpoint before step {number} of {key}")
    if not debugging.breakpoints:
        yield Message("No breakpoints")


def _breakable(stored: StoredProgram, step: int) -> int:
    """The step itself, or the first behind it at which something is done. Raises IllegalValue, ProgramNotExecutable."""
    found = stored.compiled.stand(step - 1)
    if found is None:
        raise IllegalValue(f"step {step}", f"nothing is done there or after it in {stored.name}")
    return found + 1


def _watch(session: Session, it: Instruction) -> Iterator[Reply]:
    from vrs_cli.interfaces.debugging import Watch

    watches, expression = session.driver.debugging.watches, _argument(it, 0)
    if expression is None:
        watches.clear()
        yield Message("Nothing is watched")
        return
    units = session.environment.units
    watch = Watch(_shown(expression), _sight(session, expression), lambda value: _value_text(value, units))
    watch.changed()
    watches.append(watch)
    yield Message(f"Programs stop when {watch.text} changes")


def _value_text(value: Value, units: JointUnits) -> str:
    if isinstance(value, str):
        return f'"{value}"'
    numbers = (value,) if isinstance(value, float) else numbers_of(value, units)
    return ", ".join(plain(round(number, 3)) for number in numbers)


def _run(session: Session, run: Callable[[Callable[[float], None] | None], RunResult]) -> Iterator[Reply]:
    """Run, with progress where somebody watches; how it ended, and what became of other tasks."""
    result = session.watched(run)
    for one in result.beside:
        fault = one.fault
        yield ProgramStopped(
            f"{fault.message} [task {one.number}]", fault.program, fault.step, fault.source, Tone.ERROR
        )
    yield ending(session, result)


def ending(session: Session, result: RunResult) -> Reply:
    """What is said when a program ends."""
    if result.fault is not None:
        fault = result.fault
        return ProgramStopped(fault.message, fault.program, fault.step, fault.source, Tone.ERROR)
    task = session.task
    if result.outcome is Outcome.COMPLETED or task is None:
        return Message(result.outcome.value)
    before = result.outcome in (Outcome.STEPPED, Outcome.BREAKPOINT, Outcome.WATCHED)
    what = f"{result.outcome.value} {result.detail}".strip()
    return ProgramStopped(what, result.program, task.step, task.source if before else "")


def _abort(session: Session, it: Instruction) -> Iterator[Reply]:
    number = _task_number(session, it)
    yield from _abort_task(session, number) if number else _abort_robot(session)


def _abort_task(session: Session, number: int) -> Iterator[Reply]:
    track = session.driver.tasks.abort(number)
    session.settle()
    yield (
        Message("Nothing is running")
        if track is None
        else ProgramStopped(Outcome.ABORTED.value, track.task.program, track.task.step)
    )


def _abort_robot(session: Session) -> Iterator[Reply]:
    scheduled = session.engine.now < session.engine.end
    task = session.task
    session.abort()
    if task is not None and not task.ended:
        yield ProgramStopped(Outcome.ABORTED.value, task.program, task.step)
    elif scheduled:
        yield Message("The motion is stopped")
    else:
        yield Message("Nothing is running")


# --- settings ------------------------------------------------------------------------------------------------------


def _speed(session: Session, it: Instruction) -> Iterator[Reply]:
    argument = _argument(it, 0)
    assert argument is not None
    session.engine.perform(SetMonitorSpeed(_real(session, argument)))
    yield from ()


def _signal(session: Session, it: Instruction) -> Iterator[Reply]:
    """As the instruction, and inputs too: at the prompt one stands at the cabinet."""
    numbers = [_real(session, argument) for argument in it.arguments if argument is not None]
    for number in numbers:
        session.environment.signals.read(number)
    for number in numbers:
        session.environment.signals.write(number, inputs=True)
    session.settle()
    yield from ()


def _as_instruction(session: Session, it: Instruction) -> Iterator[Reply]:
    """A word that does the same at the prompt as in a program, and answers nothing."""
    session.do(it)
    yield from ()


def _calibrate(_session: Session, _it: Instruction) -> Iterator[Reply]:
    yield Message("A virtual robot is calibrated")


def _switch(session: Session, it: Instruction) -> Iterator[Reply]:
    if it.value is not None:
        session.do(it)
        return
    switches = session.engine.parameters.switches
    rows = _asked(it, SWITCHES, "switch")
    yield SettingTable(
        "Switch",
        tuple(SettingRow(row.name, "ON" if switches[row.name] else "OFF", row.summary) for row in rows),
    )


def _parameter(session: Session, it: Instruction) -> Iterator[Reply]:
    if it.value is not None:
        session.do(it)
        return
    values = session.engine.parameters.values
    rows = _asked(it, PARAMETERS, "parameter")
    yield SettingTable(
        "Parameter", tuple(SettingRow(row.name, _with_unit(row, values[row.name]), row.summary) for row in rows)
    )


def _asked(it: Instruction, table: Mapping[str, Any], what: str) -> list[Any]:
    """The rows of the names given, all when none is. Raises UsageError."""
    names = [_text(argument) for argument in it.arguments if argument is not None]
    return [row_of(table, name, what) for name in names] or list(table.values())


def _with_unit(row: ParameterRow, value: float | str) -> str:
    return value if isinstance(value, str) else f"{plain(value)} {row.unit}".rstrip()


# --- state ---------------------------------------------------------------------------------------------------------


def _status(session: Session, it: Instruction) -> Iterator[Reply]:
    yield _status_of(session, _task_number(session, it))


def _status_of(session: Session, number: int) -> Reply:
    engine, parameters = session.engine, session.engine.parameters
    speed = parameters.speed.always
    return StatusReport(
        robot=engine.model.title,
        progress=_progress(session, number),
        monitor_speed=parameters.monitor_speed,
        program_speed=f"{plain(speed.value)} {speed.unit.value}",
        power=parameters.switch("POWER"),
        clock=engine.now,
        end=engine.end,
        configuration=engine.arm.configuration(engine.position().joints),
        next_motion=said_for_next_motion(engine),
    )


def _progress(session: Session, number: int) -> Progress | None:
    track = session.driver.tasks.get(number)
    if track is None:
        return None
    task = track.task
    left = None if task.cycles < 0 else task.cycles - task.cycles_done
    return Progress(task.program, task.state.value, None if task.ended else task.step, task.cycles_done, left)


BANKS: Mapping[int, tuple[str, range]] = {
    0: ("Inputs", INPUTS),
    1: ("Outputs", OUTPUTS),
    2: ("Internal signals", INTERNAL),
}


def _io(session: Session, it: Instruction) -> Iterator[Reply]:
    asked = _argument(it, 0)
    number = None if asked is None else whole(_real(session, asked))
    if number is not None and number not in BANKS:
        raise IllegalValue(f"IO {number}", "0 inputs, 1 outputs, 2 internal signals")
    chosen = BANKS.values() if number is None else (BANKS[number],)
    signals = session.environment.signals
    yield SignalTable(tuple(SignalBank(title, bank[0], signals.state(bank)) for title, bank in chosen))


def _time(session: Session, _it: Instruction) -> Iterator[Reply]:
    yield clock_report(session)


def _id(session: Session, _it: Instruction) -> Iterator[Reply]:
    yield Identification(__version__, ".".join(map(str, sys.version_info[:3])), session.engine.model)


def _free(session: Session, _it: Instruction) -> Iterator[Reply]:
    environment = session.environment
    yield FreeReport(
        programs=len(environment.programs),
        steps=sum(len(stored.program.steps) for stored in environment.programs.values()),
        variables=sum(1 for kind in Kind for _ in environment.variables(kind)),
        segments=len(session.engine.timeline),
        percent=free_memory(),
    )


def free_memory() -> float | None:
    """How much of the computer's memory is free [%]; None where the system does not say."""
    try:
        return 100.0 * os.sysconf("SC_AVPHYS_PAGES") / os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, ValueError, OSError, ZeroDivisionError):
        return None


def _help(_session: Session, it: Instruction) -> Iterator[Reply]:
    from vrs_cli.interfaces.help import overview, page

    asked = _argument(it, 0)
    yield overview() if asked is None else page(_text(asked))


# --- the timeline --------------------------------------------------------------------------------------------------


def _undo(session: Session, it: Instruction) -> Iterator[Reply]:
    engine = session.engine
    texts = [step.delta.motion.text for step in reversed(engine.history.done)]
    count = _steps_back(session, it, texts, "undo")
    for _ in range(count):
        engine.undo()
    yield Message(f"{_counted(texts[:count], 'undone')}; the clock is at {engine.now:.3f} s")


def _redo(session: Session, it: Instruction) -> Iterator[Reply]:
    engine = session.engine
    texts = [undone.step.delta.motion.text for undone in reversed(engine.history.undone)]
    count = _steps_back(session, it, texts, "redo")
    for _ in range(count):
        engine.redo()
    yield Message(f"{_counted(texts[:count], 'done again')}; the clock is at {engine.now:.3f} s")


def _steps_back(session: Session, it: Instruction, texts: Sequence[str], what: str) -> int:
    """How many commands UNDO or REDO is to take. Raises UsageError where there are not so many, IllegalValue."""
    count = whole(_real_or(session, it, 0, 1.0))
    if count < 1:
        raise IllegalValue(f"{it.word} {count}", "at least one command")
    if 1 < count > len(texts) > 0:
        raise UsageError(f"there are not {count} motions to {what}", f"at most {it.word} {len(texts)}")
    return count


def _counted(texts: Sequence[str], what: str) -> str:
    """`MOVE a is undone`, `3 commands are undone, the last of them MOVE a`."""
    last = texts[-1] or "a motion"
    return f"{last} is {what}" if len(texts) == 1 else f"{len(texts)} commands are {what}, up to {last}"


def _branch(session: Session, it: Instruction) -> Iterator[Reply]:
    branches, asked = session.branches, _argument(it, 0)
    if asked is None:
        yield BranchTable(tuple(_branch_row(session, name) for name in branches.names))
        return
    name = _text(asked)
    if not name[:1].isalpha():
        raise InvalidName(name, "a branch is named as a program is: BRANCH trial")
    _tasks_stand(session)
    if name in branches:
        branches.change_over(name)
        yield Message(f"On {branches.present}; the clock is at {session.engine.now:.3f} s")
    else:
        origin = branches.present
        branches.make(name)
        yield Message(f"On {name}, a new branch of {origin}; the clock is at {session.engine.now:.3f} s")


def _branch_row(session: Session, name: str) -> BranchRow:
    line = session.branches.line(name)
    present = name == session.branches.present
    return BranchRow(name, present, len(line.history.done), line.timeline.end, line.clock)


def _tasks_stand(session: Session) -> None:
    """Raises UsageError while a task waits for a time of the present branch."""
    running = next(session.driver.tasks.running, None)
    if running is not None:
        number = "" if running.number == ROBOT_PROGRAM else f" {running.number}"
        raise UsageError(f"{running.task.program} is running", f"ABORT{number} stops it")


def _compare(session: Session, it: Instruction) -> Iterator[Reply]:
    from vrs_cli.engine.comparison import compare

    branches = session.branches
    a, b = _argument(it, 0), _argument(it, 1)
    first, second = MAIN if a is None else _text(a), branches.present if b is None else _text(b)
    if first.lower() == second.lower():
        raise UsageError(f"{first} is the same as {second}", "COMPARE a, b; BRANCH lists the branches")
    comparison = compare(session.engine.arm, branches.line(first), branches.line(second))
    yield ComparisonTable(branches.spelled(first), branches.spelled(second), comparison, session.environment.units)


def _merge(session: Session, it: Instruction) -> Iterator[Reply]:
    asked = _argument(it, 0)
    name = session.branches.spelled(session.branches.present if asked is None else _text(asked))
    _tasks_stand(session)
    again = session.branches.merge(name)
    how = f", {again} command{'' if again == 1 else 's'} of it planned again" if again else ""
    yield Message(f"{name} is merged into main{how}; the timeline ends at {session.engine.end:.3f} s")


def _deleteb(session: Session, it: Instruction) -> Iterator[Reply]:
    branches = session.branches
    doomed = [branches.droppable(_text(argument)) for argument in it.arguments]
    _tasks_stand(session)
    refused = _refused(session, f"{_listed(doomed)} will be deleted.")
    if refused:
        yield refused
        return
    for name in doomed:
        branches.drop(name)


def _timeline(session: Session, _it: Instruction) -> Iterator[Reply]:
    engine = session.engine
    yield TimelineTable(engine.records(), engine.timeline, engine.now)


def _plot(session: Session, it: Instruction) -> Iterator[Reply]:
    engine = session.engine
    asked = selected(engine.arm, [_text(argument) for argument in it.arguments if argument is not None])
    if engine.end <= engine.timeline.start:
        yield Message("No motions yet")
    else:
        yield plotted(engine.arm, engine.timeline, asked)


def _leave(_session: Session, _it: Instruction) -> Iterator[Reply]:
    yield Farewell()


# --- the table -----------------------------------------------------------------------------------------------------

MONITOR: Mapping[str, Handler] = {
    "WHERE": _where,
    "WHY": _why,
    "HERE": _here,
    "POINT": _point,
    "TEACH": _teach,
    "TOOL": _tool,
    "BASE": _base,
    "LISTL": _listl,
    "LISTR": _listr,
    "LISTS": _lists,
    "LISTP": _listp,
    "DIRECTORY": _directory,
    "COPY": _copy,
    "RENAME": _rename,
    "DELETE": _delete,
    "DELETEP": _deletep,
    "DELETEL": _delete_variables(Kind.LOCATION, Kind.PRECISION),
    "DPOINT": _delete_variables(Kind.LOCATION, Kind.PRECISION),
    "DELETER": _delete_variables(Kind.REAL),
    "DELETES": _delete_variables(Kind.STRING),
    "ZERO": _zero,
    "LOAD": _load,
    "LOADP": _load,
    "LOADL": _load,
    "STORE": _store(".v2", "PROGRAMS", "LOCATIONS", "REALS", "STRINGS"),
    "STOREP": _store(".pg", "PROGRAMS"),
    "STOREL": _store(".lc", "LOCATIONS"),
    "STORER": _store(".rv", "REALS"),
    "STORES": _store(".st", "STRINGS"),
    "EDIT": _edit,
    "SEE": _see,
    "FLIST": _flist,
    "FDIRECTORY": _fdirectory,
    "LISTF": _fdirectory,
    "FDELETE": _fdelete,
    "FCOPY": _fcopy,
    "FRENAME": _frename,
    "COMMANDS": _commands,
    "SAVE": _save,
    "REPLAY": _replay,
    "EXECUTE": _execute,
    "ABORT": _abort,
    "PROCEED": _proceed,
    "RETRY": _retry,
    "PRIME": _prime,
    "SSTEP": _step(over=True),
    "XSTEP": _step(over=False),
    "NEXT": _step(over=True),
    "BPT": _bpt,
    "WATCH": _watch,
    "KILL": _kill,
    "CYCLE.END": _cycle_end,
    "PCEXECUTE": _pc_execute,
    "PCABORT": _process_control(_abort_task),
    "PCEND": _process_control(lambda session, number: (_ends(session, number),)),
    "PCPROCEED": _process_control(lambda session, number: _go_on(session, number, retry=False)),
    "PCRETRY": _process_control(lambda session, number: _go_on(session, number, retry=True)),
    "PCSTATUS": _process_control(lambda session, number: (_status_of(session, number),)),
    "SPEED": _speed,
    "SIGNAL": _signal,
    "RESET": _as_instruction,
    "CALIBRATE": _calibrate,
    "SELECT": _as_instruction,
    "ENABLE": _as_instruction,
    "DISABLE": _as_instruction,
    "SWITCH": _switch,
    "PARAMETER": _parameter,
    "STATUS": _status,
    "IO": _io,
    "TIME": _time,
    "CLOCK": clock,
    "ID": _id,
    "FREE": _free,
    "HELP": _help,
    "JOG": jog,
    "UNDO": _undo,
    "REDO": _redo,
    "BRANCH": _branch,
    "COMPARE": _compare,
    "MERGE": _merge,
    "DELETEB": _deleteb,
    "TIMELINE": _timeline,
    "PLOT": _plot,
    "EXIT": _leave,
    "QUIT": _leave,
}
