"""Represent the links of an arm and the things in a scene as convex solids, for the search for contacts. A link has the
solids of its shapes (`RobotModel.collision`, otherwise `kinematics.bodies`). Cylinders and capsules are used unchanged.
A box becomes the hull of its corners, because MuJoCo's test of two boxes misses some that are near. A cone, a slab and
a capsule with two radii become the convex hull of points that enclose them, and a mesh file its convex hull. A link
whose mesh cannot be read gets capsules along its length."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from enum import Enum
from itertools import product
from math import acos, cos, hypot, pi, sin
from pathlib import Path
from typing import NamedTuple

import numpy as np

from vrs_cli.errors import VrsError
from vrs_cli.files.mesh_file import load_mesh, metres_of
from vrs_cli.kinematics import transform
from vrs_cli.kinematics.bodies import capsules, shapes_of
from vrs_cli.kinematics.link_data import Body, Box, Capsule, Cylinder, LinkShape, MeshFile, Opening, Slab
from vrs_cli.kinematics.model import RobotModel, frame
from vrs_cli.values.scene import BoxShape, CylinderShape, MeshShape, Shape, SphereShape

AROUND = 24  # number of points that approximate a circle in a hull
OUTSIDE = 1.0 / cos(pi / AROUND)  # circumradius of the regular polygon divided by the radius of the circle inside it
SHORT = 1e-9  # [m] lengths below this count as zero


class SolidForm(Enum):
    """The form of a solid. `sizes` of a solid: the radius, and half the length along z [m]; a hull has no sizes."""

    BALL = "ball"
    CAPSULE = "capsule"
    CYLINDER = "cylinder"
    HULL = "hull"


class Solid(NamedTuple):
    """A convex solid, centred at the frame `pose`. A hull has `points` in this frame [m] instead of `sizes` [m]."""

    form: SolidForm
    sizes: transform.Vector = (0.0, 0.0, 0.0)
    pose: transform.Transform = transform.IDENTITY
    points: tuple[transform.Vector, ...] = ()


class LinkSolids(NamedTuple):
    """Solids of a link that move together. `opens`: their motion as the hand opens, if they are part of a finger; empty
    if they are fixed to the link."""

    link: int
    opens: tuple[Opening, ...]
    solids: tuple[Solid, ...]


def solids_of_robot(model: RobotModel) -> tuple[LinkSolids, ...]:
    """Return the solids of all links, the base (0) first."""
    found, lost = list[tuple[LinkShape, Solid]](), set[int]()
    for shape in model.collision or shapes_of(model):
        try:
            found.append((shape, solid_of(shape.body)))
        except VrsError:  # the mesh cannot be read
            lost.add(shape.link)
    found = [row for row in found if row[0].link not in lost]
    found += [(shape, solid_of(shape.body)) for shape in (capsules(model) if lost else ()) if shape.link in lost]
    groups: dict[tuple[int, tuple[Opening, ...]], list[Solid]] = {}
    for shape, solid in sorted(found, key=lambda row: row[0].link):
        groups.setdefault((shape.link, shape.opens), []).append(solid)
    return tuple(LinkSolids(*key, tuple(solids)) for key, solids in groups.items())


def solids_of_shape(shape: Shape) -> tuple[Solid, ...]:
    """Return the solids of a part or a fixture, in its own frame."""
    match shape:
        case BoxShape(size):
            return (_box(size),)
        case CylinderShape(radius, height):
            return (Solid(SolidForm.CYLINDER, (radius, 0.5 * height, 0.0)),)
        case SphereShape(radius):
            return (Solid(SolidForm.BALL, (radius, 0.0, 0.0)),)
        case MeshShape(pieces):
            return tuple(Solid(SolidForm.HULL, points=points) for points in pieces)


def solid_of(body: Body) -> Solid:
    """Return the solid for a body of a link, in the frame of the link. Raises FileError or FileDamaged for a mesh that
    cannot be read."""
    match body:
        case Box(size, pose):
            return _box(size, pose)
        case Capsule(start, end, (r, s)) if r == s:
            if hypot(*transform.vector_difference(end, start)) < SHORT:
                return Solid(SolidForm.BALL, (r, 0.0, 0.0), transform.translation(*start))
            return _upright(SolidForm.CAPSULE, start, end, r)
        case Cylinder(start, end, (r, s)) if r == s:
            return _upright(SolidForm.CYLINDER, start, end, r)
        case Capsule(start, end, (r, s)):
            return _hull(start, end, (*_cap(r, -1.0), *_cap(s, 1.0, hypot(*transform.vector_difference(end, start)))))
        case Cylinder(start, end, (r, s)):
            return _hull(start, end, (*_circle(r, 0.0), *_circle(s, hypot(*transform.vector_difference(end, start)))))
        case Slab():
            return Solid(SolidForm.HULL, points=tuple(_slab(body)))
        case MeshFile(path, pose, scale):
            mesh = load_mesh(Path(path))
            points = np.unique(mesh.vertices * (metres_of(mesh.units) * np.array(scale)), axis=0)
            return Solid(SolidForm.HULL, pose=pose, points=tuple(map(tuple, points.tolist())))


def _box(size: transform.Vector, pose: transform.Transform = transform.IDENTITY) -> Solid:
    x, y, z = transform.scaled_vector(size, 0.5)
    return Solid(SolidForm.HULL, pose=pose, points=tuple(product((-x, x), (-y, y), (-z, z))))


def _upright(form: SolidForm, start: transform.Vector, end: transform.Vector, radius: float) -> Solid:
    middle, way = (
        transform.scaled_vector((start[0] + end[0], start[1] + end[1], start[2] + end[2]), 0.5),
        transform.vector_difference(end, start),
    )
    return Solid(form, (radius, 0.5 * hypot(*way), 0.0), _along_z(middle, way))


def _along_z(place: transform.Vector, way: transform.Vector) -> transform.Transform:
    """Return a frame at a position, with its z axis along a direction."""
    z = transform.unit(way)
    return frame(transform.any_normal(z), z, place)


def _hull(start: transform.Vector, end: transform.Vector, points: Sequence[transform.Vector]) -> Solid:
    """Return the hull of points given in a frame with its origin at `start` and its z axis towards `end`."""
    T = _along_z(start, transform.vector_difference(end, start))
    return Solid(SolidForm.HULL, points=tuple(transform.moved_point(T, point) for point in points))


def _circle(radius: float, height: float) -> Iterator[transform.Vector]:
    """Yield the corners of a regular polygon that encloses a circle."""
    for k in range(AROUND):
        angle = 2.0 * pi * k / AROUND
        yield OUTSIDE * radius * cos(angle), OUTSIDE * radius * sin(angle), height


def _cap(radius: float, side: float, height: float = 0.0) -> Iterator[transform.Vector]:
    """Yield points that enclose the lower half (side -1) or the upper half (side 1) of a ball, whose centre is at
    `height` on the z axis."""
    yield 0.0, 0.0, height + side * radius
    for k in range(4):
        latitude = 0.125 * pi * k
        yield from _circle(radius * cos(latitude), height + side * radius * sin(latitude))


def _slab(body: Slab) -> Iterator[transform.Vector]:
    """Yield the corners of the hull of a slab's two discs, without the bevels that the page draws."""
    way, (r1, r2), (t1, t2) = transform.vector_difference(body.end, body.start), body.radii, body.thickness
    far, x = transform.length(way), transform.unit(way)
    z = transform.unit(transform.along(body.across, x, -transform.dot(body.across, x)))
    T, edge = frame(x, z, body.start), acos((r1 - r2) / far)  # angle at which the straight edges touch the discs
    for centre, radius, low, high in ((0.0, r1, edge, 2.0 * pi - edge), (far, r2, -edge, edge)):
        for k in range(AROUND // 2 + 1):
            angle = low + (high - low) * k / (AROUND // 2)
            u, v = centre + radius * cos(angle), radius * sin(angle)
            half = 0.5 * (t1 + (t2 - t1) * (u + r1) / (far + r1 + r2))
            for side in (-half, half):
                yield transform.moved_point(T, (u, v, side))
