"""The ranges of the joints, and the reach of the tool."""

from __future__ import annotations

from math import ceil, degrees, pi
from threading import Thread
from typing import NamedTuple

import numpy as np
from viser import LabelHandle, MeshHandle, SceneApi, SceneNodeHandle

from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.bodies import size_of
from vrs_cli.kinematics.joints import Configuration
from vrs_cli.kinematics.model import RobotModel, link_pose
from vrs_cli.kinematics.reach_outline import Sections, outline
from vrs_cli.kinematics.transform import (
    Transform,
    Vector,
    compose,
    inverse,
    position,
    rotation_z,
    translation,
    unit_quaternion,
)
from vrs_cli.view3d.figure import link_node, looks_of
from vrs_cli.view3d.meshes import Mesh, Points, joined, moved
from vrs_cli.view3d.parts import Shown, put

FREE, END, HAND = (108, 158, 214), (214, 78, 62), (52, 58, 66)
LARGEST, SMALLEST = 0.2, 0.1  # radius of the first joint's arc and of the last one's, for an arm that reaches 1
WIDE = 0.16  # of an arc, in its radius
WINDS = 0.1  # how much an arc grows with each half turn, in its radius, so that one of several turns winds
ABOVE = 0.004  # [m] over the bodies of its link
FINEST = 5.0  # [deg] between corners of an arc
NEAR = 0.05  # of its range: so near to its end a joint is marked


class LimitHand(NamedTuple):
    """The hand and the label that show the value of a joint."""

    mesh: MeshHandle
    label: LabelHandle


class LimitsView:
    """Hidden at first, and made when it is first shown. It stands in the nodes of a `Figure`, and so moves with it."""

    def __init__(self, scene: SceneApi, root: str, model: RobotModel) -> None:
        self._scene, self._root, self._model = scene, root, model
        self._nodes: list[SceneNodeHandle] = []
        self._hands: list[LimitHand] = []
        self.visible = False

    def show(self, shown: Shown) -> None:
        model = self._model
        if self.visible and not self._nodes:
            for joint in range(1, model.joint_count + 1):
                self._add(joint)
        for node in self._nodes:
            put(node, visible=self.visible)
        if not self.visible:
            return
        ends = zip(model.lower, model.upper, strict=True)
        rows = zip(self._hands, shown.position.joints, ends, strict=True)
        for joint, (hand, x, (lower, upper)) in enumerate(rows, 1):
            put(hand.label, text=f"JT{joint}  {model.said(joint, x, 0)}")
            put(hand.mesh, color=END if min(x - lower, upper - x) < NEAR * (upper - lower) else HAND)

    def _add(self, joint: int) -> None:
        model, slides = self._model, self._model.units.slides(joint)
        size = size_of(model) * (LARGEST + (SMALLEST - LARGEST) * (joint - 1) / max(model.joint_count - 1, 1))
        meshes = (_rail if slides else _arc)(model, joint, size)
        fixed, moving = link_node(self._root, joint - 1), link_node(self._root, joint)
        for name, mesh, colour in (("range", meshes.free, FREE), ("ends", meshes.ends, END)):
            self._nodes.append(self._drawn(f"{fixed}/{name}{joint}", mesh, colour))
        T = compose(inverse(link_pose(model, joint, 0.0)), meshes.T_zero_hand)  # of the link at zero, then for ever
        hand = self._drawn(f"{moving}/hand{joint}", meshes.hand, HAND, T)
        label = self._scene.add_label(
            f"{moving}/hand{joint}/value", "", position=meshes.tip, font_screen_scale=0.85, anchor="center-center"
        )
        self._nodes.append(hand)
        self._hands.append(LimitHand(hand, label))

    def _drawn(self, name: str, mesh: Mesh, colour: tuple[int, int, int], T: Transform | None = None) -> MeshHandle:
        at = translation(0.0, 0.0, 0.0) if T is None else T
        return self._scene.add_mesh_simple(
            name,
            mesh.vertices,
            mesh.faces,
            color=colour,
            side="double",
            cast_shadow=False,
            receive_shadow=False,
            position=(at.px, at.py, at.pz),
            wxyz=unit_quaternion(at),
        )


class Scale(NamedTuple):
    """The surfaces of a joint's range, in the frame before it; those of the hand in its own, T_zero_hand in that frame
    while the joint is 0."""

    free: Mesh
    ends: Mesh
    hand: Mesh
    T_zero_hand: Transform
    tip: tuple[float, float, float]


def _arc(model: RobotModel, joint: int, radius: float) -> Scale:
    """About the axis, over the bodies of the link that turns."""
    theta, lower, upper = model.links[joint - 1].theta, model.lower[joint - 1], model.upper[joint - 1]
    high = _top(model, joint, radius) + ABOVE
    end = min(NEAR * (upper - lower), pi / 12)
    sectors = [(lower, lower + end), (lower + end, upper - end), (upper - end, upper)]
    least = radius / (1.0 + WINDS * (upper - lower) / pi)
    first, free, last = (_sector(a, b, lower, least, high) for a, b in sectors)
    T = rotation_z(theta)
    hand = _needle(0.35 * radius, radius)
    T_zero_hand = compose(T, translation(0.0, 0.0, high + ABOVE))
    return Scale(moved(free, T), moved(joined([first, last]), T), hand, T_zero_hand, (1.2 * radius, 0.0, 0.0))


