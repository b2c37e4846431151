"""How a robot looks: the surfaces of its shapes, made once, and what room they take."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from vrs_cli.kinematics.bodies import shapes_of
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.model import RobotModel, link_frames
from vrs_cli.kinematics.shapes import MeshFile, Shape
from vrs_cli.view3d.meshes import Mesh, Points, mesh_of, moved


class Look(NamedTuple):
    """A shape and its surface, in the frame of its link."""

    shape: Shape
    mesh: Mesh


@lru_cache
def looks_of(model: RobotModel) -> tuple[Look, ...]:
    """All that is seen of a robot."""
    return tuple(Look(shape, mesh_of(shape.body)) for shape in shapes_of(model) if not isinstance(shape.body, MeshFile))


@lru_cache
def floor_height(model: RobotModel) -> float:
    """Where the robot's foot stands, in its own frame [m]."""
    feet = [moved(look.mesh, model.base).vertices[:, 2].min() for look in looks_of(model) if look.shape.link == 0]
    return float(min(feet, default=0.0))


def room_of(model: RobotModel, joints: Joints) -> Points:
    """The corners of the box that the robot fills at these joints, in its own frame: least, largest (2, 3) [m]."""
    frames = link_frames(model, joints)
    points = np.concatenate([moved(look.mesh, frames[look.shape.link]).vertices for look in looks_of(model)])
    return np.array([points.min(axis=0), points.max(axis=0)])
