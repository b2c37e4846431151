"""Commands on programs: list, copy, rename, delete, edit, start, stop and continue them, and run them step by step."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from fnmatch import fnmatchcase
from functools import partial

from msgspec.structs import replace

from vrs_cli.errors import IllegalValue, NoProgramSpecified, ProgramExists, UsageError
from vrs_cli.files.layout import Layout
from vrs_cli.files.store import variables_used, with_called
from vrs_cli.interfaces.dialogue import Dialogue, beside_if
from vrs_cli.interfaces.editor import buffer, editors
from vrs_cli.interfaces.station import loaded_file, operands
from vrs_cli.interfaces.station.station import Station
from vrs_cli.interfaces.tasks.tasks import PROMPT_LINE, ROBOT_PROGRAM, Stepping, Track, Watch
from vrs_cli.language.run import effects, runtime, variables
from vrs_cli.language.run.memory import StoredProgram
from vrs_cli.language.run.semantics.instructions import checked_task
from vrs_cli.language.text import ast, printer
from vrs_cli.language.words import values
from vrs_cli.values import questions, replies, results
from vrs_cli.values.numbers import Value


@operands.handles("LISTP")
def _list_programs(station: Station, it: ast.Instruction) -> Dialogue[None]:
    """List the named programs in canonical form; if no name is given, list all programs."""
    environment = station.environment
    stored = [environment.program_by_prefix(name) for name in operands.words(it)] or list(environment.programs.values())
    if not stored:
        yield replies.ProgramNames(())
    for one in stored:
        steps = yield from beside_if(
            len(one.program.steps) > loaded_file.LONG_PROGRAM, partial(buffer.list_steps, one.analysis)
        )
        yield replies.ProgramText(printer.program_header(one.program), steps)


@operands.handles("DIRECTORY")
def _list_names(station: Station, it: ast.Instruction) -> Dialogue[None]:
    """List the names of all programs, or of those that match a pattern."""
    pattern, programs = operands.word_or(it, 0, "*").lower(), dict(station.programs)
    rows = yield from beside_if(
        len(programs) > operands.LONG_LIST,
        lambda: tuple(row for row in program_names(programs) if fnmatchcase(row.name.lower(), pattern)),
    )
    yield replies.ProgramNames(rows)


def program_names(programs: Mapping[str, StoredProgram]) -> Iterator[replies.ProgramName]:
    """Yield a table row for each program, sorted by name."""
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
    """Delete programs, the programs that only they call, and the variables that only the deleted programs use."""
    environment = station.environment
    named = {environment.program(operands.word(argument)).program.key for argument in it.arguments}
    memory = environment.copy()

    def find() -> tuple[list[str], frozenset[str]]:
        """Return the keys of the programs to delete, and of the variables that only those programs use."""
        under = {program.key for program in with_called(memory, sorted(named))}
        outside = [key for key in memory.programs if key not in under]
        kept = {program.key for program in with_called(memory, outside)} - named
        keys = [key for key in memory.programs if key in under - kept]
        still_used = variables_used(memory.programs[key].program for key in kept)
        return keys, variables_used(memory.programs[key].program for key in keys) - still_used

    long = sum(len(stored.program.steps) for stored in memory.programs.values()) > loaded_file.LONG_PROGRAM
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
    """Delete programs if the user agrees. Return whether they were deleted. `question`: the question to the user, after
    their names. Raises ProgramInterlocked."""
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
    editor = editors.Editor(station, (yield from buffer.open_program(station, program, step)))
    station.user_state.editor, station.user_state.last_edited = editor, program.name
    yield from (yield from editor.screen())


@operands.handles("SEE")
def _see(station: Station, it: ast.Instruction) -> Dialogue[None]:
    program, step = _program_to_edit(station, it)
    user_state, line_by_line = station.user_state, f"EDIT {program.name} edits line by line"
    if not user_state.attended:
        raise UsageError("SEE fills a terminal, and there is none", line_by_line)
    draft = editors.ScreenDraft(station, (yield from buffer.open_program(station, program, step)))
    user_state.last_edited = program.name
    if not (yield from user_state.show(draft, questions.Editing(draft.name, draft.text, draft.row, draft.dialect))):
        raise UsageError("SEE fills the screen, and this terminal cannot", line_by_line)
    yield from draft.said


def _program_to_edit(station: Station, it: ast.Instruction) -> tuple[ast.Program, int]:
    """Return the program to edit (by default the last one) and the number of the step at which to begin. Raises
    NoProgramSpecified, IllegalValue."""
    given = operands.operand(it, 0)
    last = station.user_state.last_edited or station.last_program
    if given is None and last is None:
        raise NoProgramSpecified("none was edited before", f"{it.word} name")
    step = values.whole(operands.real_or(station, it, 1, 1.0))
    if step < 1:
        raise IllegalValue(f"step {step}", "steps count from 1")
    program = buffer.named_program(last or "") if given is None else buffer.asked_program(given)
    if program.name.lower().endswith((".v2", ".pg")) and program.key not in station.environment.programs:
        raise UsageError(
            f"{it.word} takes the name of a program, not of a file",
            f"LOAD {program.name} loads a file, {it.word} {program.name[:-3]} opens a program of it",
        )
    return program, step


# --- running programs -------------------------------------------------------------------------------------------------


@operands.handles("EXECUTE")
def _execute(station: Station, it: ast.Instruction) -> Dialogue[None]:
    """Run a program as the robot program. With a task number, start it as another task."""
    number = values.whole(operands.real_or(station, it, 3, 0.0))
    if number:
        yield from _start(station, it, checked_task(number))
    else:
        yield from run(station, station.begin(*(yield from asked_program(station, it))))


def asked_program(
    station: Station, it: ast.Instruction
) -> Dialogue[tuple[str | None, tuple[variables.Reference | None, ...], int, int]]:
    """Compile the program that EXECUTE or a similar command names. Return its name, arguments, number of cycles and
    first step. Raises UndefinedName."""
    given = operands.operand(it, 0)
    name = None if given is None else station.environment.program_by_prefix(operands.word(given)).name
    step = values.whole(operands.real_or(station, it, 2, 1.0))
    yield from station.compile_program(name, everywhere=step > 1)
    expressions = given.arguments if isinstance(given, ast.ProgramCall) else ()
    arguments = runtime.arguments_of(station.environment, station.engine, expressions)
    return name, arguments, values.whole(operands.real_or(station, it, 1, 1.0)), step


@operands.handles("PCEXECUTE", number=effects.PROCESS_CONTROL)
def _start(station: Station, it: ast.Instruction, number: int) -> Dialogue[None]:
    """Start a program as a task that runs at the same time as the robot program."""
    name, arguments, cycles, step = yield from asked_program(station, it)
    if name is None:
        raise NoProgramSpecified(f"task {number} needs a program", "name it")
    station.start(number, name, arguments, cycles, step)


def _task_number(station: Station, it: ast.Instruction) -> int:
    """Return the number of the task that a command names; 0 (the robot program) if none is named."""
    return checked_task(operands.real_or(station, it, 0, 0.0))


@operands.handles("PROCEED")
@operands.handles("RETRY", retry=True)
@operands.handles("PCPROCEED", number=effects.PROCESS_CONTROL)
@operands.handles("PCRETRY", number=effects.PROCESS_CONTROL, retry=True)
def _go_on(station: Station, it: ast.Instruction, number: int | None = None, retry: bool = False) -> Dialogue[None]:
    """Continue a stopped task. `number`: the task, by default as typed. `retry`: repeat the step at which the task
    stopped."""
    number = _task_number(station, it) if number is None else number
    track = station.tasks.get(number)
    # the task continues at another step than the next one, so compile the variant that can start at any step
    if track is not None and (retry or track.task.fault is not None):
        yield from station.compile_program(track.task.program, everywhere=True)
    if not number:
        yield from run(station, station.resume(retry=retry))
    else:
        station.tasks.proceed(number, retry=retry)
        station.settle()


@operands.handles("CYCLE.END")
@operands.handles("PCEND", number=effects.PROCESS_CONTROL)
def _end_cycles(station: Station, it: ast.Instruction, number: int | None = None) -> Iterable[replies.Reply]:
    track = station.tasks.end_cycles(_task_number(station, it) if number is None else number)
    yield results.Message(f"{track.task.program} ends after its present cycle")


operands.handles("KILL")(lambda station, it: station.tasks.kill(_task_number(station, it)))


def run(station: Station, track: Track) -> Dialogue[None]:
    """Wait until a program has stopped, and report how it ended. If the user continues typing while it runs, do not
    wait; the report is shown when the program has stopped."""
    if station.user_state.lives and not station.user_state.command_files:
        station.let_run(track, lambda result: station.terminal.show(ending_reply(station, result)))
    else:
        yield ending_reply(station, (yield from station.wait(track)))


def ending_reply(station: Station, result: results.RunResult) -> replies.Reply:
    if (fault := result.fault) is not None:
        return results.ProgramStopped(fault.message, fault.program, fault.step, fault.source, results.Tone.ERROR)
    task = station.task
    if result.outcome is results.RunOutcome.COMPLETED or task is None:
        return results.Message(result.outcome.value)
    before = result.outcome in (results.RunOutcome.STEPPED, results.RunOutcome.BREAKPOINT, results.RunOutcome.WATCHED)
    return results.ProgramStopped(
        f"{result.outcome.value} {result.detail}".strip(), result.program, task.step, task.source if before else ""
    )


@operands.handles("ABORT")
@operands.handles("PCABORT", number=effects.PROCESS_CONTROL)
def _abort(station: Station, it: ast.Instruction, number: int | None = None) -> Iterable[replies.Reply]:
    """Stop a task; without a number, stop the robot program and the motion."""
    number = _task_number(station, it) if number is None else number
    if not number:
        return _stop(station, station.abort)
    track = station.tasks.abort(number)
    station.settle()
    return [results.Message("Nothing is running") if track is None else _abort_reply(track.task)]


def emergency_stop(station: Station) -> Dialogue[None]:
    """Stop the motion and all tasks immediately, and report what was stopped."""
    others = [track.task for track in station.tasks.running if track.number not in (PROMPT_LINE, ROBOT_PROGRAM)]
    said = [*_stop(station, station.stop), *map(_abort_reply, others)]
    yield from (one for one in said if not (others and isinstance(one, results.Message)))


def _stop(station: Station, stop: Callable[[], None]) -> list[replies.Reply]:
    """Call `stop`, and return replies that say what was stopped. Return none to a user who is waiting for the program,
    because that wait then ends with its own report."""
    scheduled, running, task = station.engine.now < station.engine.end, station.running, station.task
    track = station.tasks.get(ROBOT_PROGRAM)
    waits = running and track is not None and track.driven_by is station.user_state
    stop()
    if waits:
        return []
    if task is not None and (running or not task.is_over):
        return [_abort_reply(task)]
    return [results.Message("The motion is stopped" if scheduled else "Nothing is running")]


def _abort_reply(task: runtime.Task) -> results.ProgramStopped:
    return results.ProgramStopped(results.RunOutcome.ABORTED.value, task.program, task.step)


# --- step by step -----------------------------------------------------------------------------------------------------


@operands.handles("PRIME")
def _prime(station: Station, it: ast.Instruction) -> Dialogue[None]:
    task = station.begin(*(yield from asked_program(station, it)), primed=True).task
    yield results.ProgramStopped("(PRIMED)", task.program, task.step)


@operands.handles("SSTEP", "XSTEP", "NEXT")
def _step(station: Station, it: ast.Instruction) -> Dialogue[None]:
    """Carry out one step of the named program, or of the stopped one. XSTEP also stops inside called programs."""
    if operands.operand(it, 0) is not None:
        station.begin(*(yield from asked_program(station, it)), primed=True)
    yield from run(station, station.resume(stepping=Stepping(over=it.word != "XSTEP")))


@operands.handles("BPT")
def _set_breakpoint(station: Station, it: ast.Instruction) -> Dialogue[None]:
    """Set or clear a breakpoint, and list all breakpoints."""
    breakpoints, given, step = (
        station.tasks.breakpoints,
        operands.operand(it, 0),
        values.whole(operands.real_or(station, it, 1, 0.0)),
    )
    if given is not None:
        stored = station.environment.program(operands.word(given))
        key, last = stored.program.key, len(stored.program.steps)
        yield from station.compile_program(stored.name)
        if abs(step) > last:
            raise IllegalValue(f"step {abs(step)}", f"{stored.name} has the steps 1 to {last}")
        if step > 0:
            if (found := station.environment.executable(stored).compilation.stand(step - 1)) is None:
                raise IllegalValue(f"step {step}", f"nothing is done there or after it in {stored.name}")
            # `found` is the index of the first executable step at or after the given one
            breakpoints.add((key, found + 1))
        else:
            breakpoints -= {point for point in breakpoints if point[0] == key and step in (0, -point[1])}
    for key, number in sorted(breakpoints):
        yield results.Message(f"Breakpoint before step {number} of {key}")
    if not breakpoints:
        yield results.Message("No breakpoints")


@operands.handles("WATCH")
def _watch(station: Station, it: ast.Instruction) -> Dialogue[None]:
    """Watch an expression: programs stop when its value changes. Without an expression, end all watches."""
    watches, expression = station.tasks.watches, operands.operand(it, 0)
    if expression is None:
        watches.clear()
        yield results.Message("Nothing is watched")
        return
    units = station.units
    text = station.environment.signals.with_names(printer.expression_text(expression))

    def value_text(value: Value) -> str:
        if isinstance(value, str):
            return f'"{value}"'
        numbers = (value,) if isinstance(value, float) else values.numbers_of(value, units)
        return ", ".join(values.plain(round(number, 3)) for number in numbers)

    watch = Watch(text, operands.evaluator(station, expression), value_text)
    watch.change()
    watches.append(watch)
    yield results.Message(f"Programs stop when {watch.text} changes")
