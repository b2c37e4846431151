"""Define names for types of numpy arrays, and functions that transform many poses at once (for single poses:
`transform`).

A pose is the upper three rows of a homogeneous matrix, shape (..., 3, 4); a `Transform` contains the same twelve
numbers, row by row. Leading dimensions broadcast. Units are metres and radians.
"""

from collections.abc import Iterable
from math import pi

import numpy as np
from numpy.typing import NDArray

from vrs_cli.kinematics.transform import POLE, RIGHT_ANGLE, TURN, Transform

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
Rows = NDArray[np.intp]
Singles = NDArray[np.float32]


def stack(transforms: Iterable[Transform]) -> Floats:
    """Return N transforms as an array (N, 3, 4)."""
    return np.array(list(transforms), dtype=np.float64).reshape(-1, 3, 4)


def compose_batch(a: Floats, b: Floats) -> Floats:
    """Return T_x_z = T_x_y @ T_y_z for poses a = T_x_y and b = T_y_z (..., 3, 4)."""
    product: Floats = a[..., :3] @ b
    product[..., 3] += a[..., 3]
    return product


def rotation_about_batch(axis: Floats, angle: Floats) -> Floats:
    """Return rotations (..., 3, 3) about unit axes (..., 3) by angles (...) [rad] (Rodrigues)."""
    x, y, z = axis[..., 0], axis[..., 1], axis[..., 2]
    s = np.sin(angle)
    half = np.sin(0.5 * angle)
    versine = 2.0 * half * half
    c = 1.0 - versine
    xy, yz, zx = x * y * versine, y * z * versine, z * x * versine
    R = np.empty((*np.broadcast(x, angle).shape, 3, 3))
    R[..., 0, 0], R[..., 0, 1], R[..., 0, 2] = x * x * versine + c, xy - z * s, zx + y * s
    R[..., 1, 0], R[..., 1, 1], R[..., 1, 2] = xy + z * s, y * y * versine + c, yz - x * s
    R[..., 2, 0], R[..., 2, 1], R[..., 2, 2] = zx - y * s, yz + x * s, z * z * versine + c
    return R


def to_oat_batch(T: Floats) -> Floats:
    """Return the VAL-II angles O, A, T (..., 3) [rad] of poses (..., 3, 4), in the same ranges as those of
    `transform.to_oat`, even if the tool is vertical.
    """
    ax, ay, az = T[..., 0, 2], T[..., 1, 2], T[..., 2, 2]
    h = np.hypot(ax, ay)
    pole = h < POLE
    x, y = np.where(pole, 1.0, ax), np.where(pole, 0.0, ay)
    angles = np.empty((*h.shape, 3))  # yaw, pitch, roll
    angles[..., 0] = np.arctan2(y, x)
    angles[..., 1] = np.where(pole, np.where(az > 0.0, 0.0, pi), np.arctan2(h, az))
    angles[..., 2] = np.arctan2(x * T[..., 1, 0] - y * T[..., 0, 0], x * T[..., 1, 1] - y * T[..., 0, 1])
    angles[angles == -pi] = pi
    angles[..., 0] += RIGHT_ANGLE
    angles[..., 0] -= TURN * (angles[..., 0] > pi)
    angles[..., 1] -= RIGHT_ANGLE
    angles += 0.0
    return angles


def quaternions(R: Floats) -> Floats:
    """Convert rotation matrices (N, 3, 3) to unit quaternions x, y, z, w (N, 4) with w >= 0. The largest component is
    computed first (Shepperd 1978).
    """
    m00, m11, m22 = R[:, 0, 0], R[:, 1, 1], R[:, 2, 2]
    squares = np.stack((1 + m00 - m11 - m22, 1 - m00 + m11 - m22, 1 - m00 - m11 + m22, 1 + m00 + m11 + m22), axis=1)
    xy, xz, yz = R[:, 0, 1] + R[:, 1, 0], R[:, 0, 2] + R[:, 2, 0], R[:, 1, 2] + R[:, 2, 1]
    x, y, z = R[:, 2, 1] - R[:, 1, 2], R[:, 0, 2] - R[:, 2, 0], R[:, 1, 0] - R[:, 0, 1]
    rows = np.stack(
        [
            np.stack((squares[:, 0], xy, xz, x), axis=1),
            np.stack((xy, squares[:, 1], yz, y), axis=1),
            np.stack((xz, yz, squares[:, 2], z), axis=1),
            np.stack((x, y, z, squares[:, 3]), axis=1),
        ],
        axis=1,
    )
    largest = rows[np.arange(len(R)), np.argmax(squares, axis=1)]
    unit: Floats = largest / np.linalg.norm(largest, axis=1, keepdims=True)
    return np.where(unit[:, 3:] < 0.0, -unit, unit)
