"""Define the values that describe a robot in Python: postures at one time or many, previews, parts of the cell, joint
solutions for a location, measured joints, and the model."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cached_property
from typing import NamedTuple

import numpy as np
from msgspec import Struct
from numpy.typing import ArrayLike

from vrs_cli.api.answers import figures, table
from vrs_cli.api.location import Flags, Floats, Location, Units, freeze, number, numbers
from vrs_cli.engine.position import PositionArrays
from vrs_cli.interfaces.port.port import Expected, Previewed
from vrs_cli.interfaces.roles.supervisor import Observer, RecordedRobot
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.arrays import compose_batch, stack
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.robot_file import robot_names
from vrs_cli.kinematics.transform import inverse
from vrs_cli.render.blocks import Column, number_columns
from vrs_cli.trajectory.measured import MeasuredTimeline
from vrs_cli.trajectory.reports import MODES
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.commands import Frames
from vrs_cli.values.numbers import count
from vrs_cli.values.replies import PartRow
from vrs_cli.values.results import Position


class Posture(Struct, frozen=True, eq=False, dict=True):
    """The state of the robot at one time or at N times. For N times every array has N rows, such as `joints` (N, n).

    `t` [s]; `joints` (n,) in degrees (mm for prismatic joints), `velocity` (n,) per second, `acceleration` (n,) per
    second squared; all are in SI units with `units="SI"`; `location`: the tool tip in the world (BASE) frame; `hand`: 1
    open, 0 closed.
    """

    t: Floats
    joints: Floats
    velocity: Floats
    acceleration: Floats
    location: Location
    hand: Floats

    @classmethod
    def of(cls, at: Position | PositionArrays, model: RobotModel, units: Units) -> Posture:
        time, rows = (
            (np.array(at.time), np.array(at.T_world_tool).reshape(3, 4))
            if isinstance(at, Position)
            else (at.times, at.T_world_tool)
        )
        scales = units.scales(model.units, model.joint_count)
        joints, velocity, acceleration = (
            freeze(np.array(rates) * scales) for rates in (at.joints, at.velocity, at.acceleration)
        )
        return cls(freeze(time), joints, velocity, acceleration, Location(rows, units), freeze(np.array(at.hand)))

    @property
    def xyz(self) -> Floats:
        """Return X, Y, Z of the tool tip (..., 3)."""
        return self.location.xyz

    @property
    def oat(self) -> Floats:
        """Return the angles O, A, T of the tool (..., 3)."""
        return self.location.oat

    @property
    def units(self) -> Units:
        """Return the units of all numbers."""
        return self.location.units

    @cached_property
    def speed(self) -> Floats:
        """Return the speed of the tool tip (N,), computed from the positions at neighbouring times. Raises ValueError
        for fewer than two times.
        """
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

        return table(repr(self), number_columns(*names), len(times), row)


def posture_at(observer: Observer, t: ArrayLike, model: RobotModel, units: Units) -> Posture:
    """Return the posture at a time [s] or at times (N,). Raises ValueError, TypeError."""
    times = numbers(t, "t")
    if times.ndim > 1:
        raise ValueError(f"t: one time or an array (N,) is wanted, not {times.shape}")
    return Posture.of(observer.over(times) if times.ndim else observer.at(float(times)), model, units)


def place_text(location: Location) -> str:
    """Return the coordinates of one location as text."""
    units = location.units
    return f"xyz {_list(location.xyz)} {units.length}, oat {_list(location.oat)} {units.angle}"


def _list(numbers: Floats) -> str:
    return f"({', '.join(f'{x:.6g}' for x in numbers.round(9) + 0.0)})"


class Preview(Struct, frozen=True, eq=False):
    """A preview of the robot's motion, including the commands that have been sent and have not arrived yet. Later
    commands do not change a preview. All times are in seconds.

    `timeline`: the timeline with all of these commands. The robot has confirmed it up to the time `unconfirmed`
    (infinity: all of it). `commands`: the expected effect of each command that has not arrived yet, in the order of
    sending: `text`, `issued`, `begin` (the time from which it changes the timeline, or None), `refused` (why the robot
    will refuse it, or None), `planned`. `arrives`: the time of the robot's clock at which a command sent now will
    arrive; `round_trip`: the measured round-trip delay. `flagged`: pairs of times between which this client has shown a
    wrong position, because it did not know of a command yet.
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
        """Return the posture at a time [s] or at times (N,); without `t`, at the time when a command sent now will
        arrive."""
        observer = Observer(RecordedRobot(self.arm, self.timeline))
        return posture_at(observer, self.arrives if t is None else t, self.arm.model, self.units)

    def __repr__(self) -> str:
        end, under_way = self.timeline.end, count(len(self.commands), "command")
        until = "all" if self.unconfirmed > end else f"to {self.unconfirmed:.3f} s"
        return f"<Preview to {end:.3f} s: confirmed {until}, {under_way} on the way>"


