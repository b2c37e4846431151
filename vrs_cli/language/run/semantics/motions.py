"""MOVE, APPRO, DRIVE and the other motions, and what waits for them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import partial
from math import radians

from vrs_cli.engine.parameters import FULL_SPEED, JOINT_SPEED
from vrs_cli.errors import IllegalJoint, IllegalValue
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.transform import Transform, compose, rotation_x, rotation_y, rotation_z, translation
from vrs_cli.language.run.effects import Event
from vrs_cli.language.run.memory import Context
from vrs_cli.language.run.operands import Handler, Wording, transform
from vrs_cli.language.run.operations import shift
from vrs_cli.language.words.values import TRUE, integer_between, plain, whole
from vrs_cli.values.commands import Alter, AlterMode, Brake, Break, Delay, Move, SetAlter
from vrs_cli.values.motion import (
    AlignedTarget,
    JointOffsetTarget,
    JointTarget,
    NamedTarget,
    PoseTarget,
    ToolOffsetTarget,
)


def _move(
    straight: bool, _context: Context, it: Wording, place: Transform | Joints, hand: float | None = None
) -> Iterable[Event]:
    """An air hand opens for anything above 0, and for TRUE; otherwise it closes."""
    target = PoseTarget(place) if isinstance(place, Transform) else JointTarget(place)
    opening = None if hand is None else float(hand > 0.0 or hand == TRUE)
    return (Move(target, straight, hand=opening, stamp=it.stamp, text=it.text),)


def _back_off(distance: float) -> Transform:
    """So many mm along the tool's -Z."""
    return translation(0.0, 0.0, -distance / 1000.0)


def _approach(
    straight: bool, _context: Context, it: Wording, place: Transform | Joints, distance: float
) -> Iterable[Event]:
    pose = compose(transform(place), _back_off(distance))
    return (Move(PoseTarget(pose), straight, stamp=it.stamp, text=it.text),)


def _depart(straight: bool, _context: Context, it: Wording, distance: float) -> Iterable[Event]:
    return (Move(ToolOffsetTarget(_back_off(distance)), straight, stamp=it.stamp, text=it.text),)


def _drive(context: Context, it: Wording, joint: float, change: float, speed: float | None = None) -> Iterable[Event]:
    if not 0.5 <= joint < context.robot.dof + 0.5:
        raise IllegalJoint(plain(joint), f"joints are 1 to {context.robot.dof}")
    target = JointOffsetTarget(whole(joint), context.environment.units.one_read(whole(joint), change))
    fraction = None if speed is None else JOINT_SPEED.checked(speed) / FULL_SPEED
    return (Move(target, False, speed=fraction, stamp=it.stamp, text=it.text),)


def _draw(context: Context, it: Wording, *distances: float | None) -> Iterable[Event]:
    target = shift(context.robot.destination(), *distances)
    return (Move(PoseTarget(target), True, stamp=it.stamp, text=it.text),)


def _delay(_context: Context, it: Wording, seconds: float) -> Iterable[Event]:
    if seconds < 0.0:
        raise IllegalValue(f"a delay of {plain(seconds)} seconds", "it must not be negative")
    return (Delay(seconds, it.text),)


ADDS, WORLD = 1, 2  # bits of the mode of ALTON


def _alter_on(_context: Context, _it: Wording, _lun: float | None = None, mode: float | None = None) -> Iterable[Event]:
    bits = integer_between(mode or 0.0, 0, ADDS | WORLD, "ALTON mode")
    return (SetAlter(AlterMode(world=bool(bits & WORLD), adds=bool(bits & ADDS))),)


def _alter(_context: Context, it: Wording, _lun: float | None = None, *numbers: float | None) -> Iterable[Event]:
    *shift_by, rx, ry, rz = (number or 0.0 for number in (*numbers, *(None,) * 6)[:6])
    turn = compose(compose(rotation_x(radians(rx)), rotation_y(radians(ry))), rotation_z(radians(rz)))
    return (Alter(shift(turn, *shift_by), it.text),)


def _alter_off(_context: Context, _it: Wording, _lun: float | None = None) -> Iterable[Event]:
    return (SetAlter(None),)


MOTIONS: Mapping[str, Handler] = {
    "MOVE": partial(_move, False),
    "MOVES": partial(_move, True),
    "MOVET": partial(_move, False),
    "MOVEST": partial(_move, True),
    "GO": partial(_move, False),
    "APPRO": partial(_approach, False),
    "APPROS": partial(_approach, True),
    "DEPART": partial(_depart, False),
    "DEPARTS": partial(_depart, True),
    "DRAW": _draw,
    "DRIVE": _drive,
    "READY": lambda _context, it: (Move(NamedTarget("ready"), False, stamp=it.stamp, text=it.text),),
    "NEST": lambda _context, it: (Move(NamedTarget("nest"), False, stamp=it.stamp, text=it.text),),
    "ALIGN": lambda _context, it: (Move(AlignedTarget(), True, stamp=it.stamp, text=it.text),),
    "ALTON": _alter_on,
    "ALTER": _alter,
    **dict.fromkeys(("ALTOFF", "NOALTER"), _alter_off),
    "DELAY": _delay,
    "BREAK": lambda _context, _it: (Break(),),
    "BRAKE": lambda _context, _it: (Brake(),),
}
