"""Commands that start, stop and continue programs, and carry them out step by step."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from vrs_cli.errors import IllegalValue, NoProgramSpecified
from vrs_cli.interfaces.dialogue import Dialogue
from vrs_cli.interfaces.station.operands import evaluator, handles, operand, real_or, word
from vrs_cli.interfaces.station.station import Station
from vrs_cli.interfaces.tasks.tasks import PROMPT_LINE, ROBOT_PROGRAM, Stepping, Track, Watch
from vrs_cli.language.run import effects, runtime, variables
from vrs_cli.language.run.semantics.instructions import checked_task
from vrs_cli.language.text import ast, printer
from vrs_cli.language.words.values import numbers_of, plain, whole
from vrs_cli.values import replies, results
from vrs_cli.values.numbers import Value


@handles("EXECUTE")
def _execute(station: Station, it: ast.Instruction) -> Dialogue[None]:
    """Run a program; with a task number, start it as a task beside the others."""
    number = whole(real_or(station, it, 3, 0.0))
    if number:
        yield from _start(station, it, checked_task(number))
    else:
        yield from run(station, station.begin(*(yield from asked_program(station, it))))


def asked_program(
    station: Station, it: ast.Instruction
) -> Dialogue[tuple[str | None, tuple[variables.Reference | None, ...], int, int]]:
    """Compile the program that EXECUTE or a similar command names. Return its name, arguments, cycles and first step.
    Raises UndefinedName.
    """
    given = operand(it, 0)
    name = None if given is None else station.environment.meant(word(given)).name
    step = whole(real_or(station, it, 2, 1.0))
    yield from station.compile_program(name, everywhere=step > 1)
    expressions = given.arguments if isinstance(given, ast.ProgramCall) else ()
    arguments = runtime.arguments_of(station.environment, station.engine, expressions)
    return name, arguments, whole(real_or(station, it, 1, 1.0)), step


@handles("PCEXECUTE", number=effects.PROCESS_CONTROL)
def _start(station: Station, it: ast.Instruction, number: int) -> Dialogue[None]:
    """Start a task beside the robot program."""
    name, arguments, cycles, step = yield from asked_program(station, it)
    if name is None:
        raise NoProgramSpecified(f"task {number} needs a program", "name it")
    station.start(number, name, arguments, cycles, step)


def _task_number(station: Station, it: ast.Instruction) -> int:
    """Return the number of the task that a command names; 0 (the robot program) if it names none."""
    return checked_task(real_or(station, it, 0, 0.0))


@handles("PROCEED")
@handles("RETRY", retry=True)
@handles("PCPROCEED", number=effects.PROCESS_CONTROL)
@handles("PCRETRY", number=effects.PROCESS_CONTROL, retry=True)
def _go_on(station: Station, it: ast.Instruction, number: int | None = None, retry: bool = False) -> Dialogue[None]:
    """Continue a stopped task; `retry`: with the step that failed."""
    number = _task_number(station, it) if number is None else number
    track = station.tasks.get(number)
    # the task continues at another step than the next one
    if track is not None and (retry or track.task.fault is not None):
        yield from station.compile_program(track.task.program, everywhere=True)
    if not number:
        yield from run(station, station.resume(retry=retry))
    else:
        station.tasks.proceed(number, retry=retry)
        station.settle()


@handles("CYCLE.END")
@handles("PCEND", number=effects.PROCESS_CONTROL)
def _end_cycles(station: Station, it: ast.Instruction, number: int | None = None) -> Iterable[replies.Reply]:
    track = station.tasks.end_cycles(_task_number(station, it) if number is None else number)
    yield replies.Message(f"{track.task.program} ends after its present cycle")


handles("KILL")(lambda station, it: station.tasks.kill(_task_number(station, it)))


def run(station: Station, track: Track) -> Dialogue[None]:
    """Wait for a program, and report how it ended. If the user goes on typing meanwhile, the report comes at the
    end.
    """
    if station.user_state.lives and not station.user_state.command_files:
        station.let_run(track, lambda result: station.terminal.show(ending(station, result)))
    else:
        yield ending(station, (yield from station.wait(track)))


def ending(station: Station, result: results.RunResult) -> replies.Reply:
    if result.fault is not None:
        fault = result.fault
        return replies.ProgramStopped(fault.message, fault.program, fault.step, fault.source, replies.Tone.ERROR)
    task = station.task
    if result.outcome is results.RunOutcome.COMPLETED or task is None:
        return replies.Message(result.outcome.value)
    before = result.outcome in (results.RunOutcome.STEPPED, results.RunOutcome.BREAKPOINT, results.RunOutcome.WATCHED)
    what = f"{result.outcome.value} {result.detail}".strip()
    return replies.ProgramStopped(what, result.program, task.step, task.source if before else "")


@handles("ABORT")
@handles("PCABORT", number=effects.PROCESS_CONTROL)
def _abort(station: Station, it: ast.Instruction, number: int | None = None) -> Iterable[replies.Reply]:
    """Stop a task; if none is named, the robot program and the motion."""
    number = _task_number(station, it) if number is None else number
    if not number:
        return _stop(station, station.abort)
    track = station.tasks.abort(number)
    station.settle()
    return [replies.Message("Nothing is running") if track is None else _abort_reply(track.task)]


def emergency_stop(station: Station) -> Dialogue[None]:
    """Stop the motion and all tasks now, and report what was stopped."""
    others = [track.task for track in station.tasks.running if track.number not in (PROMPT_LINE, ROBOT_PROGRAM)]
    said = [*_stop(station, station.stop), *map(_abort_reply, others)]
    yield from (one for one in said if not (others and isinstance(one, replies.Message)))


def _stop(station: Station, stop: Callable[[], None]) -> list[replies.Reply]:
    """Call `stop`, and report what was stopped. A user who waits for the end of the program gets the report of that
    end, and needs no reply.
    """
    scheduled, running, task = station.engine.now < station.engine.end, station.running, station.task
    track = station.tasks.get(ROBOT_PROGRAM)
    waits = running and track is not None and track.driven_by is station.user_state
    stop()
    if waits:
        return []
    if task is not None and (running or not task.is_over):
        return [_abort_reply(task)]
    return [replies.Message("The motion is stopped" if scheduled else "Nothing is running")]


def _abort_reply(task: runtime.Task) -> replies.ProgramStopped:
    return replies.ProgramStopped(results.RunOutcome.ABORTED.value, task.program, task.step)


# --- step by step -----------------------------------------------------------------------------------------------------


@handles("PRIME")
def _prime(station: Station, it: ast.Instruction) -> Dialogue[None]:
    task = station.begin(*(yield from asked_program(station, it)), primed=True).task
    yield replies.ProgramStopped("(PRIMED)", task.program, task.step)


@handles("SSTEP", "XSTEP", "NEXT")
def _step(station: Station, it: ast.Instruction) -> Dialogue[None]:
    """Carry out one step of the named program, or of the stopped one; XSTEP steps into called programs."""
    if operand(it, 0) is not None:
        station.begin(*(yield from asked_program(station, it)), primed=True)
    yield from run(station, station.resume(stepping=Stepping(over=it.word != "XSTEP")))


@handles("BPT")
def _set_breakpoint(station: Station, it: ast.Instruction) -> Dialogue[None]:
    """Set or clear a breakpoint, and list all breakpoints."""
    breakpoints, given, step = station.tasks.breakpoints, operand(it, 0), whole(real_or(station, it, 1, 0.0))
    if given is not None:
        stored = station.environment.program(word(given))
        key, last = stored.program.key, len(stored.program.steps)
        yield from station.compile_program(stored.name)
        if abs(step) > last:
            raise IllegalValue(f"step {abs(step)}", f"{stored.name} has the steps 1 to {last}")
        if step > 0:
            found = station.environment.executable(stored).compilation.stand(step - 1)
            if found is None:
                raise IllegalValue(f"step {step}", f"nothing is done there or after it in {stored.name}")
            breakpoints.add((key, found + 1))  # the first executable step from there on
        else:
            breakpoints -= {point for point in breakpoints if point[0] == key and step in (0, -point[1])}
    for key, number in sorted(breakpoints):
        yield replies.Message(f"Breakpoint before step {number} of {key}")
    if not breakpoints:
        yield replies.Message("No breakpoints")


@handles("WATCH")
def _watch(station: Station, it: ast.Instruction) -> Dialogue[None]:
    """Watch an expression: programs stop when its value changes. Without an expression, stop watching."""
    watches, expression = station.tasks.watches, operand(it, 0)
    if expression is None:
        watches.clear()
        yield replies.Message("Nothing is watched")
        return
    units = station.units
    text = station.environment.signals.with_names(printer.expression_text(expression))

    def value_text(value: Value) -> str:
        if isinstance(value, str):
            return f'"{value}"'
        numbers = (value,) if isinstance(value, float) else numbers_of(value, units)
        return ", ".join(plain(round(number, 3)) for number in numbers)

    watch = Watch(text, evaluator(station, expression), value_text)
    watch.change()
    watches.append(watch)
    yield replies.Message(f"Programs stop when {watch.text} changes")