# --- the parts of a cell ---------------------------------------------------------------------------------------------


class PartPlace(NamedTuple):
    """A part of the cell at a time [s]. `location`: None if the part is absent; `held`: the hand holds the part; `on`:
    the name of the part or fixture on which the part rests, empty in the air and in the hand."""

    name: str
    time: float
    location: Location | None
    held: bool
    on: str

    @classmethod
    def of(cls, row: PartRow, units: Units) -> PartPlace:
        T = row.T_world_part
        return cls(row.name, row.time, None if T is None else Location.of(T, units), row.held, row.on)


class CellPart:
    """A part (workpiece) in a robot's cell."""

    def __init__(self, name: str, look: Callable[[float | None], PartPlace]) -> None:
        self.name, self._look = name, look

    def at(self, t: float) -> PartPlace:
        """Return where the part is at a time [s], past or planned."""
        return self._look(number(t, "t"))

    @property
    def now(self) -> PartPlace:
        """Return where the part is now."""
        return self._look(None)

    def __repr__(self) -> str:
        now = self.now
        place = "not there" if now.location is None else f"{now.location}{', held' * now.held}"
        return f"<CellPart {self.name}: {place}>"


# --- kinematics, with the current TOOL and BASE ----------------------------------------------------------------------


class Ways(Struct, frozen=True, eq=False, dict=True):
    """All joint solutions for a location, or for N locations, in k configurations. `configurations`: their names; a
    second solution of the same configuration has a number. `joints` (..., k, n): nan if the arm does not reach the
    location in this configuration. `usable` (..., k): True if the arm reaches it with every joint in its range.
    """

    configurations: tuple[str, ...]
    joints: Floats
    usable: Flags
    units: Units

    @cached_property
    def best(self) -> Floats:
        """Return the joints (..., n) of the first usable solution; nan if no solution is usable."""
        first = np.expand_dims(self.usable.argmax(axis=-1), (-1, -2))
        found = np.take_along_axis(self.joints, first, axis=-2)[..., 0, :]
        return freeze(np.where(self.usable.any(axis=-1, keepdims=True), found, np.nan))

    def __getitem__(self, configuration: str) -> Floats:
        """Return the joints (..., n) of one solution by the name of its configuration. Raises KeyError."""
        name = " ".join(configuration.upper().split())
        if name not in self.configurations:
            raise KeyError(f"{configuration}: there are {', '.join(self.configurations)}")
        return self.joints[..., self.configurations.index(name), :]

    def __iter__(self) -> Iterator[str]:
        return iter(self.configurations)

    def __repr__(self) -> str:
        if self.usable.ndim > 1:
            count = int(self.usable.any(axis=-1).sum())
            return f"Ways to {self.usable[..., 0].size} locations, {count} of them usable: joints {self.joints.shape}"
        return "\n".join(map(self._line, range(len(self.configurations)))) or "no ways"

    def _repr_html_(self) -> str:
        if self.usable.ndim > 1:
            return f"<pre>{self!r}</pre>"
        columns = number_columns(*(f"JT{joint}" for joint in range(1, self.joints.shape[-1] + 1)))
        count = len(self.configurations)

        def row(index: int) -> tuple[str, ...]:
            return self.configurations[index], *figures(self.joints[index]), str(self.usable[index])

        title = f"{int(self.usable.sum())} of {count} ways are usable"
        return table(title, (Column("configuration"), *columns, Column("usable")), count, row)

    def _line(self, index: int) -> str:
        joints = self.joints[index]
        name = self.configurations[index] or "joints"
        if np.isnan(joints).any():
            return f"{name:<20} out of reach"
        columns = " ".join(f"{x:9.3f}" for x in joints.round(9) + 0.0)
        return f"{name:<20} {columns}{'' if self.usable[index] else '  out of range'}"


