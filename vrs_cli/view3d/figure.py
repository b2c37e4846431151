"""One arm in a scene: the surfaces of its shapes, made once, in the frames that g gives its links."""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from viser import MeshHandle, SceneApi

from vrs_cli.errors import VrsError
from vrs_cli.kinematics.bodies import capsules, shapes_of
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.model import RobotModel, link_frames, link_pose
from vrs_cli.kinematics.shapes import LinkShape, MeshFile, Opening, opened, rgb
from vrs_cli.kinematics.transform import IDENTITY, Transform, inverse
from vrs_cli.view3d.meshes import Mesh, Points, joined, mesh_of, moved, read_mesh
from vrs_cli.view3d.parts import Rooted, place, put


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


# --- the arm ---------------------------------------------------------------------------------------------------------


Colour = tuple[int, int, int]


class Finger(NamedTuple):
    """A part that the hand moves: `opens` from closed to open, in the frame of its link."""

    node: MeshHandle
    opens: tuple[Opening, ...]


class Figure(Rooted):
    """An arm, as often as there are roots: node ROOT, in it the frames of the links, each in that of the link before
    (`link_node`), and their meshes. `links` are these frames, that of the base first.

    So a joint that moves is one node that does. `colour` and `opacity` are those of a ghost; without them each shape
    has its own.
    """

    def __init__(
        self,
        scene: SceneApi,
        root: str,
        model: RobotModel,
        *,
        colour: Colour | None = None,
        opacity: float | None = None,
    ) -> None:
        self.model = model
        self._scene, self._colour, self._opacity = scene, colour, opacity
        self._root = scene.add_frame(root, show_axes=False)
        self.links = [scene.add_frame(link_node(root, i), show_axes=False) for i in range(model.joint_count + 1)]
        place(self.links[0], model.base)
        self._joints: list[float | None] = [None] * model.joint_count
        self._base, self._hand = IDENTITY, -1.0
        self.fingers: list[Finger] = []
        self._bodies: list[list[MeshHandle]] = [[] for _ in self.links]
        for k, group in enumerate(_groups(looks_of(model), one_colour=colour is not None)):
            self._add(f"{link_node(root, group[0].shape.link)}/body{k}", group)

    def _add(self, name: str, group: list[ShapeLook]) -> None:
        first = group[0].shape
        mesh = joined([look.mesh for look in group])
        node = self._scene.add_mesh_simple(
            name,
            mesh.vertices,
            mesh.faces,
            color=self._colour or rgb(first.colour),
            opacity=self._opacity,
            side="double" if isinstance(first.body, MeshFile) else "front",  # files may have holes
            cast_shadow=self._opacity is None,
            receive_shadow=False,
        )
        self._bodies[first.link].append(node)
        if first.opens:
            self.fingers.append(Finger(node, first.opens))

    def show_link(self, i: int, visible: bool) -> None:
        """Whether the bodies of a link are seen, 0 the base; the links after it stay as they are."""
        for node in self._bodies[i]:
            put(node, visible=visible)

    def pose(self, joints: Joints, hand: float, base: Transform = IDENTITY) -> None:
        """Stand at these joints, the hand open (1), closed (0) or between; `base` is BASE, T_robot_world.

        Nothing is sent of what did not move.
        """
        if base != self._base:
            self._base = base
            place(self._root, inverse(base))
        for i, x in enumerate(joints, 1):
            if x != self._joints[i - 1]:
                self._joints[i - 1] = x
                place(self.links[i], link_pose(self.model, i, x))
        if hand != self._hand:
            self._hand = hand
            for finger in self.fingers:
                place(finger.node, opened(finger.opens, hand))

    def remove(self) -> None:
        """Take it out of the scene."""
        self._root.remove()


def link_node(root: str, i: int) -> str:
    """The name of the node of a link, 0 the base: ROOT/0/1/2 of the second."""
    return "/".join((root, *map(str, range(i + 1))))


def _groups(looks: Iterable[ShapeLook], one_colour: bool) -> list[list[ShapeLook]]:
    """Shapes that move together and have one colour: a node each."""
    groups: dict[tuple[object, ...], list[ShapeLook]] = {}
    for look in looks:
        shape = look.shape
        key = shape.link, shape.opens, isinstance(shape.body, MeshFile), None if one_colour else shape.colour
        groups.setdefault(key, []).append(look)
    return list(groups.values())
