"""Motions as the settings have them: what f is asked to plan."""

from __future__ import annotations

from typing import NamedTuple

from vrs_cli.engine.commands import Move, SetSpeed, SpeedUnit
from vrs_cli.engine.parameters import FULL_SPEED
from vrs_cli.engine.settings import MM, Settings
from vrs_cli.engine.targets import Goal
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.trajectory.instant import on_grid
from vrs_cli.trajectory.motion import Frames, Kind, Motion, RelativeTarget, Start

SLOWEST = 1e-4  # fraction of nominal speed: slower is no motion
INCH = 0.0254  # [m]


class Speed(NamedTuple):
    """Fractions of the nominal speed of a motion, and of that of turning on a line; `tip` [m/s] where it was given."""

    fraction: float
    tip: float | None = None
    rotation: float | None = None


def motion_to(
    goal: Goal,
    start: Start,
    speed: Speed,
    before: Motion,
    number: int,
    settings: Settings,
    *,
    duration: float = 0.0,
    hand: float | None = None,
    text: str = "",
    relative: RelativeTarget | None = None,
) -> Motion:
    """A motion to joints or a pose; hand, BASE and TOOL are as the motion `before` it has them."""
    return Motion(
        number=number,
        kind=Kind.JOINT if goal.pose is None else Kind.STRAIGHT,
        start=start,
        goal=goal.joints,
        pose=goal.pose,
        speed=speed.fraction,
        acceleration=settings.acceleration,
        tip_speed=speed.tip,
        rotation=speed.rotation,
        duration=on_grid(duration),
        hand=before.hand if hand is None else hand,
        frames=before.frames,
        text=text,
        relative=relative,
        profile=settings.profile,
        rounding=settings.rounding if start is Start.BLEND else None,
    )


def motion_of(
    move: Move, goal: Goal, start: Start, before: Motion, number: int, settings: Settings, model: RobotModel
) -> Motion:
    """The motion of an instruction."""
    if move.speed is None:
        speed = program_speed(settings.speed.present, settings, model)
    else:
        speed = fraction_of_full(move.speed, settings)
    return motion_to(
        goal,
        start,
        speed,
        before,
        number,
        settings,
        duration=settings.duration.present,
        hand=move.hand if move.hand is not None else settings.hand,
        text=move.text,
        relative=move.target if isinstance(move.target, RelativeTarget) else None,
    )


def rest_after(
    before: Motion,
    number: int,
    settings: Settings,
    text: str,
    *,
    start: Start = Start.AFTER,
    seconds: float = 0.0,
    hand: float | None = None,
    frames: Frames | None = None,
) -> Motion:
    """Standing still, or braking first."""
    return Motion(
        number,
        Kind.REST,
        start,
        duration=on_grid(seconds),
        hand=before.hand if hand is None else hand,
        frames=frames or before.frames,
        text=text,
        profile=settings.profile,
    )


# --- speed: actual = monitor x program -------------------------------------------------------------------------------


def fraction_of_full(fraction: float, settings: Settings) -> Speed:
    return Speed(_limited(settings.monitor_speed / FULL_SPEED * fraction))


def program_speed(program: SetSpeed, settings: Settings, model: RobotModel) -> Speed:
    monitor = settings.monitor_speed / FULL_SPEED
    rotation = None if program.rotation is None else _limited(monitor * program.rotation / FULL_SPEED)
    if program.unit is SpeedUnit.PERCENT:
        return Speed(_limited(monitor * program.value / FULL_SPEED), None, rotation)
    tip, full = monitor * program.value * (MM if program.unit is SpeedUnit.MMPS else INCH), model.linear_speed
    fraction = _limited(tip / full)
    return Speed(fraction, min(max(tip, SLOWEST * full), full), fraction if rotation is None else rotation)


def _limited(speed: float) -> float:
    """A fraction of nominal speed: never above it, never so slow that it would be none."""
    return min(max(speed, SLOWEST), 1.0)
