"""Read the shapes, masses and joint drives from a URDF file. Links that are fixed to each other form one rigid body;
each joint of the arm moves one body.

The mass of a body is the sum over its links, including those of the closed hand. An inertia is unknown if the file does
not give it, or gives zeros. The drive of a joint has the effort of the element `limit`, and the damping and friction of
the element `dynamics`, if they are above zero. Shapes that cannot be read are left out, because an arm can move without
them. Format: http://wiki.ros.org/urdf/XML/link.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path, PurePosixPath
from typing import Any, NamedTuple
from urllib.parse import unquote, urlsplit
from xml.etree.ElementTree import Element

from vrs_cli.errors import FileDamaged
from vrs_cli.kinematics import link_data, transform
from vrs_cli.kinematics.data_reader import TINY
from vrs_cli.kinematics.transform import Transform, Vector
from vrs_cli.kinematics.urdf.tree import HUGE, Joint, Tree, name_of

# attributes of the element `inertia`, in the order of `Inertia`
INERTIA_KEYS = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
ZERO: link_data.Inertia = (0.0,) * 6
USUAL_COLOUR = "grey"


class LinkPlace(NamedTuple):
    """The position of a link: the number of the body that contains it (0 is the base), T_body_link, and its motions
    while the hand opens.
    """

    body: int
    T: Transform
    opens: tuple[link_data.Opening, ...] = ()


class _Solid(NamedTuple):
    """A mass [kg], its centre [m] and its inertia about this centre [kg m2], in the frame of a body."""

    mass: float
    centre: Vector
    inertia: link_data.Inertia


def masses_of_bodies(
    tree: Tree, joints: Sequence[Joint], places: Mapping[str, tuple[int, Transform]]
) -> tuple[link_data.LinkMasses, ...]:
    """Return the mass of each body that a joint of an arm moves, and the drive of this joint.

    `places`: for each link the number of the body that contains it (0 is the base), and T_body_link. The mass of a body
    is unknown if none of its links has a mass, or a link has an invalid value.
    """
    solids: list[list[_Solid | None]] = [[] for _ in range(len(joints) + 1)]
    for link in tree.robot.findall("link"):
        place, inertial = places.get(name_of(link)), link.find("inertial")
        if place is not None and inertial is not None:
            body, T = place
            solids[body].append(_solid(tree, inertial, T))
    return tuple(
        (_together(row) or link_data.LinkMasses())._replace(**_drive(tree, joint))
        for row, joint in zip(solids[1:], joints, strict=True)
    )


def complete(
    masses: Sequence[link_data.LinkMasses], own: Sequence[link_data.LinkMasses]
) -> tuple[link_data.LinkMasses, ...]:
    """Return the masses with the values in `own` (one entry for each link) in place of those of the URDF file. Return
    no masses if none is known.
    """
    said = ({key: x for key, x in one._asdict().items() if x is not None} for one in own or masses)
    found = tuple(link._replace(**row) for link, row in zip(masses, said, strict=True))
    return found if any(link.mass is not None for link in found) else ()


def _solid(tree: Tree, inertial: Element, T: Transform) -> _Solid | None:
    """Return the mass of a link in the frame of its body; None if one of its values is invalid. `T`: T_body_link."""
    found, inertia = inertial.find("mass"), inertial.find("inertia")
    with suppress(FileDamaged):
        placed = transform.compose(T, tree.origin(inertial))
        (mass,) = tree.numbers(inertial, "mass", "" if found is None else found.get("value", ""), 1)
        if mass < 0.0:
            return None
        values: Mapping[str, str] = {} if inertia is None else inertia.attrib
        rows = [tree.numbers(inertial, f"inertia {key}", values.get(key, "0"), 1)[0] for key in INERTIA_KEYS]
        xx, yy, zz, xy, xz, yz = rows
        half = [transform.rotate(placed, column) for column in ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))]
        # R I R^T, computed row by row from R I
        turned = (transform.rotate(placed, row) for row in zip(*half, strict=True))
        (xx, xy, xz), (_, yy, yz), (_, _, zz) = turned
        return _Solid(mass, transform.position(placed), (xx, yy, zz, xy, xz, yz))
    return None


def _together(solids: Sequence[_Solid | None]) -> link_data.LinkMasses | None:
    """Add up all solids of a body; return None if one of their masses is unknown, or if the body has no mass."""
    known = [one for one in solids if one is not None]
    if not known or len(known) < len(solids):
        return None
    mass = sum(one.mass for one in known)
    if not mass > 0.0:
        return link_data.LinkMasses(mass=0.0, centre=known[0].centre, inertia=known[0].inertia)
    centre: Vector = (0.0, 0.0, 0.0)
    for one in known:
        centre = transform.vector_sum(centre, transform.scaled_vector(one.centre, one.mass / mass))
    total = ZERO
    for one in known:
        x, y, z = transform.vector_difference(one.centre, centre)
        moved = (y * y + z * z, x * x + z * z, x * x + y * y, -x * y, -x * z, -y * z)
        xx, yy, zz, xy, xz, yz = (a + b + one.mass * c for a, b, c in zip(total, one.inertia, moved, strict=True))
        total = xx, yy, zz, xy, xz, yz
    return link_data.LinkMasses(mass=mass, centre=centre, inertia=total if any(total) else None)


def _drive(tree: Tree, joint: Joint) -> dict[str, Any]:
    """Return the maximum torque and the friction of a joint, without values that the file does not contain."""
    said = dict[str, Any]()
    for key, tag, attribute in (
        ("max_torque", "limit", "effort"),
        ("viscous", "dynamics", "damping"),
        ("coulomb", "dynamics", "friction"),
    ):
        element = joint.element.find(tag)
        with suppress(FileDamaged):
            (value,) = tree.numbers(
                joint.element, attribute, "0" if element is None else element.get(attribute, "0"), 1
            )
            if 0.0 < value < HUGE:
                said[key] = value
    return said


# --- shapes --------------------------------------------------------------------------------------------------------


def link_shapes(
    folder: Path, tree: Tree, places: Mapping[str, LinkPlace], *, collision: bool = False
) -> tuple[link_data.LinkShape, ...]:
    """Return the visible shapes of the links in `places`. Paths of mesh files are relative to `folder`.

    `collision`: return the shapes for contact detection instead.
    """
    said = ((material.get("name", ""), _colour(tree, material)) for material in tree.robot.iter("material"))
    # colours may be defined at any position in the file
    colours = {name: colour for name, colour in said if colour is not None}
    found, other = list[link_data.LinkShape](), not collision
    for link in tree.robot.findall("link"):
        for tag in ("collision", "visual") if collision else ("visual",):
            place = places.get(name_of(link))
            rows = [] if place is None else [_shape(folder, tree, one, place, colours) for one in link.findall(tag)]
            if shapes := [shape for shape in rows if shape is not None]:
                found += shapes
                other = other or tag == "collision"
                break
    return tuple(found[: link_data.MAX_SHAPES]) if other else ()


def _shape(
    folder: Path, tree: Tree, visual: Element, place: LinkPlace, colours: Mapping[str, str]
) -> link_data.LinkShape | None:
    try:
        body = _body(folder, tree, visual, transform.compose(place.T, tree.origin(visual)))
    except FileDamaged:
        return None
    material = visual.find("material")
    own = None if material is None else _colour(tree, material) or colours.get(material.get("name", ""))
    return None if body is None else link_data.LinkShape(place.body, body, own or USUAL_COLOUR, place.opens)


def _body(folder: Path, tree: Tree, visual: Element, T: Transform) -> link_data.Body | None:
    for form in visual.iterfind("geometry/*"):
        if form.tag == "box":
            x, y, z = _sizes(tree, form, "size", 3)
            return link_data.Box((x, y, z), T)
        if form.tag == "cylinder":
            (r,), (high,) = _sizes(tree, form, "radius", 1), _sizes(tree, form, "length", 1)
            ends = (
                transform.position(transform.compose(T, transform.translation(0.0, 0.0, z)))
                for z in (-0.5 * high, 0.5 * high)
            )
            return link_data.Cylinder(next(ends), next(ends), (r, r))
        if form.tag == "sphere":
            (r,) = _sizes(tree, form, "radius", 1)
            return link_data.Capsule(transform.position(T), transform.position(T), (r, r))
        if form.tag == "mesh":
            x, y, z = tree.numbers(visual, "mesh scale", form.get("scale", "1 1 1"), 3)
            if min(abs(x), abs(y), abs(z)) < TINY:
                return None
            return link_data.MeshFile(str(mesh_path(folder, form.get("filename", ""))), T, (x, y, z))
    return None


def _sizes(tree: Tree, form: Element, key: str, count: int) -> tuple[float, ...]:
    values = tree.numbers(form, f"{form.tag} {key}", form.get(key, ""), count)
    if min(values) < TINY:
        raise FileDamaged(f"{form.tag} {key} is {form.get(key)}", "give what is above zero")
    return values


def _colour(tree: Tree, material: Element) -> str | None:
    colour = material.find("color")
    try:
        parts = () if colour is None else tree.numbers(material, "color rgba", colour.get("rgba", ""), 4)[:3]
    except FileDamaged:
        return None
    return "#" + "".join(f"{round(255 * min(max(part, 0.0), 1.0)):02x}" for part in parts) if parts else None


def mesh_path(folder: Path, name: str) -> Path:
    """Return the path of a mesh file: relative to the URDF file's folder, or in a package in a folder above it. If the
    file is not found, return the most likely path.
    """
    try:
        address = urlsplit(name)
    except ValueError:
        return folder / name
    if address.scheme == "file":
        return Path(unquote(address.path))
    if address.scheme != "package":
        return folder / name
    inside = PurePosixPath(address.netloc + unquote(address.path))
    above: Sequence[Path] = (folder, *folder.parents)
    tries = [base / part for base in above for part in (inside, PurePosixPath(*inside.parts[1:]))]
    return next((path for path in tries if path.is_file()), folder / inside)
