"""Torques of an arm: recursive Newton-Euler, and the same torques as a linear function of inertial parameters.

Everything is computed over N samples at once, in the base frame of the robot. The recursion is that of Luh, Walker and
Paul, "On-line computational scheme for mechanical manipulators" (1980); the regressor that of Atkeson, An and
Hollerbach, "Estimation of inertial parameters of manipulator loads and links" (1986). Metres, radians, kilograms,
newtons; of a joint that slides, torques are forces.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from vrs_cli.kinematics.arrays import Floats
from vrs_cli.kinematics.joints import JointKind
from vrs_cli.kinematics.model import RobotModel, link_pose
from vrs_cli.kinematics.transform import Transform, Vector
from vrs_cli.kinematics.transform_batch import rotation_about_batch

GRAVITY: Vector = (0.0, 0.0, -9.81)  # [m/s2]
PARAMETERS = 10  # inertial parameters of a link
AXIS_Z = np.array([0.0, 0.0, 1.0])


class InertialModel(NamedTuple):
    """Masses and drives of an arm with n joints, in the frames of the links (`model.link_frames`).

    `mass` (n,) [kg]; `centre` (n, 3) of mass [m]; `inertia` (n, 3, 3) about the centre [kg m2]. `armature` (n,): what
    the rotor of each motor adds to its joint [kg m2, kg]; `viscous` (n,) [N m s/rad, N s/m] and `coulomb` (n,) [N m, N]
    friction; `max_torque` (n,) [N m, N].
    """

    mass: Floats
    centre: Floats
    inertia: Floats
    armature: Floats
    viscous: Floats
    coulomb: Floats
    max_torque: Floats

    def parameters(self) -> Floats:
        """Return the parameters that `regressor` multiplies, (10 n,): of each link m, m cx, m cy, m cz, and the inertia
        about the origin of its frame, xx, xy, xz, yy, yz, zz.
        """
        square = np.einsum("ni,ni->n", self.centre, self.centre)[:, None, None] * np.eye(3)
        outer = self.centre[:, :, None] * self.centre[:, None, :]
        about_origin = self.inertia + self.mass[:, None, None] * (square - outer)
        rows = [self.mass, *(self.mass * x for x in self.centre.T)]
        rows += [about_origin[:, i, j] for i in range(3) for j in range(i, 3)]
        return np.column_stack(rows).ravel()


class LinkMotion(NamedTuple):
    """How a link moves, over N samples: R (N, 3, 3) and origin (N, 3) of its frame, its angular velocity and
    acceleration, and the acceleration of the origin less that of gravity, each (N, 3); `axis` (N, 3) of its joint and
    `lever` (N, 3) from the frame before to its own.
    """

    slides: bool
    axis: Floats
    lever: Floats
    R: Floats
    origin: Floats
    velocity: Floats
    acceleration: Floats
    linear: Floats


def link_motions(
    model: RobotModel, q: Floats, qd: Floats, qdd: Floats, gravity: Sequence[float] = GRAVITY
) -> list[LinkMotion]:
    """Return the motion of each link for joints, velocities and accelerations of shape (N, n)."""
    n = len(q)
    R, origin = (np.broadcast_to(part, (n, *part.shape)) for part in _parts(model.base))
    w = wd = np.zeros((n, 3))
    a = np.broadcast_to(-np.array(gravity), (n, 3))
    found = []
    for i, link in enumerate(model.links):
        K, k = _parts(link_pose(model, i + 1, 0.0))
        axis, x, v, vd = R[:, :, 2], *(rows[:, i, None] for rows in (q, qd, qdd))
        if slides := link.kind is JointKind.PRISMATIC:
            lever = R @ k + axis * x
            a = a + np.cross(wd, lever) + np.cross(w, np.cross(w, lever)) + 2.0 * np.cross(w, axis) * v + axis * vd
        else:
            R = R @ rotation_about_batch(AXIS_Z, x[:, 0])
            lever = R @ k
            w, wd = w + axis * v, wd + axis * vd + np.cross(w, axis) * v
            a = a + np.cross(wd, lever) + np.cross(w, np.cross(w, lever))
        R, origin = R @ K, origin + lever
        found.append(LinkMotion(slides, axis, lever, R, origin, w, wd, a))
    return found


def torques(
    model: RobotModel,
    inertial: InertialModel,
    q: Floats,
    qd: Floats,
    qdd: Floats,
    gravity: Sequence[float] = GRAVITY,
    *,
    friction: bool = True,
) -> Floats:
    """Return the torques (N, n) of the joints that give these accelerations; `friction`: with that of the joints."""
    found = inertial.armature * qdd
    if friction:
        found = found + inertial.viscous * qd + inertial.coulomb * np.sign(qd)
    motions = link_motions(model, q, qd, qdd, gravity)
    force = moment = np.zeros((len(q), 3))
    for i, link in reversed(list(enumerate(motions))):
        centre = link.R @ inertial.centre[i]
        w, wd = link.velocity, link.acceleration
        own = inertial.mass[i] * (link.linear + np.cross(wd, centre) + np.cross(w, np.cross(w, centre)))
        inertia = link.R @ inertial.inertia[i] @ link.R.transpose(0, 2, 1)
        turning = _times(inertia, wd) + np.cross(w, _times(inertia, w)) + np.cross(centre, own)
        force = force + own
        moment = moment + turning + np.cross(link.lever, force)  # about the origin of the frame before
        found[:, i] += np.einsum("ni,ni->n", link.axis, force if link.slides else moment)
    return found


def regressor(model: RobotModel, q: Floats, qd: Floats, qdd: Floats, gravity: Sequence[float] = GRAVITY) -> Floats:
    """Return Y (N, n, 10 n): Y @ `InertialModel.parameters()` is `torques` without armature and friction."""
    n, motions = model.joint_count, link_motions(model, q, qd, qdd, gravity)
    Y = np.zeros((len(q), n, PARAMETERS * n))
    for k, link in enumerate(motions):
        force, moment = _wrench_matrix(link)
        columns = slice(PARAMETERS * k, PARAMETERS * (k + 1))
        for i in range(k, -1, -1):
            moment = moment + _skew(motions[i].lever) @ force
            Y[:, i, columns] = np.einsum("ni,nij->nj", motions[i].axis, force if motions[i].slides else moment)
    return Y


def mass_matrix(model: RobotModel, inertial: InertialModel, q: Floats) -> Floats:
    """Return the inertia of the joints (N, n, n) at joints (N, n), that of the motors' rotors included."""
    still = np.zeros_like(q)
    columns = [
        torques(model, inertial, q, still, still + unit, (0.0, 0.0, 0.0), friction=False)
        for unit in np.eye(model.joint_count)
    ]
    return np.stack(columns, axis=2)


