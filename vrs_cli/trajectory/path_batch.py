"""The numpy half of `segment`: poses of a path at many times."""

from __future__ import annotations

import numpy as np

from vrs_cli.kinematics import transform_batch as batch
from vrs_cli.kinematics.arrays import Floats
from vrs_cli.kinematics.transform import Transform, inverse
from vrs_cli.trajectory.segment import CartesianPath


def flange_poses(path: CartesianPath, s: Floats, T_flange_tool: Transform) -> Floats:
    """T_robot_flange (N, 3, 4) at times (N,) of a path of the tool."""
    position = np.stack([np.polynomial.polynomial.polyval(s, a) for a in path.position], axis=-1)
    (R,) = batch.stack([path.orientation])[:, :, :3]
    for turn in path.turns:
        angle = np.polynomial.polynomial.polyval(s, turn.angle).astype(float)
        R = R @ batch.rotation_about_batch(np.array(turn.axis), angle)
    T_robot_tool = np.concatenate((np.broadcast_to(R, (len(s), 3, 3)), position[:, :, None]), axis=2)
    (T_tool_flange,) = batch.stack([inverse(T_flange_tool)])
    return batch.compose_batch(T_robot_tool, T_tool_flange)


def guide_values(path: CartesianPath, s: Floats) -> Floats:
    """What the guides of a path ask at times (N,): (N, r)."""
    values = np.empty((len(s), len(path.guides)))
    for r, guide in enumerate(path.guides):
        values[:, r] = np.polynomial.polynomial.polyval(s, guide.value)
    return values
