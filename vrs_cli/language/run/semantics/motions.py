"""MOVE, APPRO, DRIVE and the other motions, and what waits for them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import partial

from vrs_cli.engine.commands import Brake, Break, Delay, JointTarget, Move, NamedTarget, PoseTarget
from vrs_cli.engine.parameters import FULL_SPEED, JOINT_SPEED
from vrs_cli.errors import IllegalJoint, IllegalValue
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.transform import Transform, compose, translation
from vrs_cli.language.run.effects import Event
from vrs_cli.language.run.memory import Context
from vrs_cli.language.run.operands import Handler, Wording, transform
from vrs_cli.language.run.operations import shift
from vrs_cli.language.words.values import TRUE, plain, whole
from vrs_cli.trajectory.motion import AlignedTarget, JointOffsetTarget, ToolOffsetTarget


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
    "DELAY": _delay,
    "BREAK": lambda _context, _it: (Break(),),
    "BRAKE": lambda _context, _it: (Brake(),),
}
