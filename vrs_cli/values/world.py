"""Define the scene around a robot (parts, which are workpieces; fixtures, sensors, feeders, sinks), contacts, and the
state of a world at one time. `T_world_part` is the pose of a part in the world frame, like a location of VAL-II. Units
are metres, radians, kilograms, seconds. A world state and the timeline after it determine all later states."""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum
from math import inf
from typing import NamedTuple

from msgspec import Struct

from vrs_cli.kinematics.transform import Transform, Vector


class SpanKind(Enum):
    """The state of a part: absent, at rest, in the hand, or falling."""

    ABSENT = "absent"
    RESTS = "rests"
    HELD = "held"
    FALLS = "falls"


class PartBegin(NamedTuple):
    """The state of a part, starting at `begin` [s]. `T`: T_world_part; for a held part T_flange_part; for a falling
    part its pose at the start of the fall. `on`: the names of the objects on which the part rests, or onto which it
    falls."""

    begin: float
    kind: SpanKind
    T: Transform
    on: tuple[str, ...] = ()


class PartSpan(Struct, frozen=True):
    """The state of a part from `begin` to `end` [s], as `PartBegin` describes it."""

    begin: float
    kind: SpanKind
    T: Transform
    end: float = inf
    on: tuple[str, ...] = ()


class HandGrip(Struct, frozen=True, array_like=True):
    """The state of the hand, starting at `begin` [s]: the part that it holds, and the opening of its fingers from 0
    (closed) to 1 (open)."""

    begin: float
    part: str | None
    opening: float


class StateChange(Struct, frozen=True, array_like=True):
    """The state of a signal (on or off) or of a sensor (whether it detects something), starting at `begin` [s]."""

    begin: float
    on: bool


class WorldNote(Struct, frozen=True, array_like=True):
    """A message about the world at a time [s]. Kinds: EMPTY (the hand closed on nothing), FALL (a part falls), EDGE (a
    part rests on an edge), FEEDER (a feeder cannot bring a part), ENDLESS (rules trigger each other without end)."""

    time: float
    kind: str
    text: str


class CourseRows(Struct, frozen=True, omit_defaults=True):
    """The changes of a world between two times; each row is valid until the next row of its list. `parts`: the states
    of each part. `grips`: the states of the hand. `signals`: the states of inputs that the world sets, by number;
    `sensors`: the states of sensors, by index in the scene. A signal or sensor without a row is off."""

    parts: Mapping[str, tuple[PartBegin, ...]] = {}
    grips: tuple[HandGrip, ...] = ()
    signals: Mapping[int, tuple[StateChange, ...]] = {}
    sensors: Mapping[int, tuple[StateChange, ...]] = {}
    notes: tuple[WorldNote, ...] = ()


class Happening(Struct, frozen=True, tag_field="kind", tag=True):
    """A planned event in a world. `rank`: events at the same instant occur in the order of their ranks."""

    @property
    def rank(self) -> int:
        return 0

    @property
    def follows_arm(self) -> bool:
        """Return whether the motion of the arm causes the event."""
        return self.rank > 0


class FingersArrive(Happening, frozen=True):
    """The fingers reach their commanded opening: the gap between them has changed from `before` to `after` [m]."""

    before: float
    after: float


class SignalSwitches(Happening, frozen=True):
    """A rule of the cell switches a signal."""

    signal: int
    on: bool


class PartComes(Happening, frozen=True):
    """Feeder number `feeder` brings its next part."""

    feeder: int


class PartsGo(Happening, frozen=True):
    """Sink number `sink` removes the parts in its zone."""

    sink: int


class PartLands(Happening, frozen=True):
    """A falling part comes to rest at T_world_part on other bodies."""

    part: str
    T: Transform
    on: tuple[str, ...]


class BodyCrosses(Happening, frozen=True):
    """A part or the hand enters (`inside`) or leaves the region of a sensor, given by its index. `moved`: the arm is
    moving the part or the hand."""

    body: str
    region: int
    inside: bool
    moved: bool = False

    @property
    def rank(self) -> int:
        return 1 if self.moved else 0


CertainHappening = (
    FingersArrive | SignalSwitches | PartComes | PartsGo | PartLands | BodyCrosses
)  # events that can occur while the arm is at rest


class DueHappening(Struct, frozen=True, array_like=True):
    """A planned event and its time [s]; it occurs even if the arm is at rest."""

    time: float
    what: CertainHappening


class WorldState(Struct, frozen=True):
    """The state of a world just before `time` [s]. `hand`: the opening from 0 (closed) to 1 (open); `held`: the part in
    the hand; `width` [m]: the width of that part; `stack`: the parts that were on that part when the hand took it,
    until the arm moves. `parts`: the state of each part. `on`: the inputs and outputs that are on. `inside`: for each
    body, the sensor regions that it is in. `used`, `fed`: how often rules and feeders were used, by index."""

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
    """A contact of two bodies from `begin` to `end` [s]; None: the contact does not end. Links are named base, link 1
    and so on; the last link is named hand if it has fingers. The surface under the robot is named floor."""

    begin: float
    end: float | None
    first: str
    second: str


