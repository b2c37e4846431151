"""What a URDF file says that its links look like: boxes, cylinders, spheres and files of meshes, each fixed in a body.

A body is what one joint of the arm moves: all links that hang on it by fixed joints, those that the joints of its hand
move, as they are while it is closed, and those that other joints move, as they are at zero. What cannot be understood
is left out, for an arm moves without looks. Format: http://wiki.ros.org/urdf/XML/link.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import islice
from pathlib import Path, PurePosixPath
from typing import NamedTuple
from urllib.parse import unquote, urlsplit
from xml.etree.ElementTree import Element

from vrs_cli.errors import FileDamaged
from vrs_cli.kinematics.data_reader import TINY
from vrs_cli.kinematics.shapes import MOST_SHAPES, Body, Box, Capsule, Cylinder, LinkShape, MeshFile, Opening
from vrs_cli.kinematics.transform import Transform, compose, position, translation
from vrs_cli.kinematics.urdf.document import named
from vrs_cli.kinematics.urdf.tree import Tree

USUAL_COLOUR = "grey"


class LinkPlace(NamedTuple):
    """Where a link is: in which body (0 is the base), T_body_link, and how it moves as the hand opens."""

    body: int
    T: Transform
    opens: tuple[Opening, ...] = ()


class Visuals:
    """Reads the looks of links; files of meshes are seen from `folder`."""

    def __init__(self, folder: Path, tree: Tree) -> None:
        self.folder, self.root = folder, tree.document.root
        self.numbers, self.origin = tree.document.numbers, tree.origin

    def shapes(self, places: Mapping[str, LinkPlace]) -> tuple[LinkShape, ...]:
        """Of the links that have a place."""
        colours = dict(self._colours())
        shapes = (
            self._shape(visual, place, colours)
            for link in self.root.findall("link")
            if (place := places.get(named(link))) is not None
            for visual in link.findall("visual")
        )
        return tuple(islice(filter(None, shapes), MOST_SHAPES))

    def _shape(self, visual: Element, place: LinkPlace, colours: Mapping[str, str]) -> LinkShape | None:
        try:
            body = self._body(visual, compose(place.T, self.origin(visual)))
        except FileDamaged:
            return None
        colour = self._colour(visual.find("material"), colours)
        return None if body is None else LinkShape(place.body, body, colour, place.opens)

    def _body(self, visual: Element, T: Transform) -> Body | None:
        for form in visual.iterfind("geometry/*"):
            if form.tag == "box":
                x, y, z = self._sizes(form, "size", 3)
                return Box((x, y, z), T)
            if form.tag == "cylinder":
                (r,), (high,) = self._sizes(form, "radius", 1), self._sizes(form, "length", 1)
                ends = (position(compose(T, translation(0.0, 0.0, z))) for z in (-0.5 * high, 0.5 * high))
                return Cylinder(next(ends), next(ends), (r, r))
            if form.tag == "sphere":
                (r,) = self._sizes(form, "radius", 1)
                return Capsule(position(T), position(T), (r, r))
            if form.tag == "mesh":
                x, y, z = self.numbers(visual, "mesh scale", form.get("scale", "1 1 1"), 3)
                if min(abs(x), abs(y), abs(z)) < TINY:
                    return None
                return MeshFile(str(found(self.folder, form.get("filename", ""))), T, (x, y, z))
        return None

    def _sizes(self, form: Element, key: str, count: int) -> tuple[float, ...]:
        values = self.numbers(form, f"{form.tag} {key}", form.get(key, ""), count)
        if min(values) < TINY:
            raise FileDamaged(f"{form.tag} {key} is {form.get(key)}", "give what is above zero")
        return values

    def _colours(self) -> Iterator[tuple[str, str]]:
        """Those that have a name, wherever they stand."""
        for material in self.root.iter("material"):
            if (said := self._said(material)) is not None:
                yield material.get("name", ""), said

    def _colour(self, material: Element | None, named: Mapping[str, str]) -> str:
        if material is None:
            return USUAL_COLOUR
        return self._said(material) or named.get(material.get("name", ""), USUAL_COLOUR)

    def _said(self, material: Element) -> str | None:
        colour = material.find("color")
        try:
            parts = () if colour is None else self.numbers(material, "color rgba", colour.get("rgba", ""), 4)[:3]
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
