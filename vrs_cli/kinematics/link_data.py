"""Define the shapes and masses of links, and read and write them as tables of plain data.

Link 0 is the base, and link i is moved by joint i; its frame is `model.link_frames(model, q)[i]`. A robot's TOML file
and the header of a trajectory file have one table for each shape, and one for the masses of each link. Units are SI; a
TOML file has millimetres and degrees.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import reduce
from math import dist, hypot
from pathlib import Path
from re import fullmatch
from reprlib import repr as brief
from typing import Any, NamedTuple

from vrs_cli.kinematics import transform
from vrs_cli.kinematics.data_reader import ANGLE, LENGTH, PLAIN, POSITIVE, TINY, DataReader, Quantity
from vrs_cli.kinematics.transform import IDENTITY, Transform, Vector

MAX_SHAPES = 1000  # maximum number of shapes that a file may give a robot


class Box(NamedTuple):
    """A box with the edge lengths `size` [m], centred on the origin of the frame `pose`, in the frame of the link."""

    size: Vector
    pose: Transform = IDENTITY


class Cylinder(NamedTuple):
    """A cylinder from `start` to `end`, the centres of its ends, with a radius at each end [m]; a truncated cone if the
    radii differ.
    """

    start: Vector
    end: Vector
    radii: tuple[float, float]


class Capsule(NamedTuple):
    """The convex hull of two balls with the centres `start` and `end` and a radius each [m]; a single ball if both
    centres are the same.
    """

    start: Vector
    end: Vector
    radii: tuple[float, float]


class Slab(NamedTuple):
    """The convex hull of two discs perpendicular to the direction `across`, with centres `start` and `end`, and with a
    radius and a thickness each [m].
    """

    start: Vector
    end: Vector
    across: Vector
    radii: tuple[float, float]
    thickness: tuple[float, float]


class MeshFile(NamedTuple):
    """A triangle mesh in a file (STL, OBJ, DAE). The file may be missing on the machine that displays the robot."""

    path: str
    pose: Transform = IDENTITY
    scale: Vector = (1.0, 1.0, 1.0)


Body = Box | Cylinder | Capsule | Slab | MeshFile


class Opening(NamedTuple):
    """The motion of a part of the hand while the hand opens completely, in the frame of the link that carries it.

    The part slides by `slide` [m] and turns by the rotation vector `turn` [rad] about an axis through `point` [m].
    """

    slide: Vector = (0.0, 0.0, 0.0)
    turn: Vector = (0.0, 0.0, 0.0)
    point: Vector = (0.0, 0.0, 0.0)

    def at(self, hand: float) -> Transform:
        """Return the motion from the closed hand to the opening `hand`, from 0 (closed) to 1 (open)."""
        x, y, z = self.turn
        if not any(self.turn):
            return transform.translation(*transform.scaled_vector(self.slide, hand))
        turned = transform.rotation_about(self.turn, hand * hypot(x, y, z))
        about = transform.compose(
            transform.compose(transform.translation(*self.point), turned),
            transform.translation(*transform.scaled_vector(self.point, -1.0)),
        )
        return transform.compose(transform.translation(*transform.scaled_vector(self.slide, hand)), about)


class LinkShape(NamedTuple):
    """A shape fixed to a link, or to a part of the hand that the link carries. `opens`: for a part of the hand, the
    motions of all joints between the link and the part from closed to open, in the order from the link outward.
    """

    link: int
    body: Body
    colour: str = "cream"
    opens: tuple[Opening, ...] = ()


def opening_motion(openings: Iterable[Opening], hand: float) -> Transform:
    """Return the motion of a part of the hand from the closed hand to the opening `hand`, from 0 (closed) to 1 (open),
    in the frame of the link that carries it.
    """
    return reduce(transform.compose, (opening.at(hand) for opening in openings), IDENTITY)


COLOURS = {
    "cream": (240, 232, 212),
    "white": (240, 241, 243),
    "grey": (176, 181, 188),
    "dark": (62, 67, 74),
    "steel": (146, 152, 160),
    "orange": (226, 122, 42),
    "blue": (84, 134, 190),
    "red": (190, 62, 54),
    "yellow": (236, 190, 60),
    "green": (92, 150, 96),
}


def rgb(colour: str) -> tuple[int, int, int]:
    """Return red, green and blue (0 to 255) for a name in COLOURS or a string #rrggbb."""
    if colour in COLOURS:
        return COLOURS[colour]
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)


