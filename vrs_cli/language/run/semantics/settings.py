"""What motions go by: SPEED, DURATION, modes, configurations, the hand, TOOL and BASE, switches and parameters."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import partial
from math import radians
from typing import cast

from vrs_cli.engine.commands import (
    Mode,
    OperateHand,
    SetAcceleration,
    SetBase,
    SetConfiguration,
    SetDuration,
    SetMode,
    SetMonitorSpeed,
    SetParameter,
    SetSpeed,
    SetSwitch,
    SetTool,
    SpeedUnit,
)
from vrs_cli.engine.parameters import ACCELERATION, DECELERATION, MONITOR_SPEED, PROGRAM_SPEED, ROTATION_SPEED
from vrs_cli.errors import IllegalValue
from vrs_cli.kinematics.configuration import Arm, Elbow, Wrist
from vrs_cli.kinematics.transform import IDENTITY, compose, rotation_z, translation
from vrs_cli.language.run.effects import Yielded
from vrs_cli.language.run.memory import Context
from vrs_cli.language.run.operands import NOTHING, Handler, Operands
from vrs_cli.language.words.values import plain, whole


def _speed(_context: Context, it: Operands) -> Iterable[Yielded]:
    if it.unit == "MONITOR":
        return (SetMonitorSpeed(MONITOR_SPEED.checked(it.real(0))),)
    unit = SpeedUnit.PERCENT if it.unit is None else SpeedUnit(it.unit)
    rotation = it.optional(1)
    if rotation is not None:
        ROTATION_SPEED.checked(rotation)
    return (SetSpeed(PROGRAM_SPEED[unit].checked(it.real(0)), rotation, unit, it.always),)


def _duration(_context: Context, it: Operands) -> Iterable[Yielded]:
    seconds = it.real(0)
    if seconds < 0.0:
        raise IllegalValue(f"a duration of {plain(seconds)} seconds", "it must not be negative")
    return (SetDuration(seconds, it.always),)


def _acceleration(_context: Context, it: Operands) -> Iterable[Yielded]:
    deceleration = it.optional(1)
    if deceleration is not None:
        DECELERATION.checked(deceleration)
    return (SetAcceleration(ACCELERATION.checked(it.real(0)), deceleration),)


def _mode(mode: Mode, on: bool, _context: Context, it: Operands) -> Iterable[Yielded]:
    tolerance = None if it.get(0) is None else it.positive(0, "a tolerance of")
    return (SetMode(mode, on, it.always, tolerance),)


def _configuration(flag: Arm | Elbow | Wrist, _context: Context, _it: Operands) -> Iterable[Yielded]:
    return (SetConfiguration(flag),)


def _hand(opening: float | None, immediate: bool, _context: Context, it: Operands) -> Iterable[Yielded]:
    return (OperateHand(opening, immediate, it.text),)


def _tool(_context: Context, it: Operands) -> Iterable[Yielded]:
    return (SetTool(IDENTITY if it.get(0) is None else it.transform(0)),)


def _base(_context: Context, it: Operands) -> Iterable[Yielded]:
    dx, dy, dz, turn = (it.real_or(index, 0.0) for index in range(4))
    shift = translation(dx / 1000.0, dy / 1000.0, dz / 1000.0)
    return (SetBase(compose(shift, rotation_z(radians(turn)))),)


def _select(_context: Context, it: Operands) -> Iterable[Yielded]:
    device, number = cast(str, it.get(0)), cast(float, it.value)
    if not "ROBOT".startswith(device) or whole(number) != 1:
        raise IllegalValue(f"SELECT {device} = {plain(number)}", "there is one robot: SELECT ROBOT = 1")
    return NOTHING


def _switches(on: bool, _context: Context, it: Operands) -> Iterable[Yielded]:
    return tuple(SetSwitch(cast(str, name), on) for name in it.arguments)


def _switch(_context: Context, it: Operands) -> Iterable[Yielded]:
    return (SetSwitch(cast(str, it.get(0)), bool(it.value)),)


def _parameter(_context: Context, it: Operands) -> Iterable[Yielded]:
    return (SetParameter(cast(str, it.get(0)), cast("float | str", it.value)),)


MODE_WORDS = {
    "COARSE": (Mode.COARSE, True),
    "FINE": (Mode.COARSE, False),
    "NULL": (Mode.NULLING, True),
    "NONULL": (Mode.NULLING, False),
    "CPON": (Mode.CONTINUOUS_PATH, True),
    "CPOFF": (Mode.CONTINUOUS_PATH, False),
    "INTON": (Mode.INTEGRAL, True),
    "INTOFF": (Mode.INTEGRAL, False),
    "SINGLE": (Mode.SINGLE, True),
    "MULTIPLE": (Mode.SINGLE, False),
    "OVERLAP": (Mode.OVERLAP, True),
    "NOOVERLAP": (Mode.OVERLAP, False),
}

_CONFIGURATIONS: dict[str, Arm | Elbow | Wrist] = {flag.name: flag for flags in (Arm, Elbow, Wrist) for flag in flags}
_HANDS = {"OPEN": 1.0, "CLOSE": 0.0, "RELAX": None}

SETTINGS: Mapping[str, Handler] = {
    "SPEED": _speed,
    "DURATION": _duration,
    "ACCEL": _acceleration,
    **{word: partial(_mode, mode, on) for word, (mode, on) in MODE_WORDS.items()},
    **{word: partial(_configuration, flag) for word, flag in _CONFIGURATIONS.items()},
    **{word: partial(_hand, opening, False) for word, opening in _HANDS.items()},
    **{f"{word}I": partial(_hand, opening, True) for word, opening in _HANDS.items()},
    "GRASP": partial(_hand, 0.0, True),
    "TOOL": _tool,
    "BASE": _base,
    "ENABLE": partial(_switches, True),
    "DISABLE": partial(_switches, False),
    "SWITCH": _switch,
    "PARAMETER": _parameter,
    "SELECT": _select,
    "CALIBRATE": lambda _context, _it: NOTHING,
}