def _top(model: RobotModel, joint: int, radius: float) -> float:
    """The height of a link's bodies on the axis of its joint, in the frame before it [m]."""
    T = link_pose(model, joint, 0.0)
    points = [moved(look.mesh, T).vertices for look in looks_of(model).looks if look.shape.link == joint]
    if not points:
        return model.links[joint - 1].d
    corners = np.concatenate(points)
    near = np.hypot(corners[:, 0], corners[:, 1]) < radius
    return float(corners[near, 2].max(initial=0.0))


def _sector(first: float, last: float, lower: float, radius: float, high: float) -> Mesh:
    """A ribbon between two angles; it winds outwards from the lower end of the range, where that has several turns."""
    count = max(2, ceil(degrees(last - first) / FINEST) + 1)
    angles = np.linspace(first, last, count)
    sizes = radius * (1.0 + WINDS * (angles - lower) / pi)[:, None]
    round_about = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    inner, outer = (1.0 - WIDE) * sizes * round_about, sizes * round_about
    points = np.concatenate([inner, outer])
    return _ribbon(np.column_stack([points, np.full(len(points), high)]), count)


def _ribbon(points: Points, count: int) -> Mesh:
    """Return the surface between two lines of as many points."""
    k = np.arange(count - 1, dtype=np.uint32)
    a, b, c, d = k, k + 1, k + count + 1, k + count
    return Mesh(points, np.concatenate([np.stack([a, c, b], axis=1), np.stack([a, d, c], axis=1)]).astype(np.uint32))


def _needle(near: float, far: float) -> Mesh:
    """A long triangle along x."""
    half = 0.06 * far
    corners = [(near, -half, 0.0), (far, 0.0, 0.0), (near, half, 0.0)]
    return Mesh(np.array(corners), np.array([(0, 1, 2)], dtype=np.uint32))


def _rail(model: RobotModel, joint: int, size: float) -> Scale:
    """Return the rail of a joint that slides, beside its axis."""
    d, lower, upper = model.links[joint - 1].d, model.lower[joint - 1], model.upper[joint - 1]
    beside, end = 0.9 * size, NEAR * (upper - lower)
    strips = [
        _ribbon(np.array([(x, 0.0, z) for x in (beside, beside + WIDE * size) for z in (a, b)]), 2)
        for a, b in ((lower, lower + end), (lower + end, upper - end), (upper - end, upper))
    ]
    first, free, last = (moved(strip, translation(0.0, 0.0, d)) for strip in strips)
    hand = _needle(0.3 * size, beside)
    return Scale(free, joined([first, last]), hand, translation(0.0, 0.0, d), (1.4 * size, 0.0, 0.0))


# --- the reach of the tool -------------------------------------------------------------------------------------------


STEPS = 60  # of a full circle about the first axis
COLOUR, OPACITY = (70, 130, 210), 0.16


class ReachView:
    """The boundary of an arm that turns about its first axis. Hidden at first. It stands in the node of a `Figure`, and
    is found anew where configuration or TOOL change.
    """

    def __init__(self, scene: SceneApi, root: str, arm: RobotArm) -> None:
        self._scene, self._name, self._arm = scene, f"{root}/reach", arm
        self._of: tuple[Configuration, Vector] | None = None
        self._node: MeshHandle | None = None
        self._search: Thread | None = None
        self.visible = False

    def show(self, shown: Shown) -> None:
        if self._node is not None:
            self._node.visible = self.visible
        if not self.visible or (self._search is not None and self._search.is_alive()):
            return
        wanted = self._arm.configuration(shown.position.joints), position(shown.frames.tool)
        if wanted != self._of:
            self._of = wanted
            self._search = Thread(target=self._draw, args=wanted, name="vrs reach", daemon=True)
            self._search.start()

    def wait(self) -> None:
        """Wait until what is searched is drawn."""
        if self._search is not None:
            self._search.join()

    def _draw(self, configuration: Configuration, tip: Vector) -> None:
        mesh = boundary(self._arm, configuration, tip)
        self._node = self._scene.add_mesh_simple(
            self._name,
            mesh.vertices,
            mesh.faces,
            color=COLOUR,
            opacity=OPACITY,
            side="double",
            cast_shadow=False,
            receive_shadow=False,
            visible=self.visible,
        )


def boundary(arm: RobotArm, configuration: Configuration, tip: Vector) -> Mesh:
    """The surface, in the robot's own frame; `tip` in that of the flange."""
    return moved(_swept(arm, outline(arm, configuration, tip)), arm.model.base)


def _swept(arm: RobotArm, sections: Sections) -> Mesh:
    """Pieces turned about the first axis through all of joint 1's range."""
    model = arm.model
    lower, span = model.lower[0], min(model.upper[0] - model.lower[0], 2 * pi)
    turns = lower + span * np.linspace(0.0, 1.0, max(2, round(STEPS * span / (2 * pi)) + 1))
    far, z, angle = (sections[..., k, None] for k in range(3))
    around = angle + turns
    points = np.stack([far * np.cos(around), far * np.sin(around), z + 0.0 * around], axis=-1)  # (S, 2, turns, 3)
    count = len(turns)
    a = (np.arange(len(sections)) * 2 * count)[:, None] + np.arange(count - 1)
    corners = np.stack([np.stack([a, a + 1, a + count + 1], axis=-1), np.stack([a, a + count + 1, a + count], axis=-1)])
    return Mesh(points.reshape(-1, 3), corners.reshape(-1, 3).astype(np.uint32))
