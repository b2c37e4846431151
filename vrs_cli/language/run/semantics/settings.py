"""What motions go by: SPEED, DURATION, modes, configurations, the hand, TOOL and BASE, switches and parameters."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import partial
from math import radians

from vrs_cli.engine.parameters import (
    ACCELERATION,
    DECELERATION,
    FULL_SPEED,
    MONITOR_SPEED,
    PROGRAM_SPEED,
    ROTATION_SPEED,
)
from vrs_cli.errors import IllegalJoint, IllegalValue
from vrs_cli.kinematics.configuration import Arm, Elbow, Wrist
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.profile import Profile
from vrs_cli.kinematics.transform import IDENTITY, Transform, compose, rotation_z
from vrs_cli.language.run.effects import Event
from vrs_cli.language.run.memory import Context
from vrs_cli.language.run.operands import NOTHING, Handler, Wording, transform
from vrs_cli.language.run.operations import shift
from vrs_cli.language.words.values import integer_between, plain, whole
from vrs_cli.values.commands import (
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
    SetSwivel,
    SetTool,
    SpeedUnit,
)
from vrs_cli.values.motion import Swivel

LAST_PROFILE = 8  # V+ Language Reference Guide, ACCEL


def _speed(_context: Context, it: Wording, speed: float, rotation: float | None = None) -> Iterable[Event]:
    if it.unit == "MONITOR":
        return (SetMonitorSpeed(MONITOR_SPEED.checked(speed)),)
    unit = SpeedUnit.PERCENT if it.unit is None else SpeedUnit(it.unit)
    if rotation is not None:
        ROTATION_SPEED.checked(rotation)
    return (SetSpeed(PROGRAM_SPEED[unit].checked(speed), rotation, unit, it.always),)


def _duration(_context: Context, it: Wording, seconds: float) -> Iterable[Event]:
    if seconds < 0.0:
        raise IllegalValue(f"a duration of {plain(seconds)} seconds", "it must not be negative")
    return (SetDuration(seconds, it.always),)


def _swivel(context: Context, it: Wording, joint: float | None = None, value: float | None = None) -> Iterable[Event]:
    if joint is None:
        if value is not None:
            raise IllegalValue("SWIVEL of no joint", "name the joint that has the value: SWIVEL 3, 20")
        return (SetSwivel(None, it.always),)
    if not 0.5 <= joint < context.robot.dof + 0.5:
        raise IllegalJoint(plain(joint), f"joints are 1 to {context.robot.dof}")
    number = whole(joint)
    end = None if value is None else context.environment.units.one_read(number, value)
    return (SetSwivel(Swivel(number, end), it.always),)


def _acceleration(
    context: Context,
    _it: Wording,
    profile: float | None = None,
    acceleration: float | None = None,
    deceleration: float | None = None,
) -> Iterable[Event]:
    """What is left out stays as it is."""
    if profile is not None:
        yield SetParameter("PROFILE", _profile(profile).name)
    if acceleration is not None or deceleration is not None:
        if deceleration is not None:
            DECELERATION.checked(deceleration)
        given = context.robot.acceleration() if acceleration is None else acceleration
        yield SetAcceleration(ACCELERATION.checked(given), deceleration)


def _profile(number: float) -> Profile:
    """Profile 0 is a square wave of acceleration; one that a robot does not define is profile 0 (V+ Language Reference
    Guide, ACCEL).
    """
    index = integer_between(number, 0, LAST_PROFILE, "a profile of")
    profiles = tuple(Profile)
    return profiles[index] if index < len(profiles) else profiles[0]


def _payload(
    context: Context, _it: Wording, percent: float | None = None, joint: float | None = None
) -> Iterable[Event]:
    """No servo is there that would need to know."""
    if percent is not None and percent > FULL_SPEED:
        raise IllegalValue(
            f"PAYLOAD {plain(percent)}", "a load is 0 to 100 % of the largest, or negative: the usual one"
        )
    integer_between(joint or 0.0, 0, context.robot.dof, "joint")
    return NOTHING


def _mode(mode: Mode, on: bool, _context: Context, it: Wording, tolerance: float | None = None) -> Iterable[Event]:
    if tolerance is not None and not tolerance > 0.0:
        raise IllegalValue(f"a tolerance of {plain(tolerance)}", "it must be greater than 0")
    return (SetMode(mode, on, it.always, tolerance),)


def _hand(
    opening: float | None, immediate: bool, _context: Context, it: Wording, width: float | None = None
) -> Iterable[Event]:
    return (OperateHand(opening, immediate, it.text, None if width is None else width / 1000.0),)


def _grasp(_context: Context, it: Wording, *_operands: float | None) -> Iterable[Event]:
    return (OperateHand(0.0, True, it.text),)


def _asks(event: Event, _context: Context, _it: Wording) -> Iterable[Event]:
    """The same, whatever the wording."""
    return (event,)


def _tool(_context: Context, _it: Wording, tool: Transform | Joints | None = None) -> Iterable[Event]:
    return (SetTool(IDENTITY if tool is None else transform(tool)),)


def _base(_context: Context, _it: Wording, *numbers: float | None) -> Iterable[Event]:
    *distances, turn = [number or 0.0 for number in (*numbers, *(None,) * 4)[:4]]
    return (SetBase(compose(shift(IDENTITY, *distances), rotation_z(radians(turn)))),)


def _select(_context: Context, it: Wording, device: str) -> Iterable[Event]:
    if not "ROBOT".startswith(device) or whole(it.value) != 1:
        raise IllegalValue(f"SELECT {device} = {plain(it.value)}", "there is one robot: SELECT ROBOT = 1")
    return NOTHING


def _switches(on: bool, _context: Context, _it: Wording, *names: str) -> Iterable[Event]:
    return tuple(SetSwitch(name, on) for name in names)


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
    "SWIVEL": _swivel,
    "ACCEL": _acceleration,
    "PAYLOAD": _payload,
    "ROBOT.OPR": lambda _context, _it, *_values: NOTHING,
    **{word: partial(_mode, mode, on) for word, (mode, on) in MODE_WORDS.items()},
    **{word: partial(_asks, SetConfiguration(flag)) for word, flag in _CONFIGURATIONS.items()},
    **{word: partial(_hand, opening, False) for word, opening in _HANDS.items()},
    **{f"{word}I": partial(_hand, opening, True) for word, opening in _HANDS.items()},
    "GRASP": _grasp,
    "TOOL": _tool,
    "BASE": _base,
    "ENABLE": partial(_switches, True),
    "DISABLE": partial(_switches, False),
    "SWITCH": lambda _context, it, name: (SetSwitch(name, bool(it.value)),),
    "PARAMETER": lambda _context, it, name: (SetParameter(name, it.value),),
    "SELECT": _select,
    "CALIBRATE": lambda _context, _it: NOTHING,
}
