"""Torques: beside those of MuJoCo, beside published figures of the PUMA, and beside their own linear form."""

from __future__ import annotations

from math import pi
from pathlib import Path

import numpy as np
import pytest
from msgspec import structs

from tests.twin.regressor import parameters, regressor
from vrs_cli.errors import NotAvailable
from vrs_cli.kinematics.arrays import Floats
from vrs_cli.kinematics.link_data import Box, Capsule, Cylinder, LinkMasses, LinkShape, MeshFile, Slab
from vrs_cli.kinematics.model import Link, RobotModel, link_frames
from vrs_cli.kinematics.robot_file import ROBOTS, load_robot
from vrs_cli.kinematics.transform import rotation_about, translation
from vrs_cli.twin.dynamics import (
    InertialModel,
    inertial_model,
    mass_matrix,
    masses_of,
    point_masses,
    realizable_inertia,
    solid_of_link,
    torques,
)

SAMPLE_ROBOTS = ("puma560", "cobra600", "iiwa14", "planar2", "so100")  # one that slides, one that is redundant
SAMPLES = 50


def random_inertial(model: RobotModel, seed: int) -> InertialModel:
    random, n = np.random.default_rng(seed), model.joint_count
    A = random.normal(size=(n, 3, 3))
    inertia = np.array([realizable_inertia(one @ one.T) for one in A])
    rows = (random.uniform(0.1, 2.0, n) for _ in range(4))
    return InertialModel(random.uniform(0.5, 5.0, n), random.normal(size=(n, 3)), inertia, *rows)


def motions(n: int, seed: int = 0) -> Floats:
    return np.random.default_rng(seed).normal(size=(3, SAMPLES, n))


@pytest.mark.parametrize("robot", SAMPLE_ROBOTS)
def test_torques_are_those_of_mujoco(robot: str) -> None:
    mujoco = pytest.importorskip("mujoco")
    from vrs_cli.bodies.mujoco_arm import compile_arm

    model = load_robot(robot)
    inertial = random_inertial(model, 1)
    m, d = compile_arm(model, inertial)
    m.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    q, qd, qdd = motions(model.joint_count)
    found = torques(model, inertial._replace(coulomb=0.0 * inertial.coulomb), q, qd, qdd)
    for k in range(SAMPLES):
        d.qpos[:], d.qvel[:], d.qacc[:] = q[k], qd[k], qdd[k]
        mujoco.mj_inverse(m, d)
        assert np.max(np.abs(d.qfrc_inverse - found[k])) < 1e-9


@pytest.mark.parametrize("robot", SAMPLE_ROBOTS)
def test_torques_are_linear_in_the_parameters(robot: str) -> None:
    model = load_robot(robot)
    inertial, (q, qd, qdd) = random_inertial(model, 2), motions(model.joint_count, 3)
    rotors = inertial.armature * qdd
    found = torques(model, inertial, q, qd, qdd, friction=False)
    assert regressor(model, q, qd, qdd) @ parameters(inertial) + rotors == pytest.approx(found, abs=1e-10)


@pytest.mark.parametrize("robot", SAMPLE_ROBOTS)
def test_power_is_the_rate_of_energy(robot: str) -> None:
    """An oracle that knows kinetic and potential energy alone: masses at the ends of difference quotients."""
    model = load_robot(robot)
    inertial, (q, qd, qdd) = random_inertial(model, 4), motions(model.joint_count, 5)

    def height(joints: Floats) -> float:
        frames = link_frames(model, tuple(joints))[1:]
        rows = (np.array(T).reshape(3, 4) for T in frames)
        return sum(m * (R[2, :3] @ c + R[2, 3]) for m, c, R in zip(inertial.mass, inertial.centre, rows, strict=True))

    def energy(k: int, t: float) -> float:
        joints, rates = q[k] + t * qd[k] + 0.5 * t * t * qdd[k], qd[k] + t * qdd[k]
        M = mass_matrix(model, inertial, joints[None])[0]
        return float(0.5 * rates @ M @ rates + 9.81 * height(joints))

    found = torques(model, inertial, q, qd, qdd, friction=False)
    for k in range(5):
        rate = (energy(k, 1e-5) - energy(k, -1e-5)) / 2e-5
        assert float(found[k] @ qd[k]) == pytest.approx(rate, rel=1e-6, abs=1e-6)


