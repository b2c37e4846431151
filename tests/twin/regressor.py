"""Torques of an arm as a linear function of its inertial parameters, an oracle for `torques` (Atkeson, An and
Hollerbach, "Estimation of inertial parameters of manipulator loads and links", 1986)."""

from __future__ import annotations

import numpy as np

from vrs_cli.kinematics.arrays import Floats
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.twin.dynamics import InertialModel, LinkMotion, link_motions

PARAMETERS = 10  # number of inertial parameters of a link


def parameters(it: InertialModel) -> Floats:
    """Return the parameters that `regressor` multiplies, (10 n,): of each link m, m cx, m cy, m cz, and the inertia
    about the origin of its frame, xx, xy, xz, yy, yz, zz.
    """
    square = np.einsum("ni,ni->n", it.centre, it.centre)[:, None, None] * np.eye(3)
    outer = it.centre[:, :, None] * it.centre[:, None, :]
    about_origin = it.inertia + it.mass[:, None, None] * (square - outer)
    rows = [it.mass, *(it.mass * x for x in it.centre.T)]
    rows += [about_origin[:, i, j] for i in range(3) for j in range(i, 3)]
    return np.column_stack(rows).ravel()


def regressor(model: RobotModel, q: Floats, qd: Floats, qdd: Floats) -> Floats:
    """Return Y (N, n, 10 n): Y @ `parameters` is `torques` without armature and friction."""
    n, motions = model.joint_count, link_motions(model, q, qd, qdd)
    Y = np.zeros((len(q), n, PARAMETERS * n))
    for k, link in enumerate(motions):
        force, moment = _wrench_matrix(link)
        columns = slice(PARAMETERS * k, PARAMETERS * (k + 1))
        for i in range(k, -1, -1):
            moment = moment + _skew(motions[i].lever) @ force
            Y[:, i, columns] = np.einsum("ni,nij->nj", motions[i].axis, force if motions[i].slides else moment)
    return Y


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
    """Multiply matrices (N, 3, 3) by vectors (N, 3); return (N, 3)."""
    return np.asarray(np.einsum("nij,nj->ni", matrices, vectors))
