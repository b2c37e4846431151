"""Represent the shapes and masses of links, and read and write them as tables of plain data.

Link 0 is the base, link i is what joint i moves; its frame is `model.link_frames(model, q)[i]`. Each shape and each
link's masses have a table in a robot's TOML file and in the header of a trajectory file. SI units; a TOML file has
millimetres and degrees.
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

MAX_SHAPES = 1000  # maximum number of shapes of a robot


class Box(NamedTuple):
    """A box about the origin of `pose`."""

    size: Vector
    pose: Transform = IDENTITY


class Cylinder(NamedTuple):
    """A cylinder between the centres of its ends, or a cone if its two radii differ."""

    start: Vector
    end: Vector
    radii: tuple[float, float]


class Capsule(NamedTuple):
    """The convex hull of two balls; one ball if both have the same centre."""

    start: Vector
    end: Vector
    radii: tuple[float, float]


class Slab(NamedTuple):
    """The convex hull of two discs perpendicular to `across`, each with its radius; the thickness tapers."""

    start: Vector
    end: Vector
    across: Vector
    radii: tuple[float, float]
    thickness: tuple[float, float]


class MeshFile(NamedTuple):
    """Triangles in a file (STL, OBJ, DAE). The file may be missing on the machine that shows the robot."""

    path: str
    pose: Transform = IDENTITY
    scale: Vector = (1.0, 1.0, 1.0)


Body = Box | Cylinder | Capsule | Slab | MeshFile


class Opening(NamedTuple):
    """Motion of a hand's part from closed to open, in the frame of its link.

    The part slides by `slide` [m] and turns about an axis through `point` by the vector `turn` [rad].
    """

    slide: Vector = (0.0, 0.0, 0.0)
    turn: Vector = (0.0, 0.0, 0.0)
    point: Vector = (0.0, 0.0, 0.0)

    def at(self, hand: float) -> Transform:
        """Return the motion at an opening from 0 (closed) to 1 (open)."""
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
    """A body of a link. `opens`: the motions of the joints between the link and a part of the hand, measured from the
    closed hand, in the order of the joints from the link outward."""

    link: int
    body: Body
    colour: str = "cream"
    opens: tuple[Opening, ...] = ()


def opening_motion(openings: Iterable[Opening], hand: float) -> Transform:
    """Return the motion of a hand's part at an opening from 0 (closed) to 1 (open), in the frame of its link."""
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
    """Return the red, green and blue of a name in COLOURS or of #rrggbb."""
    if colour in COLOURS:
        return COLOURS[colour]
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)


SIZE = Quantity("mm", positive=True)


class Keys(NamedTuple):
    """The keys that a kind of shape must have, and the keys that it may have."""

    needed: tuple[str, ...]
    options: tuple[str, ...] = ()


KINDS: Mapping[str, Keys] = {
    "box": Keys(("size",), ("at",)),
    "cylinder": Keys(("from", "to", "radius")),
    "capsule": Keys(("from", "radius"), ("to",)),
    "slab": Keys(("from", "to", "across", "radius", "thickness")),
    "mesh": Keys(("file",), ("at", "scale", "glb")),  # `glb`: the address on a server, for clients
}
BODY_KEYS: Mapping[type[Body], tuple[str, ...]] = {  # the name of a kind of shape, and a key for each field
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
    """Return one table for each shape, in metres."""
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
    """Makes shapes from tables. Paths of mesh files are relative to the folder of the file that names them."""

    def shapes(self, data: object, joints: int, key: str = "shapes") -> tuple[LinkShape, ...]:
        """Return the shapes of a robot with the given number of joints. `key`: the key of the tables. Raises
        FileDamaged.
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
        """Return openings from [x, y, z] for a part that one joint slides, else from one table for each joint.

        The vector of a turn has the direction of the axis, and the angle as its length.
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
            scale = self.three(table.get("scale", (1.0, 1.0, 1.0)), f"{key}: scale", PLAIN)  # negative: mirrored
            if min(map(abs, scale)) < TINY:
                raise self.wrong(f"{key}: scale", "makes it flat", "give how many times as large as in its file it is")
            file = self.word(
                table["file"], f"{key}: file"
            )  # the absolute path in a user's file; unchanged in a robot's data
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
        """Return the sizes at both ends; a single number counts for both."""
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
    """The masses of a link and the drive of its joint; None for an unknown figure.

    Mass [kg], centre [m] and inertia about the centre [kg m2] are in the frame of the link. The inertia of the rotor
    [kg m2], the viscous [N m s/rad] and the Coulomb friction [N m] are those of the motor, which makes `gear` turns for
    one turn of the joint. `max_torque` is at the joint [N m]. For a joint that slides, torques at the joint are forces,
    and `gear` is in radians of the motor for each metre.
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
    """Return one table for each link, in metres."""
    rows = (one._asdict().items() for one in masses)
    return [{key: list(x) if isinstance(x, tuple) else x for key, x in row if x is not None} for row in rows]


class MassReader(DataReader, frozen=True):
    """Makes masses from tables."""

    def masses(self, data: object, joints: int) -> tuple[LinkMasses, ...]:
        """Return the masses of all links. Raises FileDamaged."""
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
