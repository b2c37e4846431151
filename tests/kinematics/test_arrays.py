"""The array half of the geometry does what the scalar half does."""

from __future__ import annotations

from math import pi

import numpy as np

from vrs_cli.kinematics import transform as scalar
from vrs_cli.kinematics.arrays import compose_batch, rotation_about_batch, stack, to_oat_batch

RNG = np.random.default_rng(1)
XYZ = RNG.uniform(-1, 1, (400, 3))
OAT = RNG.uniform(-pi, pi, (400, 3))
OAT[:100, 1] = pi / 2  # straight down and straight up
OAT[100:200, 1] = -pi / 2
TRANSFORMS = [scalar.from_oat(*xyz, *oat) for xyz, oat in zip(XYZ.tolist(), OAT.tolist(), strict=True)]
POSES = stack(TRANSFORMS)


def test_stack() -> None:
    assert POSES.shape == (400, 3, 4)
    assert POSES.reshape(-1, 12).tolist() == list(map(list, TRANSFORMS))
    assert stack([]).shape == (0, 3, 4)


def test_angles() -> None:
    assert np.abs(to_oat_batch(POSES) - [scalar.to_oat(T) for T in TRANSFORMS]).max() < 1e-14
    assert to_oat_batch(POSES[0]).shape == (3,)
    assert to_oat_batch(POSES.reshape(20, 20, 3, 4)).shape == (20, 20, 3)


def test_products() -> None:
    other = POSES[::-1]
    expected = stack(scalar.compose(a, b) for a, b in zip(TRANSFORMS, reversed(TRANSFORMS), strict=True))
    assert np.abs(compose_batch(POSES, other) - expected).max() < 1e-15
    assert np.abs(compose_batch(POSES[0], other)[0] - expected[0]).max() < 1e-15


def test_rotations_about_axes() -> None:
    axes = XYZ / np.linalg.norm(XYZ, axis=1, keepdims=True)
    angles = OAT[:, 0]
    expected = stack(scalar.rotation_about(tuple(a), t) for a, t in zip(axes.tolist(), angles.tolist(), strict=True))
    assert np.abs(rotation_about_batch(axes, angles) - expected[:, :, :3]).max() < 1e-15
    assert rotation_about_batch(axes[0], angles).shape == (400, 3, 3)
