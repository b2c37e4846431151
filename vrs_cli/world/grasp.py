"""Which part is between the fingers of the hand, and how far they are open."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from math import sqrt

from vrs_cli.kinematics.transform import Transform, Vector, dot, moved_point, position, subtracted
from vrs_cli.values.scene import ScenePart
from vrs_cli.values.world import FingersArrive
from vrs_cli.world.history import GRIPS, WorldHistory
from vrs_cli.world.settings import WorldSettings
from vrs_cli.world.solids import Solids, point_apart, spread

SLACK = 1e-6  # [m] of comparisons of widths


def part_between(
    settings: WorldSettings,
    parts: Iterable[tuple[str, Transform]],
    tool: Transform,
    gap: tuple[float, float],
    tell: Callable[[str, str], None] | None = None,
) -> tuple[str, float] | None:
    """Return the part between fingers whose gap goes from one width to another, and its own width [m]; of several,
    the nearest to the tip. `tell` hears why there is none.
    """
    tip, axis = position(tool), (tool.nx, tool.ny, tool.nz)
    tolerance, found, wide = settings.scene.gripper.tolerance, list[tuple[float, str, float]](), ""
    for name, T in parts:
        solids, part = settings.solids[name], settings.parts[name]
        reach = max(one.reach for one in solids) + max(abs(x) for one in solids for x in one.middle)
        if max(map(abs, subtracted(position(T), tip))) > reach + tolerance:
            continue
        away, low, high = _hold_of(part, solids, T, tip, axis)
        if away > tolerance:
            continue
        if high - low > gap[0] + SLACK or max(-low, high) > 0.5 * gap[0] + tolerance:
            wide = f"{name} is {1000.0 * (high - low):.1f} mm wide, the fingers {1000.0 * gap[0]:.1f} mm apart"
        elif high - low >= gap[1] - SLACK:
            found.append((away, name, high - low))
    if found:
        return min(found)[1:]
    if tell is not None:
        x, y, z = (round(1000.0 * edge, 1) + 0.0 for edge in tip)
        why = f": {wide}" if wide else f" at {x:.1f}, {y:.1f}, {z:.1f} mm"
        tell("EMPTY", f"the hand closes on nothing{why}")
    return None


def add_grip(history: WorldHistory, settings: WorldSettings) -> None:
    """Write down which part the hand holds from now on, and how far it is open: its fingers stop at the part, and count
    as where they were while they are on their way.
    """
    name, opening = history.get("held"), history.get("hand")
    if name is not None:
        opening = max(opening, history.get("width") / settings.opening)
    for due in history.due:
        if isinstance(due.what, FingersArrive):
            opening = max(opening, due.what.before / settings.opening)
    history.add(GRIPS, (history.now, name, opening))


def _hold_of(part: ScenePart, solids: Solids, T: Transform, tip: Vector, axis: Vector) -> tuple[float, float, float]:
    """Return how far the tool's tip is from where a part can be taken, and from where to where it reaches there along
    the closing axis, seen from the tip [m].
    """
    if not part.grasp:
        low, high = spread(solids, T, axis)
        at = dot(tip, axis)
        return point_apart(solids, T, tip), low - at, high - at
    found = []
    for place in part.grasp:
        away = subtracted(moved_point(T, place.point), tip)
        found.append((sqrt(dot(away, away)), dot(away, axis), place.width))
    away_from, offset, wide = min(found)
    return away_from, offset - 0.5 * wide, offset + 0.5 * wide
