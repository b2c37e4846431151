"""What a world is made of, prepared once: solids by name, regions of sensors, rules by the signal that they follow."""

from __future__ import annotations

from collections import defaultdict

from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.transform import translation
from vrs_cli.language.run.signals import Cell, Follow
from vrs_cli.language.words.values import INPUTS, INTERNAL
from vrs_cli.values.scene import BoxShape, ScenePart
from vrs_cli.values.world import BodyCrosses, PartComes, PartLands, PartsGo, WorldState
from vrs_cli.world.history import WorldHistory
from vrs_cli.world.sensing import Region, SeenBody, Sensing
from vrs_cli.world.solids import Solids, solids_of
from vrs_cli.world.support import FALLS, below_in, floor_height, put

FINGERS = ""  # the name of the hand's fingers among bodies
OPENING = 0.1  # [m] of a hand of which nobody says how wide it opens


class WorldSettings:
    """An arm in a cell. `opening`: of the hand [m]. `fed`: the parts that feeders bring. `rules`: those that the world
    applies, with their places, by the signal that they follow. `computed`: the inputs that the world drives; `sensed`:
    those of them that sensors drive. `at_start`: a history in which all stands that is there at the start.
    """

    def __init__(self, arm: RobotArm, cell: Cell) -> None:
        scene = cell.scene
        self.arm, self.scene = arm, scene
        self.opening = scene.gripper.opening or arm.model.hand_width or OPENING
        self.floor = floor_height(scene, arm.model)
        self.parts: dict[str, ScenePart] = {part.name: part for part in scene.parts}
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
        bodies = {**self.solids, FINGERS: solids_of(BoxShape(scene.gripper.size))}
        self.sensing = Sensing(arm, bodies, tuple(Region.of(sensor.region) for sensor in scene.sensors))
        self.sinks = [(sink.zone.T_world_zone, Region.of(sink.zone)) for sink in scene.sinks]
        self.rules = defaultdict[int, list[tuple[int, Follow]]](list)
        for place, rule in enumerate(cell.follows):
            if rule.sets is not None and abs(rule.sets) in INPUTS and abs(rule.when) not in INTERNAL:
                self.rules[rule.when].append((place, rule))
        self.sensed = frozenset(abs(sensor.signal) for sensor in scene.sensors) | {abs(scene.gripper.signal)} - {0}
        followed = {abs(rule.sets or 0) for rules in self.rules.values() for _, rule in rules}
        self.computed = frozenset(self.sensed | followed)

    def fits(self, state: WorldState) -> bool:
        """Return whether a state is one of this world, and not of another cell."""
        named = {one.what.part if isinstance(one.what, PartLands) else "" for one in state.due} | {state.held or ""}
        bodies = named | {*state.stack, *state.inside}
        regions = [region for several in state.inside.values() for region in several]
        regions += [one.what.region for one in state.due if isinstance(one.what, BodyCrosses)]
        feeders = [*state.fed, *(one.what.feeder for one in state.due if isinstance(one.what, PartComes))]
        sinks = [one.what.sink for one in state.due if isinstance(one.what, PartsGo)]
        return (
            state.parts.keys() == self.parts.keys()
            and bodies <= {*self.parts, FINGERS}
            and all(0 <= region < len(self.sensing.regions) for region in regions)
            and all(0 <= feeder < len(self.scene.feeders) for feeder in feeders)
            and all(0 <= sink < len(self.sinks) for sink in sinks)
        )

    def stood_on(self, name: str) -> str:
        """Return what a part stands on at the start; "" if nothing is just below it."""
        known = self._stood_on.get(name)
        if known is None:
            found = below_in(self.at_start, name, self.solids[name], self.parts[name].T_world_part, self.floor)
            known = self._stood_on[name] = found.on[0] if found.drop <= FALLS else ""
        return known