SIZE = Quantity("mm", positive=True)


class Keys(NamedTuple):
    """The keys that the table of a kind of shape must have, and the keys that it may have."""

    needed: tuple[str, ...]
    options: tuple[str, ...] = ()


KINDS: Mapping[str, Keys] = {
    "box": Keys(("size",), ("at",)),
    "cylinder": Keys(("from", "to", "radius")),
    "capsule": Keys(("from", "radius"), ("to",)),
    "slab": Keys(("from", "to", "across", "radius", "thickness")),
    # `glb`: the address from which clients of a server download the mesh
    "mesh": Keys(("file",), ("at", "scale", "glb")),
}
# the name of each kind of shape, then the key of each of its fields
BODY_KEYS: Mapping[type[Body], tuple[str, ...]] = {
    Box: ("box", "size", "at"),
    Cylinder: ("cylinder", "from", "to", "radius"),
    Capsule: ("capsule", "from", "to", "radius"),
    Slab: ("slab", "from", "to", "across", "radius", "thickness"),
    MeshFile: ("mesh", "file", "at", "scale"),
}
OPENING_KEYS: Mapping[str, Quantity] = {"slide": LENGTH, "turn": ANGLE, "point": LENGTH}
ALL_NEED, ALL_MAY = ("link", "kind"), ("colour", "opens")


# --- values to tables ----------------------------------------------------------------------------------------------


def shape_tables(shapes: Iterable[LinkShape]) -> list[dict[str, Any]]:
    """Convert shapes to plain data: one table for each, in metres."""
    tables = list[dict[str, Any]]()
    for shape in shapes:
        kind, *keys = BODY_KEYS[type(shape.body)]
        table: dict[str, Any] = {"link": shape.link, "kind": kind}
        for key, value in zip(keys, shape.body, strict=True):
            if key != "at" or value != IDENTITY:
                table[key] = value if isinstance(value, str) else list(value)
        table["colour"] = shape.colour
        if len(shape.opens) == 1 and not any(shape.opens[0].turn):
            table["opens"] = list(shape.opens[0].slide)
        elif shape.opens:
            said = (one._asdict().items() for one in shape.opens)
            table["opens"] = [{key: list(value) for key, value in items if any(value)} for items in said]
        tables.append(table)
    return tables


# --- tables to values ----------------------------------------------------------------------------------------------


