"""One arm in a scene: the surfaces of its shapes, made once, in the frames that g gives its links. And what is around
it: the floor with its scale, light, the frames of base, world and tool, and who looks at it.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import lru_cache
from itertools import pairwise
from math import atan, ceil, hypot, sin, tan
from typing import NamedTuple

import numpy as np
from viser import FrameHandle, MeshHandle, SceneApi

from vrs_cli.errors import VrsError
from vrs_cli.kinematics.bodies import capsules, shapes_of, size_of
from vrs_cli.kinematics.joints import JointKind, Joints
from vrs_cli.kinematics.model import RobotModel, link_frames, link_pose
from vrs_cli.kinematics.shapes import LinkShape, MeshFile, Opening, opened, rgb
from vrs_cli.kinematics.transform import IDENTITY, Transform, Vector, compose, inverse, position, translation
from vrs_cli.view3d.meshes import Mesh, Points, joined, mesh_of, moved, read_mesh
from vrs_cli.view3d.parts import Colour, Rooted, place, put


class ShapeLook(NamedTuple):
    """A shape and its surface, in the frame of its link."""

    shape: LinkShape
    mesh: Mesh


class Looks(NamedTuple):
    """The surfaces of a robot. `missing`: what is said of files of meshes that cannot be read; their links have
    capsules instead."""

    looks: tuple[ShapeLook, ...]
    missing: str = ""


@lru_cache
def looks_of(model: RobotModel) -> Looks:
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
    feet = [moved(look.mesh, model.base).vertices[:, 2].min() for look in looks_of(model).looks if look.shape.link == 0]
    return float(min(feet, default=0.0))


def room_of(model: RobotModel, joints: Joints) -> Points:
    """The corners of the box that the robot fills at these joints, in its own frame: least, largest (2, 3) [m]."""
    frames = link_frames(model, joints)
    points = np.concatenate([moved(look.mesh, frames[look.shape.link]).vertices for look in looks_of(model).looks])
    return np.array([points.min(axis=0), points.max(axis=0)])


# --- the arm ---------------------------------------------------------------------------------------------------------


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
        self._root = scene.add_frame(root, show_axes=False)
        self.links = [scene.add_frame(link_node(root, i), show_axes=False) for i in range(model.joint_count + 1)]
        place(self.links[0], model.base)
        self._joints: list[float | None] = [None] * model.joint_count
        self._base, self._hand = IDENTITY, -1.0
        self.fingers: list[Finger] = []
        self._bodies: list[list[tuple[MeshHandle, Colour]]] = [[] for _ in self.links]  # with their own colours
        for k, group in enumerate(_groups(looks_of(model).looks, one_colour=colour is not None)):
            first = group[0].shape
            mesh = joined([look.mesh for look in group])
            own = colour or rgb(first.colour)
            node = scene.add_mesh_simple(
                f"{link_node(root, first.link)}/body{k}",
                mesh.vertices,
                mesh.faces,
                color=own,
                opacity=opacity,
                side="double" if isinstance(first.body, MeshFile) else "front",  # files may have holes
                cast_shadow=opacity is None,
                receive_shadow=False,
            )
            self._bodies[first.link].append((node, own))
            if first.opens:
                self.fingers.append(Finger(node, first.opens))

    def show_link(self, i: int, visible: bool) -> None:
        """Show or hide the bodies of a link, 0 the base; the links after it stay as they are."""
        for node, _ in self._bodies[i]:
            put(node, visible=visible)

    def paint(self, i: int, colour: Colour | None) -> None:
        """Paint the bodies of a link, 0 the base, in one colour; None: each in its own."""
        for node, own in self._bodies[i]:
            put(node, color=colour or own)

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


# --- around the arm --------------------------------------------------------------------------------------------------


# lines through points (x, y) of a field 4 wide and 6 high
GLYPHS: Mapping[str, tuple[tuple[tuple[float, float], ...], ...]] = {
    "0": (((1, 0), (3, 0), (4, 1), (4, 5), (3, 6), (1, 6), (0, 5), (0, 1), (1, 0)),),
    "1": (((0.5, 4.5), (2, 6), (2, 0)), ((0.5, 0), (3.5, 0))),
    "2": (((0, 5), (1, 6), (3, 6), (4, 5), (4, 4), (0, 0), (4, 0)),),
    "3": (((0, 6), (4, 6), (2, 3.5), (3, 3.5), (4, 2.5), (4, 1), (3, 0), (1, 0), (0, 1)),),
    "4": (((3, 0), (3, 6), (0, 2), (4, 2)),),
    "5": (((4, 6), (0, 6), (0, 3.5), (3, 3.5), (4, 2.5), (4, 1), (3, 0), (1, 0), (0, 1)),),
    "6": (((3.5, 6), (1.5, 6), (0, 4), (0, 1), (1, 0), (3, 0), (4, 1), (4, 2.5), (3, 3.5), (0, 3.5)),),
    "7": (((0, 6), (4, 6), (1.5, 0)),),
    "8": (
        ((1, 3.2), (0, 4.2), (0, 5), (1, 6), (3, 6), (4, 5), (4, 4.2), (3, 3.2), (1, 3.2)),
        ((1, 3.2), (0, 2.2), (0, 1), (1, 0), (3, 0), (4, 1), (4, 2.2), (3, 3.2)),
    ),
    "9": (((0.5, 0), (2.5, 0), (4, 2), (4, 5), (3, 6), (1, 6), (0, 5), (0, 3.5), (1, 2.5), (4, 2.5)),),
    "-": (((0.5, 3), (3.5, 3)),),
    "X": (((0, 0), (4, 6)), ((0, 6), (4, 0))),
    "Y": (((0, 6), (2, 3), (4, 6)), ((2, 3), (2, 0))),
    "m": (((0, 0), (0, 4), (1.2, 4), (2, 3.2), (2, 0)), ((2, 3.2), (2.8, 4), (3.2, 4), (4, 3.2), (4, 0))),
    " ": (),
}
ADVANCE, WIDTH, HEIGHT = 5.6, 4.0, 6.0
STROKE = 0.62  # how thick a line is


def lettered(text: str, height: float) -> Mesh:
    """A text about the origin in the plane z = 0, of such a height [m]; it runs along y, its foot to x."""
    strokes = [
        _stroke((x + ADVANCE * k, y), (u + ADVANCE * k, v))
        for k, letter in enumerate(text)
        for line in GLYPHS[letter]
        for (x, y), (u, v) in pairwise(line)
    ]
    mesh = joined(strokes)
    middle = np.array([0.5 * (ADVANCE * (len(text) - 1) + WIDTH), 0.5 * HEIGHT, 0.0])
    points = (mesh.vertices - middle) * (height / HEIGHT)
    return Mesh(np.stack([-points[:, 1], points[:, 0], points[:, 2]], axis=1), mesh.faces)


def _stroke(start: tuple[float, float], end: tuple[float, float]) -> Mesh:
    """A line of some thickness, a little longer than from end to end, so that corners are filled."""
    (x, y), (u, v) = start, end
    half = 0.5 * STROKE / hypot(u - x, v - y)
    a, b = half * (u - x), half * (v - y)
    corners = [(x - a + b, y - b - a), (u + a + b, v + b - a), (u + a - b, v + b + a), (x - a - b, y - b + a)]
    faces = np.array([(0, 1, 2), (0, 2, 3)], dtype=np.uint32)
    return Mesh(np.array([(*corner, 0.0) for corner in corners]), faces)


CELL, SECTION = 0.1, 0.5  # [m] between the lines of the floor, and between those that have a number
HEAD, FOOT = (214, 222, 232), (250, 250, 248)  # of the background
LETTER = 0.055  # of the reach: the height of its numbers
LARGEST_LETTER = 0.08  # [m] so that numbers do not run into each other
BELOW = 0.0005  # [m] the floor lies lower than the foot, which would flicker in it
FIELD = 0.66  # [rad] of view, from top to bottom: as a lens of 50 mm sees
MARGIN = 1.12  # around the arm in the picture
KEY = (0.45, -0.28, 0.85)  # towards the lamp: behind the robot's right shoulder, from above
LAMP, LIT = 8.0, 2.0  # of the reach: how far away it is, and the radius of what it lights
TOWARDS = (0.80, 0.55, 0.38)  # from the robot to who looks at it: from the front, on its left, from above


class Camera(NamedTuple):
    """A camera: its position, and the point it looks at [m]."""

    position: Vector
    look_at: Vector


class Stage:
    """The scene around an arm, before a backdrop. Nodes /floor, /world, /base, /tool."""

    def __init__(self, scene: SceneApi, model: RobotModel) -> None:
        reach = size_of(model)
        self._floor = scene.add_frame("/floor", show_axes=False)
        # the floor is a square with lines, and numbers in millimetres along X and Y, where the robot's foot stands
        half, height = SECTION * ceil(1.3 * reach / SECTION), floor_height(model)
        scene.add_grid(
            "/floor/lines",
            width=2.0 * half,
            height=2.0 * half,
            position=(0.0, 0.0, height - BELOW),
            cell_size=CELL,
            section_size=SECTION,
            cell_color=(224, 227, 230),
            section_color=(188, 194, 201),
            shadow_opacity=0.3,
            plane_color=(246, 246, 244),
            plane_opacity=1.0,
        )
        numbers = joined(_numbers(half, min(LETTER * reach, LARGEST_LETTER)))
        scene.add_mesh_simple(
            "/floor/numbers",
            numbers.vertices,
            numbers.faces,
            color=(120, 128, 138),
            cast_shadow=False,
            receive_shadow=False,
            position=(0.0, 0.0, height),
        )
        # a lamp far above the robot throws its shadow: a spot makes one map of it, where a directional light of viser
        # makes three, and all of that has to be drawn before the first picture
        x, y, z = (LAMP * reach * part for part in KEY)
        scene.add_light_spot(
            "/floor/lamp",
            intensity=2.6,
            decay=0.0,
            angle=atan(LIT / LAMP),
            position=(x, y, z),
            direction=(-x, -y, -z),
            cast_shadow=True,
        )
        self._frames = {name: _named_frame(scene, name, 0.22 * reach) for name in ("world", "base", "tool")}
        self._frames["base"].visible = False
        self._base = IDENTITY

    def pose(self, T_world_tool: Transform, base: Transform = IDENTITY) -> None:
        """Show the frames of this moment; `base` is BASE, T_robot_world. Nothing is sent of those that stand still."""
        place(self._frames["tool"], T_world_tool)
        if base != self._base:
            self._base = base
            self._frames["base"].visible = base != IDENTITY
            for node in (self._floor, self._frames["base"]):
                place(node, inverse(base))


def backdrop(scene: SceneApi) -> None:
    """Add the background and the light of every scene. Nodes /light.

    Without viser's picture of a hall that lights the scene, which takes software seconds to prepare: a page that is not
    told so with the first that it hears has begun to.
    """
    scene.configure_environment_map(None)
    scene.configure_default_lights(enabled=False)
    scene.set_up_direction("+z")
    scene.add_light_hemisphere("/light/sky", sky_color=(255, 255, 255), ground_color=(168, 164, 158), intensity=2.0)
    scene.add_light_directional("/light/fill", intensity=0.7, cast_shadow=False, position=(-1.0, 2.0, 1.0))
    # the background is lighter from above downwards, as paper that is bent behind what is photographed
    part = np.linspace(0.0, 1.0, 128)[:, None, None]
    picture = (1.0 - part) * np.array(HEAD) + part * np.array(FOOT)
    scene.set_background_image(np.repeat(picture, 2, axis=1).astype(np.uint8), format="png")


def _numbers(half: float, high: float) -> list[Mesh]:
    """The scales of X and Y, beside the lines through the origin."""
    count, found = round(half / SECTION), []
    for k in [k for k in range(-count, count + 1) if k]:
        number = f"{1000 * SECTION * k:.0f}"
        for axis, at in (("X", (SECTION * k - high, 2.0 * high)), ("Y", (high, SECTION * k))):
            mesh = lettered(number if k < count else f"{axis} mm", high)
            found.append(moved(mesh, translation(*at, 0.0)))
    return found


def _named_frame(scene: SceneApi, name: str, length: float) -> FrameHandle:
    node = scene.add_frame(f"/{name}", axes_length=length, axes_radius=0.02 * length, origin_radius=0.04 * length)
    scene.add_label(
        f"/{name}/name",
        name,
        position=(0.0, 0.0, 1.1 * length) if name == "tool" else (1.1 * length, 0.0, 0.0),
        anchor="center-center",
    )
    return node


def camera_for(model: RobotModel, aspect: float, base: Transform = IDENTITY) -> Camera:
    """A camera that sees all of the arm at READY, at NEST, and with sliding joints far out.

    `aspect`: the width of the screen by its height.
    """
    ready = model.poses["ready"]
    joints = zip(ready, model.upper, model.units.kinds, strict=True)
    far_out = tuple(upper if kind is JointKind.PRISMATIC else x for x, upper, kind in joints)
    rooms = np.concatenate([room_of(model, q) for q in (ready, model.poses["nest"], far_out)])
    low, high = rooms.min(axis=0), rooms.max(axis=0)
    centre, radius = 0.5 * (low + high), 0.5 * float(np.linalg.norm(high - low))
    half = min(0.5 * FIELD, atan(tan(0.5 * FIELD) * aspect))
    away = MARGIN * radius / sin(half)
    towards = np.array(TOWARDS) / np.linalg.norm(TOWARDS)
    T_world_robot = inverse(base)
    points = (centre + away * towards, centre)
    eye, aim = (position(compose(T_world_robot, translation(*map(float, point)))) for point in points)
    return Camera(eye, aim)
