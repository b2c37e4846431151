"""A scene around a robot: parts, fixtures, sensors, feeders and sinks, as its cell file gives them.

`T_world_part` is the pose of a part in the world, as VAL-II's locations are. Metres, radians, kilograms.
"""

from __future__ import annotations

from msgspec import Struct

from vrs_cli.kinematics.transform import Transform, Vector

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
