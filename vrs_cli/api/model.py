"""What a robot is, in the units of a robot in Python: joints with their limits, poses; and which robots there are."""

from __future__ import annotations

import numpy as np
from msgspec import Struct

from vrs_cli.api.answers import figures, table
from vrs_cli.api.location import Floats, Units, freeze
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.robot_file import robot_names
from vrs_cli.render.blocks import Column, number_columns


class Model(Struct, frozen=True, eq=False):
    """Joints are in degrees (mm where a joint slides), or in radians and metres.

    `names` (n): jt1, jt2, ...; `lower`, `upper` (n,): the range of each joint; `max_velocity`, `max_acceleration`,
    `max_jerk` (n,): each joint at full speed; `poses`: joints (n,) by name, such as "ready".
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
        """Return a model in some units."""
        scales = units.scales(model.units, model.joint_count)

        def shown(joints: Joints) -> Floats:
            return freeze(np.array(joints) * scales)

        return cls(
            model.name,
            model.title,
            model.joint_count,
            tuple([f"jt{joint}" for joint in range(1, model.joint_count + 1)]),
            shown(model.lower),
            shown(model.upper),
            shown(model.max_velocity),
            shown(model.max_acceleration),
            shown(model.max_jerk),
            {name: shown(joints) for name, joints in model.poses.items()},
        )

    @property
    def limits(self) -> Floats:
        """(n, 2): the lower and the upper end of the range of each joint."""
        return freeze(np.stack((self.lower, self.upper), axis=-1))

    def __repr__(self) -> str:
        return f"<Model {self.name}: {self.dof} joints, poses {', '.join(self.poses)}>"

    def _repr_html_(self) -> str:
        """A row for each joint: its range, full speed, and place in each pose."""
        rates = ("lower", "upper", "max_velocity", "max_acceleration", "max_jerk")
        columns = [getattr(self, name) for name in rates] + list(self.poses.values())

        def row(index: int) -> tuple[str, ...]:
            return self.names[index], *figures(float(column[index]) for column in columns)

        shown = (Column("joint"), *number_columns(*(name.replace("_", " ") for name in rates), *self.poses))
        return table(f"{self.title}: {self.dof} joints", shown, self.dof, row)


def robots() -> tuple[str, ...]:
    """Return the names of the built-in robots, each of which `Robot` takes."""
    return robot_names()
