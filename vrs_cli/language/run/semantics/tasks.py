"""Signals, timers and reactions; the end of a program or of a cycle; tasks side by side: EXECUTE, ABORT, events."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import partial

from vrs_cli.errors import IllegalSignal
from vrs_cli.language.run.effects import (
    DEFAULT_PRIORITY,
    LAST_TASK,
    PROCESS_CONTROL,
    CallProgram,
    ControlTask,
    Event,
    EventSignal,
    Halt,
    LookAround,
    Pause,
    Reaction,
    Return,
    RunSignal,
    SetEvent,
    StartTask,
    Stop,
    TaskControl,
    Wait,
    WaitEvent,
    checked_priority,
    checked_signal,
)
from vrs_cli.language.run.memory import Context, Handler, Wording, checked_seconds
from vrs_cli.language.words.values import INPUTS, integer, integer_between, plain, whole

MOST_STEPS = 9999  # that RETURN n leaves out

# --- signals and reactions ---------------------------------------------------------------------------------------

_LOOK_AROUND = (LookAround(),)


def _signal(context: Context, _it: Wording, *numbers: float | None) -> Iterable[Event]:
    for number in numbers:
        if number is not None:
            context.environment.signals.write(number)
    return _LOOK_AROUND


def _reset(context: Context, _it: Wording) -> Iterable[Event]:
    context.environment.signals.reset()
    return _LOOK_AROUND


def _bits(context: Context, it: Wording, first: float, count: float | None = None) -> Iterable[Event]:
    context.environment.signals.write_bits(first, 1.0 if count is None else count, integer(it.value))
    return _LOOK_AROUND


def _react(
    immediate: bool, context: Context, _it: Wording, number: float, call: CallProgram, given: float | None = None
) -> None:
    signal, priority = checked_signal(number), checked_priority(DEFAULT_PRIORITY if given is None else given, 1)
    context.environment.signals.read(signal)
    context.environment.program(call.name)
    context.reactions.set(Reaction(signal, call.name, priority, immediate))


def _react_to_errors(context: Context, _it: Wording, call: CallProgram | None = None) -> None:
    if call is not None:
        context.environment.program(call.name)
    context.reactions.on_error = None if call is None else call.name


def _ignore(context: Context, _it: Wording, number: float) -> None:
    signal = checked_signal(number)
    context.environment.signals.read(signal)
    context.reactions.ignore(signal)


def _lock(context: Context, _it: Wording, priority: float) -> Iterable[Event]:
    context.reactions.priority = checked_priority(priority, 0)
    return _LOOK_AROUND


def _run_signal(context: Context, _it: Wording, number: float) -> Iterable[Event]:
    return (RunSignal(context.environment.signals.writable(checked_signal(number))),)


# --- tasks -------------------------------------------------------------------------------------------------------


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


def _wait_event(
    _context: Context, _it: Wording, event: float | None = None, seconds: float | None = None
) -> Iterable[Event]:
    if seconds is not None:
        checked_seconds("a wait", seconds)
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
    "SIGNAL": _signal,
    "RESET": _reset,
    "BITS": _bits,
    "TIMER": lambda context, it, number: context.environment.timers.set(number, it.value, context.engine.now),
    "REACT": partial(_react, False),
    "REACTI": partial(_react, True),
    "REACTE": _react_to_errors,
    "IGNORE": _ignore,
    "LOCK": _lock,
    "RUNSIG": _run_signal,
    "RETURN": lambda _context, _it, steps=None: (
        Return(integer_between(steps or 0.0, 0, MOST_STEPS, "a number of steps of")),
    ),
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
