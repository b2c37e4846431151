"""Code that all parts of a scene and of panels share: the moment that they show, changes of nodes and inputs, of which
what stays is not sent, and the building blocks of panels.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from math import inf
from typing import Any, NamedTuple, Protocol

import numpy as np
import viser
from numpy.typing import NDArray
from viser import FrameHandle, LineSegmentsHandle, SceneNodeHandle
from viser import _messages as its

from vrs_cli.interfaces.port.preview import Previewed
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.transform import Transform, Vector, position, unit_quaternion
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.acts import Surveyed
from vrs_cli.values.motion import Frames
from vrs_cli.values.results import Position

GRAIN = 2.0**-26  # of metres (15 nm) and of quaternions: numbers of few bits make recordings nearly half as large

Colour = tuple[int, int, int]  # red, green, blue


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
    what viser remembers of the node is set here, and told by its messages. tests/view3d/test_parts.py holds that they
    are those of the setters.
    """
    state = node._impl
    x, y, z = at = _grained(position(T))
    if node.position.tolist() != at:
        node.position[:] = at
        state.api._queue_scene_message(SetPositionMessage(state.name, (x, y, z)))
    a, b, c, d = turned = _grained(unit_quaternion(T))
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


# --- moments ---------------------------------------------------------------------------------------------------------


LEAST = 0.25  # [s] between two pictures
COSTS = 20.0  # times as long as a picture took to be made, no other one is


class Shown(NamedTuple):
    """One moment of a robot: what every part of a scene draws itself by. Metres, radians, seconds.

    `t`: the time that is shown, `position`: g there; `now`: the robot's clock. `surveyed`: what there is beside the
    timeline, None where nobody can be asked. `seen`: of a robot afar, how much of this it has said. `reads`: what is
    read is to be looked at too, which is not in every picture.
    """

    arm: RobotArm
    timeline: Timeline
    t: float
    position: Position
    now: float
    surveyed: Surveyed | None = None
    seen: Previewed | None = None
    reads: bool = True

    @property
    def frames(self) -> Frames:
        """BASE and TOOL in force then."""
        return self.timeline.locate(self.t)[0].motion.frames


class ShownPart(Protocol):
    """A part of a scene or a panel. It remembers what it drew last, and sends nothing where that is still so."""

    def show(self, shown: Shown) -> None: ...


class Redrawing:
    """Decides when a picture is made again that may change all the time. `wall` tells the time of the day [s]."""

    def __init__(self, wall: Callable[[], float]) -> None:
        self._wall = wall
        self._of: object = None
        self._urgent: object = None
        self._due = -inf

    def look(self, of: object, urgent: object, draw: Callable[[], None]) -> None:
        """Draw it if what it shows is another one: later where that is `of`, at once where it is `urgent`."""
        began = self._wall()
        if urgent == self._urgent and (of == self._of or began < self._due):
            return
        self._of, self._urgent = of, urgent
        draw()
        ended = self._wall()
        self._due = ended + max(LEAST, COSTS * (ended - began))


# --- building blocks of panels ---------------------------------------------------------------------------------------


Act = Callable[[], object]
ON, OFF = "\N{BLACK CIRCLE}", "\N{WHITE CIRCLE}"  # lamps
STYLE = (
    "<style>.vrs pre{margin:0;white-space:pre-wrap;font:inherit}.vrs table{font:inherit;border-spacing:0}"
    ".vrs td,.vrs th{padding:0 0 0 0.7em}</style>"
)


class Hands:
    """Does what is typed and clicked in one browser, in order, in a thread of its own. `refused` is told what goes
    wrong.
    """

    def __init__(self, refused: Callable[[Exception], None]) -> None:
        self._refused = refused
        self._thread = ThreadPoolExecutor(1, "vrs panel")
        self._loop: asyncio.AbstractEventLoop | None = None  # in which the page is heard, once it has said something

    def do(self, act: Act) -> None:
        def guarded() -> None:
            try:
                act()
            except Exception as error:
                self._refused(error)

        with suppress(RuntimeError):  # the browser has gone
            self._thread.submit(guarded)

    def on(self, handle: Any, act: Callable[[Any], object]) -> None:
        """Have what a user does with an input done: `act` is given its value."""

        async def changed(event: viser.GuiEvent[Any]) -> None:
            value, self._loop = event.target.value, asyncio.get_running_loop()
            self.do(lambda: act(value))

        hears = next(name for name in ("on_click", "on_upload", "on_update") if hasattr(handle, name))
        getattr(handle, hears)(changed)

    def fill(self, field: Any, text: str) -> None:
        """Have a text in a field in which a user may be typing: never between what he types and its being heard."""
        if self._loop is None:
            put(field, value=text)
            return
        with suppress(RuntimeError):  # the page has gone
            self._loop.call_soon_threadsafe(lambda: put(field, value=text))

    def close(self) -> None:
        self._thread.shutdown(wait=False, cancel_futures=True)


def add_choice(gui: viser.GuiApi, hands: Hands, label: str, names: Sequence[str], act: Callable[[str], object]) -> None:
    """Add buttons of which the one that was pressed last is lit, the first at first; `act` is given its name."""

    def lamps(lit: str) -> tuple[str, ...]:
        return tuple(f"{ON if name == lit else OFF} {name}" for name in names)

    def choose(pressed: str) -> None:
        name = pressed.removeprefix(ON).removeprefix(OFF).strip()
        put(handle, options=lamps(name))
        act(name)

    handle = gui.add_button_group(label, lamps(names[0]))
    hands.on(handle, choose)


def boxed(content: str) -> str:
    """HTML in the letters of a terminal."""
    return f'{STYLE}<div class="vrs" style="font:12px/1.35 monospace;padding:0 0.8em 0.6em">{content}</div>'
