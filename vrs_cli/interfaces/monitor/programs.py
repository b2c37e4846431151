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
from vrs_cli.interfaces.editor.buffer import asked_program, list_steps, named_program, open_program
from vrs_cli.interfaces.editor.editors import Editor, ScreenDraft
from vrs_cli.interfaces.station import operands
from vrs_cli.interfaces.station.loaded_file import LONG_PROGRAM
from vrs_cli.interfaces.station.station import Station
from vrs_cli.kinematics.joints import Joints, JointUnits
from vrs_cli.kinematics.transform import Transform
from vrs_cli.language.run.memory import StoredProgram
from vrs_cli.language.run.variables import Index, Reference, subscript
from vrs_cli.language.text import ast, printer
from vrs_cli.language.words import functions, values
from vrs_cli.values import numbers, questions, replies

MANY = 100  # a search through at least this many programs or variables counts as long


@operands.handles("LISTP")
def _list_programs(station: Station, it: ast.Instruction) -> Dialogue[None]:
    """List programs in canonical form; all programs if none is named."""
    environment = station.environment
    stored = [environment.meant(name) for name in operands.words(it)] or list(environment.programs.values())
    if not stored:
        yield replies.ProgramNames(())
    for one in stored:
        long = len(one.program.steps) > LONG_PROGRAM
        steps = yield from beside_if(long, partial(list_steps, one.analysis))
        yield replies.ProgramText(printer.program_header(one.program), steps)


@operands.handles("DIRECTORY")
def _list_names(station: Station, it: ast.Instruction) -> Dialogue[None]:
    """List the names of programs: all, or those that match a pattern."""
    pattern, programs = operands.word_or(it, 0, "*").lower(), dict(station.programs)

    def rows() -> tuple[replies.ProgramName, ...]:
        return tuple(row for row in program_names(programs) if fnmatchcase(row.name.lower(), pattern))

    yield replies.ProgramNames((yield from beside_if(len(programs) > MANY, rows)))


def program_names(programs: Mapping[str, StoredProgram]) -> Iterator[replies.ProgramName]:
    """Yield a row for each program of a memory, in the order of names."""
    for _, stored in sorted(programs.items()):
        comment = f"; {stored.program.comment.strip()}" if stored.program.comment else ""
        yield replies.ProgramName(stored.name, stored.analysis.executable, len(stored.program.steps), comment)


@operands.handles("COPY")
def _copy(station: Station, it: ast.Instruction) -> None:
    """Copy a program. Raises ProgramExists, UndefinedName."""
    new, old = operands.word(it.arguments[0]), station.environment.program(operands.word(it.value))
    if values.key_of(new) in station.programs:
        raise ProgramExists(new, f"DELETEP {new} deletes it")
    station.environment.store(replace(old.analysis, program=replace(old.program, name=new)), old.lines)


@operands.handles("RENAME")
def _rename(station: Station, it: ast.Instruction) -> None:
    """Rename a program. Raises ProgramExists, UndefinedName, ProgramInterlocked."""
    new, old = operands.word(it.arguments[0]), operands.word(it.value)
    station.check_free(old)
    _copy(station, it)
    station.layout = station.layout.with_renamed(old, new)
    del station.programs[values.key_of(old)]
    if station.last_program is not None and values.key_of(station.last_program) == values.key_of(old):
        station.last_program = new


@operands.handles("DELETE")
def _delete(station: Station, it: ast.Instruction) -> Dialogue[None]:
    """Delete programs, the programs that only they call, and the variables that only these programs use."""
    environment = station.environment
    named = {environment.program(operands.word(argument)).program.key for argument in it.arguments}
    memory = environment.copy()

    def find() -> tuple[list[str], frozenset[str]]:
        """Return the keys of the programs to delete, and of the variables that only these use."""
        under = {program.key for program in with_called(memory, sorted(named))}
        outside = [key for key in memory.programs if key not in under]
        kept = {program.key for program in with_called(memory, outside)} - named
        keys = [key for key in memory.programs if key in under - kept]
        still_used = variables_used(memory.programs[key].program for key in kept)
        return keys, variables_used(memory.programs[key].program for key in keys) - still_used

    long = sum(len(stored.program.steps) for stored in memory.programs.values()) > LONG_PROGRAM
    keys, unused = yield from beside_if(long, find)
    programs = [environment.programs[key] for key in keys if key in environment.programs]
    if (yield from _delete_programs(station, programs, "and what only they use go.")):
        for name in unused:
            environment.delete(name)


