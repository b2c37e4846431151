"""The surfaces of a robot's shapes, made once, and the room that they take."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from vrs_cli.errors import VrsError
from vrs_cli.kinematics.bodies import capsules, shapes_of
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.model import RobotModel, link_frames
from vrs_cli.kinematics.shapes import LinkShape, MeshFile
from vrs_cli.view3d.meshes import Mesh, Points, mesh_of, moved, read_mesh


class ShapeLook(NamedTuple):
    """A shape and its surface, in the frame of its link."""

    shape: LinkShape
    mesh: Mesh


class Looks(NamedTuple):
    """All that is seen of a robot. `missing`: what is said of files of meshes that cannot be read; their links have
    capsules instead."""

    looks: tuple[ShapeLook, ...]
    missing: str = ""


def looks_of(model: RobotModel) -> tuple[ShapeLook, ...]:
    """All that is seen of a robot."""
    return all_of(model).looks


@lru_cache
def all_of(model: RobotModel) -> Looks:
    found, bare, why = list[ShapeLook](), set[int](), list[VrsError]()
    for shape in shapes_of(model):
        try:
            found.append(ShapeLook(shape, _mesh(shape)))
        except VrsError as error:
            why.append(error)
            bare.add(shape.link)
    instead = [shape for shape in capsules(model) if shape.link in bare] if bare else []
    more = f" (and {len(why) - 1} more)" if len(why) > 1 else ""
    missing = f"{why[0]}{more}: capsules stand for what is missing" if why else ""
    looks = [look for look in found if look.shape.link not in bare]
    return Looks((*looks, *(ShapeLook(shape, _mesh(shape)) for shape in instead)), missing)


def _mesh(shape: LinkShape) -> Mesh:
    return read_mesh(shape.body) if isinstance(shape.body, MeshFile) else mesh_of(shape.body)


@lru_cache
def floor_height(model: RobotModel) -> float:
    """The height of the robot's foot in its own frame [m]."""
    feet = [moved(look.mesh, model.base).vertices[:, 2].min() for look in looks_of(model) if look.shape.link == 0]
    return float(min(feet, default=0.0))


def room_of(model: RobotModel, joints: Joints) -> Points:
    """The corners of the box that the robot fills at these joints, in its own frame: least, largest (2, 3) [m]."""
    frames = link_frames(model, joints)
    points = np.concatenate([moved(look.mesh, frames[look.shape.link]).vertices for look in looks_of(model)])
    return np.array([points.min(axis=0), points.max(axis=0)])
