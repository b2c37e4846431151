"""Convex solids: distances beside those of another method, widths, drops."""

from __future__ import annotations

import random
from math import inf, pi

import pytest

from tests.world.oracle import gap
from vrs_cli.kinematics.transform import (
    Transform,
    compose,
    dot,
    from_oat,
    inverse,
    moved_point,
    rotation_z,
    translation,
)
from vrs_cli.values.scene import Beam, BoxShape, CylinderShape, MeshShape, Shape, SphereShape, Zone
from vrs_cli.world.sensing import Region, clearance
from vrs_cli.world.solids import bounds, drop, point_apart, point_drop, separation, solids_of, spread


def a_pose(R: random.Random, far: float) -> Transform:
    x, y, z = (R.uniform(-far, far) for _ in range(3))
    o, a, t = (R.uniform(-pi, pi) for _ in range(3))
    return from_oat(x, y, z, o, a, t)


def a_shape(R: random.Random, kinds: int = 3) -> Shape:
    kind = R.randrange(kinds)
    if kind == 0:
        x, y, z = (R.uniform(0.01, 0.1) for _ in range(3))
        return BoxShape((x, y, z))
    if kind == 1:
        return SphereShape(R.uniform(0.01, 0.05))
    if kind == 2:
        return CylinderShape(R.uniform(0.01, 0.05), R.uniform(0.01, 0.1))
    return MeshShape((tuple((R.gauss(0, 0.03), R.gauss(0, 0.03), R.gauss(0, 0.03)) for _ in range(12)),), "")


def test_the_distance_is_that_between_two_parallel_planes_that_separate() -> None:
    R, touching = random.Random(1), 0
    for _ in range(400):
        (a,), (b,), T = solids_of(a_shape(R, 4)), solids_of(a_shape(R, 4)), a_pose(R, 0.15)
        found = separation(a, T, b)
        back = separation(b, inverse(T), a)
        assert back.distance == pytest.approx(found.distance, abs=1e-9)
        if found.distance <= 1e-9:
            touching += 1
            continue
        n = found.toward
        turned = (
            T.nx * n[0] + T.ny * n[1] + T.nz * n[2],
            T.sx * n[0] + T.sy * n[1] + T.sz * n[2],
            T.ax * n[0] + T.ay * n[1] + T.az * n[2],
        )
        behind = dot(n, moved_point(T, a.support(turned))) + a.radius
        ahead = dot(n, b.support((-n[0], -n[1], -n[2]))) - b.radius
        assert ahead - behind == pytest.approx(found.distance, abs=1e-9), "no farther, and no nearer"
    assert 10 < touching < 100


def test_clearances_of_sensors_have_the_sign_of_another_method() -> None:
    R, inside = random.Random(2), 0
    for count in range(300):
        T, zone = a_pose(R, 0.1), count % 2
        shape = a_shape(R, 2 if zone else 3)
        ends = [(R.uniform(-0.2, 0.2), R.uniform(-0.2, 0.2), R.uniform(-0.2, 0.2)) for _ in range(2)]
        x, y, z = (R.uniform(0.01, 0.2) for _ in range(3))
        region = Zone(a_pose(R, 0.1), (x, y, z)) if zone else Beam(*ends, R.uniform(0.0005, 0.02))
        found, expected = clearance(solids_of(shape), T, Region.of(region)), gap(shape, T, region)
        assert (found <= 0.0) is (expected <= 0.0)
        if not zone and expected > 0.0:
            assert found <= expected + 1e-9, "a step is never longer than the distance"
        inside += found <= 0.0
    assert 50 < inside < 250


def test_bounds_and_widths() -> None:
    box = solids_of(BoxShape((0.2, 0.1, 0.06)))
    T = compose(translation(1.0, 2.0, 3.0), rotation_z(pi / 2))
    assert bounds(box, T) == pytest.approx((0.95, 1.05, 1.9, 2.1, 2.97, 3.03))
    assert spread(box, T, (0.0, 1.0, 0.0)) == pytest.approx((1.9, 2.1))
    assert bounds(solids_of(CylinderShape(0.05, 0.2)), T) == pytest.approx((0.95, 1.05, 1.95, 2.05, 2.9, 3.1))
    assert point_apart(box, T, (1.0, 2.0, 3.05)) == pytest.approx(0.02)
    assert point_apart(box, T, (1.0, 2.09, 3.0)) == 0.0


@pytest.mark.parametrize(
    ("upper", "T", "expected"),
    [
        (BoxShape((0.04, 0.04, 0.04)), translation(0.0, 0.0, 0.2), 0.13),
        (BoxShape((0.04, 0.04, 0.04)), translation(0.0, 0.0, 0.069), -0.001),
        (BoxShape((0.04, 0.04, 0.04)), translation(0.06, 0.0, 0.2), 0.13),
        (BoxShape((0.04, 0.04, 0.04)), translation(0.07, 0.0, 0.2), inf),
        (BoxShape((0.04, 0.04, 0.04)), translation(0.06995, 0.0, 0.2), inf),
        (SphereShape(0.02), translation(0.0, 0.0, 0.2), 0.13),
        (SphereShape(0.02), translation(0.06, 0.0, 0.2), 0.15 - 0.02 * 0.75**0.5),
        (CylinderShape(0.02, 0.04), translation(0.06, 0.0, 0.2), 0.13),
    ],
)
def test_how_far_a_body_can_be_lowered(upper: Shape, T: Transform, expected: float) -> None:
    lower = solids_of(BoxShape((0.1, 0.1, 0.1)))
    assert drop(solids_of(upper), T, lower, translation(0.0, 0.0, 0.0)) == pytest.approx(expected, abs=1e-9)


def test_a_body_falls_past_the_corner_of_a_turned_one() -> None:
    """Its bounds, seen from above, overlap."""
    a, b = solids_of(BoxShape((0.04, 0.04, 0.04))), solids_of(BoxShape((0.1, 0.1, 0.1)))
    turned = rotation_z(pi / 4)
    assert drop(a, translation(0.06, 0.06, 0.2), b, turned) == inf
    assert drop(a, translation(0.05, 0.0, 0.2), b, turned) == pytest.approx(0.13)


def test_a_point_falls_onto_a_ball() -> None:
    ball = solids_of(SphereShape(0.05))
    assert point_drop((0.03, 0.0, 0.2), ball, translation(0.0, 0.0, 0.0)) == pytest.approx(0.16, abs=1e-9)
    assert point_drop((0.06, 0.0, 0.2), ball, translation(0.0, 0.0, 0.0)) == inf
