"""Programs started, stopped and gone on with."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import TYPE_CHECKING

from vrs_cli.dialogue.replies import Message, ProgramStopped, Reply, Tone
from vrs_cli.errors import NoProgramSpecified
from vrs_cli.interfaces.monitor.operands import Handler, operand, real_or, word
from vrs_cli.interfaces.tasks.runs import Outcome, RunResult
from vrs_cli.language.run.cells import Reference
from vrs_cli.language.run.semantics.tasks import PROCESS_CONTROL, checked_task
from vrs_cli.language.text.ast import Instruction, ProgramCall
from vrs_cli.language.words.values import whole

if TYPE_CHECKING:
    from vrs_cli.interfaces.session.session import Session


def _execute(session: Session, it: Instruction) -> Iterator[Reply]:
    number = whole(real_or(session, it, 3, 0.0))
    if number:
        _start(session, it, checked_task(number))
        return
    name, arguments, cycles, step = asked_program(session, it)
    yield from run(session, lambda progress: session.execute(name, arguments, cycles, step, progress=progress))


def asked_program(session: Session, it: Instruction) -> tuple[str | None, tuple[Reference | None, ...], int, int]:
    """Program, arguments, cycles and first step of EXECUTE and its like."""
    from vrs_cli.language.run.prompt import arguments_of

    asked = operand(it, 0)
    name = None if asked is None else word(asked)
    given = asked.arguments if isinstance(asked, ProgramCall) else ()
    arguments = arguments_of(session.environment, session.robot, given)
    return name, arguments, whole(real_or(session, it, 1, 1.0)), whole(real_or(session, it, 2, 1.0))


def _start(session: Session, it: Instruction, number: int) -> None:
    """A task beside the robot program."""
    name, arguments, cycles, step = asked_program(session, it)
    if name is None:
        raise NoProgramSpecified(f"task {number} needs a program", "name it")
    session.start(number, name, arguments, cycles, step)


def _pc_execute(session: Session, it: Instruction) -> Iterator[Reply]:
    _start(session, it, PROCESS_CONTROL)
    yield from ()


def task_number(session: Session, it: Instruction) -> int:
    return checked_task(real_or(session, it, 0, 0.0))


def _proceed(session: Session, it: Instruction) -> Iterator[Reply]:
    yield from _go_on(session, task_number(session, it), retry=False)


def _retry(session: Session, it: Instruction) -> Iterator[Reply]:
    yield from _go_on(session, task_number(session, it), retry=True)


def _go_on(session: Session, number: int, retry: bool) -> Iterator[Reply]:
    if number:
        session.driver.tasks.proceed(number, retry=retry)
        session.settle()
    else:
        yield from run(session, session.retry if retry else session.proceed)


def _kill(session: Session, it: Instruction) -> Iterator[Reply]:
    session.driver.tasks.kill(task_number(session, it))
    yield from ()


def _cycle_end(session: Session, it: Instruction) -> Iterator[Reply]:
    yield _ends(session, task_number(session, it))


def _ends(session: Session, number: int) -> Reply:
    track = session.driver.tasks.end_cycles(number)
    return Message(f"{track.task.program} ends after its present cycle")


def process_control(act: Callable[[Session, int], Iterable[Reply]]) -> Handler:
    """A command for the process control program."""
    return lambda session, _it: act(session, PROCESS_CONTROL)


def run(session: Session, way: Callable[[Callable[[float], None] | None], RunResult]) -> Iterator[Reply]:
    """Run, with progress where somebody watches; how it ended."""
    yield ending(session, session.watched(way))


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
    number = task_number(session, it)
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


RUNNING: Mapping[str, Handler] = {
    "EXECUTE": _execute,
    "ABORT": _abort,
    "PROCEED": _proceed,
    "RETRY": _retry,
    "KILL": _kill,
    "CYCLE.END": _cycle_end,
    "PCEXECUTE": _pc_execute,
    "PCABORT": process_control(_abort_task),
    "PCEND": process_control(lambda session, number: (_ends(session, number),)),
    "PCPROCEED": process_control(lambda session, number: _go_on(session, number, retry=False)),
    "PCRETRY": process_control(lambda session, number: _go_on(session, number, retry=True)),
}
