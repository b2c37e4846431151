"""The shapes of links as closed surfaces of triangles, counter-clockwise seen from outside, as a page draws them."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from math import acos, ceil, cos, hypot, pi, sin
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vrs_cli.kinematics.link_data import Box, Capsule, Cylinder, Slab
from vrs_cli.kinematics.model import frame
from vrs_cli.kinematics.transform import Transform, Vector, along, any_normal, dot, translation, unit, vector_difference

Points = NDArray[np.float64]  # (N, 3) [m]
Faces = NDArray[np.uint32]  # (M, 3)

SIDES = 40  # of a full circle
BEVEL = 0.06  # of the smallest size of a body: how far its edges are broken
HALF = SIDES // 2


class Mesh(NamedTuple):
    """A surface of triangles: vertices (N, 3) [m], faces (M, 3) of rows of them."""

    vertices: Points
    faces: Faces


def mesh_of(body: Box | Cylinder | Capsule | Slab) -> Mesh:
    """The surface of a body, in the frame of its link."""
    match body:
        case Box():
            return moved(_box(body.size), body.pose)
        case Cylinder():
            return _cylinder(body)
        case Capsule():
            return _capsule(body)
        case Slab():
            return _slab(body)


def joined(meshes: Sequence[Mesh]) -> Mesh:
    """Join meshes."""
    offsets = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    faces = [mesh.faces + np.uint32(offset) for mesh, offset in zip(meshes, offsets, strict=False)]
    return Mesh(np.concatenate([mesh.vertices for mesh in meshes]), np.concatenate(faces))


def moved(mesh: Mesh, T: Transform) -> Mesh:
    rows = np.array(T).reshape(3, 4)
    return Mesh(mesh.vertices @ rows[:, :3].T + rows[:, 3], mesh.faces)


# --- round an axis -------------------------------------------------------------------------------------------------

Profile = Sequence[tuple[float, float]]  # radius and height of rings, from below upwards


def _cylinder(body: Cylinder) -> Mesh:
    length = _length(body.start, body.end)
    (low, high), bevel = body.radii, BEVEL * min(length, *body.radii)
    slope = (high - low) / length * bevel
    corners = [(0.0, 0.0), (low - bevel, 0.0), (low + slope, bevel)]
    corners += [(high - slope, length - bevel), (high - bevel, length), (0.0, length)]
    bands = [_turned(pair) for pair in pairwise(corners)]
    return moved(joined(bands), _upright(body.start, body.end))


def _capsule(body: Capsule) -> Mesh:
    """Two caps and the cone that touches both balls; the larger ball alone where it holds the other."""
    length, (low, high) = _length(body.start, body.end), body.radii
    if length <= abs(low - high):
        start, r = (body.start, low) if low >= high else (body.end, high)
        return moved(_turned(_arc(r, 0.0, pi, 0.0)), translation(*start))
    edge = acos(min(1.0, max(-1.0, (low - high) / length)))  # where the cone begins, seen from the top of each ball
    profile = [*_arc(low, edge, pi, 0.0), *_arc(high, 0.0, edge, length)]
    return moved(_turned(profile), _upright(body.start, body.end))


def _arc(r: float, first: float, last: float, height: float) -> list[tuple[float, float]]:
    """A meridian of a ball, between two angles from its top, from below upwards."""
    count = max(2, ceil((last - first) / pi * HALF))
    angles = [last + (first - last) * k / count for k in range(count + 1)]
    return [(0.0 if angle in (0.0, pi) else r * sin(angle), height + r * cos(angle)) for angle in angles]


def _turned(profile: Profile) -> Mesh:
    """The surface that a profile draws round the z axis; a ring of radius 0 is a point."""
    turn = np.linspace(0.0, 2 * pi, SIDES, endpoint=False)
    rings, starts, at = [], [], 0
    for r, z in profile:
        ring = np.stack([r * np.cos(turn), r * np.sin(turn), np.full(SIDES, z)], axis=1)
        rings.append(ring if r > 0.0 else ring[:1])
        starts.append(at)
        at += len(rings[-1])
    faces = [
        _band(start, len(low), above, len(high))
        for start, above, low, high in zip(starts, starts[1:], rings, rings[1:], strict=False)
    ]
    return Mesh(np.concatenate(rings), np.concatenate(faces))


def _band(low: int, low_count: int, high: int, high_count: int) -> Faces:
    """The triangles between two rings, of which one may be a point."""
    k = np.arange(max(low_count, high_count), dtype=np.uint32)
    after = (k + 1) % len(k)
    a, b = (low + (k if low_count > 1 else 0 * k), low + (after if low_count > 1 else 0 * k))
    c, d = (high + (after if high_count > 1 else 0 * k), high + (k if high_count > 1 else 0 * k))
    triangles = [np.stack([a, b, c], axis=1)] if low_count > 1 else []
    triangles += [np.stack([a, c, d], axis=1)] if high_count > 1 else []
    return np.concatenate(triangles).astype(np.uint32)


# --- with flat faces -----------------------------------------------------------------------------------------------


def _box(size: Vector) -> Mesh:
    """A box about the origin, its edges broken."""
    bevel = BEVEL * min(size)
    x, y, z = (0.5 * side for side in size)
    outlines = [
        _rectangle(x - inset, y - inset, h, bevel)
        for inset, h in ((bevel, -z), (0.0, bevel - z), (0.0, z - bevel), (bevel, z))
    ]
    sides = [_facets(low, high) for low, high in pairwise(outlines)]
    return joined([_lid(outlines[0][::-1]), *sides, _lid(outlines[-1])])


def _rectangle(x: float, y: float, z: float, bevel: float) -> Points:
    """A rectangle without its corners, at a height."""
    a, b = x - bevel, y - bevel
    corners = [(x, -b), (x, b), (a, y), (-a, y), (-x, b), (-x, -b), (-a, -y), (a, -y)]
    return np.array([(*corner, z) for corner in corners])


def _facets(low: Points, high: Points) -> Mesh:
    """Flat faces between two outlines of as many corners."""
    corners = np.stack([low, np.roll(low, -1, axis=0), np.roll(high, -1, axis=0), high], axis=1)
    first = np.arange(len(low), dtype=np.uint32) * 4
    faces = [np.stack([first, first + i, first + i + 1], axis=1) for i in (1, 2)]
    return Mesh(corners.reshape(-1, 3), np.concatenate(faces).astype(np.uint32))


def _lid(outline: Points) -> Mesh:
    """A convex flat face."""
    k = np.arange(1, len(outline) - 1, dtype=np.uint32)
    return Mesh(outline, np.stack([0 * k, k, k + 1], axis=1))


def _slab(body: Slab) -> Mesh:
    length = _length(body.start, body.end)
    bevel = BEVEL * min(*body.radii, *body.thickness)
    outlines = [
        _outline(body, length, inset, side, end)
        for inset, side, end in ((bevel, -1, 0.0), (0.0, -1, bevel), (0.0, 1, bevel), (bevel, 1, 0.0))
    ]
    bands = [  # each is round along its two outlines
        Mesh(np.concatenate([low, high]), _band(0, len(low), len(low), len(high))) for low, high in pairwise(outlines)
    ]
    x = unit(vector_difference(body.end, body.start))
    z = unit(along(body.across, x, -dot(body.across, x)))  # as near to `across` as can be
    return moved(joined([_lid(outlines[0][::-1]), *bands, _lid(outlines[-1])]), frame(x, z, body.start))


def _outline(body: Slab, length: float, inset: float, side: int, lower: float) -> Points:
    """The edge of the hull of two discs, from (0, 0) along x: on one side of it, `inset` and `lower` by so much."""
    (r1, r2), (t1, t2) = body.radii, body.thickness
    edge = acos((r1 - r2) / length)  # where the straight edges touch the discs
    back, front = np.linspace(edge, 2 * pi - edge, HALF + 1), np.linspace(-edge, edge, HALF + 1)
    x = np.concatenate([(r1 - inset) * np.cos(back), length + (r2 - inset) * np.cos(front)])
    y = np.concatenate([(r1 - inset) * np.sin(back), (r2 - inset) * np.sin(front)])
    run = length + r1 + r2
    thick = t1 + (t2 - t1) * (x + r1) / run
    return np.stack([x, y, side * (0.5 * thick - lower)], axis=1)


# --- frames --------------------------------------------------------------------------------------------------------


def _length(start: Vector, end: Vector) -> float:
    return hypot(*vector_difference(end, start))


def _upright(start: Vector, end: Vector) -> Transform:
    """z from start to end."""
    z = unit(vector_difference(end, start))
    return frame(any_normal(z), z, start)