def forward(arm: RobotArm, frames: Frames, q: Floats, units: Units) -> Location:
    """Return the tool tip in the world for joints (..., n) [rad, m]."""
    T_world_robot, T_flange_tool = stack([inverse(frames.base), frames.tool])
    T_robot_flange = arm.batch.forward(q.reshape(-1, q.shape[-1]))
    T = compose_batch(compose_batch(T_world_robot, T_robot_flange), T_flange_tool)
    return Location(T.reshape(*q.shape[:-1], 3, 4), units)


def ways(arm: RobotArm, frames: Frames, location: Location, units: Units) -> Ways:
    """Return all joint solutions for locations (all branches of the inverse kinematics)."""
    T_robot_world, T_tool_flange = stack([frames.base, inverse(frames.tool)])
    T = compose_batch(compose_batch(T_robot_world, location.rows.reshape(-1, 3, 4)), T_tool_flange)
    configurations, joints, usable = arm.batch.every_inverse(T)
    n, shape = arm.model.joint_count, location.shape
    joints = joints * units.scales(arm.model.units, n)
    names = [str(one) for one in configurations]
    counts = [names[: i + 1].count(name) for i, name in enumerate(names)]
    numbered = tuple(f"{name} {count}" if count > 1 else name for name, count in zip(names, counts, strict=True))
    return Ways(numbered, freeze(joints.reshape(*shape, -1, n)), usable.reshape(*shape, -1), units)


def jacobian(arm: RobotArm, frames: Frames, q: Floats, units: Units) -> Floats:
    """Return the Jacobian (..., 6, n) at joints (..., n) [rad, m], in the robot's frame and in these units."""
    n = arm.model.joint_count
    J = arm.batch.jacobian(q.reshape(-1, n), frames.tool)
    turn, shift = (180.0 / np.pi, 1000.0) if units is Units.VAL else (1.0, 1.0)
    rows = np.repeat((shift, turn), 3)[:, None]
    return np.reshape(J * rows / units.scales(arm.model.units, n), (*q.shape[:-1], 6, n))


