"""Motions as the settings have them: what f is asked to plan."""

from __future__ import annotations

from dataclasses import replace

from vrs_cli.engine.commands import Move, SetSpeed, SpeedUnit
from vrs_cli.engine.parameters import FULL_SPEED
from vrs_cli.engine.settings import MM, Settings
from vrs_cli.engine.targets import Goal
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.trajectory.instant import on_grid
from vrs_cli.trajectory.motion import Frames, Kind, Motion, RelativeTarget, Start

SLOWEST = 1e-4  # fraction of nominal speed: slower is no motion
INCH = 0.0254  # [m]


def motion_to(goal: Goal, start: Start, before: Motion, number: int, settings: Settings, text: str = "") -> Motion:
    """A motion at full speed, with hand, BASE and TOOL as the motion `before` it has them."""
    return Motion(
        number,
        Kind.JOINT if goal.pose is None else Kind.STRAIGHT,
        start,
        goal.joints,
        goal.pose,
        acceleration=settings.acceleration,
        hand=before.hand,
        frames=before.frames,
        text=text,
        profile=settings.profile,
    )


def motion_of(move: Move, goal: Goal, start: Start, before: Motion, number: int, settings: Settings) -> Motion:
    """The motion of an instruction, but for its speed."""
    hand = move.hand if move.hand is not None else settings.hand
    return replace(
        motion_to(goal, start, before, number, settings, move.text),
        duration=on_grid(settings.duration.present),
        hand=before.hand if hand is None else hand,
        relative=move.target if isinstance(move.target, RelativeTarget) else None,
        rounding=settings.rounding if start is Start.BLEND else None,
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


def at_fraction(motion: Motion, fraction: float, settings: Settings) -> Motion:
    """At a fraction of full speed."""
    return replace(motion, speed=_limited(_monitor(settings) * fraction))


def at_program_speed(motion: Motion, program: SetSpeed, settings: Settings, model: RobotModel) -> Motion:
    monitor, rotation = _monitor(settings), program.rotation
    turning = None if rotation is None else _limited(monitor * rotation / FULL_SPEED)
    if program.unit is SpeedUnit.PERCENT:
        return replace(motion, speed=_limited(monitor * program.value / FULL_SPEED), rotation=turning)
    tip, full = monitor * program.value * (MM if program.unit is SpeedUnit.MMPS else INCH), model.linear_speed
    fraction = _limited(tip / full)
    return replace(
        motion,
        speed=fraction,
        tip_speed=min(max(tip, SLOWEST * full), full),
        rotation=fraction if turning is None else turning,
    )


def _monitor(settings: Settings) -> float:
    return settings.monitor_speed / FULL_SPEED


def _limited(speed: float) -> float:
    """A fraction of nominal speed: never above it, never so slow that it would be none."""
    return min(max(speed, SLOWEST), 1.0)
