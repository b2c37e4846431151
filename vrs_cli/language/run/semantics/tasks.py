"""The end of a program or of a cycle, and tasks side by side: EXECUTE, ABORT, events."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import partial

from vrs_cli.errors import IllegalSignal, IllegalValue
from vrs_cli.language.run.effects import (
    LAST_TASK,
    PROCESS_CONTROL,
    CallProgram,
    ControlTask,
    Event,
    EventSignal,
    Halt,
    Pause,
    Return,
    SetEvent,
    StartTask,
    Stop,
    TaskControl,
    Wait,
    WaitEvent,
)
from vrs_cli.language.run.memory import Context
from vrs_cli.language.run.operands import Handler, Wording
from vrs_cli.language.words.signals import INPUTS
from vrs_cli.language.words.values import integer_between, plain, whole

MOST_STEPS = 9999  # that RETURN n leaves out


def checked_task(number: float) -> int:
    """Raises IllegalValue."""
    return integer_between(number, 0, LAST_TASK, "task")


def _start(
    context: Context,
    _it: Wording,
    call: CallProgram,
    cycles: float | None = None,
    step: float | None = None,
    task: float | None = None,
) -> Iterable[Event]:
    number = None if task is None else checked_task(task)
    context.environment.program(call.name)
    times = 1 if cycles is None else whole(cycles) or 1  # programs of V+ write 0 for once
    return (StartTask(number, call, times, 1 if step is None else whole(step)),)


def _control(control: TaskControl, _context: Context, _it: Wording, task: float | None = None) -> Iterable[Event]:
    return (ControlTask(control, checked_task(task or 0.0)),)


def _return(_context: Context, _it: Wording, steps: float | None = None) -> Iterable[Event]:
    return (Return(integer_between(steps or 0.0, 0, MOST_STEPS, "a number of steps of")),)


def _wait_event(
    _context: Context, _it: Wording, event: float | None = None, seconds: float | None = None
) -> Iterable[Event]:
    if seconds is not None and seconds < 0.0:
        raise IllegalValue(f"a wait of {plain(seconds)} seconds", "it must not be negative")
    return (WaitEvent(event is not None or seconds is None, seconds),)


def _event(
    on: bool, _context: Context, _it: Wording, task: float | None = None, flag: float | None = None
) -> Iterable[Event]:
    integer_between(1.0 if flag is None else flag, 1, 1, "flag")
    return (SetEvent(None if task is None else checked_task(task), on),)


def _event_signal(context: Context, _it: Wording, number: float, level: float | None = None) -> Iterable[Event]:
    """`level` is of the bus of a controller, which is not there."""
    integer_between(1.0 if level is None else level, 1, 2, "level")
    if whole(number) == 0:
        return (EventSignal(None),)
    if whole(number) not in INPUTS:
        raise IllegalSignal(plain(number), f"INT.EVENT wants an input, {INPUTS[0]} to {INPUTS[-1]}, or 0")
    context.environment.signals.read(number)
    return (EventSignal(whole(number)),)


TASKS: Mapping[str, Handler] = {
    "RETURN": _return,
    "RETURNE": lambda _context, _it: (Return(mended=True),),
    "STOP": lambda _context, _it: (Stop(),),
    "PAUSE": lambda _context, _it: (Pause(),),
    "HALT": lambda _context, _it: (Halt(),),
    "EXECUTE": _start,
    "PCEXECUTE": partial(_start, task=PROCESS_CONTROL),
    **{control.value: partial(_control, control) for control in TaskControl},
    "WAIT.EVENT": _wait_event,
    "SET.EVENT": partial(_event, True),
    "CLEAR.EVENT": partial(_event, False),
    "INT.EVENT": _event_signal,
    "RELEASE": lambda _context, _it, _task=None: (Wait(lambda: True, 1),),
}