class Measured(Struct, frozen=True, eq=False):
    """All joints that the real or simulated arm has reported up to now; later reports do not change this value. Joints
    are in degrees (mm for prismatic joints), for a robot with `units="SI"` in radians and metres; times are in seconds.
    `timeline`: the same reports in radians and metres."""

    timeline: MeasuredTimeline
    model: RobotModel
    units: Units

    def __len__(self) -> int:
        return len(self.timeline)

    @property
    def unknown_since(self) -> float | None:
        """Return the time of the last report, after which the robot's position is unknown; None if there is
        no report.
        """
        return self.timeline.end

    def at(self, t: ArrayLike) -> Floats | None:
        """Return the joints (n,) at a time, or None if they are unknown; at times (N,): (N, n), NaN if unknown.

        Raises ValueError, TypeError.
        """
        times = numbers(t, "t")
        if times.ndim > 1:
            raise ValueError(f"t: one time or an array (N,) is wanted, not {times.shape}")
        if times.ndim:
            return freeze(self.timeline.joints_over(times) * self._scales)
        joints = self.timeline.joints_at(float(times))
        return None if joints is None else freeze(np.array(joints) * self._scales)

    @property
    def times(self) -> Floats:
        """Return the times of all reports (N,)."""
        return freeze(self.timeline.arrays().times)

    @property
    def joints(self) -> Floats:
        """Return the joints of all reports (N, n)."""
        return freeze(self.timeline.arrays().joints * self._scales)

    @property
    def velocity(self) -> Floats:
        """Return the velocities of all reports (N, n); NaN for reports without velocities."""
        return freeze(self.timeline.arrays().velocity * self._scales)

    @property
    def effort(self) -> Floats:
        """Return the efforts of all reports (N, n) [N m, N]; NaN for reports without efforts."""
        return freeze(self.timeline.arrays().effort.astype(float))

    @property
    def modes(self) -> tuple[str, ...]:
        """Return the mode of each report: "follows", "holds" or "stopped"."""
        return tuple([MODES[place].value for place in self.timeline.arrays().modes.tolist()])

    @property
    def _scales(self) -> Floats:
        return self.units.scales(self.model.units, self.model.joint_count)

    def __repr__(self) -> str:
        return repr(self.timeline).replace("MeasuredTimeline", "Measured")


class Model(Struct, frozen=True, eq=False):
    """The data of a robot: joints with their limits, and poses. Joints are in degrees (mm for prismatic joints); for a
    robot with `units="SI"` they are in radians and metres.

    `dof`: the number n of joints; `names` (n): jt1, jt2, ...; `lower`, `upper` (n,): the range of each joint;
    `max_velocity`, `max_acceleration`, `max_jerk` (n,): limits of each joint at full speed; `poses`: joints (n,) by
    name, such as "ready".
    """

    name: str
    title: str
    dof: int
    names: tuple[str, ...]
    lower: Floats
    upper: Floats
    max_velocity: Floats
    max_acceleration: Floats
    max_jerk: Floats
    poses: dict[str, Floats]

    @classmethod
    def of(cls, model: RobotModel, units: Units) -> Model:
        """Return the data of a robot model in these units."""
        scales = units.scales(model.units, model.joint_count)
        names = tuple([f"jt{joint}" for joint in range(1, model.joint_count + 1)])
        rates = (model.max_velocity, model.max_acceleration, model.max_jerk)
        rows = (model.lower, model.upper, *rates, *model.poses.values())
        lower, upper, velocity, acceleration, jerk, *poses = [freeze(np.array(row) * scales) for row in rows]
        limits = (lower, upper, velocity, acceleration, jerk)
        return cls(model.name, model.title, len(names), names, *limits, dict(zip(model.poses, poses, strict=True)))

    @property
    def limits(self) -> Floats:
        """Return the lower and the upper end of the range of each joint (n, 2)."""
        return freeze(np.stack((self.lower, self.upper), axis=-1))

    def __repr__(self) -> str:
        return f"<Model {self.name}: {self.dof} joints, poses {', '.join(self.poses)}>"

    def _repr_html_(self) -> str:
        """Return a table with a row for each joint: its range, its limits at full speed, its value in each pose."""
        rates = ("lower", "upper", "max_velocity", "max_acceleration", "max_jerk")
        columns = [getattr(self, name) for name in rates] + list(self.poses.values())

        def row(index: int) -> tuple[str, ...]:
            return self.names[index], *figures(float(column[index]) for column in columns)

        shown = (Column("joint"), *number_columns(*(name.replace("_", " ") for name in rates), *self.poses))
        return table(f"{self.title}: {self.dof} joints", shown, self.dof, row)


def robots() -> tuple[str, ...]:
    """Return the names of the built-in robots; `Robot` accepts each of them."""
    return robot_names()
