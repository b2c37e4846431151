"""Bodies as triangles: closed, with their outsides out, and as large as their values say."""

from __future__ import annotations

from collections import Counter
from math import pi

import numpy as np
import pytest

from vrs_cli.kinematics.shapes import Body, Box, Capsule, Cylinder, Slab
from vrs_cli.kinematics.transform import Vector, compose, rotation_x, rotation_z, translation
from vrs_cli.view3d.meshes import Mesh, Points, mesh_of

SLAB = Slab((0.0, 0.0, 0.0), (0.4, 0.0, 0.0), (0.0, 0.0, 1.0), (0.1, 0.06), (0.09, 0.05))
BODIES: tuple[Body, ...] = (
    Box((0.3, 0.2, 0.1)),
    Box((0.03, 0.2, 0.1), compose(translation(1.0, 2.0, 3.0), compose(rotation_x(0.3), rotation_z(1.0)))),
    Cylinder((0.0, 0.0, 0.0), (0.0, 0.0, 0.5), (0.1, 0.1)),
    Cylinder((0.1, 0.2, 0.3), (0.5, -0.2, 0.1), (0.12, 0.07)),
    Cylinder((0.0, 0.0, 0.0), (0.01, 0.0, 0.0), (0.1, 0.2)),
    Capsule((0.0, 0.0, 0.0), (0.0, 0.0, -0.5), (0.1, 0.1)),
    Capsule((0.0, 0.0, 0.0), (0.3, 0.2, 0.1), (0.1, 0.05)),
    Capsule((0.0, 0.0, 0.0), (0.3, 0.2, 0.1), (0.05, 0.1)),
    Capsule((0.3, 0.2, 0.1), (0.3, 0.2, 0.1), (0.1, 0.1)),
    Capsule((0.0, 0.0, 0.0), (0.01, 0.0, 0.0), (0.05, 0.1)),
    SLAB,
    SLAB._replace(across=(0.3, 0.1, -1.0)),
    SLAB._replace(radii=(0.06, 0.1), thickness=(0.05, 0.05), end=(0.1, 0.3, 0.2)),
)


def corners(mesh: Mesh) -> Points:
    """The corners of the triangles: (M, 3, 3)."""
    return mesh.vertices[mesh.faces]


def volume(mesh: Mesh) -> float:
    """By the divergence theorem; below zero where the inside is out."""
    a, b, c = np.moveaxis(corners(mesh), 1, 0)
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)


def assert_closed(mesh: Mesh) -> None:
    """Each edge is there once in each direction: no hole, no wall between, all faces turned alike."""
    _, place = np.unique(np.round(mesh.vertices, 9), axis=0, return_inverse=True)
    faces = place.reshape(-1)[mesh.faces]
    edges = Counter((int(face[i]), int(face[(i + 1) % 3])) for face in faces for i in range(3))
    assert max(edges.values()) == 1
    assert all((b, a) in edges for a, b in edges)


@pytest.mark.parametrize("body", BODIES)
def test_closed_and_outside_out(body: Body) -> None:
    mesh = mesh_of(body)
    assert_closed(mesh)
    assert volume(mesh) > 0.0
    a, b, c = np.moveaxis(corners(mesh), 1, 0)
    assert np.linalg.norm(np.cross(b - a, c - a), axis=1).min() > 0.0, "no triangle without area"
    centre = mesh.vertices.mean(axis=0)
    outward = np.einsum("ij,ij->i", np.cross(b - a, c - a), (a + b + c) / 3 - centre)
    assert (outward > 0.0).all(), "all bodies are convex"


@pytest.mark.parametrize("end", [(0.0, 0.0, 0.5), (0.3, -0.2, 0.1)])
def test_bodies_are_as_large_as_they_say(end: Vector) -> None:
    high = float(np.linalg.norm(end))
    for body, expected in (
        (Cylinder((0.0, 0.0, 0.0), end, (0.1, 0.1)), pi * 0.1**2 * high),
        (Capsule((0.0, 0.0, 0.0), end, (0.1, 0.1)), pi * 0.1**2 * high + 4 / 3 * pi * 0.1**3),
        (Slab((0.0, 0.0, 0.0), end, (0.0, 1.0, 0.0), (0.1, 0.1), (0.05, 0.05)), (pi * 0.1**2 + 0.2 * high) * 0.05),
    ):
        assert volume(mesh_of(body)) == pytest.approx(expected, rel=0.02)


def test_the_same_body_has_the_same_mesh() -> None:
    for body in BODIES:
        one, other = mesh_of(body), mesh_of(body)
        assert one.vertices.tobytes() == other.vertices.tobytes()
        assert one.faces.tobytes() == other.faces.tobytes()
