"""Programs started, stopped and gone on with."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from vrs_cli.dialogue.replies import Message, ProgramStopped, Reply, Tone
from vrs_cli.dialogue.talk import Talk
from vrs_cli.errors import NoProgramSpecified
from vrs_cli.interfaces.station.operands import Handler, operand, real_or, word
from vrs_cli.interfaces.station.station import Station
from vrs_cli.interfaces.tasks.runs import Outcome, RunResult
from vrs_cli.interfaces.tasks.track import Track
from vrs_cli.language.run.cells import Reference
from vrs_cli.language.run.prompt import arguments_of
from vrs_cli.language.run.semantics.tasks import PROCESS_CONTROL, checked_task
from vrs_cli.language.text.ast import Instruction, ProgramCall
from vrs_cli.language.words.values import whole


def _execute(station: Station, it: Instruction) -> Talk[None]:
    number = whole(real_or(station, it, 3, 0.0))
    if number:
        _start(station, it, checked_task(number))
        return
    name, arguments, cycles, step = asked_program(station, it)
    yield from run(station, station.begin(name, arguments, cycles, step))


def asked_program(station: Station, it: Instruction) -> tuple[str | None, tuple[Reference | None, ...], int, int]:
    """Program, arguments, cycles and first step of EXECUTE and its like."""
    asked = operand(it, 0)
    name = None if asked is None else word(asked)
    given = asked.arguments if isinstance(asked, ProgramCall) else ()
    arguments = arguments_of(station.environment, station.robot, given)
    return name, arguments, whole(real_or(station, it, 1, 1.0)), whole(real_or(station, it, 2, 1.0))


def _start(station: Station, it: Instruction, number: int) -> None:
    """A task beside the robot program."""
    name, arguments, cycles, step = asked_program(station, it)
    if name is None:
        raise NoProgramSpecified(f"task {number} needs a program", "name it")
    station.start(number, name, arguments, cycles, step)


def _pc_execute(station: Station, it: Instruction) -> Talk[None]:
    _start(station, it, PROCESS_CONTROL)
    yield from ()


def task_number(station: Station, it: Instruction) -> int:
    return checked_task(real_or(station, it, 0, 0.0))


def _proceed(station: Station, it: Instruction) -> Talk[None]:
    yield from _go_on(station, task_number(station, it), retry=False)


def _retry(station: Station, it: Instruction) -> Talk[None]:
    yield from _go_on(station, task_number(station, it), retry=True)


def _go_on(station: Station, number: int, retry: bool) -> Talk[None]:
    if number:
        station.tasks.proceed(number, retry=retry)
        station.settle()
    else:
        yield from run(station, station.resume(retry=retry))


def _kill(station: Station, it: Instruction) -> Talk[None]:
    station.tasks.kill(task_number(station, it))
    yield from ()


def _cycle_end(station: Station, it: Instruction) -> Talk[None]:
    return _ends(station, task_number(station, it))


def _ends(station: Station, number: int) -> Talk[None]:
    track = station.tasks.end_cycles(number)
    yield Message(f"{track.task.program} ends after its present cycle")


def process_control(act: Callable[[Station, int], Talk[None]]) -> Handler:
    """A command for the process control program."""
    return lambda station, _it: act(station, PROCESS_CONTROL)


def run(station: Station, track: Track) -> Talk[None]:
    """Wait for a program, and tell how it ended; where the prompt lives, that is told when it does."""
    if station.lives and not station.desk.command_files:
        station.let_run(track, lambda result: station.terminal.show(ending(station, result)))
    else:
        yield ending(station, (yield from station.wait(track)))


def ending(station: Station, result: RunResult) -> Reply:
    """What is said when a program ends."""
    if result.fault is not None:
        fault = result.fault
        return ProgramStopped(fault.message, fault.program, fault.step, fault.source, Tone.ERROR)
    task = station.task
    if result.outcome is Outcome.COMPLETED or task is None:
        return Message(result.outcome.value)
    before = result.outcome in (Outcome.STEPPED, Outcome.BREAKPOINT, Outcome.WATCHED)
    what = f"{result.outcome.value} {result.detail}".strip()
    return ProgramStopped(what, result.program, task.step, task.source if before else "")


def _abort(station: Station, it: Instruction) -> Talk[None]:
    number = task_number(station, it)
    yield from _abort_task(station, number) if number else _abort_robot(station)


def _abort_task(station: Station, number: int) -> Talk[None]:
    track = station.tasks.abort(number)
    station.settle()
    yield (
        Message("Nothing is running")
        if track is None
        else ProgramStopped(Outcome.ABORTED.value, track.task.program, track.task.step)
    )


def _abort_robot(station: Station) -> Talk[None]:
    scheduled, running = station.engine.now < station.engine.end, station.running
    task = station.task
    station.abort()
    if running:
        return  # whoever waits for its end is told
    if task is not None and not task.ended:
        yield ProgramStopped(Outcome.ABORTED.value, task.program, task.step)
    elif scheduled:
        yield Message("The motion is stopped")
    else:
        yield Message("Nothing is running")


RUNNING: Mapping[str, Handler] = {
    "EXECUTE": _execute,
    "ABORT": _abort,
    "PROCEED": _proceed,
    "RETRY": _retry,
    "KILL": _kill,
    "CYCLE.END": _cycle_end,
    "PCEXECUTE": _pc_execute,
    "PCABORT": process_control(_abort_task),
    "PCEND": process_control(_ends),
    "PCPROCEED": process_control(lambda station, number: _go_on(station, number, retry=False)),
    "PCRETRY": process_control(lambda station, number: _go_on(station, number, retry=True)),
}
