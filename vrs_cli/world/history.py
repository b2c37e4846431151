"""The history of a world: values that are computed forward in time and can be reverted to any earlier time. Also a grid
that finds bodies at rest near a place, and functions that find the surface below a body."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Callable, Hashable, Iterable, Iterator, Sequence
from math import floor, inf
from operator import itemgetter
from typing import Any, NamedTuple

from vrs_cli.kinematics.bodies import shapes_of
from vrs_cli.kinematics.link_data import Box, MeshFile
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.transform import Transform, moved_point
from vrs_cli.values.scene import CellScene
from vrs_cli.values.world import Happening
from vrs_cli.world.solids import Bounds, Solids, bounds, drop, overlap, point_drop

# keys under which a history stores its rows
CHANGES, GRIPS, MOVES, NOTES, SEES = "changes", "grips", "moves", "notes", "sees"


class Due(NamedTuple):
    """A planned event and its time. Events at the same instant are ordered by rank, then by the order in which they
    were planned."""

    time: float
    rank: int
    order: int
    what: Happening


class WorldHistory:
    """The state of a world and its past: values by key, rows by key, and planned events. A row is a tuple that begins
    with its time; rows are only appended. `back_to` reverts everything to an earlier time."""

    def __init__(self) -> None:
        self.now = -inf
        self._values: dict[Hashable, Any] = {}
        self._trail: list[tuple[float, Hashable, Any]] = []
        self._rows: dict[Hashable, list[Any]] = {}

    def copy(self) -> WorldHistory:
        again = WorldHistory()
        again.now = self.now
        again._values, again._trail = dict(self._values), list(self._trail)
        again._rows = {key: list(rows) for key, rows in self._rows.items()}
        return again

    def get(self, key: Hashable, default: Any = None) -> Any:
        return self._values.get(key, default)

    def items(self, kind: str) -> dict[Any, Any]:
        """Return the values whose keys are pairs (`kind`, x), as a dict from x to the value."""
        return {key[1]: value for key, value in self._values.items() if isinstance(key, tuple) and key[0] == kind}

    def set(self, key: Hashable, value: Any) -> None:
        self._trail.append((self.now, key, self._values.get(key, _MISSING)))
        self._values[key] = value

    def rows(self, key: Hashable) -> Sequence[Any]:
        return self._rows.get(key, ())

    def count(self, key: Hashable, t: float) -> int:
        """Return the number of rows that begin at t [s] or earlier."""
        return bisect_right(self.rows(key), t, key=itemgetter(0))

    def last(self, key: Hashable, t: float) -> Any:
        """Return the last row that begins at t [s] or earlier; None if there is none."""
        count = self.count(key, t)
        return self.rows(key)[count - 1] if count else None

    def between(self, key: Hashable, begin: float, end: float) -> Sequence[Any]:
        """Return the rows that begin after `begin` and not later than `end` [s]."""
        return self.rows(key)[self.count(key, begin) : self.count(key, end)]

    def add(self, key: Hashable, row: tuple[Any, ...]) -> None:
        """Append a row; its first element is the current time."""
        self._rows.setdefault(key, []).append(row)

    def back_to(self, t: float) -> None:
        """Revert all changes that were made at t [s] and later."""
        while self._trail and self._trail[-1][0] >= t:
            _, key, before = self._trail.pop()
            if before is _MISSING:
                del self._values[key]
            else:
                self._values[key] = before
        for rows in self._rows.values():
            del rows[bisect_left(rows, (t,)) :]
        self.now = min(self.now, t)

    # --- planned events ---

    @property
    def due(self) -> tuple[Due, ...]:
        """Return all planned events, the earliest first."""
        return tuple(self._values.get("due", ()))

    def plan(self, t: float, what: Happening) -> None:
        order = self._values.get("order", 0)
        self.set("order", order + 1)
        one, due = Due(t, what.rank, order, what), self.due
        place = bisect_left(due, one)
        self.set("due", (*due[:place], one, *due[place:]))

    def take(self) -> Due:
        """Remove and return the earliest planned event."""
        first, *later = self.due
        self.set("due", tuple(later))
        return first

    def drop(self, is_dropped: Callable[[Happening], bool]) -> None:
        """Remove the planned events for which `is_dropped` returns True."""
        left = tuple(one for one in self.due if not is_dropped(one.what))
        if len(left) < len(self.due):
            self.set("due", left)


_MISSING = object()


CELL = 0.1  # [m] width of a cell of the grid
MAX_CELLS = 100  # maximum number of grid cells of a body; a larger body is compared with every other body
PRESSED = 0.005  # [m] maximum depth to which a body may be pressed into its support
LEVEL = 1e-4  # [m] tolerance for equal heights: bodies of equal height support a body together
FALLS = 1e-3  # [m] minimum height of a fall that is reported
FLOOR = "floor"


class Below(NamedTuple):
    """The surface on which a body would come to rest: the distance to it [m], and the names of the bodies that would
    support it."""

    drop: float
    on: tuple[str, ...]


def floor_height(scene: CellScene, model: RobotModel) -> float:
    """Return the height of the floor in the world [m]: the floor of the cell, or the surface on which the robot
    stands."""
    if scene.floor is not None:
        return scene.floor
    heights = [0.0]
    for shape in shapes_of(model):
        body = shape.body
        if shape.link or isinstance(body, MeshFile):
            continue
        ends = (
            [moved_point(body.pose, (0.0, 0.0, sign * 0.5 * body.size[2])) for sign in (-1.0, 1.0)]
            if isinstance(body, Box)
            else [body.start, body.end]
        )
        heights += [moved_point(model.base, end)[2] for end in ends]
    return min(heights)


def cells(area: Bounds) -> Iterator[tuple[int, int]] | None:
    """Return the grid cells that a body covers, seen from above; None if there are more than MAX_CELLS."""
    first_x, last_x, first_y, last_y = (floor(edge / CELL) for edge in area[:4])
    if (last_x - first_x + 1) * (last_y - first_y + 1) > MAX_CELLS:
        return None
    return ((x, y) for x in range(first_x, last_x + 1) for y in range(first_y, last_y + 1))


def below(
    solids: Solids,
    T_world_body: Transform,
    others: Iterable[tuple[str, Solids, Transform, Bounds]],
    floor_at: float,
) -> Below:
    """Return the surface below a body: the floor, or the highest of the other bodies below it."""
    area = bounds(solids, T_world_body)
    found = [(max(0.0, area[4] - floor_at), FLOOR)]
    for name, shape, T, room in others:
        apart = area[0] > room[1] or room[0] > area[1] or area[2] > room[3] or room[2] > area[3]
        if apart or area[4] - room[5] < -PRESSED - (room[5] - room[4]):
            continue
        lowered = drop(solids, T_world_body, shape, T)
        if -PRESSED <= lowered < inf:
            found.append((max(0.0, lowered), name))
    least = min(found)[0]
    return Below(least, tuple(name for lowered, name in sorted(found) if lowered <= least + LEVEL))


def is_balanced(solids: Solids, T_world_body: Transform, carriers: Iterable[tuple[Solids, Transform, Bounds]]) -> bool:
    """Return whether the centre of a body is above one of the bodies that support it, or between several of them."""
    middles = [moved_point(T_world_body, one.middle) for one in solids]
    x, y = (sum(middle[axis] for middle in middles) / len(middles) for axis in (0, 1))
    area, rooms = bounds(solids, T_world_body), []
    for shape, T, room in carriers:
        if point_drop((x, y, area[4]), shape, T) < inf:
            return True
        rooms.append(room)
    return len(rooms) > 1 and all(
        min(max(area[axis], room[axis]) for room in rooms)
        <= middle
        <= max(min(area[axis + 1], room[axis + 1]) for room in rooms)
        for middle, axis in ((x, 0), (y, 2))
    )


# --- the grid of all bodies at rest ---


def put(history: WorldHistory, name: str, solids: Solids, T_world_body: Transform) -> None:
    """Record that a body now rests at a pose."""
    lift(history, name)
    area = bounds(solids, T_world_body)
    covered = cells(area)
    keys = [("cell", *cell) for cell in covered] if covered is not None else [("cell",)]
    for key in keys:
        history.set(key, history.get(key, frozenset()) | {name})
    history.set(("place", name), (solids, T_world_body, area, tuple(keys)))


def lift(history: WorldHistory, name: str) -> None:
    """Remove a body from the grid."""
    if (place := history.get(("place", name))) is None:
        return
    for key in place[3]:
        history.set(key, history.get(key) - {name})
    history.set(("place", name), None)


def standing_body(history: WorldHistory, name: str) -> tuple[Solids, Transform, Bounds]:
    """Return the solids, T_world_body and bounds of a body at rest."""
    solids, T, area, _ = history.get(("place", name))
    return solids, T, area


def near(history: WorldHistory, area: Bounds) -> list[str]:
    """Return the names of the bodies at rest whose bounds overlap an area."""
    found = set(history.get(("cell",), ()))
    if (covered := cells(area)) is None:
        found.update(name for name, place in history.items("place").items() if place)
    for cell in covered or ():
        found |= history.get(("cell", *cell), frozenset())
    return sorted(name for name in found if overlap(area, history.get(("place", name))[2]))


def below_in(history: WorldHistory, name: str, solids: Solids, T_world_body: Transform, floor_at: float) -> Below:
    """Return the surface below a body at a pose, among all bodies at rest."""
    x, X, y, Y, _, top = bounds(solids, T_world_body)
    others = (
        (other, *standing_body(history, other)) for other in near(history, (x, X, y, Y, -inf, top)) if other != name
    )
    return below(solids, T_world_body, others, floor_at)