def as_published() -> tuple[RobotModel, InertialModel]:
    """The PUMA with the lengths of P. Corke's toolbox, and with its inertia of link 3, which is that of no body."""
    model = load_robot("puma560")
    links = [structs.asdict(link) for link in model.links]
    links[1]["d"], links[2]["a"], links[3]["d"] = 0.15005, -0.0203, 0.4318
    masses = inertial_model(model)
    centre, inertia = masses.centre.copy(), masses.inertia.copy()
    centre[1, 2] = 0.2275 - 0.15005
    inertia[2] = np.diag([0.066, 0.086, 0.0125])
    found = structs.replace(model, links=tuple(Link(**link) for link in links))
    return found, masses._replace(centre=centre, inertia=inertia)


def test_gravity_and_inertia_of_the_puma_are_the_published_ones() -> None:
    """P. Corke, "Robotics, Vision and Control" (2011), section 9.2: at the nominal pose (0, 45, 180, 0, 45, 0) deg of
    its own joints, the load of gravity and the inertia with that of the motors.
    """
    model, inertial = as_published()
    q = np.radians([[180.0, 45.0 - 180.0, 180.0 - 180.0, 0.0, 45.0, 0.0]])
    still = np.zeros_like(q)
    load = torques(model, inertial, q, still, still, friction=False)[0]
    assert load == pytest.approx([0.0, 31.6399, 6.0351, 0.0, 0.0283, 0.0], abs=1e-4)
    M = mass_matrix(model, inertial, q)[0]
    assert M[0] == pytest.approx([3.6594, -0.4044, 0.1006, -0.0025, 0.0, 0.0], abs=1e-4)
    assert M[1] == pytest.approx([-0.4044, 4.4137, 0.3509, 0.0, 0.0024, 0.0], abs=1e-4)
    assert M[2] == pytest.approx([0.1006, 0.3509, 0.9378, 0.0, 0.0015, 0.0], abs=1e-4)
    assert np.diag(M)[3:] == pytest.approx([0.1925, 0.1713, 0.1941], abs=1e-4)


TOOLBOX_LINKS = (  # alpha, a, d of the toolbox; lengths of our links
    *((pi / 2, 0.0, 0.0), (0.0, 0.4318, 0.0), (-pi / 2, 0.02032, 0.14909)),
    *((pi / 2, 0.0, 0.43307), (-pi / 2, 0.0, 0.0), (0.0, 0.0, 0.0)),
)
TOOLBOX_CENTRES = (  # in the frames of the toolbox [m]
    *((0.0, 0.0, 0.0), (-0.3638, 0.006, 0.2275), (-0.0203, -0.0141, 0.070)),
    *((0.0, 0.019, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.032)),
)
SHIFTS = np.radians([180.0, -180.0, 180.0, 0.0, 0.0, 0.0])  # of our joints against those of the toolbox


def test_centres_of_the_puma_are_where_the_published_frames_have_them() -> None:
    model = load_robot("puma560")
    centres = [link.centre for link in masses_of(model)]
    for q in np.random.default_rng(6).uniform(-3.0, 3.0, size=(20, 6)):
        T = np.eye(4)
        ours = link_frames(model, tuple(q + SHIFTS))[1:]
        for theta, (alpha, a, d), centre, frame, own in zip(
            q, TOOLBOX_LINKS, TOOLBOX_CENTRES, ours, centres, strict=True
        ):
            c, s, ca, sa = np.cos(theta), np.sin(theta), np.cos(alpha), np.sin(alpha)
            T = T @ np.array([[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0, sa, ca, d], [0, 0, 0, 1]])
            here = np.array(frame).reshape(3, 4) @ [*own, 1.0]
            assert here == pytest.approx((T @ [*centre, 1.0])[:3], abs=1e-12)


ORIGIN = (0.0, 0.0, 0.0)


def unit_moments(body: object) -> tuple[float, Floats, Floats]:
    """Volume, centre and inertia about the centre of one kilogram."""
    points, volumes = point_masses(body)  # type: ignore[arg-type]
    shares = volumes / volumes.sum()
    centre = shares @ points
    S = (points - centre).T @ (shares[:, None] * (points - centre))
    return float(volumes.sum()), centre, np.trace(S) * np.eye(3) - S


