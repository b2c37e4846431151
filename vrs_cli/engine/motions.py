"""Motions as the settings have them: what f is asked to plan."""

from __future__ import annotations

from typing import NamedTuple

from msgspec import Struct

from vrs_cli.engine.parameters import FULL_SPEED
from vrs_cli.engine.settings import MM, Settings
from vrs_cli.engine.targets import Goal
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.transform import Transform
from vrs_cli.trajectory.instant import on_grid
from vrs_cli.values.commands import SetSpeed, SpeedUnit
from vrs_cli.values.motion import Frames, Motion, MotionKind, RelativeTarget, Start

SLOWEST = 1e-4  # fraction of nominal speed: slower is no motion
INCH = 0.0254  # [m]


class Speed(NamedTuple):
    """Fractions of the nominal speed of a motion, and of that of turning on a line; `tip` [m/s] where it was given."""

    fraction: float
    tip: float | None = None
    rotation: float | None = None


FULL = Speed(1.0)


class After(Struct, frozen=True):
    """What a motion follows: the motion that is `before` it on the timeline, its own number, and the settings."""

    before: Motion
    number: int
    settings: Settings

    def motion(
        self,
        start: Start,
        goal: Goal | None = None,
        speed: Speed = FULL,
        *,
        duration: float = 0.0,
        hand: float | None = None,
        frames: Frames | None = None,
        text: str = "",
        relative: RelativeTarget | None = None,
    ) -> Motion:
        """A motion to joints or a pose, or standing still; hand, BASE and TOOL are as those of `before`."""
        pose = goal if isinstance(goal, Transform) else None
        return Motion(
            number=self.number,
            kind=MotionKind.REST if goal is None else MotionKind.JOINT if pose is None else MotionKind.STRAIGHT,
            start=start,
            goal=goal if pose is None else None,
            pose=pose,
            speed=speed.fraction,
            acceleration=1.0 if goal is None else self.settings.acceleration,
            tip_speed=speed.tip,
            rotation=speed.rotation,
            duration=on_grid(duration),
            swivel=None if pose is None else self.settings.swivel.present.swivel,
            hand=self.before.hand if hand is None else hand,
            frames=frames or self.before.frames,
            text=text,
            relative=relative,
            profile=self.settings.profile,
            rounding=self.settings.rounding if start is Start.BLEND else None,
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
