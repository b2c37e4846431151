"""What sensors see, by other means: signed distances, searched along beams, and separating axes. For tests."""

from __future__ import annotations

from collections.abc import Callable
from math import hypot

import numpy as np
from numpy.typing import NDArray

from vrs_cli.kinematics.transform import Transform, Vector
from vrs_cli.values.scene import Beam, BoxShape, CylinderShape, Proximity, Shape, SphereShape, Zone

Points = NDArray[np.float64]
GOLDEN = 0.3819660112501051


def rows(T: Transform) -> Points:
    return np.array(T).reshape(3, 4)


def outside(shape: Shape, p: Vector) -> float:
    """The signed distance of a point from a shape, in its frame."""
    x, y, z = p
    match shape:
        case BoxShape((a, b, c)):
            q = [abs(x) - 0.5 * a, abs(y) - 0.5 * b, abs(z) - 0.5 * c]
        case CylinderShape(radius, height):
            q = [hypot(x, y) - radius, abs(z) - 0.5 * height]
        case SphereShape(radius):
            return hypot(x, y, z) - radius
        case _:
            raise NotImplementedError
    return hypot(*(max(one, 0.0) for one in q)) + min(max(q), 0.0)


def least(f: Callable[[float], float]) -> float:
    """The least value of a convex function from 0 to 1."""
    low, high = 0.0, 1.0
    a, b = low + GOLDEN * (high - low), high - GOLDEN * (high - low)
    at_a, at_b = f(a), f(b)
    for _ in range(45):
        if at_a <= at_b:
            high, b, at_b = b, a, at_a
            a = low + GOLDEN * (high - low)
            at_a = f(a)
        else:
            low, a, at_a = a, b, at_b
            b = high - GOLDEN * (high - low)
            at_b = f(b)
    return min(at_a, at_b)


def gap(shape: Shape, T_world_body: Transform, region: Beam | Zone | Proximity) -> float:
    """Its sign tells whether a body is in a region."""
    M = rows(T_world_body)
    R, p = M[:, :3], M[:, 3]
    if isinstance(region, Zone):
        return _apart(shape, R, p, region)
    begin = np.array(region.begin if isinstance(region, Beam) else region.place)
    end = np.array(region.end) if isinstance(region, Beam) else begin + region.range * np.array(region.direction)
    ax, ay, az = map(float, R.T @ (begin - p))
    bx, by, bz = map(float, R.T @ (end - begin))
    return least(lambda s: outside(shape, (ax + s * bx, ay + s * by, az + s * bz))) - region.radius


def _apart(shape: Shape, R: Points, p: Points, zone: Zone) -> float:
    Z = rows(zone.T_world_zone)
    half = np.array(zone.size) / 2
    if isinstance(shape, SphereShape):
        x, y, z = map(float, Z[:, :3].T @ (p - Z[:, 3]))
        return outside(BoxShape(zone.size), (x, y, z)) - shape.radius
    assert isinstance(shape, BoxShape)
    mine = np.array(shape.size) / 2
    axes = [*R.T, *Z[:, :3].T, *(np.cross(a, b) for a in R.T for b in Z[:, :3].T)]
    found = -np.inf
    for axis in axes:
        size = float(np.linalg.norm(axis))
        if size > 1e-9:
            n = axis / size
            reach = float(np.abs(R.T @ n) @ mine + np.abs(Z[:, :3].T @ n) @ half)
            found = max(found, abs(float(n @ (p - Z[:, 3]))) - reach)
    return found