def sampled(inside: object, low: Floats, high: Floats, count: int = 120) -> tuple[float, Floats, Floats]:
    """The same of a body that is told by which points are in it, from a grid of points."""
    axes = [np.linspace(a, b, count, endpoint=False) + 0.5 * (b - a) / count for a, b in zip(low, high, strict=True)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    points = points[inside(points)]  # type: ignore[operator]
    centre = points.mean(axis=0)
    S = (points - centre).T @ (points - centre) / len(points)
    return len(points) * float(np.prod((high - low) / count)), centre, np.trace(S) * np.eye(3) - S


def test_box_and_cylinder_have_the_moments_of_the_book() -> None:
    volume, centre, inertia = unit_moments(Box((0.2, 0.3, 0.5), translation(1.0, 2.0, 3.0)))
    assert (volume, *centre) == pytest.approx((0.03, 1.0, 2.0, 3.0))
    assert np.diag(inertia) == pytest.approx([0.34 / 12, 0.29 / 12, 0.13 / 12])
    volume, centre, inertia = unit_moments(Cylinder((0.0, 0.0, -0.2), (0.0, 0.0, 0.4), (0.1, 0.1)))
    assert (volume, *centre) == pytest.approx((pi * 0.006, 0.0, 0.0, 0.1))
    across = 0.01 / 4 + 0.36 / 12
    assert np.diag(inertia) == pytest.approx([across, across, 0.005])


def test_cone_and_ball_have_the_moments_of_the_book() -> None:
    volume, centre, inertia = unit_moments(Cylinder(ORIGIN, (0.0, 0.0, 0.4), (0.3, 1e-12)))
    assert (volume, centre[2]) == pytest.approx((pi * 0.09 * 0.4 / 3, 0.1))
    across = 3 / 20 * 0.09 + 3 / 80 * 0.16
    assert np.diag(inertia) == pytest.approx([across, across, 0.3 * 0.09])
    for ball in (Capsule(ORIGIN, ORIGIN, (0.2, 0.2)), Capsule(ORIGIN, (0.0, 0.05, 0.0), (0.2, 0.1))):
        volume, centre, inertia = unit_moments(ball)  # the second holds a smaller ball
        assert (volume, *centre) == pytest.approx((4 / 3 * pi * 0.008, 0.0, 0.0, 0.0))
        assert inertia == pytest.approx(0.4 * 0.04 * np.eye(3))


def test_capsule_of_two_radii_beside_points_of_a_grid() -> None:
    r, s, far = 0.2, 0.1, 0.3

    def inside(points: Floats) -> Floats:
        """In a ball whose centre and radius go from those of one end to those of the other."""
        part = np.linspace(0.0, 1.0, 60)[:, None]
        away = np.full(len(points), np.inf)
        for k in part[:, 0]:
            away = np.minimum(away, np.linalg.norm(points - [0.0, 0.0, k * far], axis=1) - (r + k * (s - r)))
        return away < 0.0

    low, high = np.array([-0.2, -0.2, -0.2]), np.array([0.2, 0.2, 0.4])
    wanted = sampled(inside, low, high, 40)
    for found, other in zip(unit_moments(Capsule(ORIGIN, (0.0, 0.0, far), (r, s))), wanted, strict=True):
        assert found == pytest.approx(other, rel=1e-2, abs=3e-4)


def test_slab_beside_points_of_a_grid() -> None:
    r, s, far, thick, thin = 0.2, 0.1, 0.5, 0.1, 0.06

    def inside(points: Floats) -> Floats:
        x, y, z = points.T
        away = np.full(len(points), np.inf)
        for k in np.linspace(0.0, 1.0, 60):
            away = np.minimum(away, np.hypot(x - k * far, y) - (r + k * (s - r)))
        half = 0.5 * (thick + (thin - thick) * (x + r) / (far + r + s))
        return (away < 0.0) & (np.abs(z) < half)

    low, high = np.array([-0.2, -0.2, -0.05]), np.array([0.6, 0.2, 0.05])
    wanted = sampled(inside, low, high, 40)
    slab = Slab(ORIGIN, (far, 0.0, 0.0), (0.0, 0.0, 1.0), (r, s), (thick, thin))
    for found, other in zip(unit_moments(slab), wanted, strict=True):
        assert found == pytest.approx(other, rel=1e-2, abs=3e-4)


def test_mesh_is_weighed_by_its_triangles(tmp_path: Path) -> None:
    trimesh = pytest.importorskip("trimesh")
    trimesh.creation.box((0.2, 0.3, 0.5)).export(tmp_path / "box.stl")
    pose = translation(0.1, 0.0, 0.0)
    wanted = unit_moments(Box((0.2, 0.3, 0.5), pose))
    for found, other in zip(unit_moments(MeshFile(str(tmp_path / "box.stl"), pose)), wanted, strict=True):
        assert found == pytest.approx(other)


def test_moments_turn_with_a_body_and_add_up_over_a_link() -> None:
    R = rotation_about((1.0, 0.0, 0.0), 0.5 * pi)
    _, _, inertia = unit_moments(Box((0.2, 0.3, 0.5), R))
    assert np.diag(inertia) == pytest.approx([0.34 / 12, 0.13 / 12, 0.29 / 12])
    halves = [LinkShape(1, Box((0.2, 0.3, 0.25), translation(0.0, 0.0, z))) for z in (-0.125, 0.125)]
    model = structs.replace(load_robot("planar2"), shapes=(*halves, LinkShape(2, Box((1.0, 1.0, 1.0)))))
    found = solid_of_link(model, 1)
    assert found is not None
    assert np.diag(found.inertia) == pytest.approx([0.34 / 12, 0.29 / 12, 0.13 / 12])


def test_every_inertia_is_that_of_a_body() -> None:
    random = np.random.default_rng(1)
    for _ in range(200):
        axes, _ = np.linalg.qr(random.normal(size=(3, 3)))
        a, b, c = np.linalg.eigvalsh(realizable_inertia(axes * random.uniform(0.0, 1.0, 3) @ axes.T))
        assert a > 0.0
        assert a + b >= c
    good = np.diag([0.2, 0.3, 0.4])
    assert np.array_equal(realizable_inertia(good), good)


@pytest.mark.parametrize("name", sorted(path.stem for path in Path(ROBOTS, "masses").glob("*.toml")))
def test_robots_with_masses_have_bodies_for_links(name: str) -> None:
    model = load_robot(name)
    found = inertial_model(model)
    for inertia in found.inertia:
        a, b, c = np.linalg.eigvalsh(inertia)
        assert a > 0.0
        assert a + b >= c * (1.0 - 1e-12)
    for row in (found.armature, found.viscous, found.coulomb, found.max_torque):
        assert row.shape == (model.joint_count,)
        assert np.all(row >= 0.0)
    assert np.all(found.max_torque > 0.0)


@pytest.mark.parametrize(
    ("name", "kilograms", "holding"),
    [
        ("irb120", 11.931, (0.0, -13.034, -4.855, 0.020, 0.059, 0.0)),
        ("iiwa14", 25.61, (0.0, -22.289, -5.216, -9.758, 0.035, -0.807, 0.0)),
        ("kr10", 39.83708, (0.0, -108.272, -13.036, -0.030, 0.499, 0.0)),
        ("lrmate200id", 19.6994, (0.0, -20.984, 6.621, -0.157, 0.009, 0.0)),
        ("panda", 16.0621, (0.0, -10.246, -2.784, -12.490, -0.542, 0.227, -0.059)),
        ("so100", 0.608965, (0.0, 0.321, -0.109, 0.097, -0.001)),
        ("ur5e", 16.9949, (0.0, -37.279, -3.989, 1.257, -0.056, 0.0)),
        ("xarm6", 7.7536, (0.0, -0.506, 8.719, 0.168, 0.453, 0.0)),
    ],
)
def test_masses_load_the_joints_as_in_their_source(name: str, kilograms: float, holding: tuple[float, ...]) -> None:
    """Torques that hold the arm at 0.3, 0.5, 0.7, ... rad: slopes of the potential energy along the source's chain of
    bodies. The source of the UR5e has lengths in whole millimetres, that of the KR 10 another forearm.
    """
    model = load_robot(name)
    found = inertial_model(model)
    q = np.array([[0.3 + 0.2 * i for i in range(len(holding))]])
    assert found.mass.sum() == pytest.approx(kilograms, abs=1e-4)
    near = {"kr10": 0.75, "ur5e": 0.05}.get(name, 1e-3)
    assert torques(model, found, q, 0.0 * q, 0.0 * q)[0] == pytest.approx(holding, abs=near)


def test_all_links_without_a_mass_are_told_at_once() -> None:
    model = structs.replace(load_robot("cobra600"), links=load_robot("cobra600").links[:3])
    with pytest.raises(NotAvailable) as told:
        inertial_model(structs.replace(model, masses=(LinkMasses(), LinkMasses(2.0), LinkMasses())))
    assert "links 1 and 3 of Adept Cobra 600" in told.value.detail
    assert "[[masses]]" in told.value.hint