class Contact(Struct, frozen=True):
    """The first contact of a motion: two bodies touch at `t` [s], at a point in the world [m]. `depth` [m]: the maximum
    overlap during this contact; 0 if the bodies only come closer than PARAMETER CLEARANCE. `needed` [m]:
    the distance by which they are too close."""

    t: float
    first: str
    second: str
    place: Vector
    depth: float
    needed: float

    def describe(self, when: str = "at") -> str:
        """Return the contact as a sentence; `when`: the word before the time."""
        x, y, z = (1000.0 * one for one in self.place)
        where = f"{when} {self.t:.3f} s near X {x:z.1f} Y {y:z.1f} Z {z:z.1f} mm"
        needed = f"{1000.0 * self.needed:.1f} mm more are needed"
        if self.depth <= 0.0:
            return f"{self.first} comes too near to {self.second} {where}: {needed}"
        return f"{self.first} touches {self.second} {where}, {1000.0 * self.depth:.1f} mm deep: {needed}"


Colour = tuple[float, float, float]  # red, green and blue, each from 0 to 1

# --- shapes: all are convex, or made of convex pieces ----------------------------------------------------------------


class BoxShape(Struct, frozen=True, tag=True):
    """A box with its frame at its centre; `size`: the edge lengths along X, Y and Z [m]."""

    size: Vector


class CylinderShape(Struct, frozen=True, tag=True):
    """A cylinder with its axis along Z [m] and its frame at its centre."""

    radius: float
    height: float


class SphereShape(Struct, frozen=True, tag=True):
    """A sphere with its frame at its centre; `radius` [m]."""

    radius: float


class MeshShape(Struct, frozen=True, tag=True):
    """A shape made of convex pieces; each piece is the convex hull of its points [m]. `file`: the file from which they
    were read."""

    pieces: tuple[tuple[Vector, ...], ...]
    file: str


Shape = BoxShape | CylinderShape | SphereShape | MeshShape

# --- bodies ----------------------------------------------------------------------------------------------------------


class GraspPlace(Struct, frozen=True):
    """A grasp: the point in the part's frame at which the hand can take the part, and the part's width there [m]."""

    point: Vector
    width: float


class ScenePart(Struct, frozen=True):
    """A part (workpiece) that the hand can take. If `grasp` is empty, its grasps are computed from its shape."""

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
    """The hand. `opening`: the distance between its open fingers, which close along the tool's Y axis; None: the
    opening of the robot's hand. `tolerance`: the maximum distance between the tool tip and a part that the hand can
    take. `size`: the sizes of the box around the fingers; it ends at the tip, and sensors detect it. `signal`: an input
    that is on while the hand holds a part; 0: none."""

    opening: float | None = None
    tolerance: float = 0.005
    size: Vector = (0.02, 0.08, 0.05)
    signal: int = 0


# --- sensors ---------------------------------------------------------------------------------------------------------


class Beam(Struct, frozen=True, tag=True):
    """A light barrier: a cylinder with round ends, from `begin` to `end` in the world [m]."""

    begin: Vector
    end: Vector
    radius: float


class Zone(Struct, frozen=True, tag=True):
    """A box-shaped zone in the world, centred on the origin of its frame. `size`: the edge
    lengths along X, Y and Z [m]."""

    T_world_zone: Transform
    size: Vector


class Proximity(Struct, frozen=True, tag=True):
    """A proximity switch: it detects bodies up to `range` [m] along a unit direction, and up to `radius` [m] beside
    that line."""

    place: Vector
    direction: Vector
    range: float
    radius: float


class Sensor(Struct, frozen=True):
    """A sensor. While a part or the hand is in its region, it turns the input `signal` on; if `signal` is negative, it
    turns the input off instead."""

    name: str
    signal: int
    region: Beam | Zone | Proximity


# --- feeders and sinks ------------------------------------------------------------------------------------------------


class Feeder(Struct, frozen=True):
    """A feeder. Each time signal `when` turns on (a negative number: turns off), the next of `parts` appears `after`
    seconds later at `T_world_part`, or at the part's own pose if `T_world_part` is None. Until then the part is absent.
    `again`: after the last part the first one follows; otherwise no more parts appear."""

    parts: tuple[str, ...]
    when: int
    after: float = 0.0
    T_world_part: Transform | None = None
    again: bool = False


class PartSink(Struct, frozen=True):
    """A sink. Each time signal `when` turns on (a negative number: turns off), the parts that are in the zone and not
    held disappear `after` seconds later."""

    when: int
    zone: Zone
    after: float = 0.0


class CellScene(Struct, frozen=True):
    """The surroundings of a robot. `floor`: its height in the world [m]; None: the surface under the robot."""

    parts: tuple[ScenePart, ...] = ()
    fixtures: tuple[Fixture, ...] = ()
    sensors: tuple[Sensor, ...] = ()
    feeders: tuple[Feeder, ...] = ()
    sinks: tuple[PartSink, ...] = ()
    gripper: Gripper = Gripper()
    floor: float | None = None

    @property
    def empty(self) -> bool:
        """Return whether the scene has no parts, fixtures or sensors."""
        return not (self.parts or self.fixtures or self.sensors)


NO_SCENE = CellScene()
