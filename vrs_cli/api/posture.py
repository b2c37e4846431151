"""The posture of a robot at one time or at many, and previews with the commands that are on their way to it."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from msgspec import Struct
from numpy.typing import ArrayLike

from vrs_cli.api.answers import figures, number_columns, table
from vrs_cli.api.location import Location
from vrs_cli.api.numbers import Floats, Units, freeze, numbers
from vrs_cli.engine.position import PositionArrays
from vrs_cli.interfaces.port.preview import Expected, Previewed
from vrs_cli.interfaces.roles.observer import Observer, RecordedRobot
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.numbers import count
from vrs_cli.values.results import Position


class Posture(Struct, frozen=True, eq=False, dict=True):
    """The robot at one time, or at N times: then every array has N rows before its own shape.

    `t` [s]; `joints` (n,), `velocity` and `acceleration` (n,): degrees (mm where a joint slides), a second, a second
    squared, or SI; `location`: of the tool tip in the world (BASE) frame; `hand`: 1 open, 0 closed.
    """

    t: Floats
    joints: Floats
    velocity: Floats
    acceleration: Floats
    location: Location
    hand: Floats

    @classmethod
    def of(cls, at: Position | PositionArrays, model: RobotModel, units: Units) -> Posture:
        if isinstance(at, Position):
            time, rows = np.array(at.time), np.array(at.T_world_tool).reshape(3, 4)
        else:
            time, rows = at.times, at.T_world_tool
        scales = units.scales(model.units, model.joint_count)
        rates = (at.joints, at.velocity, at.acceleration)
        joints, velocity, acceleration = (freeze(np.array(q) * scales) for q in rates)
        return cls(freeze(time), joints, velocity, acceleration, Location(rows, units), freeze(np.array(at.hand)))

    @classmethod
    def seen(cls, observer: Observer, t: ArrayLike, model: RobotModel, units: Units) -> Posture:
        """At a time [s], or at times (N,). Raises ValueError, TypeError."""
        times = numbers(t, "t")
        if times.ndim > 1:
            raise ValueError(f"t: one time or an array (N,) is wanted, not {times.shape}")
        return cls.of(observer.over(times) if times.ndim else observer.at(float(times)), model, units)

    @property
    def xyz(self) -> Floats:
        """(..., 3): X, Y, Z of the tool tip."""
        return self.location.xyz

    @property
    def oat(self) -> Floats:
        """(..., 3): the angles O, A, T of the tool."""
        return self.location.oat

    @property
    def units(self) -> Units:
        return self.location.units

    @cached_property
    def speed(self) -> Floats:
        """(N,): how fast the tool tip goes between neighbouring times. Raises ValueError for fewer than two."""
        if self.t.size < 2:
            raise ValueError("speed: at least two times are wanted")
        return freeze(np.linalg.norm(np.gradient(self.xyz, self.t, axis=0), axis=-1))

    def __len__(self) -> int:
        return len(self.t)

    def __repr__(self) -> str:
        if self.t.ndim:
            span = f", {self.t.min():.3f} to {self.t.max():.3f} s" if self.t.size else ""
            return f"Posture at {self.t.size} times{span}: joints {self.joints.shape}, xyz {self.xyz.shape}"
        angle, joints = self.units.angle, _list(self.joints)
        return f"Posture at {float(self.t):.3f} s: joints {joints} {angle}, {place_text(self.location)}"

    def _repr_html_(self) -> str:
        parts = [np.atleast_2d(part) for part in (self.joints, self.xyz, self.oat)]
        names = ("t", *(f"JT{joint}" for joint in range(1, self.joints.shape[-1] + 1)), *"XYZOAT")
        times = np.atleast_1d(self.t)

        def row(index: int) -> tuple[str, ...]:
            return figures((times[index], *(number for part in parts for number in part[index])))

        return table(repr(self), number_columns(names), len(times), row)


def place_text(location: Location) -> str:
    """Return the place of one location as text."""
    units = location.units
    return f"xyz {_list(location.xyz)} {units.length}, oat {_list(location.oat)} {units.angle}"


def _list(numbers: Floats) -> str:
    return f"({', '.join(f'{x:.6g}' for x in numbers.round(9) + 0.0)})"


class Preview(Struct, frozen=True, eq=False):
    """A preview of the robot, as it was known when the preview was made; later commands do not change it. Times [s].

    `timeline`: with all that is on its way; from `unconfirmed` on it is not what the robot has said (infinity: all of
    it is). `commands`: what is expected of each that is on its way, in the order of sending: `text`, `issued`, `begin`
    (from when on it changes the timeline, or None), `refused` (why the robot will not do it, or None), `planned`.
    `arrives`: the robot's clock when a command of now comes to it; `round_trip`: D_f + D_b, as measured. `flagged`:
    pairs, the times of which something wrong was seen here, as a command was not known yet.
    """

    arm: RobotArm
    units: Units
    timeline: Timeline
    arrives: float
    unconfirmed: float
    commands: tuple[Expected, ...]
    round_trip: float
    flagged: tuple[tuple[float, float], ...]

    @classmethod
    def of(cls, it: Previewed, arm: RobotArm, units: Units) -> Preview:
        return cls(arm, units, it.timeline, it.arrives, it.unconfirmed, it.expected, it.round_trip, it.flagged)

    def where(self, t: ArrayLike | None = None) -> Posture:
        """Return the posture at a time [s] or at times (N,); without `t`, when a command sent now will arrive."""
        observer = Observer(RecordedRobot(self.arm, self.timeline))
        return Posture.seen(observer, self.arrives if t is None else t, self.arm.model, self.units)

    def __repr__(self) -> str:
        end, under_way = self.timeline.end, count(len(self.commands), "command")
        until = "all" if self.unconfirmed > end else f"to {self.unconfirmed:.3f} s"
        return f"<Preview to {end:.3f} s: confirmed {until}, {under_way} on the way>"
