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


def rotated_back(T: Transform, a: Vector) -> Vector:
    """R^T a, with the rotation of T."""
    x, y, z = a
    return (
        T.nx * x + T.ny * y + T.nz * z,
        T.sx * x + T.sy * y + T.sz * z,
        T.ax * x + T.ay * y + T.az * z,
    )
