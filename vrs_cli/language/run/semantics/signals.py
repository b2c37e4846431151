"""Signals and timers, and reactions to signals and to errors."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import partial

from vrs_cli.language.run.effects import CallProgram, Event, Ignore, Lock, LookAround, ReactToErrors, RunSignal
from vrs_cli.language.run.memory import Context
from vrs_cli.language.run.operands import NOTHING, Handler, Wording
from vrs_cli.language.run.reactions import DEFAULT, Reaction, checked_priority, checked_signal
from vrs_cli.language.words.values import integer

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


def _timer(context: Context, it: Wording, number: float) -> Iterable[Event]:
    context.environment.timers.set(number, it.value, context.robot.time())
    return NOTHING


def _react(
    immediate: bool, context: Context, _it: Wording, number: float, call: CallProgram, given: float | None = None
) -> Iterable[Event]:
    signal, priority = checked_signal(number), checked_priority(DEFAULT if given is None else given, 1)
    context.environment.signals.read(signal)
    context.environment.program(call.name)
    return (Reaction(signal, call.name, priority, immediate),)


def _react_to_errors(context: Context, _it: Wording, call: CallProgram | None = None) -> Iterable[Event]:
    if call is not None:
        context.environment.program(call.name)
    return (ReactToErrors(None if call is None else call.name),)


def _ignore(context: Context, _it: Wording, number: float) -> Iterable[Event]:
    signal = checked_signal(number)
    context.environment.signals.read(signal)
    return (Ignore(signal),)


def _run_signal(context: Context, _it: Wording, number: float) -> Iterable[Event]:
    signal = checked_signal(number)
    context.environment.signals.writable(signal)
    return (RunSignal(signal),)


SIGNALS: Mapping[str, Handler] = {
    "SIGNAL": _signal,
    "RESET": _reset,
    "BITS": _bits,
    "TIMER": _timer,
    "REACT": partial(_react, False),
    "REACTI": partial(_react, True),
    "REACTE": _react_to_errors,
    "IGNORE": _ignore,
    "LOCK": lambda _context, _it, priority: (Lock(checked_priority(priority, 0)),),
    "RUNSIG": _run_signal,
}
