"""The state of a world at one time: what parts do, what sensors see, and what is due. With the timeline from then on it
gives the rest of the course.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum
from math import inf
from typing import NamedTuple

from msgspec import Struct

from vrs_cli.kinematics.transform import Transform, Vector


class SpanKind(Enum):
    """The ways of a part: not there, at rest, in the hand, or falling."""

    ABSENT = "absent"
    RESTS = "rests"
    HELD = "held"
    FALLS = "falls"


class PartBegin(NamedTuple):
    """What a part does from `begin` on [s]. `T`: T_world_part; of a part that is held, T_flange_part; of one that
    falls, where it begins to. `on`: what it stands on, or falls onto.
    """

    begin: float
    kind: SpanKind
    T: Transform
    on: tuple[str, ...] = ()


class PartSpan(NamedTuple):
    """The same, up to `end` [s]."""

    begin: float
    kind: SpanKind
    T: Transform
    end: float = inf
    on: tuple[str, ...] = ()


class HandGrip(NamedTuple):
    """From `begin` on [s]: the part in the hand, and how far the fingers are open, from 0, closed, to 1."""

    begin: float
    part: str | None
    opening: float


class StateChange(NamedTuple):
    """From `begin` on [s] a signal is on, or a sensor sees something."""

    begin: float
    on: bool


class WorldNote(NamedTuple):
    """Something to tell at a time [s]. Kinds: EMPTY (the hand closed on nothing), FALL, EDGE, FEEDER, ENDLESS."""

    time: float
    kind: str
    text: str


class CourseRows(Struct, frozen=True, omit_defaults=True):
    """What begins in a world between two times; each row holds until the next one of its list begins. `parts`: what
    each part does. `grips`: the hand. `signals`: the inputs that the world drives, by their numbers; `sensors`: by
    their numbers in the scene, from 0. A signal or sensor without a row is off.
    """

    parts: Mapping[str, tuple[PartBegin, ...]] = {}
    grips: tuple[HandGrip, ...] = ()
    signals: Mapping[int, tuple[StateChange, ...]] = {}
    sensors: Mapping[int, tuple[StateChange, ...]] = {}
    notes: tuple[WorldNote, ...] = ()


class Happening(Struct, frozen=True, tag_field="kind", tag=True):
    """Something that is due in a world. `rank`: of one instant, the lowest rank comes first; `carried`: it follows from
    the motion of the arm.
    """

    @property
    def rank(self) -> int:
        return 0

    @property
    def follows_arm(self) -> bool:
        return self.rank > 0


class FingersArrive(Happening, frozen=True):
    """The fingers arrive; their gap goes from `before` to `after` [m]."""

    before: float
    after: float


class SignalSwitches(Happening, frozen=True):
    """A rule of the cell switches a signal."""

    signal: int
    on: bool


class PartComes(Happening, frozen=True):
    """A feeder, by its number, brings its next part."""

    feeder: int


class PartsGo(Happening, frozen=True):
    """A sink, by its number, takes the parts in its zone."""

    sink: int


class PartLands(Happening, frozen=True):
    """A part that falls comes to rest at T_world_part on other bodies."""

    part: str
    T: Transform
    on: tuple[str, ...]


class BodyCrosses(Happening, frozen=True):
    """A body enters (`inside`) or leaves the region of a sensor, by its number. `moved`: by the arm."""

    body: str
    region: int
    inside: bool
    moved: bool = False

    @property
    def rank(self) -> int:
        return 1 if self.moved else 0


CertainHappening = (
    FingersArrive | SignalSwitches | PartComes | PartsGo | PartLands | BodyCrosses
)  # those that may come whatever the arm does


class DueHappening(NamedTuple):
    """What is due at a time [s] whatever the arm does."""

    time: float
    what: CertainHappening


class WorldState(Struct, frozen=True):
    """The world just before `time` [s].

    `hand`: from 0, closed, to 1, open; `held`: the part in it; `width` of it [m]; `stack`: the parts that stood on it
    when it was taken, until the arm moves. `parts`: what each does. `on`: the inputs and outputs that are on. `inside`:
    the regions of sensors in which bodies are. `used`, `fed`: how often rules and feeders were used, by their numbers.
    """

    time: float
    hand: float
    parts: Mapping[str, PartBegin]
    held: str | None = None
    width: float = 0.0
    stack: tuple[str, ...] = ()
    on: tuple[int, ...] = ()
    inside: Mapping[str, tuple[int, ...]] = {}
    used: Mapping[int, int] = {}
    fed: Mapping[int, int] = {}
    due: tuple[DueHappening, ...] = ()


class ContactSpan(NamedTuple):
    """Two things touch from `begin` to `end` [s]; None: for ever. Links are called base, link 1 and so on, the last one
    hand where it has fingers; what the robot stands on is the floor.
    """

    begin: float
    end: float | None
    first: str
    second: str


class Contact(Struct, frozen=True):
    """The first contact of a motion: at `t` [s] two things touch, at a place in the world [m].

    `depth` [m]: how far they overlap at most in the course of this contact; 0 where they only come nearer than
    PARAMETER CLEARANCE. `needed` [m]: how much farther apart they would have to be.
    """

    t: float
    first: str
    second: str
    place: Vector
    depth: float
    needed: float

    def describe(self, when: str = "at") -> str:
        """Return the sentence that reports say; `when`: the word before the time."""
        x, y, z = (1000.0 * one for one in self.place)
        where = f"{when} {self.t:.3f} s near X {x:z.1f} Y {y:z.1f} Z {z:z.1f} mm"
        needed = f"{1000.0 * self.needed:.1f} mm more are needed"
        if self.depth <= 0.0:
            return f"{self.first} comes too near to {self.second} {where}: {needed}"
        return f"{self.first} touches {self.second} {where}, {1000.0 * self.depth:.1f} mm deep: {needed}"


Colour = tuple[float, float, float]  # red, green, blue from 0 to 1

# --- shapes: all are convex, or made of convex pieces ----------------------------------------------------------------


class BoxShape(Struct, frozen=True, tag=True):
    """A box about its centre: its whole sizes along X, Y and Z [m]."""

    size: Vector


class CylinderShape(Struct, frozen=True, tag=True):
    """A cylinder about its centre, its axis along Z [m]."""

    radius: float
    height: float


class SphereShape(Struct, frozen=True, tag=True):
    """A ball about its centre [m]."""

    radius: float


class MeshShape(Struct, frozen=True, tag=True):
    """Convex pieces, each the hull of its points [m]. `file`: where they were read from."""

    pieces: tuple[tuple[Vector, ...], ...]
    file: str


Shape = BoxShape | CylinderShape | SphereShape | MeshShape

# --- bodies ----------------------------------------------------------------------------------------------------------


class GraspPlace(Struct, frozen=True):
    """A place at which a hand takes a part: a point in the part's frame, and the part's width there [m]."""

    point: Vector
    width: float


class ScenePart(Struct, frozen=True):
    """A body that a hand can take. Without `grasp` the places follow from its shape."""

    name: str
    shape: Shape
    T_world_part: Transform
    colour: Colour
    mass: float
    grasp: tuple[GraspPlace, ...] = ()


class Fixture(Struct, frozen=True):
    """A body that never moves."""

    name: str
    shape: Shape
    T_world_fixture: Transform
    colour: Colour


class Gripper(Struct, frozen=True):
    """The hand. `opening`: the width between its open fingers, which close along the tool's Y; None: as wide as the
    robot's hand. `tolerance`: how far the tool's tip may be from a part that it takes. `size`: of the box about the
    fingers, which ends at the tip; sensors see it. `signal`: an input that is on while the hand holds a part; 0: none.
    """

    opening: float | None = None
    tolerance: float = 0.005
    size: Vector = (0.02, 0.08, 0.05)
    signal: int = 0


# --- sensors ---------------------------------------------------------------------------------------------------------


class Beam(Struct, frozen=True, tag=True):
    """A light barrier: a cylinder of this radius with round ends, from `begin` to `end` in the world [m]."""

    begin: Vector
    end: Vector
    radius: float


class Zone(Struct, frozen=True, tag=True):
    """A box in the world, about the origin of its frame: its whole sizes [m]."""

    T_world_zone: Transform
    size: Vector


class Proximity(Struct, frozen=True, tag=True):
    """A proximity switch at a place: it sees as far as `range` along a direction of length 1, and `radius` beside it
    [m].
    """

    place: Vector
    direction: Vector
    range: float
    radius: float


class Sensor(Struct, frozen=True):
    """While a part or the hand is in its region, its input signal is on; of a negative signal: off."""

    name: str
    signal: int
    region: Beam | Zone | Proximity


# --- what brings and takes parts -------------------------------------------------------------------------------------


class Feeder(Struct, frozen=True):
    """Each time a signal takes a state (negative: goes off), the next of `parts` comes `after` seconds later: to
    T_world_part, or where it is None to the part's own place. Until then the part is absent. After the last part none
    comes, or (`again`) the first one comes again.
    """

    parts: tuple[str, ...]
    when: int
    after: float = 0.0
    T_world_part: Transform | None = None
    again: bool = False


class PartSink(Struct, frozen=True):
    """Each time a signal takes a state (negative: goes off), the parts in its zone that nobody holds go, `after`
    seconds later.
    """

    when: int
    zone: Zone
    after: float = 0.0


class CellScene(Struct, frozen=True):
    """All that is around a robot. `floor`: its height in the world [m]; None: what the robot stands on."""

    parts: tuple[ScenePart, ...] = ()
    fixtures: tuple[Fixture, ...] = ()
    sensors: tuple[Sensor, ...] = ()
    feeders: tuple[Feeder, ...] = ()
    sinks: tuple[PartSink, ...] = ()
    gripper: Gripper = Gripper()
    floor: float | None = None

    @property
    def empty(self) -> bool:
        """Return whether there is nothing that could be taken, touched or seen."""
        return not (self.parts or self.fixtures or self.sensors)


NO_SCENE = CellScene()