@operands.handles("DELETEP")
def _delete_named(station: Station, it: ast.Instruction) -> Dialogue[None]:
    programs = [station.environment.program(operands.word(argument)) for argument in it.arguments]
    yield from _delete_programs(station, programs, "will be deleted.")


def _delete_programs(station: Station, programs: Sequence[StoredProgram], question: str) -> Dialogue[bool]:
    """Delete programs if the user agrees; the question begins with the names of the programs. Raises
    ProgramInterlocked.
    """
    for program in programs:
        station.check_free(program.name)
    if not (yield from operands.may_delete(station, f"{', '.join(program.name for program in programs)} {question}")):
        return False
    for program in programs:
        station.programs.pop(program.program.key, None)
        station.layout = station.layout.with_part(program.program.key, ())
        if station.last_program is not None and values.key_of(station.last_program) == program.program.key:
            station.last_program = None
    station.unstored.programs_deleted()
    return True


@operands.handles("ZERO")
def _zero(station: Station, _it: ast.Instruction) -> Dialogue[None]:
    """Delete all programs and variables. Raises ProgramInterlocked."""
    for stored in station.programs.values():
        station.check_free(stored.name)
    if not (yield from operands.may_delete(station, "All programs and variables will be deleted.")):
        return
    station.programs.clear()
    station.unstored.programs_deleted()
    station.environment.clear_variables()
    station.layout = Layout()
    station.last_program = None
    for track in list(station.tasks):
        station.tasks.forget(track.number)


@operands.handles("EDIT")
def _edit(station: Station, it: ast.Instruction) -> Dialogue[None]:
    program, step = _program_to_edit(station, it)
    editor = Editor(station, (yield from open_program(station, program, step)))
    station.user_state.editor, station.user_state.last_edited = editor, program.name
    yield from (yield from editor.screen())


@operands.handles("SEE")
def _see(station: Station, it: ast.Instruction) -> Dialogue[None]:
    program, step = _program_to_edit(station, it)
    user_state, line_by_line = station.user_state, f"EDIT {program.name} edits line by line"
    if not user_state.attended:
        raise UsageError("SEE fills a terminal, and there is none", line_by_line)
    draft = ScreenDraft(station, (yield from open_program(station, program, step)))
    user_state.last_edited = program.name
    if not (yield from user_state.show(draft, questions.Editing(draft.name, draft.text, draft.row, draft.dialect))):
        raise UsageError("SEE fills the screen, and this terminal cannot", line_by_line)
    yield from draft.said


def _program_to_edit(station: Station, it: ast.Instruction) -> tuple[ast.Program, int]:
    """Return the named program, or the last one, and the step number. Raises NoProgramSpecified, IllegalValue."""
    given = operands.operand(it, 0)
    last = station.user_state.last_edited or station.last_program
    if given is None and last is None:
        raise NoProgramSpecified("none was edited before", f"{it.word} name")
    step = values.whole(operands.real_or(station, it, 1, 1.0))
    if step < 1:
        raise IllegalValue(f"step {step}", "steps count from 1")
    program = named_program(last or "") if given is None else asked_program(given)
    if program.name.lower().endswith((".v2", ".pg")) and program.key not in station.environment.programs:
        hint = f"LOAD {program.name} loads a file, {it.word} {program.name[:-3]} opens a program of it"
        raise UsageError(f"{it.word} takes the name of a program, not of a file", hint)
    return program, step


# --- variables -------------------------------------------------------------------------------------------------------

Rows = tuple[tuple[str, numbers.Value], ...]  # names or texts, with values

REALS, STRINGS = (values.Kind.REAL,), (values.Kind.STRING,)


def _table(kinds: tuple[values.Kind, ...], rows: Rows, units: JointUnits, truth: bool = False) -> replies.Reply:
    """Return the reply that lists variables of these kinds. `truth`: a real number stands for true or false."""
    if kinds == REALS:
        return replies.RealTable(tuple((name, cast(float, value)) for name, value in rows), truth)
    if kinds == STRINGS:
        return replies.StringTable(tuple((name, cast(str, value)) for name, value in rows))
    named = tuple(replies.NamedLocation.of(name, cast("Transform | Joints", value)) for name, value in rows)
    return replies.LocationTable(named, units)


