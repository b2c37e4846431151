"""Solids that stand for the shapes of links: nothing of a shape is outside of its solid, and little of it inside."""

from __future__ import annotations

from math import dist, hypot
from pathlib import Path

import numpy as np
import pytest
from msgspec import structs

from vrs_cli.contacts.solids import Solid, SolidForm, solid_of, solids_of_robot
from vrs_cli.kinematics.link_data import Capsule, Cylinder, LinkShape, MeshFile, Slab
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import Vector, translation

NEAR = 0.04  # of the largest radius: how far a hull is outside


def directions(count: int) -> list[np.ndarray]:
    rng = np.random.default_rng(1)
    rows = rng.normal(size=(count, 3))
    return list(rows / np.linalg.norm(rows, axis=1)[:, None])


def reach(solid: Solid, d: np.ndarray) -> float:
    """How far a hull reaches along a direction."""
    return float(max(np.array(solid.points) @ d))


@pytest.mark.parametrize("kind", [Capsule, Cylinder])
def test_cones_are_within_their_hulls(kind: type) -> None:
    start, end, radii = (0.1, 0.0, 0.2), (0.3, 0.2, 0.1), (0.08, 0.03)
    solid = solid_of(kind(start, end, radii))
    axis = np.subtract(end, start) / dist(start, end)
    for d in directions(200):
        across = hypot(*(d - axis * (d @ axis))) if kind is Cylinder else 1.0
        true = max(np.dot(place, d) + r * across for place, r in zip((start, end), radii, strict=True))
        assert true - 0.02 * max(radii) <= reach(solid, d) <= true + NEAR * max(radii)


def test_slabs_are_within_their_hulls() -> None:
    solid = solid_of(Slab((0.0, 0.0, 0.0), (0.4, 0.0, 0.0), (0.0, 0.0, 1.0), (0.1, 0.05), (0.06, 0.06)))
    for d in directions(200):
        flat = hypot(d[0], d[1])
        true = max(x * d[0] + r * flat for x, r in ((0.0, 0.1), (0.4, 0.05))) + 0.03 * abs(d[2])
        assert abs(reach(solid, d) - true) <= NEAR * 0.1


def test_round_shapes_stand_for_themselves() -> None:
    same: Vector = (0.1, 0.2, 0.3)
    assert solid_of(Capsule(same, same, (0.05, 0.05))) == Solid(SolidForm.BALL, (0.05, 0.0, 0.0), translation(*same))
    upright = solid_of(Cylinder((0.0, 0.0, 0.0), (0.0, 0.0, 0.2), (0.05, 0.05)))
    assert upright.form is SolidForm.CYLINDER
    assert upright.sizes == (0.05, 0.1, 0.0)
    assert upright.pose.pz == 0.1


def test_a_mesh_stands_as_its_points_or_the_link_as_capsules(tmp_path: Path) -> None:
    pytest.importorskip("trimesh")
    path = tmp_path / "wedge.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n", encoding="utf-8")
    robot = load_robot("puma560")

    def with_mesh(file: Path) -> RobotModel:
        shape = LinkShape(1, MeshFile(str(file), translation(0.0, 0.0, 0.1), (0.001, 0.001, 0.001)))
        return structs.replace(robot, shapes=(shape,))

    (read,) = solids_of_robot(with_mesh(path))
    assert read.link == 1
    assert sorted(read.solids[0].points)[-1] == pytest.approx((0.001, 0.0, 0.0))
    instead = solids_of_robot(with_mesh(tmp_path / "none.stl"))
    assert {one.link for one in instead} == {1}
    assert [one.form for one in instead[0].solids] == [SolidForm.CYLINDER]


def test_collision_shapes_stand_for_the_links_where_there_are_any() -> None:
    model = load_robot("puma560")
    ball = LinkShape(1, Capsule((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.1, 0.1)))
    (only,) = solids_of_robot(structs.replace(model, collision=(ball,)))
    assert only.link == 1
    assert only.solids == (Solid(SolidForm.BALL, (0.1, 0.0, 0.0)),)
