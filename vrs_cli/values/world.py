"""The state of a world at one time: what parts do, what sensors see, and what is due. With the timeline from then on it
gives the rest of the course.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum
from math import inf
from typing import NamedTuple

from msgspec import Struct

from vrs_cli.kinematics.transform import Transform


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
    def carried(self) -> bool:
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