@operands.handles("LISTL", kinds=operands.PLACES, hint="LISTR lists reals, LISTS strings")
@operands.handles("LISTR", kinds=REALS, hint="LISTL lists locations, LISTS strings")
@operands.handles("LISTS", kinds=STRINGS, hint="LISTL lists locations, LISTR reals")
def _list_variables(station: Station, it: ast.Instruction, kinds: tuple[values.Kind, ...], hint: str) -> Dialogue[None]:
    """List the values of the arguments, or of all variables of some kinds. Raises TypeMismatch for another kind."""
    rows, expressions = (
        list[tuple[str, numbers.Value]](),
        [argument for argument in it.arguments if argument is not None],
    )
    if not expressions:
        memory = station.environment.copy()
        rows += yield from beside(lambda: list(chain.from_iterable(map(memory.variables, kinds))))
    for expression in expressions:
        found = yield from _values(station, expression)
        for name, value in found:
            if values.kind_of_value(value) not in kinds:
                raise TypeMismatch(f"{name} is a {values.kind_of_value(value).value}", hint)
        rows += found
    yield (yield from beside_if(len(rows) >= MANY, lambda: _table(kinds, tuple(rows), station.units)))


def show_value(station: Station, expression: ast.Expression) -> Dialogue[None]:
    """Answer an expression that is typed alone at the prompt, as LISTR, LISTL or LISTS does."""
    if isinstance(expression, ast.Binary) and expression.operator == "==" and isinstance(expression.left, ast.Variable):
        left, right = printer.expression_text(expression.left), printer.expression_text(expression.right)
        yield replies.Message(f"== compares; {left} = {right} assigns")
    rows = yield from _values(station, expression)
    truth = (
        isinstance(expression, ast.Binary | ast.Unary)
        and expression.operator in functions.RELATIONS | functions.LOGICAL
    )
    yield _table((values.kind_of_value(rows[0][1]),), rows, station.units, truth)


def _values(station: Station, expression: ast.Expression) -> Dialogue[Rows]:
    """Return an expression and its value; for a name alone, the simple variable and all elements of the array."""
    rows: Rows = ()
    if isinstance(expression, ast.Variable) and not expression.indexes:
        if (reference := operands.own_variables(station).get(expression.key)) is not None:
            rows = tuple(_own_elements(station, expression, reference))
        else:
            found = station.environment.alone(expression.key)
            rows = yield from beside_if(
                found.count() >= MANY, lambda: tuple(chain.from_iterable(map(found.variables, values.Kind)))
            )
    return rows or ((printer.expression_text(expression), operands.evaluator(station, expression)()),)


def _own_elements(station: Station, asked: ast.Variable, reference: Reference) -> Iterator[tuple[str, numbers.Value]]:
    """Yield the values of a local variable of the stopped program. Raises UndefinedValue."""
    program, name = station.task.program if station.task is not None else "", asked.sigil + asked.name
    if reference.key is not None:
        yield f"{name} ({program})", reference.value()
        return
    for cells in (reference.cells, reference.locations):
        indexes = [index for index in cells if not isinstance(index, str)]
        for index in sorted(indexes, key=lambda index: index if isinstance(index, tuple) else (index,)):
            yield f"{name}[{subscript(index)}] ({program})", cells[index]


@operands.handles("DELETEL", "DPOINT", kinds=operands.PLACES)
@operands.handles("DELETER", kinds=REALS)
@operands.handles("DELETES", kinds=STRINGS)
def _delete_variables(station: Station, it: ast.Instruction, kinds: tuple[values.Kind, ...]) -> Dialogue[None]:
    """Delete variables of some kinds, or elements of arrays. Raises UndefinedValue, TypeMismatch."""
    variables = list[tuple[str, Index | None]]()
    for expression in it.arguments:
        if not isinstance(expression, ast.Variable):
            raise TypeMismatch("an expression", "the name of a variable is wanted")
        name = expression.sigil + expression.name
        kind = station.environment.kind_of(name)
        if kind is None:
            raise UndefinedValue(name, "there is nothing to delete")
        if kind not in kinds:
            raise TypeMismatch(f"{name} is a {kind.value}")
        indexes = tuple(values.whole(operands.real(station, index)) for index in expression.indexes or ())
        variables.append((name, None if not indexes else indexes[0] if len(indexes) == 1 else indexes))
    if (yield from operands.may_delete(station, f"{', '.join(name for name, _ in variables)} will be deleted.")):
        for name, index in variables:
            station.environment.delete(name, index)
