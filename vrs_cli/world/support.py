"""What bodies stand on: the places of all that stands, found by a grid, and what is below a body."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from math import floor, inf
from typing import NamedTuple

from vrs_cli.kinematics.bodies import shapes_of
from vrs_cli.kinematics.link_data import Box, MeshFile
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.transform import Transform, moved_point
from vrs_cli.values.scene import CellScene
from vrs_cli.world.history import WorldHistory
from vrs_cli.world.solids import Bounds, Solids, bounds, drop, overlap, point_drop

CELL = 0.1  # [m] between the lines of the grid
MOST_CELLS = 100  # of a body; a larger one is looked at always
PRESSED = 0.005  # [m] so far a body may be pressed into what it stands on
LEVEL = 1e-4  # [m] bodies below whose heights differ less carry together
FALLS = 1e-3  # [m] a fall of less is not worth a word
FLOOR = "floor"


class Below(NamedTuple):
    """What a body would stand on: how far it is lowered until then [m], and the names of what carries it."""

    drop: float
    on: tuple[str, ...]


def floor_height(scene: CellScene, model: RobotModel) -> float:
    """The height of the floor in the world [m]: as the cell says, or what the robot stands on."""
    if scene.floor is not None:
        return scene.floor
    heights = [0.0]
    for shape in shapes_of(model):
        body = shape.body
        if shape.link or isinstance(body, MeshFile):
            continue
        if isinstance(body, Box):
            ends = [moved_point(body.pose, (0.0, 0.0, sign * 0.5 * body.size[2])) for sign in (-1.0, 1.0)]
        else:
            ends = [body.start, body.end]
        heights += [moved_point(model.base, end)[2] for end in ends]
    return min(heights)


def cells(area: Bounds) -> Iterator[tuple[int, int]] | None:
    """The cells of the grid that a body covers, seen from above; None if they are too many."""
    first_x, last_x, first_y, last_y = (floor(edge / CELL) for edge in area[:4])
    if (last_x - first_x + 1) * (last_y - first_y + 1) > MOST_CELLS:
        return None
    return ((x, y) for x in range(first_x, last_x + 1) for y in range(first_y, last_y + 1))


def below(
    solids: Solids,
    T_world_body: Transform,
    others: Iterable[tuple[str, Solids, Transform, Bounds]],
    floor_at: float,
) -> Below:
    """Return what is below a body: the floor, or the highest of the others."""
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


def balanced(solids: Solids, T_world_body: Transform, carriers: Iterable[tuple[Solids, Transform, Bounds]]) -> bool:
    """Return whether the middle of a body stands above what carries it, or between several bodies that do."""
    middles = [moved_point(T_world_body, one.middle) for one in solids]
    x, y = (sum(middle[axis] for middle in middles) / len(middles) for axis in (0, 1))
    area, rooms = bounds(solids, T_world_body), []
    for shape, T, room in carriers:
        if point_drop((x, y, area[4]), shape, T) < inf:
            return True
        rooms.append(room)
    if len(rooms) < 2:
        return False
    for middle, axis in ((x, 0), (y, 2)):
        first = min(max(area[axis], room[axis]) for room in rooms)
        last = max(min(area[axis + 1], room[axis + 1]) for room in rooms)
        if not first <= middle <= last:
            return False
    return True


# --- the grid of all that stands ---


def put(history: WorldHistory, name: str, solids: Solids, T_world_body: Transform) -> None:
    """Let a body stand at a place from now on."""
    lift(history, name)
    area = bounds(solids, T_world_body)
    covered = cells(area)
    keys = [("cell", *cell) for cell in covered] if covered is not None else [("cell",)]
    for key in keys:
        history.set(key, history.get(key, frozenset()) | {name})
    history.set(("place", name), (solids, T_world_body, area, tuple(keys)))


def lift(history: WorldHistory, name: str) -> None:
    """Take a body out of the grid."""
    place = history.get(("place", name))
    if place is None:
        return
    for key in place[3]:
        history.set(key, history.get(key) - {name})
    history.set(("place", name), None)


def placed(history: WorldHistory, name: str) -> tuple[Solids, Transform, Bounds]:
    """Return a body that stands: T_world_body and its bounds, too."""
    solids, T, area, _ = history.get(("place", name))
    return solids, T, area


def near(history: WorldHistory, area: Bounds) -> list[str]:
    """The bodies that stand and whose bounds overlap an area, by name."""
    found = set(history.get(("cell",), ()))
    covered = cells(area)
    if covered is None:
        found.update(name for name, place in history.items("place").items() if place)
    for cell in covered or ():
        found |= history.get(("cell", *cell), frozenset())
    return sorted(name for name in found if overlap(area, history.get(("place", name))[2]))


def below_in(history: WorldHistory, name: str, solids: Solids, T_world_body: Transform, floor_at: float) -> Below:
    """Return what would be below a body at a place, of all that stands."""
    x, X, y, Y, _, top = bounds(solids, T_world_body)
    others = ((other, *placed(history, other)) for other in near(history, (x, X, y, Y, -inf, top)) if other != name)
    return below(solids, T_world_body, others, floor_at)
