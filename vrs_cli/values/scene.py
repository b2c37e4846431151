"""Define the scene around a robot: parts (workpieces), fixtures, the hand, sensors, feeders and sinks. `T_world_part`
is the pose of a part in the world frame, like a location of VAL-II. Units are metres, radians, kilograms, seconds."""

from __future__ import annotations

from msgspec import Struct

from vrs_cli.kinematics.transform import Transform, Vector

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
