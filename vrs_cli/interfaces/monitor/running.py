"""Commands that start and stop programs, let them go on, and do them step by step."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from functools import partial

from vrs_cli.errors import IllegalValue, NoProgramSpecified
from vrs_cli.interfaces.dialogue import Dialogue
from vrs_cli.interfaces.station.operands import Handler, operand, real_or, sight, word
from vrs_cli.interfaces.station.station import Station
from vrs_cli.interfaces.tasks.tasks import PROMPT_LINE, ROBOT_PROGRAM, Stepping, Track, Watch
from vrs_cli.kinematics.joints import JointUnits
from vrs_cli.language.run.effects import PROCESS_CONTROL
from vrs_cli.language.run.runtime import Task, arguments_of
from vrs_cli.language.run.semantics.instructions import checked_task
from vrs_cli.language.run.variables import Reference
from vrs_cli.language.text.ast import Instruction, ProgramCall
from vrs_cli.language.text.printer import expression_text
from vrs_cli.language.words.values import numbers_of, plain, whole
from vrs_cli.values.numbers import Value
from vrs_cli.values.replies import Message, ProgramStopped, Reply, Tone
from vrs_cli.values.results import RunOutcome, RunResult


def _execute(station: Station, it: Instruction) -> Dialogue[None]:
    number = whole(real_or(station, it, 3, 0.0))
    if number:
        yield from _start(station, it, checked_task(number))
    else:
        yield from run(station, station.begin(*(yield from asked_program(station, it))))


def asked_program(
    station: Station, it: Instruction
) -> Dialogue[tuple[str | None, tuple[Reference | None, ...], int, int]]:
    """Program (which is compiled), arguments, cycles and first step of EXECUTE and the like. Raises UndefinedName."""
    asked = operand(it, 0)
    name = None if asked is None else station.environment.meant(word(asked)).name
    step = whole(real_or(station, it, 2, 1.0))
    yield from station.compiled(name, everywhere=step > 1)
    given = asked.arguments if isinstance(asked, ProgramCall) else ()
    arguments = arguments_of(station.environment, station.engine, given)
    return name, arguments, whole(real_or(station, it, 1, 1.0)), step


def _start(station: Station, it: Instruction, number: int) -> Dialogue[None]:
    """Start a task beside the robot program."""
    name, arguments, cycles, step = yield from asked_program(station, it)
    if name is None:
        raise NoProgramSpecified(f"task {number} needs a program", "name it")
    station.start(number, name, arguments, cycles, step)


def _go_on(station: Station, number: int, retry: bool = False) -> Dialogue[None]:
    track = station.tasks.get(number)
    if track is not None and (retry or track.task.fault is not None):  # it goes on beside the step that failed
        yield from station.compiled(track.task.program, everywhere=True)
    if not number:
        yield from run(station, station.resume(retry=retry))
    else:
        station.tasks.proceed(number, retry=retry)
        station.settle()


def _end_cycles(station: Station, number: int) -> Iterable[Reply]:
    track = station.tasks.end_cycles(number)
    yield Message(f"{track.task.program} ends after its present cycle")


def run(station: Station, track: Track) -> Dialogue[None]:
    """Wait for a program, and tell how it ended; where the user goes on meanwhile, that is told at the end."""
    if station.user_state.lives and not station.user_state.command_files:
        station.let_run(track, lambda result: station.terminal.show(ending(station, result)))
    else:
        yield ending(station, (yield from station.wait(track)))


def ending(station: Station, result: RunResult) -> Reply:
    """The reply at the end of a program."""
    if result.fault is not None:
        fault = result.fault
        return ProgramStopped(fault.message, fault.program, fault.step, fault.source, Tone.ERROR)
    task = station.task
    if result.outcome is RunOutcome.COMPLETED or task is None:
        return Message(result.outcome.value)
    before = result.outcome in (RunOutcome.STEPPED, RunOutcome.BREAKPOINT, RunOutcome.WATCHED)
    what = f"{result.outcome.value} {result.detail}".strip()
    return ProgramStopped(what, result.program, task.step, task.source if before else "")


def _abort(station: Station, number: int) -> Iterable[Reply]:
    if not number:
        return _stopped(station, station.abort)
    track = station.tasks.abort(number)
    station.settle()
    return [Message("Nothing is running") if track is None else _aborted(track.task)]


def emergency_stop(station: Station) -> Dialogue[None]:
    """Stop the motion and all tasks now, and tell what was stopped."""
    beside = [track.task for track in station.tasks.running if track.number not in (PROMPT_LINE, ROBOT_PROGRAM)]
    said = [*_stopped(station, station.stop), *map(_aborted, beside)]
    yield from (one for one in said if not (beside and isinstance(one, Message)))


def _stopped(station: Station, stop: Callable[[], None]) -> list[Reply]:
    """Stop, and tell what was stopped. A user who waits for the end of the program is told of that, and
    needs no reply.
    """
    scheduled, running, task = station.engine.now < station.engine.end, station.running, station.task
    track = station.tasks.get(ROBOT_PROGRAM)
    waits = running and track is not None and track.driven_by is station.user_state
    stop()
    if waits:
        return []
    if task is not None and (running or not task.ended):
        return [_aborted(task)]
    return [Message("The motion is stopped" if scheduled else "Nothing is running")]


def _aborted(task: Task) -> ProgramStopped:
    return ProgramStopped(RunOutcome.ABORTED.value, task.program, task.step)


def of_task(
    act: Callable[[Station, int], Dialogue[None] | Iterable[Reply] | None], number: int | None = None
) -> Handler:
    """A command for the task with this number; without one, for the task that is named, or for the robot program."""
    return lambda station, it: act(station, checked_task(real_or(station, it, 0, 0.0)) if number is None else number)


# --- step by step -----------------------------------------------------------------------------------------------------


def _prime(station: Station, it: Instruction) -> Dialogue[None]:
    task = station.begin(*(yield from asked_program(station, it)), primed=True).task
    yield ProgramStopped("(PRIMED)", task.program, task.step)


def _step(station: Station, it: Instruction) -> Dialogue[None]:
    """SSTEP, XSTEP: do one step of a program that is named, or of the one that has stopped."""
    if operand(it, 0) is not None:
        station.begin(*(yield from asked_program(station, it)), primed=True)
    yield from run(station, station.resume(stepping=Stepping(over=it.word != "XSTEP")))


def _bpt(station: Station, it: Instruction) -> Dialogue[None]:
    breakpoints, asked, step = station.tasks.breakpoints, operand(it, 0), whole(real_or(station, it, 1, 0.0))
    if asked is not None:
        stored = station.environment.program(word(asked))
        key, last = stored.program.key, len(stored.program.steps)
        yield from station.compiled(stored.name)
        if abs(step) > last:
            raise IllegalValue(f"step {abs(step)}", f"{stored.name} has the steps 1 to {last}")
        if step > 0:
            found = station.environment.executable(stored).compiled.stand(step - 1)
            if found is None:
                raise IllegalValue(f"step {step}", f"nothing is done there or after it in {stored.name}")
            breakpoints.add((key, found + 1))  # the first step behind it at which something is done
        else:
            breakpoints -= {point for point in breakpoints if point[0] == key and step in (0, -point[1])}
    for key, number in sorted(breakpoints):
        yield Message(f"Breakpoint before step {number} of {key}")
    if not breakpoints:
        yield Message("No breakpoints")


def _watch(station: Station, it: Instruction) -> Dialogue[None]:
    watches, expression = station.tasks.watches, operand(it, 0)
    if expression is None:
        watches.clear()
        yield Message("Nothing is watched")
        return
    units = station.units
    text = station.environment.signals.said(expression_text(expression))
    watch = Watch(text, sight(station, expression), lambda value: _value_text(value, units))
    watch.changed()
    watches.append(watch)
    yield Message(f"Programs stop when {watch.text} changes")


def _value_text(value: Value, units: JointUnits) -> str:
    if isinstance(value, str):
        return f'"{value}"'
    numbers = (value,) if isinstance(value, float) else numbers_of(value, units)
    return ", ".join(plain(round(number, 3)) for number in numbers)


RUNNING: Mapping[str, Handler] = {
    "EXECUTE": _execute,
    "ABORT": of_task(_abort),
    "PROCEED": of_task(_go_on),
    "RETRY": of_task(partial(_go_on, retry=True)),
    "KILL": of_task(lambda station, number: station.tasks.kill(number)),
    "CYCLE.END": of_task(_end_cycles),
    "PCEXECUTE": lambda station, it: _start(station, it, PROCESS_CONTROL),
    "PCABORT": of_task(_abort, PROCESS_CONTROL),
    "PCEND": of_task(_end_cycles, PROCESS_CONTROL),
    "PCPROCEED": of_task(_go_on, PROCESS_CONTROL),
    "PCRETRY": of_task(partial(_go_on, retry=True), PROCESS_CONTROL),
    "PRIME": _prime,
    "SSTEP": _step,
    "XSTEP": _step,
    "NEXT": _step,
    "BPT": _bpt,
    "WATCH": _watch,
}
