"""Signals and timers, and reactions to signals and to errors."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import partial
from typing import cast

from vrs_cli.language.run.effects import CallProgram, Ignore, Lock, ReactToErrors, RunSignal, SignalsSet, Yielded
from vrs_cli.language.run.memory import Context
from vrs_cli.language.run.operands import NOTHING, Handler, Operands
from vrs_cli.language.run.reactions import DEFAULT, Reaction, checked_priority, checked_signal
from vrs_cli.language.words.values import integer

_SIGNALS_SET = (SignalsSet(),)


def _signal(context: Context, it: Operands) -> Iterable[Yielded]:
    for number in it.arguments:
        if number is not None:
            context.environment.signals.write(cast(float, number))
    return _SIGNALS_SET


def _reset(context: Context, _it: Operands) -> Iterable[Yielded]:
    context.environment.signals.reset()
    return _SIGNALS_SET


def _bits(context: Context, it: Operands) -> Iterable[Yielded]:
    value = integer(cast(float, it.value))
    context.environment.signals.write_bits(it.real(0), it.real_or(1, 1.0), value)
    return _SIGNALS_SET


def _timer(context: Context, it: Operands) -> Iterable[Yielded]:
    context.environment.timers.set(it.real(0), cast(float, it.value), context.robot.time())
    return NOTHING


def _react(immediate: bool, context: Context, it: Operands) -> Iterable[Yielded]:
    signal, program = checked_signal(it.real(0)), cast(CallProgram, it.get(1))
    priority = checked_priority(it.real_or(2, DEFAULT), 1)
    context.environment.signals.read(signal)
    context.environment.program(program.name)
    return (Reaction(signal, program.name, priority, immediate),)


def _react_to_errors(context: Context, it: Operands) -> Iterable[Yielded]:
    program = cast("CallProgram | None", it.get(0))
    if program is not None:
        context.environment.program(program.name)
    return (ReactToErrors(None if program is None else program.name),)


def _ignore(context: Context, it: Operands) -> Iterable[Yielded]:
    signal = checked_signal(it.real(0))
    context.environment.signals.read(signal)
    return (Ignore(signal),)


def _lock(_context: Context, it: Operands) -> Iterable[Yielded]:
    return (Lock(checked_priority(it.real(0), 0)),)


def _run_signal(context: Context, it: Operands) -> Iterable[Yielded]:
    signal = checked_signal(it.real(0))
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
    "LOCK": _lock,
    "RUNSIG": _run_signal,
}