def _wrench_matrix(link: LinkMotion) -> tuple[Floats, Floats]:
    """Return the force and the moment about the origin of a link, each (N, 3, 10), for each of its parameters."""
    n, R, back = len(link.R), link.R, link.R.transpose(0, 2, 1)
    turning, rate = _skew(link.velocity), _skew(link.acceleration)
    w, wd = _times(back, link.velocity), _times(back, link.acceleration)
    force, moment = np.zeros((n, 3, PARAMETERS)), np.zeros((n, 3, PARAMETERS))
    force[:, :, 0] = link.linear
    force[:, :, 1:4] = (rate + turning @ turning) @ R
    moment[:, :, 1:4] = -_skew(link.linear) @ R
    moment[:, :, 4:] = R @ (_inertia_columns(wd) + _skew(w) @ _inertia_columns(w))
    return force, moment


def _inertia_columns(v: Floats) -> Floats:
    """Return L (N, 3, 6): L @ (xx, xy, xz, yy, yz, zz) is the inertia times v (N, 3)."""
    L = np.zeros((len(v), 3, 6))
    for column, (i, j) in enumerate(zip(*np.triu_indices(3), strict=True)):
        L[:, i, column] += v[:, j]
        if i != j:
            L[:, j, column] += v[:, i]
    return L


def _skew(v: Floats) -> Floats:
    """Return S (N, 3, 3): S @ u is the cross product of v (N, 3) and u."""
    S = np.zeros((len(v), 3, 3))
    S[:, 0, 1], S[:, 0, 2], S[:, 1, 2] = -v[:, 2], v[:, 1], -v[:, 0]
    return S - S.transpose(0, 2, 1)


def _times(matrices: Floats, vectors: Floats) -> Floats:
    """(N, 3, 3) and (N, 3) -> (N, 3)."""
    found: Floats = np.einsum("nij,nj->ni", matrices, vectors)
    return found


def _parts(T: Transform) -> tuple[Floats, Floats]:
    """Return the rotation (3, 3) and the place (3,) of a transform."""
    rows = np.array(T).reshape(3, 4)
    return rows[:, :3], rows[:, 3]