class ShapeReader(DataReader, frozen=True):
    """Reads shapes from tables. Paths of mesh files are relative to the folder of the robot file."""

    def shapes(self, data: object, joints: int, key: str = "shapes") -> tuple[LinkShape, ...]:
        """Check tables of shapes of a robot with this number of joints, and return the shapes. `key`: the key of the
        tables in the file, for errors. Raises FileDamaged.
        """
        if not isinstance(data, list | tuple):
            raise self.wrong(key, "is not a list of tables", f"write one [[{key}]] table for each shape")
        if len(data) > MAX_SHAPES:
            raise self.wrong(key, f"there are {len(data)}", f"a robot has {MAX_SHAPES} at most")
        name = key.removesuffix("s")
        return tuple(self.shape(table, f"{name} {i}", joints) for i, table in enumerate(data, 1))

    def shape(self, data: object, key: str, joints: int) -> LinkShape:
        kind = data.get("kind") if isinstance(data, Mapping) else None
        if not isinstance(kind, str) or kind not in KINDS:
            what = "is missing" if kind is None else f"{brief(kind)} is none"
            raise self.wrong(f"{key}: kind", what, "give " + ", ".join(f'"{known}"' for known in KINDS))
        keys = KINDS[kind]
        table = self.table(data, key, (*ALL_NEED, *keys.needed), (*keys.options, *ALL_MAY))
        opens = self.openings(table["opens"], f"{key}: opens") if "opens" in table else ()
        link, colour = table["link"], table.get("colour", next(iter(COLOURS)))
        if isinstance(link, bool) or not isinstance(link, int) or not 0 <= link <= joints:
            hint = f"give 0 for the base, or 1 to {joints} for what that joint moves"
            raise self.wrong(f"{key}: link", f"{brief(link)} is none of this robot", hint)
        if not isinstance(colour, str) or not (colour in COLOURS or fullmatch("#[0-9a-fA-F]{6}", colour)):
            hint = f"give one of {', '.join(COLOURS)}, or #rrggbb"
            raise self.wrong(f"{key}: colour", f"{brief(colour)} is none", hint)
        return LinkShape(link, self.body(kind, table, key), colour, opens)

    def openings(self, data: object, key: str) -> tuple[Opening, ...]:
        """Return the opening motions of a part of the hand. `data`: the displacement [x, y, z] of a part that only
        slides, or a table for each joint that moves it.

        The rotation vector of a joint has the direction of its axis and the length of its angle.
        """
        tables = [data] if isinstance(data, Mapping) else data
        if not isinstance(tables, list | tuple) or not tables or not all(isinstance(one, Mapping) for one in tables):
            return (Opening(self.point(data, key)),)
        found = list[Opening]()
        for i, one in enumerate(tables, 1):
            rows = self.table(one, f"{key} {i}", (), OPENING_KEYS).items()
            found.append(
                Opening(**{name: self.three(value, f"{key} {i}: {name}", OPENING_KEYS[name]) for name, value in rows})
            )
        return tuple(found)

    def body(self, kind: str, table: Mapping[str, object], key: str) -> Body:
        at, place = IDENTITY, table.get("at")
        if isinstance(place, list | tuple) and len(place) == 3:
            at = transform.translation(*self.point(place, f"{key}: at"))
        elif "at" in table:
            at = self.frame(place, f"{key}: at")
        if kind == "box":
            return Box(self.three(table["size"], f"{key}: size", SIZE), at)
        if kind == "mesh":
            # a negative factor mirrors the mesh
            scale = self.three(table.get("scale", (1.0, 1.0, 1.0)), f"{key}: scale", PLAIN)
            if min(map(abs, scale)) < TINY:
                raise self.wrong(f"{key}: scale", "makes it flat", "give how many times as large as in its file it is")
            file = self.word(
                table["file"], f"{key}: file"
            )  # in a user's file, make the path absolute; in data of a running robot, keep it
            return MeshFile(str(Path(self.file).absolute().parent / file) if self.human else file, at, scale)
        start = self.point(table["from"], f"{key}: from")
        end = self.point(table["to"], f"{key}: to") if "to" in table else start
        radii = self.pair(table["radius"], f"{key}: radius")
        if kind == "capsule":
            return Capsule(start, end, radii)
        if dist(start, end) < TINY:
            raise self.wrong(key, "from and to are one place", "give its two ends")
        if kind == "cylinder":
            return Cylinder(start, end, radii)
        across = self.three(table["across"], f"{key}: across", PLAIN)
        thickness = self.pair(table["thickness"], f"{key}: thickness")
        if transform.length(transform.cross(across, transform.vector_difference(end, start))) < TINY * dist(start, end):
            raise self.wrong(f"{key}: across", "does not lead across", "give the direction of its thickness")
        if dist(start, end) <= abs(radii[0] - radii[1]) + TINY:
            raise self.wrong(key, "one of its two discs holds the other", "give a cylinder")
        return Slab(start, end, across, radii, thickness)

    def point(self, data: object, key: str) -> Vector:
        return self.three(data, key, LENGTH)

    def three(self, data: object, key: str, quantity: Quantity) -> Vector:
        x, y, z = self.number_list(data, key, [quantity] * 3, f"give [x, y, z]{self.in_unit(quantity)}")
        return x, y, z

    def pair(self, data: object, key: str) -> tuple[float, float]:
        """Return the sizes (radius or thickness) at both ends of a shape; a single number is the size at both."""
        values = data if isinstance(data, list | tuple) else (data, data)
        if len(values) != 2:
            raise self.wrong(key, f"is a list of {len(values)}", "give one number, or that at `from` and that at `to`")
        first, last = (self.number(value, key, SIZE) for value in values)
        return first, last


