"""The named locations of a robot in a scene: small frames with their names."""

from __future__ import annotations

import numpy as np
from viser import SceneApi

from vrs_cli.engine.position import world_pose
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.model import RobotModel, levers
from vrs_cli.kinematics.transform import Transform, position
from vrs_cli.values.motion import Frames
from vrs_cli.values.replies import NamedLocation
from vrs_cli.view3d.placing import Rooted, gathered, wxyz
from vrs_cli.view3d.shown import Shown

LONG = 0.055  # of the reach: the axes
NEAR = 0.01  # of the reach: names of places so near to each other stand in one label


class PlacesView(Rooted):
    """Nodes /places ...; a precision point is where its joints bring the tool."""

    def __init__(self, scene: SceneApi, model: RobotModel) -> None:
        self._scene = scene
        _, (self._reach, *_) = levers(model)
        self._root = scene.add_frame("/places", show_axes=False)
        self._drawn: tuple[tuple[str, Transform], ...] = ()

    def show(self, shown: Shown) -> None:
        found = shown.surveyed
        if found is None or found.places is None:
            return
        frames = Frames(found.base, found.tool)
        places = tuple((row.name, T) for row in found.places.rows if (T := _pose(shown.arm, row, frames)) is not None)
        if places != self._drawn:
            self._drawn = places
            self._draw()

    def _draw(self) -> None:
        visible = self.visible
        self._root.remove()
        self._root = self._scene.add_frame("/places", show_axes=False, visible=visible)
        if not self._drawn:
            return
        poses = [T for _, T in self._drawn]
        self._scene.add_batched_axes(
            "/places/frames",
            np.array([wxyz(T) for T in poses]),
            np.array([position(T) for T in poses]),
            axes_length=LONG * self._reach,
            axes_radius=0.03 * LONG * self._reach,
        )
        named = gathered(((position(T), name) for name, T in self._drawn), NEAR * self._reach)
        for k, (place, names) in enumerate(named.items()):
            self._scene.add_label(f"/places/{k}", "\n".join(names), position=place, anchor="top-left")


def _pose(arm: RobotArm, row: NamedLocation, frames: Frames) -> Transform | None:
    """The pose in the world; None for joints of another robot, and for what is not defined."""
    if row.pose is not None:
        return row.pose
    if row.joints is None or len(row.joints) != arm.model.joint_count:
        return None
    joints: Joints = row.joints
    return world_pose(arm, frames, joints)
