"""Torques: beside those of MuJoCo, beside published figures of the PUMA, and beside their own linear form."""

from __future__ import annotations

from dataclasses import replace
from math import pi

import numpy as np
import pytest

from vrs_cli.kinematics.arrays import Floats
from vrs_cli.kinematics.axes import Link
from vrs_cli.kinematics.model import RobotModel, link_frames
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.twin.dynamics import InertialModel, mass_matrix, regressor, torques
from vrs_cli.twin.inertia import balanced, inertial_model, masses_of

ROBOTS = ("puma560", "cobra600", "iiwa14", "planar2", "so100")  # one that slides, one that is redundant
SAMPLES = 50


def random_inertial(model: RobotModel, seed: int) -> InertialModel:
    random, n = np.random.default_rng(seed), model.joint_count
    A = random.normal(size=(n, 3, 3))
    inertia = np.array([balanced(one @ one.T) for one in A])
    rows = (random.uniform(0.1, 2.0, n) for _ in range(4))
    return InertialModel(random.uniform(0.5, 5.0, n), random.normal(size=(n, 3)), inertia, *rows)


def motions(n: int, seed: int = 0) -> Floats:
    return np.random.default_rng(seed).normal(size=(3, SAMPLES, n))


@pytest.mark.parametrize("robot", ROBOTS)
def test_torques_are_those_of_mujoco(robot: str) -> None:
    mujoco = pytest.importorskip("mujoco")
    from vrs_cli.bodies.mujoco_arm import compiled

    model = load_robot(robot)
    inertial = random_inertial(model, 1)
    m, d = compiled(model, inertial)
    m.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    q, qd, qdd = motions(model.joint_count)
    found = torques(model, inertial._replace(coulomb=0.0 * inertial.coulomb), q, qd, qdd)
    for k in range(SAMPLES):
        d.qpos[:], d.qvel[:], d.qacc[:] = q[k], qd[k], qdd[k]
        mujoco.mj_inverse(m, d)
        assert np.max(np.abs(d.qfrc_inverse - found[k])) < 1e-9


@pytest.mark.parametrize("robot", ROBOTS)
def test_torques_are_linear_in_the_parameters(robot: str) -> None:
    model = load_robot(robot)
    inertial, (q, qd, qdd) = random_inertial(model, 2), motions(model.joint_count, 3)
    rotors = inertial.armature * qdd
    found = torques(model, inertial, q, qd, qdd, friction=False)
    assert regressor(model, q, qd, qdd) @ inertial.parameters() + rotors == pytest.approx(found, abs=1e-10)


@pytest.mark.parametrize("robot", ROBOTS)
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
    links = [link._asdict() for link in model.links]
    links[1]["d"], links[2]["a"], links[3]["d"] = 0.15005, -0.0203, 0.4318
    masses = inertial_model(model)
    centre, inertia = masses.centre.copy(), masses.inertia.copy()
    centre[1, 2] = 0.2275 - 0.15005
    inertia[2] = np.diag([0.066, 0.086, 0.0125])
    found = replace(model, links=tuple(Link(**link) for link in links))
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