Inertia = tuple[float, float, float, float, float, float]  # xx, yy, zz, xy, xz, yz [kg m2]

DRIVE_KEYS: Mapping[str, Quantity] = {
    "rotor": PLAIN,
    "gear": POSITIVE,
    "viscous": PLAIN,
    "coulomb": PLAIN,
    "max_torque": POSITIVE,
}


class LinkMasses(NamedTuple):
    """The mass and inertia of a link, and the data of the drive of its joint; None where a value is unknown.

    The mass [kg], its centre [m] and the inertia about this centre [kg m2] are in the frame of the link. The rotor
    inertia [kg m2], viscous friction [N m s/rad] and Coulomb friction [N m] are measured at the motor, which makes
    `gear` turns for one turn of the joint. `max_torque` is measured at the joint [N m]. For a prismatic joint, torques
    at the joint are forces [N], and `gear` is in radians of the motor per metre.
    """

    mass: float | None = None
    centre: Vector | None = None
    inertia: Inertia | None = None
    rotor: float | None = None
    gear: float | None = None
    viscous: float | None = None
    coulomb: float | None = None
    max_torque: float | None = None


def mass_tables(masses: Iterable[LinkMasses]) -> list[dict[str, Any]]:
    """Convert masses to plain data: one table for each link, in SI units, without unknown values."""
    rows = (one._asdict().items() for one in masses)
    return [{key: list(x) if isinstance(x, tuple) else x for key, x in row if x is not None} for row in rows]


class MassReader(DataReader, frozen=True):
    """Reads the masses of links from tables."""

    def masses(self, data: object, joints: int) -> tuple[LinkMasses, ...]:
        """Check the tables of masses, one for each of the links that joints move, and return the masses. Raises
        FileDamaged.
        """
        if not isinstance(data, list | tuple) or len(data) != joints:
            found = f"there are {len(data)}" if isinstance(data, list | tuple) else "is not a list of tables"
            raise self.wrong("masses", found, f"write one [[masses]] table for each of the {joints} links")
        return tuple(self.link(table, f"masses {i}") for i, table in enumerate(data, 1))

    def link(self, data: object, key: str) -> LinkMasses:
        table = self.table(data, key, (), LinkMasses._fields)
        found: dict[str, Any] = {
            name: self.number(table[name], f"{key}: {name}", quantity)
            for name, quantity in {"mass": PLAIN, **DRIVE_KEYS}.items()
            if name in table
        }
        if below := [name for name, x in found.items() if x < 0.0]:
            raise self.wrong(f"{key}: {below[0]}", f"{found[below[0]]:g} is below zero", "give it without a sign")
        if "centre" in table:
            right = f"give [x, y, z]{self.in_unit(LENGTH)}, in the frame of the link"
            found["centre"] = self.number_list(table["centre"], f"{key}: centre", [LENGTH] * 3, right)
        if "inertia" in table:
            found["inertia"] = self.inertia(table["inertia"], f"{key}: inertia")
        return LinkMasses(**found)

    def inertia(self, data: object, key: str) -> Inertia:
        right = "give [xx, yy, zz] or [xx, yy, zz, xy, xz, yz] about the centre of mass, in kg m2"
        short = isinstance(data, list | tuple) and len(data) == 3
        xx, yy, zz, *other = self.number_list(data, key, [PLAIN] * (3 if short else 6), right)
        if min(xx, yy, zz) < 0.0:
            raise self.wrong(key, "a moment of inertia is below zero", right)
        xy, xz, yz = other or (0.0, 0.0, 0.0)
        return xx, yy, zz, xy, xz, yz
