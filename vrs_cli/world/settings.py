"""The constant data of a world (solids by name, regions of sensors, rules by signal); the choice of the part that the
hand takes; and world states, read from a history or written into a new one."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable
from math import sqrt

from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.transform import Transform, Vector, dot, moved_point, position, translation, vector_difference
from vrs_cli.language.run.signals import Cell, Follow
from vrs_cli.language.words.values import INPUTS, INTERNAL
from vrs_cli.values import scene as scenes
from vrs_cli.values import world
from vrs_cli.world.history import CHANGES, FALLS, GRIPS, SEES, WorldHistory, below_in, floor_height, lift, put
from vrs_cli.world.sensing import Region, SeenBody, Sensing
from vrs_cli.world.solids import Solids, point_apart, solids_of, spread

FINGERS = ""  # the name of the body that represents the fingers
OPENING = 0.1  # [m] default width of the open hand


class WorldSettings:
    """The constant data of an arm in a cell. `opening`: the width of the open hand [m]. `fed`: the parts that feeders
    bring. `rules`: the rules that the world applies, with their numbers, by the signal that triggers them. `computed`:
    the inputs that the world sets; `sensed`: the inputs that sensors set. `at_start`: a history that contains the
    bodies present at the start."""

    def __init__(self, arm: RobotArm, cell: Cell) -> None:
        scene = cell.scene
        self.arm, self.scene = arm, scene
        self.opening = scene.gripper.opening or arm.model.hand_width or OPENING
        self.floor = floor_height(scene, arm.model)
        self.parts: dict[str, scenes.ScenePart] = {part.name: part for part in scene.parts}
        self.solids: dict[str, Solids] = {part.name: solids_of(part.shape) for part in scene.parts}
        self.fed = frozenset(name for feeder in scene.feeders for name in feeder.parts)
        self.solids |= {one.name: solids_of(one.shape) for one in scene.fixtures}
        self.at_start = WorldHistory()
        for one in scene.fixtures:
            put(self.at_start, one.name, self.solids[one.name], one.T_world_fixture)
        for name in self.parts.keys() - self.fed:
            put(self.at_start, name, self.solids[name], self.parts[name].T_world_part)
        self._stood_on: dict[str, str] = {}
        self.hand = SeenBody(FINGERS, translation(0.0, 0.0, -0.5 * scene.gripper.size[2]), at_tool=True)
        bodies = {**self.solids, FINGERS: solids_of(scenes.BoxShape(scene.gripper.size))}
        self.sensing = Sensing(arm, bodies, tuple(Region.of(sensor.region) for sensor in scene.sensors))
        self.sinks = [(sink.zone.T_world_zone, Region.of(sink.zone)) for sink in scene.sinks]
        self.rules = defaultdict[int, list[tuple[int, Follow]]](list)
        for place, rule in enumerate(cell.follows):
            if rule.sets is not None and abs(rule.sets) in INPUTS and abs(rule.when) not in INTERNAL:
                self.rules[rule.when].append((place, rule))
        self.sensed = frozenset(abs(sensor.signal) for sensor in scene.sensors) | {abs(scene.gripper.signal)} - {0}
        followed = {abs(rule.sets or 0) for rules in self.rules.values() for _, rule in rules}
        self.computed = frozenset(self.sensed | followed)

    def fits(self, state: world.WorldState) -> bool:
        """Return whether all parts, sensors, feeders and sinks that a state names exist in this cell."""
        falling = {one.what.part for one in state.due if isinstance(one.what, world.PartLands)}
        bodies = falling | {state.held or FINGERS, *state.stack, *state.inside}
        regions = [region for several in state.inside.values() for region in several]
        regions += [one.what.region for one in state.due if isinstance(one.what, world.BodyCrosses)]
        feeders = [*state.fed, *(one.what.feeder for one in state.due if isinstance(one.what, world.PartComes))]
        sinks = [one.what.sink for one in state.due if isinstance(one.what, world.PartsGo)]
        return (
            state.parts.keys() == self.parts.keys()
            and bodies <= {*self.parts, FINGERS}
            and all(0 <= region < len(self.sensing.regions) for region in regions)
            and all(0 <= feeder < len(self.scene.feeders) for feeder in feeders)
            and all(0 <= sink < len(self.sinks) for sink in sinks)
        )

    def stood_on(self, name: str) -> str:
        """Return the body on which a part rests at the start; "" if nothing is directly below it."""
        if (known := self._stood_on.get(name)) is None:
            found = below_in(self.at_start, name, self.solids[name], self.parts[name].T_world_part, self.floor)
            known = self._stood_on[name] = found.on[0] if found.drop <= FALLS else ""
        return known


SLACK = 1e-6  # [m] widths that differ by no more count as equal


def part_between(
    settings: WorldSettings,
    parts: Iterable[tuple[str, Transform]],
    tool: Transform,
    gap: tuple[float, float],
    tell: Callable[[str, str], None] | None = None,
) -> tuple[str, float] | None:
    """Return the part between fingers whose gap closes from gap[0] to gap[1], and the part's width [m]. If there are
    several parts, return the part nearest to the tip. If there is none, pass the reason to `tell`."""
    tip, axis = position(tool), (tool.nx, tool.ny, tool.nz)
    tolerance, found, wide = settings.scene.gripper.tolerance, list[tuple[float, str, float]](), ""
    for name, T in parts:
        solids, part = settings.solids[name], settings.parts[name]
        reach = max(one.reach for one in solids) + max(abs(x) for one in solids for x in one.middle)
        if max(map(abs, vector_difference(position(T), tip))) > reach + tolerance:
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
    """Record the held part and the current opening of the hand. Fingers stop at the part that they hold. While the
    fingers move, record the opening from which they started."""
    name, opening = history.get("held"), history.get("hand")
    if name is not None:
        opening = max(opening, history.get("width") / settings.opening)
    for due in history.due:
        if isinstance(due.what, world.FingersArrive):
            opening = max(opening, due.what.before / settings.opening)
    history.add(GRIPS, (history.now, name, opening))


def _hold_of(
    part: scenes.ScenePart, solids: Solids, T: Transform, tip: Vector, axis: Vector
) -> tuple[float, float, float]:
    """Return the distance between the tool tip and the nearest point at which the part can be gripped, and the two ends
    of the part at this point along the closing axis, relative to the tip [m]."""
    if not part.grasp:
        low, high = spread(solids, T, axis)
        at = dot(tip, axis)
        return point_apart(solids, T, tip), low - at, high - at
    ways = [(vector_difference(moved_point(T, place.point), tip), place.width) for place in part.grasp]
    away_from, offset, wide = min((sqrt(dot(way, way)), dot(way, axis), width) for way, width in ways)
    return away_from, offset - 0.5 * wide, offset + 0.5 * wide


ALONE = ("hand", "held", "width", "stack")  # keys of WorldHistory that are also fields of WorldState


def state_at(history: WorldHistory, settings: WorldSettings, t: float) -> world.WorldState:
    """Return the state of the world just before t [s]. The history must have reached this time."""
    history = history.copy()
    history.back_to(t)
    return world.WorldState(
        t,
        parts={name: history.rows(("spans", name))[-1] for name in settings.parts},
        on=tuple(sorted(number for number, on in history.items("signal").items() if on)),
        inside={body: tuple(sorted(regions)) for body, regions in history.items("in").items() if regions},
        used=history.items("used"),
        fed=history.items("fed"),
        due=tuple(
            world.DueHappening(due.time, due.what)
            for due in history.due
            if isinstance(due.what, world.CertainHappening) and not due.what.follows_arm
        ),
        **{key: history.get(key) for key in ALONE},
    )


def restore(history: WorldHistory, settings: WorldSettings, state: world.WorldState) -> None:
    """Start a new history from a saved state. The history already contains all bodies at their initial poses."""
    history.now = state.time
    for key in ALONE:
        history.set(key, getattr(state, key))
    for name, span in state.parts.items():
        lift(history, name)
        history.add(("spans", name), span)
        if span.kind is world.SpanKind.RESTS:
            put(history, name, settings.solids[name], span.T)
    for number in state.on:
        history.set(("signal", number), True)
        if number in settings.computed:
            history.add((CHANGES, number), (state.time, True))
    for body, regions in state.inside.items():
        history.set(("in", body), frozenset(regions))
        for region in regions:
            history.set(("region", region), history.get(("region", region), frozenset[str]()) | {body})
            history.add((SEES, region), (state.time, True))
    for kind, counts in (("used", state.used), ("fed", state.fed)):
        for place, count in counts.items():
            history.set((kind, place), count)
    for due in state.due:
        what = due.what
        if isinstance(what, world.PartLands):
            # record where the part will rest, so that parts that fall later can land on it
            put(history, what.part, settings.solids[what.part], what.T)
        history.plan(due.time, what)
    add_grip(history, settings)
