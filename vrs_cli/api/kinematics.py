"""The kinematics of a robot, for one pose or for arrays of them, with the TOOL and BASE that are in force."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property

import numpy as np
from msgspec import Struct

from vrs_cli.api.answers import figures, number_columns, table
from vrs_cli.api.location import Location
from vrs_cli.api.numbers import Flags, Floats, Units, freeze
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.transform import inverse
from vrs_cli.kinematics.transform_batch import compose_batch, stack
from vrs_cli.render.blocks import Column
from vrs_cli.values.motion import Frames


class Ways(Struct, frozen=True, eq=False, dict=True):
    """All ways to reach a location, or N locations: k configurations.

    `configurations`: their names, with a number from the second way of the same configuration on. `joints` (..., k, n):
    nan where a way does not reach. `usable` (..., k): it reaches, with every joint in its range.
    """

    configurations: tuple[str, ...]
    joints: Floats
    usable: Flags
    units: Units

    @cached_property
    def best(self) -> Floats:
        """(..., n): the first usable way; nan where there is none."""
        first = np.expand_dims(self.usable.argmax(axis=-1), (-1, -2))
        found = np.take_along_axis(self.joints, first, axis=-2)[..., 0, :]
        return freeze(np.where(self.usable.any(axis=-1, keepdims=True), found, np.nan))

    def __getitem__(self, configuration: str) -> Floats:
        """(..., n): the joints of one way. Raises KeyError."""
        return self.joints[..., self._index(configuration), :]

    def _index(self, configuration: str) -> int:
        said = " ".join(configuration.upper().split())
        if said not in self.configurations:
            raise KeyError(f"{configuration}: there are {', '.join(self.configurations)}")
        return self.configurations.index(said)

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
        columns = number_columns(f"JT{joint}" for joint in range(1, self.joints.shape[-1] + 1))
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
        said = " ".join(f"{x:9.3f}" for x in joints.round(9) + 0.0)
        return f"{name:<20} {said}{'' if self.usable[index] else '  out of range'}"


def forward(arm: RobotArm, frames: Frames, q: Floats, units: Units) -> Location:
    """The tool tip in the world, of joints (..., n) [rad, m]."""
    T_world_robot, T_flange_tool = stack([inverse(frames.base), frames.tool])
    T_robot_flange = arm.batch.forward(q.reshape(-1, q.shape[-1]))
    T = compose_batch(compose_batch(T_world_robot, T_robot_flange), T_flange_tool)
    return Location(T.reshape(*q.shape[:-1], 3, 4), units)


def ways(arm: RobotArm, frames: Frames, location: Location, units: Units) -> Ways:
    """Return all branches of the inverse."""
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
    """(..., 6, n) of joints (..., n) [rad, m]."""
    n = arm.model.joint_count
    J = arm.batch.jacobian(q.reshape(-1, n), frames.tool)
    turn, shift = (180.0 / np.pi, 1000.0) if units is Units.VAL else (1.0, 1.0)
    rows = np.repeat((shift, turn), 3)[:, None]
    scaled: Floats = J * rows / units.scales(arm.model.units, n)
    return scaled.reshape(*q.shape[:-1], 6, n)
