"""Define the state of a world (the scene around a robot) at one time and over time, and contacts. Units are metres,
radians, seconds. A world state and the timeline after it determine all later states."""

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
