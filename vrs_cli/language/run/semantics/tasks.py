"""The end of a program or of a cycle, and tasks side by side: EXECUTE, ABORT, events."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import partial
from typing import cast

from vrs_cli.errors import IllegalValue
from vrs_cli.language.run.effects import (
    CallProgram,
    Control,
    ControlTask,
    Halt,
    Pause,
    Return,
    ReturnFromError,
    SetEvent,
    StartTask,
    Stop,
    WaitEvent,
    Yielded,
)
from vrs_cli.language.run.memory import Context
from vrs_cli.language.run.operands import Handler, Operands
from vrs_cli.language.words.values import integer_between, plain, whole

MOST_STEPS = 9999  # that RETURN n leaves out
LAST_TASK = 27  # V+ Language User's Guide: tasks 0 to 27
PROCESS_CONTROL = 1  # the task that the PC commands of VAL-II mean


def checked_task(number: float) -> int:
    """Raises IllegalValue."""
    return integer_between(number, 0, LAST_TASK, "task")


def _start(number: int | None, context: Context, it: Operands) -> Iterable[Yielded]:
    """EXECUTE, whose last operand is the task, or (`number`) PCEXECUTE, which has none."""
    call = cast(CallProgram, it.get(0))
    cycles, step = whole(it.real_or(1, 1.0)), whole(it.real_or(2, 1.0))
    asked = it.optional(3) if number is None else float(number)
    task = None if asked is None else checked_task(asked)
    context.environment.program(call.name)
    return (StartTask(task, call, cycles, step),)


def _control(control: Control, _context: Context, it: Operands) -> Iterable[Yielded]:
    return (ControlTask(control, checked_task(it.real_or(0, 0.0))),)


def _return(_context: Context, it: Operands) -> Iterable[Yielded]:
    return (Return(integer_between(it.real_or(0, 0.0), 0, MOST_STEPS, "a number of steps of")),)


def _wait_event(_context: Context, it: Operands) -> Iterable[Yielded]:
    seconds = it.optional(1)
    if seconds is not None and seconds < 0.0:
        raise IllegalValue(f"a wait of {plain(seconds)} seconds", "it must not be negative")
    return (WaitEvent(it.get(0) is not None or seconds is None, seconds),)


def _set_event(_context: Context, it: Operands) -> Iterable[Yielded]:
    return (SetEvent(checked_task(it.real(0))),)


TASKS: Mapping[str, Handler] = {
    "RETURN": _return,
    "RETURNE": lambda _context, _it: (ReturnFromError(),),
    "STOP": lambda _context, _it: (Stop(),),
    "PAUSE": lambda _context, _it: (Pause(),),
    "HALT": lambda _context, _it: (Halt(),),
    "EXECUTE": partial(_start, None),
    "PCEXECUTE": partial(_start, PROCESS_CONTROL),
    **{control.value: partial(_control, control) for control in Control},
    "WAIT.EVENT": _wait_event,
    "SET.EVENT": _set_event,
}
