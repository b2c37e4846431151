"""How far the tool gets in the present configuration: the boundary of all places of its tip, with all joints inside
their ranges. It is found when it is asked for, by poses all over the ranges, on a grid, in a thread of its own.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import pi
from threading import Thread
from typing import Any

import numpy as np
from numpy.typing import NDArray
from viser import MeshHandle, SceneApi

from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.arrays import Flags
from vrs_cli.kinematics.configuration import Configuration
from vrs_cli.kinematics.transform import Vector, inverse, position
from vrs_cli.view3d.meshes import Mesh, Points, moved
from vrs_cli.view3d.shown import Shown

POSES = 40_000
BEYOND = 0.12  # of a range: so much of the poses is at its very ends
CELLS = 44  # of the grid, across the reach
LEVEL = 0.5  # share of a cell and those round it that is reached, where the boundary is
STEPS = 60  # of a full circle about the first axis
FLAT = 1e-3  # [m] of height: a reach that has none is a plane
COLOUR, OPACITY = (70, 130, 210), 0.16

Grid = NDArray[np.float64]  # (distance from the first axis, height)
Sections = NDArray[np.float64]  # (S, 2, 3): pieces of an outline by distance, height and angle about the first axis


class ReachView:
    """Hidden at first. It stands in the node of a `Figure`, and is found anew where configuration or TOOL change."""

    def __init__(self, scene: SceneApi, root: str, arm: RobotArm) -> None:
        self._scene, self._name, self._arm = scene, f"{root}/reach", arm
        self._of: tuple[Configuration, Vector] | None = None
        self._node: MeshHandle | None = None
        self._search: Thread | None = None
        self.visible = False

    @property
    def known(self) -> bool:
        """Whether there is such a boundary: of an arm that turns about its first axis."""
        return self._arm.turning[0]

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
        """Until what is searched is drawn."""
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


def outline(arm: RobotArm, configuration: Configuration, tip: Vector) -> Sections:
    """The boundary while joint 1 is 0, seen from its axis."""
    x, y, z = _tips(arm, configuration, tip).T
    far, angle = np.hypot(x, y), np.arctan2(y, x)
    if not len(far):
        return np.zeros((0, 2, 3))
    return _line(far, z, angle) if np.ptp(z) < FLAT else _contour(far, z, angle)


def _tips(arm: RobotArm, configuration: Configuration, tip: Vector) -> Points:
    """Places of the tip while joint 1 is 0, in frame 0: (N, 3)."""
    model = arm.model
    lower, upper = np.array(model.lower), np.array(model.upper)
    parts = np.random.default_rng(1).random((POSES, model.joint_count)) * (1.0 + 2.0 * BEYOND) - BEYOND
    q = lower + np.clip(parts, 0.0, 1.0) * (upper - lower)
    q[:, 0] = 0.0
    if len(arm.ways) > 1:
        q = q[[arm.configuration(tuple(row)) == configuration for row in q.tolist()]]
    T = arm.batch.forward(q)
    back = np.array(inverse(model.base)).reshape(3, 4)
    points: Points = T[:, :, :3] @ np.array(tip) + T[:, :, 3]
    seen: Points = points @ back[:, :3].T + back[:, 3]
    return seen


def _line(far: Grid, z: Grid, angle: Grid) -> Sections:
    """The boundary of an arm in a plane: from the nearest place to the farthest, each with its usual angle."""
    edges = np.linspace(far.min(), far.max(), CELLS + 1)
    cell = np.clip(np.digitize(far, edges) - 1, 0, CELLS - 1)
    sums = np.array([np.bincount(cell, weights, CELLS) for weights in (np.cos(angle), np.sin(angle))])
    turned = np.arctan2(sums[1], sums[0])
    points = np.column_stack([edges, np.full(CELLS + 1, z.mean()), np.append(turned, turned[-1])])
    return np.stack([points[:-1], points[1:]], axis=1)


def _contour(far: Grid, z: Grid, angle: Grid) -> Sections:
    """The outline of points, on a grid: where a share of LEVEL of what is around is reached (marching squares)."""
    size = max(float(far.max()), float(np.ptp(z))) / CELLS
    low = float(z.min()) - 3.0 * size
    shape = int(far.max() / size) + 4, int(np.ptp(z) / size) + 7
    at = (far / size).astype(np.intp), ((z - low) / size).astype(np.intp)
    cells = at[0] * shape[1] + at[1]
    count, c, s = (
        np.bincount(cells, weights, shape[0] * shape[1]).reshape(shape).astype(float)
        for weights in (np.ones_like(far), np.cos(angle), np.sin(angle))
    )
    pieces = _marched(_blurred(_closed(count > 0.0).astype(float)))
    nearest = np.clip(np.rint(pieces).astype(np.intp), 0, np.array(shape) - 1)
    turned = np.arctan2(_blurred(s), _blurred(c))[nearest[..., 0], nearest[..., 1]]
    middles = size * (pieces + 0.5)
    return np.stack([middles[..., 0], low + middles[..., 1], turned], axis=2)


def _closed(hit: Flags) -> Flags:
    """Fill the holes that chance has left: add the neighbours, then remove the rim."""
    for axis in (0, 1):
        first, middle, last = _shifted(hit, axis)
        hit = first | middle | last
    for axis in (0, 1):
        first, middle, last = _shifted(hit, axis)
        hit = first & middle & last
    return hit


def _blurred(grid: Grid) -> Grid:
    """Each cell with those round it."""
    for axis in (0, 1):
        first, middle, last = _shifted(grid, axis)
        grid = 0.25 * first + 0.5 * middle + 0.25 * last
    return grid


def _shifted(grid: Any, axis: int) -> Iterator[Any]:
    """The cells before, the cells, the cells after; at its ends, which are the axis or empty, it goes on as it is."""
    wide = np.pad(grid, [(1, 1) if k == axis else (0, 0) for k in (0, 1)], mode="edge")
    return (np.take(wide, range(k, k + grid.shape[axis]), axis) for k in (0, 1, 2))


def _marched(grid: Grid) -> NDArray[np.float64]:
    """The line on which a grid has LEVEL: (S, 2, 2) pieces, in cells; each half of a square has one or none."""
    found = []
    for corners in (((0, 0), (1, 0), (0, 1)), ((1, 1), (0, 1), (1, 0))):
        n, m = grid.shape[0] - 1, grid.shape[1] - 1
        values = np.stack([grid[i : i + n, j : j + m] for i, j in corners])
        inside = values > LEVEL
        for one in range(3):  # the corner that is alone on its side
            others = [k for k in range(3) if k != one]
            cut = np.argwhere((inside[one] != inside[others[0]]) & (inside[one] != inside[others[1]]))
            rows, columns = cut.T
            ends = []
            for other in others:
                a, b = values[one, rows, columns], values[other, rows, columns]
                part = ((LEVEL - a) / (b - a))[:, None]
                ends.append(cut + np.array(corners[one]) * (1.0 - part) + np.array(corners[other]) * part)
            found.append(np.stack(ends, axis=1))
    return np.concatenate(found)


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
