"""Commands that list, copy, delete and edit the programs in memory, and list and delete variables."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from fnmatch import fnmatchcase
from functools import partial
from itertools import chain
from typing import cast

from msgspec.structs import replace

from vrs_cli.errors import IllegalValue, NoProgramSpecified, ProgramExists, TypeMismatch, UndefinedValue, UsageError
from vrs_cli.files.store import Layout, variables_used, with_called
from vrs_cli.interfaces.dialogue import Dialogue, beside, beside_if
from vrs_cli.interfaces.editor.lines import Editor, asked_program, listed, named_program, opened, refuse_running
from vrs_cli.interfaces.editor.screen import ScreenDraft
from vrs_cli.interfaces.station.loaded_file import LONG_PROGRAM
from vrs_cli.interfaces.station.operands import PLACES, Handler, agreed, operand, own, real, real_or, sight, word
from vrs_cli.interfaces.station.station import Station
from vrs_cli.kinematics.joints import Joints, JointUnits
from vrs_cli.kinematics.transform import Transform
from vrs_cli.language.run.memory import StoredProgram
from vrs_cli.language.run.variables import Index, Reference, subscript
from vrs_cli.language.text.ast import Binary, Expression, Instruction, Program, Unary, Variable
from vrs_cli.language.text.meaning import LOGICAL, RELATIONS
from vrs_cli.language.text.printer import expression_text, program_header
from vrs_cli.language.words.values import Kind, key_of, kind_of_value, whole
from vrs_cli.values.numbers import Value
from vrs_cli.values.questions import Editing
from vrs_cli.values.replies import (
    LocationTable,
    Message,
    NamedLocation,
    ProgramName,
    ProgramNames,
    ProgramText,
    RealTable,
    Reply,
    StringTable,
)

MANY_PROGRAMS = 100


def _listp(station: Station, it: Instruction) -> Dialogue[None]:
    environment = station.environment
    names = [word(argument) for argument in it.arguments if argument is not None]
    stored = [environment.meant(name) for name in names] or list(environment.programs.values())
    if not stored:
        yield ProgramNames(())
    for program in stored:
        long = len(program.program.steps) > LONG_PROGRAM
        yield (yield from beside_if(long, partial(listing, program)))


def listing(stored: StoredProgram) -> ProgramText:
    """The canonical text of a program, its steps numbered, and those marked that have a mistake."""
    return ProgramText(program_header(stored.program), listed(stored.analysis))


def _directory(station: Station, it: Instruction) -> Dialogue[None]:
    pattern = word(it.arguments[0]).lower() if operand(it, 0) is not None else "*"
    programs = dict(station.programs)

    def rows() -> tuple[ProgramName, ...]:
        return tuple(row for row in directory(programs) if fnmatchcase(row.name.lower(), pattern))

    yield ProgramNames((yield from beside_if(len(programs) > MANY_PROGRAMS, rows)))


def directory(programs: Mapping[str, StoredProgram]) -> Iterator[ProgramName]:
    """The programs of a memory, in the order of names."""
    for _, stored in sorted(programs.items()):
        comment = f"; {stored.program.comment.strip()}" if stored.program.comment else ""
        yield ProgramName(stored.name, stored.analysis.executable, len(stored.program.steps), comment)


def _copy(station: Station, it: Instruction) -> None:
    """Raises ProgramExists, UndefinedName."""
    new, old = word(it.arguments[0]), station.environment.program(word(it.value))
    if key_of(new) in station.programs:
        raise ProgramExists(new, f"DELETEP {new} deletes it")
    station.environment.store(replace(old.analysis, program=replace(old.program, name=new)), old.lines)


def _rename(station: Station, it: Instruction) -> None:
    new, old = word(it.arguments[0]), word(it.value)
    station.check_free(old)
    _copy(station, it)
    station.layout = station.layout.renamed(old, new)
    del station.programs[key_of(old)]
    if station.last_program is not None and key_of(station.last_program) == key_of(old):
        station.last_program = new


def _delete(station: Station, it: Instruction) -> Dialogue[None]:
    """DELETE programs, the programs that only these call, and the variables that only these use."""
    environment = station.environment
    named = {environment.program(word(argument)).program.key for argument in it.arguments}
    memory = environment.copy()

    def found() -> tuple[list[str], frozenset[str]]:
        """The keys of the programs that go, and of the variables that only these use."""
        under = {program.key for program in with_called(memory, sorted(named))}
        outside = [key for key in memory.programs if key not in under]
        kept = {program.key for program in with_called(memory, outside)} - named
        keys = [key for key in memory.programs if key in under - kept]
        still_used = variables_used(memory.programs[key].program for key in kept)
        return keys, variables_used(memory.programs[key].program for key in keys) - still_used

    long = sum(len(stored.program.steps) for stored in memory.programs.values()) > LONG_PROGRAM
    keys, unused = yield from beside_if(long, found)
    doomed = [environment.programs[key] for key in keys if key in environment.programs]
    if (yield from _delete_programs(station, doomed, "and what only they use go.")):
        for name in unused:
            environment.delete(name)


def _deletep(station: Station, it: Instruction) -> Dialogue[None]:
    doomed = [station.environment.program(word(argument)) for argument in it.arguments]
    yield from _delete_programs(station, doomed, "will be deleted.")


def _delete_programs(station: Station, doomed: Sequence[StoredProgram], what: str) -> Dialogue[bool]:
    """Delete programs where the user agrees. `what` the user is asked about them. Raises ProgramInterlocked."""
    for program in doomed:
        station.check_free(program.name)
    if not (yield from agreed(station, f"{', '.join(program.name for program in doomed)} {what}")):
        return False
    for program in doomed:
        station.programs.pop(program.program.key, None)
        station.layout = station.layout.with_part(program.program.key, ())
        if station.last_program is not None and key_of(station.last_program) == program.program.key:
            station.last_program = None
    station.unstored.programs_deleted()
    return True


def _zero(station: Station, _it: Instruction) -> Dialogue[None]:
    for stored in station.programs.values():
        station.check_free(stored.name)
    if not (yield from agreed(station, "All programs and variables will be deleted.")):
        return
    station.programs.clear()
    station.unstored.programs_deleted()
    station.environment.clear_variables()
    station.layout = Layout()
    station.last_program = None
    for track in list(station.tasks):
        station.tasks.forget(track.number)


def _edit(station: Station, it: Instruction) -> Dialogue[None]:
    program, step = _to_edit(station, it)
    refuse_running(station, program.name)
    editor = station.user_state.editor = Editor(station, opened(station, program, step))
    station.user_state.last_edited = program.name
    yield from (yield from editor.screen())


def _see(station: Station, it: Instruction) -> Dialogue[None]:
    program, step = _to_edit(station, it)
    user_state, line_by_line = station.user_state, f"EDIT {program.name} edits line by line"
    if not user_state.attended:
        raise UsageError("SEE fills a terminal, and there is none", line_by_line)
    refuse_running(station, program.name)
    user_state.last_edited = program.name
    draft = ScreenDraft(station, program, step)
    if not (yield from user_state.show(draft, Editing(draft.name, draft.text, draft.row, draft.dialect))):
        raise UsageError("SEE fills the screen, and this terminal cannot", line_by_line)
    yield from draft.said


def _to_edit(station: Station, it: Instruction) -> tuple[Program, int]:
    """The program that is asked for, or the last one, and the step. Raises NoProgramSpecified, IllegalValue."""
    asked = operand(it, 0)
    last = station.user_state.last_edited or station.last_program
    if asked is None and last is None:
        raise NoProgramSpecified("none was edited before", f"{it.word} name")
    step = whole(real_or(station, it, 1, 1.0))
    if step < 1:
        raise IllegalValue(f"step {step}", "steps count from 1")
    return (named_program(last or "") if asked is None else asked_program(asked)), step


PROGRAMS: Mapping[str, Handler] = {
    "LISTP": _listp,
    "DIRECTORY": _directory,
    "COPY": _copy,
    "RENAME": _rename,
    "DELETE": _delete,
    "DELETEP": _deletep,
    "ZERO": _zero,
    "EDIT": _edit,
    "SEE": _see,
}


MANY_VARIABLES = 100
Rows = tuple[tuple[str, Value], ...]

REALS, STRINGS = (Kind.REAL,), (Kind.STRING,)


def _table(kinds: tuple[Kind, ...], rows: Rows, units: JointUnits, truth: bool = False) -> Reply:
    """The reply for variables of these kinds. `truth`: a real stands for true or false."""
    if kinds == REALS:
        return RealTable(tuple((name, cast(float, value)) for name, value in rows), truth)
    if kinds == STRINGS:
        return StringTable(tuple((name, cast(str, value)) for name, value in rows))
    named = tuple(NamedLocation.of(name, cast("Transform | Joints", value)) for name, value in rows)
    return LocationTable(named, units)


def _list(kinds: tuple[Kind, ...], otherwise: str) -> Handler:
    def listed(station: Station, it: Instruction) -> Dialogue[None]:
        rows = yield from _rows(station, it, kinds, otherwise)
        yield (yield from beside_if(len(rows) >= MANY_VARIABLES, lambda: _table(kinds, rows, station.units)))

    return listed


def shown_value(station: Station, expression: Expression) -> Dialogue[None]:
    """An expression alone at the prompt: what LISTR, LISTL or LISTS of it answers."""
    if isinstance(expression, Binary) and expression.operator == "==" and isinstance(expression.left, Variable):
        yield Message(f"== compares; {expression_text(expression.left)} = {expression_text(expression.right)} assigns")
    rows = yield from _values(station, expression)
    truth = isinstance(expression, Binary | Unary) and expression.operator in RELATIONS | LOGICAL
    yield _table((kind_of_value(rows[0][1]),), rows, station.units, truth)


def _rows(station: Station, it: Instruction, kinds: tuple[Kind, ...], otherwise: str) -> Dialogue[Rows]:
    """The values of the arguments, each with its name or text; without arguments all variables of these kinds."""
    asked = [argument for argument in it.arguments if argument is not None]
    if not asked:
        memory = station.environment.copy()
        return (yield from beside(lambda: tuple(chain.from_iterable(map(memory.variables, kinds)))))
    rows: list[tuple[str, Value]] = []
    for expression in asked:
        found = yield from _values(station, expression)
        for name, value in found:
            if kind_of_value(value) not in kinds:
                raise TypeMismatch(f"{name} is a {kind_of_value(value).value}", otherwise)
        rows += found
    return tuple(rows)


def _values(station: Station, expression: Expression) -> Dialogue[Rows]:
    """An expression with its value; for a name alone, the simple variable and all elements of the array."""
    rows: Rows = ()
    if isinstance(expression, Variable) and not expression.indexes:
        key = expression.key
        if (reference := own(station).get(key)) is not None:
            rows = tuple(_own_elements(station, expression, reference))
        else:
            found = station.environment.alone(key)
            rows = yield from beside_if(
                found.count() >= MANY_VARIABLES, lambda: tuple(chain.from_iterable(map(found.variables, Kind)))
            )
    return rows or ((expression_text(expression), sight(station, expression)()),)


def _own_elements(station: Station, asked: Variable, reference: Reference) -> Iterator[tuple[str, Value]]:
    """Return the values of a variable that the stopped program has to itself. Raises UndefinedValue where there is
    none.
    """
    program, name = station.task.program if station.task is not None else "", asked.sigil + asked.name
    if reference.key is not None:
        yield f"{name} ({program})", reference.value()
        return
    for cells in (reference.cells, reference.locations):
        indexes = [index for index in cells if not isinstance(index, str)]
        for index in sorted(indexes, key=lambda index: index if isinstance(index, tuple) else (index,)):
            yield f"{name}[{subscript(index)}] ({program})", cells[index]


def _delete_variables(kinds: tuple[Kind, ...]) -> Handler:
    def delete(station: Station, it: Instruction) -> Dialogue[None]:
        doomed = [_variable_of(station, argument, kinds) for argument in it.arguments]
        if not (yield from agreed(station, f"{', '.join(name for name, _ in doomed)} will be deleted.")):
            return
        for name, index in doomed:
            station.environment.delete(name, index)

    return delete


def _variable_of(station: Station, expression: Expression | None, kinds: tuple[Kind, ...]) -> tuple[str, Index | None]:
    """The name, and the index of one element. Raises UndefinedValue, TypeMismatch."""
    if not isinstance(expression, Variable):
        raise TypeMismatch("an expression", "the name of a variable is wanted")
    name = expression.sigil + expression.name
    kind = station.environment.kind_of(name)
    if kind is None:
        raise UndefinedValue(name, "there is nothing to delete")
    if kind not in kinds:
        raise TypeMismatch(f"{name} is a {kind.value}")
    indexes = tuple(whole(real(station, index)) for index in expression.indexes or ())
    return name, None if not indexes else indexes[0] if len(indexes) == 1 else indexes


VARIABLES: Mapping[str, Handler] = {
    "LISTL": _list(PLACES, "LISTR lists reals, LISTS strings"),
    "LISTR": _list(REALS, "LISTL lists locations, LISTS strings"),
    "LISTS": _list(STRINGS, "LISTL lists locations, LISTR reals"),
    "DELETEL": _delete_variables(PLACES),
    "DPOINT": _delete_variables(PLACES),
    "DELETER": _delete_variables(REALS),
    "DELETES": _delete_variables(STRINGS),
}
