"""Changes of nodes and inputs, of which what stays is not sent: where nodes stand, and whether they are seen."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray
from viser import FrameHandle, LineSegmentsHandle, SceneNodeHandle
from viser import _messages as its

from vrs_cli.kinematics.transform import Transform, Vector, position

GRAIN = 2.0**-26  # of metres (15 nm) and of quaternions: numbers of few bits make recordings nearly half as large

Quaternion = tuple[float, float, float, float]  # w, x, y, z


class Rooted:
    """Parts of a scene that hang in one node, and are seen and hidden with it."""

    _root: FrameHandle

    @property
    def visible(self) -> bool:
        return self._root.visible

    @visible.setter
    def visible(self, visible: bool) -> None:
        self._root.visible = visible


class SetPositionMessage(its.SetPositionMessage):
    """The message of viser, made faster: viser looks up the types of its fields each time that it is sent: most of what
    a picture costs.
    """

    def as_serializable_dict(self, _buffers: list[memoryview] | None = None) -> dict[str, Any]:
        return {"name": self.name, "position": self.position, "owner": self.owner, "type": "SetPositionMessage"}


class SetOrientationMessage(its.SetOrientationMessage):
    """Made faster, as SetPositionMessage."""

    def as_serializable_dict(self, _buffers: list[memoryview] | None = None) -> dict[str, Any]:
        return {"name": self.name, "wxyz": self.wxyz, "owner": self.owner, "type": "SetOrientationMessage"}


class SceneNodeUpdateMessage(its.SceneNodeUpdateMessage):
    """Made faster, for `points` alone."""

    def as_serializable_dict(self, buffers: list[memoryview] | None = None) -> dict[str, Any]:
        points, beside = self.updates["points"], buffers if buffers is not None else []
        beside.append(points.data)
        told = points.data if buffers is None else {"__binary_index": len(beside) - 1, "dtype": points.dtype.str}
        return {"name": self.name, "updates": {"points": told}, "owner": self.owner, "type": "SceneNodeUpdateMessage"}


def place(node: SceneNodeHandle, T: Transform) -> None:
    """Put a node at T, in the frame of its parent. Nothing is sent of what stays.

    viser's setters do not send what is as near as `numpy.allclose` says, which is 0.01 mm at a metre, so that a slow
    motion would go in steps; and this look costs more than all the rest of a pose, for each node of each picture. So
    what viser remembers of the node is set here, and told by its messages. tests/view3d/test_placing.py holds that they
    are those of the setters.
    """
    state = node._impl
    x, y, z = at = _grained(position(T))
    if node.position.tolist() != at:
        node.position[:] = at
        state.api._queue_scene_message(SetPositionMessage(state.name, (x, y, z)))
    a, b, c, d = turned = _grained(wxyz(T))
    if node.wxyz.tolist() != turned:
        node.wxyz[:] = turned
        state.api._queue_scene_message(SetOrientationMessage(state.name, (a, b, c, d)))


def put(handle: Any, **properties: Any) -> None:
    """Give a node or an input properties that are other ones: what stays is not sent again.

    viser's setter of `value` also calls what hears the user: its loop would be woken once more for each slider that
    follows the arm. tests/view3d/test_panel.py holds that the page is told the same.
    """
    for name, value in properties.items():
        if getattr(handle, name) == value:
            continue
        if name == "value":
            state = handle._impl
            state.value = value
            state.gui_api._websock_interface.queue_message(its.GuiUpdateMessage(state.uuid, {"value": value}))
        else:
            setattr(handle, name, value)


def move_points(node: LineSegmentsHandle, points: NDArray[np.float32]) -> None:
    """Have lines elsewhere, which is sent in any case: as `place`, for those that move in each picture."""
    state, points = node._impl, points.copy()
    state.props.points = points
    state.api._queue_scene_message(SceneNodeUpdateMessage(state.name, {"points": points}))


def gathered(named: Iterable[tuple[Vector, str]], near: float) -> dict[Vector, list[str]]:
    """The names at each place; places nearer to each other than that [m] are one."""
    found: dict[Vector, list[str]] = {}
    for place, name in named:
        here = next((one for one in found if max(abs(x - y) for x, y in zip(one, place, strict=True)) < near), place)
        found.setdefault(here, []).append(name)
    return found


def transform_of(node: SceneNodeHandle) -> Transform:
    """The pose of a node in the frame of its parent."""
    w, x, y, z = map(float, node.wxyz)
    px, py, pz = map(float, node.position)
    s = 2.0 / (w * w + x * x + y * y + z * z)
    return Transform(
        1.0 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y), px,
        s * (x * y + w * z), 1.0 - s * (x * x + z * z), s * (y * z - w * x), py,
        s * (x * z - w * y), s * (y * z + w * x), 1.0 - s * (x * x + y * y), pz,
    )  # fmt: skip


def _grained(values: Sequence[float]) -> list[float]:
    return [GRAIN * round(value / GRAIN) for value in values]


def wxyz(T: Transform) -> Quaternion:
    """The rotation of T as a unit quaternion, by its largest part (S. W. Shepperd, J. Guidance and Control 1, 1978)."""
    xx, yy, zz = T.nx, T.sy, T.az
    squares = (1.0 + xx + yy + zz, 1.0 + xx - yy - zz, 1.0 - xx + yy - zz, 1.0 - xx - yy + zz)  # four times each
    largest = max(range(4), key=squares.__getitem__)
    a, b, c = T.sz - T.ay, T.ax - T.nz, T.ny - T.sx  # 4 w times x, y, z
    d, e, f = T.ay + T.sz, T.ax + T.nz, T.ny + T.sx  # 4 times y z, x z, x y
    rows = ((squares[0], a, b, c), (a, squares[1], f, e), (b, f, squares[2], d), (c, e, d, squares[3]))
    scale = 0.5 / sqrt(squares[largest])
    w, x, y, z = (scale * value for value in rows[largest])
    return w, x, y, z
