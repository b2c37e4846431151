"""Vectors of three, as tuples of floats."""

from __future__ import annotations

from math import sqrt

from vrs_cli.kinematics.transform import Transform, Vector


def added(a: Vector, b: Vector) -> Vector:
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


def subtracted(a: Vector, b: Vector) -> Vector:
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def scaled(a: Vector, factor: float) -> Vector:
    return (a[0] * factor, a[1] * factor, a[2] * factor)


def cross(a: Vector, b: Vector) -> Vector:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def length(a: Vector) -> float:
    return sqrt(dot(a, a))


def unit(a: Vector) -> Vector:
    size = length(a)
    return (a[0] / size, a[1] / size, a[2] / size)


def along(point: Vector, direction: Vector, way: float) -> Vector:
    return (point[0] + way * direction[0], point[1] + way * direction[1], point[2] + way * direction[2])


def any_normal(z: Vector) -> Vector:
    """A unit vector square to z: X where it is, or as near to X as can be."""
    x: Vector = (1.0, 0.0, 0.0) if abs(z[0]) < 0.9 else (0.0, 1.0, 0.0)
    return unit(along(x, z, -dot(x, z)))


def rotated_back(T: Transform, a: Vector) -> Vector:
    """R^T a, with the rotation of T."""
    x, y, z = a
    return (
        T.nx * x + T.ny * y + T.nz * z,
        T.sx * x + T.sy * y + T.sz * z,
        T.ax * x + T.ay * y + T.az * z,
    )
