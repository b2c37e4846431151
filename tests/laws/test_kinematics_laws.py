"""Laws of the kinematics over a hundred thousand random poses.

fk(ik(T)) = T in all eight branches; q is one of ik(fk(q)); J is the derivative of fk; qd = J^-1 (J qd).
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from numpy.typing import NDArray

from vrs_cli.kinematics.arrays import stack, to_oat_batch
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.joints import ALL
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import from_oat

Floats = NDArray[np.float64]

PUMA = load_robot("puma560")
ARM = arm_for(PUMA)
N = 100_000
PART = 10_000


@pytest.fixture(scope="module")
def q() -> Floats:
    return np.random.default_rng(560).uniform(PUMA.lower, PUMA.upper, (N, 6))


def parts() -> Iterator[slice]:
    return (slice(i, i + PART) for i in range(0, N, PART))


def apart(a: Floats, b: Floats) -> tuple[float, float]:
    """Largest distance [m] and largest angle [rad] between poses."""
    R = a[..., :3] - b[..., :3]
    return float(np.linalg.norm(a[..., 3] - b[..., 3], axis=-1).max()), float(np.linalg.norm(R, axis=(-1, -2)).max())


def test_every_branch_leads_back_to_the_flange(q: Floats) -> None:
    for part in parts():
        T = ARM.batch.forward(q[part])
        found, _ = ARM.batch.inverse(T)
        assert not np.isnan(found).any()
        back = ARM.batch.forward(found.reshape(-1, 6)).reshape(-1, 8, 3, 4)
        metres, radians = apart(back, T[:, None])
        assert metres < 1e-9
        assert radians < 1e-9


def test_the_joints_are_among_the_eight(q: Floats) -> None:
    for part in parts():
        found, inside = ARM.batch.inverse(ARM.batch.forward(q[part]))
        off = np.abs(np.sin((found - q[part][:, None]) / 2)).max(axis=-1)
        true = off.argmin(axis=1)
        assert np.take_along_axis(off, true[:, None], 1).max() < 1e-9
        assert np.take_along_axis(inside, true[:, None], 1).all()


def test_the_branch_of_the_joints_gives_them_back(q: Floats) -> None:
    part = q[:20_000]
    index = np.array([ARM.configuration(tuple(row)).index for row in part.tolist()])
    for configuration in ALL:
        mine = part[index == configuration.index]
        found = ARM.batch.inverse_branch(ARM.batch.forward(mine), configuration, mine)
        assert len(mine) > 100
        assert np.abs(found - mine).max() < 1e-9


def test_the_jacobian_is_the_derivative(q: Floats) -> None:
    h = 1e-6
    part = q[:PART]
    J = ARM.batch.jacobian(part)
    for i in range(6):
        step = np.zeros(6)
        step[i] = h
        before, after = ARM.batch.forward(part - step), ARM.batch.forward(part + step)
        slope = (after - before) / (2 * h)
        spin = np.einsum("nij,nkj->nik", slope[..., :3], ARM.batch.forward(part)[..., :3])  # R' R^T
        assert np.abs(J[:, :3, i] - slope[..., 3]).max() < 1e-8
        assert np.abs(J[:, 3:, i] - np.stack((spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]), 1)).max() < 1e-8


def test_velocities_there_and_back(q: Floats) -> None:
    part = q[:1000]
    qd = np.random.default_rng(1).uniform(-1, 1, part.shape)
    J = ARM.batch.jacobian(part)
    twists = np.einsum("nij,nj->ni", J, qd)
    found = [
        ARM.joint_velocity(tuple(row), tuple(twist)) for row, twist in zip(part.tolist(), twists.tolist(), strict=True)
    ]
    assert np.abs(np.einsum("nij,nj->ni", J, found) - twists).max() < 1e-9


def test_oat_there_and_back(q: Floats) -> None:
    T = ARM.batch.forward(q[:PART])
    places = zip(T[..., 3].tolist(), to_oat_batch(T).tolist(), strict=True)
    metres, radians = apart(stack(from_oat(*xyz, *oat) for xyz, oat in places), T)
    assert metres == 0.0
    assert radians < 1e-9


def test_scalar_and_array_agree_to_the_last_bits(q: Floats) -> None:
    part = q[:3000]
    T = ARM.batch.forward(part)
    assert np.abs(T.reshape(-1, 12) - [ARM.forward(tuple(row)) for row in part.tolist()]).max() < 1e-15
    found, inside = ARM.batch.inverse(T)
    for row, eight, flags in zip(part.tolist(), found, inside, strict=True):
        solutions = ARM.inverse_all(ARM.forward(tuple(row)))
        assert [s.usable for s in solutions] == flags.tolist()
        assert np.abs(np.sin((eight - np.array([s.joints for s in solutions])) / 2)).max() < 1e-10
