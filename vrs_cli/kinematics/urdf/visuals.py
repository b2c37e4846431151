"""What a URDF file says that its links look like: boxes, cylinders, spheres and files of meshes, each fixed in a body.

A body is what one joint of the arm moves: all links that hang on it by fixed joints, those that the joints of its hand
move, as they are while it is closed, and those that other joints move, as they are at zero. What cannot be understood
is left out, for an arm moves without looks. Format: http://wiki.ros.org/urdf/XML/link.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import islice
from pathlib import Path, PurePosixPath
from typing import NamedTuple
from urllib.parse import unquote, urlsplit
from xml.etree.ElementTree import Element

from vrs_cli.errors import FileDamaged
from vrs_cli.kinematics.data_reader import TINY
from vrs_cli.kinematics.shapes import MOST_SHAPES, Body, Box, Capsule, Cylinder, LinkShape, MeshFile, Opening
from vrs_cli.kinematics.transform import Transform, compose, position, translation
from vrs_cli.kinematics.urdf.tree import Tree, named

USUAL_COLOUR = "grey"


class LinkPlace(NamedTuple):
    """Where a link is: in which body (0 is the base), T_body_link, and how it moves as the hand opens."""

    body: int
    T: Transform
    opens: tuple[Opening, ...] = ()


def link_shapes(folder: Path, tree: Tree, places: Mapping[str, LinkPlace]) -> tuple[LinkShape, ...]:
    """The looks of the links that have a place; files of meshes are seen from `folder`."""
    said = ((material.get("name", ""), _colour(tree, material)) for material in tree.robot.iter("material"))
    colours = {name: colour for name, colour in said if colour is not None}  # wherever they stand
    shapes = (
        _shape(folder, tree, visual, place, colours)
        for link in tree.robot.findall("link")
        if (place := places.get(named(link))) is not None
        for visual in link.findall("visual")
    )
    return tuple(islice(filter(None, shapes), MOST_SHAPES))


def _shape(folder: Path, tree: Tree, visual: Element, place: LinkPlace, colours: Mapping[str, str]) -> LinkShape | None:
    try:
        body = _body(folder, tree, visual, compose(place.T, tree.origin(visual)))
    except FileDamaged:
        return None
    material = visual.find("material")
    own = None if material is None else _colour(tree, material) or colours.get(material.get("name", ""))
    return None if body is None else LinkShape(place.body, body, own or USUAL_COLOUR, place.opens)


def _body(folder: Path, tree: Tree, visual: Element, T: Transform) -> Body | None:
    for form in visual.iterfind("geometry/*"):
        if form.tag == "box":
            x, y, z = _sizes(tree, form, "size", 3)
            return Box((x, y, z), T)
        if form.tag == "cylinder":
            (r,), (high,) = _sizes(tree, form, "radius", 1), _sizes(tree, form, "length", 1)
            ends = (position(compose(T, translation(0.0, 0.0, z))) for z in (-0.5 * high, 0.5 * high))
            return Cylinder(next(ends), next(ends), (r, r))
        if form.tag == "sphere":
            (r,) = _sizes(tree, form, "radius", 1)
            return Capsule(position(T), position(T), (r, r))
        if form.tag == "mesh":
            x, y, z = tree.numbers(visual, "mesh scale", form.get("scale", "1 1 1"), 3)
            if min(abs(x), abs(y), abs(z)) < TINY:
                return None
            return MeshFile(str(found(folder, form.get("filename", ""))), T, (x, y, z))
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


def found(folder: Path, name: str) -> Path:
    """The file of a mesh: beside the URDF file, or of a package in a folder above it. Where none is, the likeliest."""
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
