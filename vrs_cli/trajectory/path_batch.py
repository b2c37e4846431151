"""The numpy half of `segment`: poses of a path at many times."""

from __future__ import annotations

import numpy as np
from numpy.polynomial.polynomial import polyval

from vrs_cli.kinematics import transform_batch as batch
from vrs_cli.kinematics.arrays import Floats
from vrs_cli.kinematics.transform import Transform, inverse, rotate
from vrs_cli.trajectory.polynomial import Polynomial, derivative
from vrs_cli.trajectory.segment import CartesianPath


def flange_poses(path: CartesianPath, s: Floats, T_flange_tool: Transform) -> Floats:
    """T_robot_flange (N, 3, 4) at times (N,) of a path of the tool."""
    position = np.stack([polyval(s, a) for a in path.position], axis=-1)
    (R,) = batch.stack([path.orientation])[:, :, :3]
    for turn in path.turns:
        angle = polyval(s, turn.angle).astype(float)
        R = R @ batch.rotation_about_batch(np.array(turn.axis), angle)
    T_robot_tool = np.concatenate((np.broadcast_to(R, (len(s), 3, 3)), position[:, :, None]), axis=2)
    (T_tool_flange,) = batch.stack([inverse(T_flange_tool)])
    return batch.compose_batch(T_robot_tool, T_tool_flange)


def twists(path: CartesianPath, s: Floats) -> tuple[Floats, Floats]:
    """`CartesianPath.twist` and `twist_rate` at times (N,), (N, 6) each, of a path with one turn or none."""
    twist, change = np.zeros((len(s), 6)), np.zeros((len(s), 6))
    for i, a in enumerate(path.position):
        _, twist[:, i], change[:, i] = _derivatives(a, s)
    for turn in path.turns:
        axis = np.array(rotate(path.orientation, turn.axis))
        _, rate, second = _derivatives(turn.angle, s)
        twist[:, 3:], change[:, 3:] = rate[:, None] * axis, second[:, None] * axis
    return twist, change


def _derivatives(a: Polynomial, s: Floats) -> list[Floats]:
    """p, dp/dt and d2p/dt2 at times (N,)."""
    first = derivative(a)
    return [np.asarray(polyval(s, one), dtype=float) for one in (a, first, derivative(first))]


def guide_values(path: CartesianPath, s: Floats) -> Floats:
    """Return the values of a path's guides at times (N,): (N, r)."""
    values = np.empty((len(s), len(path.guides)))
    for r, guide in enumerate(path.guides):
        values[:, r] = polyval(s, guide.value)
    return values
