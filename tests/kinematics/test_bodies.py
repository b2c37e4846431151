"""What built-in robots look like: joined in every pose, without gaps, and no two colours in one place."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence
from itertools import combinations
from random import Random
from typing import NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.examples import some
from tests.kinematics.surfaces import Mesh, Points, mesh_of, moved
from vrs_cli.kinematics.bodies import capsules, shapes_of
from vrs_cli.kinematics.link_data import LinkShape, MeshFile
from vrs_cli.kinematics.model import RobotModel, link_frames
from vrs_cli.kinematics.robot_file import load_robot, robot_names
from vrs_cli.kinematics.transform import compose, inverse

Shares = NDArray[np.float64]

NEAR = 2e-4  # [m] bodies that touch
NONE = 1e-12
STEPS = 100


def meets(one: Mesh, other: Mesh) -> bool:
    """Whether two convex bodies touch: the least difference of their points (P. Wolfe, Math. Programming 11, 1976)."""
    a, b = one.vertices, other.vertices
    if (a.min(axis=0) > b.max(axis=0) + NEAR).any() or (b.min(axis=0) > a.max(axis=0) + NEAR).any():
        return False
    points, shares = np.array([a[0] - b[0]]), np.ones(1)
    for _ in range(STEPS):
        v = shares @ points
        size, w = float(np.linalg.norm(v)), a[(a @ v).argmin()] - b[(b @ v).argmax()]
        if size < NEAR:
            return True
        if v @ w > NEAR * size:
            return False  # a plane parts them
        points, shares = nearest(np.vstack([points, w]), np.append(shares, 0.0))
    raise AssertionError("neither near nor parted")


def nearest(points: Points, shares: Shares) -> tuple[Points, Shares]:
    """Those of the points whose hull has the point that is nearest to the origin inside, and their shares in it."""
    while True:
        ones = np.ones((len(points), 1))
        rows = np.block([[points @ points.T, ones], [ones.T, np.zeros((1, 1))]])
        wanted = np.linalg.lstsq(rows, np.append(0.0 * shares, 1.0), rcond=None)[0][:-1]
        if wanted.min() > NONE:
            return points, wanted
        out = wanted <= NONE
        step = min(1.0, float((shares[out] / (shares[out] - wanted[out] + NONE)).min()))
        shares = shares + step * (wanted - shares)
        points, shares = points[shares > NONE], shares[shares > NONE]


class ShapeLook(NamedTuple):
    """A shape, and its surface in the frame of its link."""

    shape: LinkShape
    mesh: Mesh


def looks_of(shapes: Sequence[LinkShape]) -> tuple[ShapeLook, ...]:
    return tuple(ShapeLook(one, mesh_of(one.body)) for one in shapes if not isinstance(one.body, MeshFile))


def by_link(looks: Iterable[ShapeLook]) -> dict[int, list[Mesh]]:
    found: dict[int, list[Mesh]] = defaultdict(list)
    for shape, mesh in looks:
        found[shape.link].append(mesh)
    return found


def looks(model: RobotModel, kind: str) -> tuple[ShapeLook, ...]:
    return looks_of(shapes_of(model) if kind == "own" else capsules(model))


@pytest.mark.parametrize("kind", ["own", "capsules"])
@pytest.mark.parametrize("name", robot_names())
def test_links_are_joined_in_every_pose(name: str, kind: str) -> None:
    model, random = load_robot(name), Random(7)
    poses = [model.poses["ready"], model.poses["nest"], model.lower, model.upper]
    poses += [tuple(map(random.uniform, model.lower, model.upper)) for _ in range(some(20))]
    links = by_link(looks(model, kind))
    for q in poses:
        steps = [inverse(T) for T in link_frames(model, q)]
        for i in range(1, model.joint_count + 1):
            T = compose(steps[i - 1], inverse(steps[i]))  # of link i, seen from the link before
            assert any(meets(a, moved(b, T)) for a in links[i - 1] for b in links[i]), f"a gap at joint {i} at {q}"


@pytest.mark.parametrize("name", robot_names())
def test_bodies_of_a_link_are_one_piece(name: str) -> None:
    model = load_robot(name)
    for link, meshes in by_link(looks_of(shapes_of(model))).items():
        reached, left = [meshes[0]], meshes[1:]
        while near := [mesh for mesh in left if any(meets(mesh, other) for other in reached)]:
            reached += near
            left = [mesh for mesh in left if not any(mesh is other for other in near)]
        assert not left, f"link {link} is in pieces"


def outlines(mesh: Mesh) -> dict[tuple[float, ...], list[NDArray[np.float64]]]:
    """The triangles of a body by their planes: where its normal points, and how far from the origin [0.1 mm]."""
    found = defaultdict(list)
    triangles = mesh.vertices[mesh.faces]
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    away = np.round(np.einsum("ni,ni->n", normals, triangles[:, 0]), 4)
    for *plane, triangle in zip(*np.round(normals, 3).T.tolist(), away.tolist(), triangles, strict=True):
        found[*plane].append(triangle)
    return found


def middle_inside(triangles: NDArray[np.float64], others: NDArray[np.float64]) -> bool:
    """Whether the middle of a triangle is in one of others, (n, 3, 3) and (m, 3, 3)."""
    corners, middles = others[None], triangles.mean(axis=1)[:, None, None]
    edges = np.roll(corners, -1, axis=2) - corners
    normals = np.cross(edges[:, :, 0], edges[:, :, 1])[:, :, None]
    return bool(((np.cross(edges, middles - corners) * normals).sum(axis=3) > 0.0).all(axis=2).any())


@pytest.mark.parametrize("name", robot_names())
def test_no_two_colours_in_one_plane(name: str) -> None:
    """Where two faces lie in each other a screen flickers between their colours."""
    model = load_robot(name)
    frames = link_frames(model, model.poses["ready"])
    planes = [
        (look.shape.colour, outlines(moved(look.mesh, frames[look.shape.link]))) for look in looks_of(shapes_of(model))
    ]
    for (colour, one), (other_colour, other) in combinations(planes, 2):
        if colour != other_colour:
            for plane in one.keys() & other.keys():
                a, b = np.array(one[plane]), np.array(other[plane])
                assert not middle_inside(a, b), f"{colour} and {other_colour} at {a.mean(axis=(0, 1))}"
                assert not middle_inside(b, a), f"{colour} and {other_colour} at {b.mean(axis=(0, 1))}"


@pytest.mark.parametrize("name", robot_names())
def test_the_arm_ends_where_the_tool_is(name: str) -> None:
    """The last link without its hand ends at the flange, which is the tool where TOOL is not set."""
    model = load_robot(name)
    last = [
        look.mesh.vertices
        for look in looks_of(shapes_of(model))
        if look.shape.link == model.joint_count and not look.shape.opens and look.shape.colour == "steel"
    ]
    ends = [end for points in last for end in (points[:, 2].min(), points[:, 2].max())]
    assert min(map(abs, ends)) < 1e-9
