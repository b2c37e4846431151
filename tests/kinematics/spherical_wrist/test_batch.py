"""Array kinematics against the scalar one, singular rows and rows out of reach among them."""

from __future__ import annotations

from math import atan2, pi, radians

import numpy as np
import pytest
from msgspec import structs
from numpy.typing import NDArray

from tests.examples import some
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.arrays import stack
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.joints import ALL, Configuration
from vrs_cli.kinematics.model import Link
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.serial_batch import SerialBatch
from vrs_cli.kinematics.transform import IDENTITY, Transform, from_oat

PUMA = load_robot("puma560")
ARM = arm_for(PUMA)
SHOULDERED = arm_for(
    structs.replace(PUMA, name="shouldered", links=(Link(0.1, 0.5, -pi / 2), Link(0.4, 0, 0), *PUMA.links[2:]))
)
AWAY = (1.5, 1.5, 1.5, 4.0, 1.5, 4.0)


def aside(sign: float) -> RobotArm:
    """The arm with all its ranges to one side of zero, two of them by more than half a turn."""
    lower, upper = (
        tuple(q + sign * more for q, more in zip(ends, AWAY, strict=True)) for ends in (PUMA.lower, PUMA.upper)
    )
    return arm_for(structs.replace(PUMA, name="aside", lower=lower, upper=upper))


TOOL = from_oat(0.03, -0.05, 0.12, 0.4, 0.5, 0.6)


def joints(n: int, seed: int) -> NDArray[np.float64]:
    q = np.random.default_rng(seed).uniform(PUMA.lower, PUMA.upper, (n, 6))
    q[::10, 4] = 0.0  # singular wrists
    q[5::10, 2] = atan2(0.43307, -0.02032)  # stretched arms
    q[0] = PUMA.poses["ready"]
    return q


def unstack(T: NDArray[np.float64]) -> list[Transform]:
    return [Transform(*row) for row in T.reshape(-1, 12).tolist()]


def rows(q: NDArray[np.float64]) -> list[tuple[float, ...]]:
    return [tuple(row) for row in q.tolist()]


@pytest.mark.parametrize("arm", [ARM, SHOULDERED])
def test_forward(arm: RobotArm) -> None:
    q = joints(2500, 1)  # more than one chunk
    assert np.abs(arm.batch.forward(q) - stack(map(arm.forward, rows(q)))).max() < 1e-15
    assert arm.batch.forward(q[:0]).shape == (0, 3, 4)


@pytest.mark.parametrize("arm", [ARM, SHOULDERED])
def test_inverse(arm: RobotArm) -> None:
    T = arm.batch.forward(joints(some(4000), 2))
    T[7::20, :, 3] *= np.linspace(0.1, 2.0, len(T[7::20]))[:, None]  # some too far, some too close
    found, inside = arm.batch.inverse(T)
    assert np.isnan(found).any()
    for pose, eight, flags in zip(unstack(T), found, inside, strict=True):
        for solution, q, flag in zip(arm.inverse_all(pose), eight, flags, strict=True):
            assert solution.usable == flag
            if solution.joints is None:
                assert np.isnan(q).any()
            else:
                # Angles near a singular wrist or a stretched arm magnify the last bit.
                assert np.abs(np.sin((q - solution.joints) / 2)).max() < 1e-7
                assert np.abs(arm.batch.forward(q[None])[0].ravel() - pose).max() < 1e-9


@pytest.mark.parametrize("arm", [ARM, SHOULDERED])
@pytest.mark.parametrize("configuration", ALL, ids=str)
def test_one_branch(arm: RobotArm, configuration: Configuration) -> None:
    near = joints(300, 3)
    T = arm.batch.forward(joints(300, 4))
    T[7, :, 3] *= 3.0
    found = arm.batch.inverse_branch(T, configuration, near)
    for pose, start, q in zip(unstack(T), rows(near), found, strict=True):
        one = arm.branch_joints(pose, configuration, start)
        assert np.isnan(q).any() if one is None else np.abs(q - one).max() < 1e-7
    again = arm.batch.inverse_branch(T, configuration, near[0])
    assert again.shape == (300, 6)


def test_one_branch_above_the_waist_keeps_joint_1() -> None:
    plain = arm_for(structs.replace(PUMA, name="plain", links=(*PUMA.links[:1], Link(0.4, 0, 0), *PUMA.links[2:])))
    T = stack([IDENTITY._replace(pz=0.6), IDENTITY._replace(px=0.3, pz=0.5)])
    near = np.full((2, 6), 0.7)
    found = plain.batch.inverse_branch(T, ALL[0], near)
    assert found[0, 0] == pytest.approx(0.7, abs=1e-15)
    assert np.abs(plain.batch.forward(found) - T).max() < 1e-12


@pytest.mark.parametrize("arm", [ARM, SHOULDERED, aside(1.0), aside(-1.0)])
def test_a_row_does_not_depend_on_the_others(arm: RobotArm) -> None:
    """Ordinary poses alone, and beside one on the axis of joint 1 and one with a singular wrist: joints to the turn."""
    q = np.random.default_rng(8).uniform(-3.0, 3.0, (60, 6))
    q[np.abs(np.sin(q[:, 4])) < 0.01, 4] = 0.5
    T = arm.batch.forward(q)
    special = np.concatenate([T, stack([IDENTITY._replace(pz=0.3)]), arm.batch.forward(np.array([[0.1] * 4 + [0, 0]]))])
    expected = np.array(
        [[s.joints or (np.nan,) * 6 for s in arm.inverse_all(pose)] for pose in unstack(T)],
    )
    for poses in (T, special):
        found, _ = arm.batch.inverse(poses)
        found = np.where(np.isnan(found).any(axis=2, keepdims=True), np.nan, found)[: len(T)]
        np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-7)


@pytest.mark.parametrize("end", [PUMA.lower, PUMA.upper])
def test_the_very_end_of_a_range_is_inside(end: tuple[float, ...]) -> None:
    q = np.array([(end[0], -0.6, 2.0, 0.3, 0.4, 0.2), (0.2, -0.6, 2.0, 0.3, 0.4, end[5])])
    _, inside = ARM.batch.inverse(ARM.batch.forward(q))
    for row, flags in zip(rows(q), inside, strict=True):
        assert flags[ALL.index(ARM.configuration(row))]


@pytest.mark.parametrize("depth", [0.0, 1e-11])
def test_the_wrist_on_the_cylinder_about_joint_1_is_reached(depth: float) -> None:
    """As far from the axis as the shoulder is to the side; `depth` [m]: nearer by rounding."""
    side = abs(PUMA.links[1].d + PUMA.links[2].d)
    T = stack([IDENTITY._replace(px=side - depth, pz=0.5)])
    found = ARM.batch.inverse_branch(T, ALL[0], np.zeros(6))
    one = ARM.branch_joints(unstack(T)[0], ALL[0], (0.0,) * 6)
    assert one is not None
    assert found[0] == pytest.approx(one, abs=1e-7)


def test_a_wrist_that_is_almost_singular_keeps_its_last_bits() -> None:
    q = np.array([[0.3, -0.8, 2.0, 1.1, 8e-11, 0.2]])
    near = (0.3, -0.8, 2.0, 0.4, 0.0, 0.2)
    T = ARM.batch.forward(q)
    one = ARM.branch_joints(unstack(T)[0], ARM.configuration(rows(q)[0]), near)
    found = ARM.batch.inverse_branch(T, ARM.configuration(rows(q)[0]), np.array(near))
    assert one is not None
    assert found[0, 4] == pytest.approx(one[4], abs=1e-13)


@pytest.mark.parametrize("arm", [ARM, SHOULDERED])
@pytest.mark.parametrize("tool", [IDENTITY, TOOL])
def test_jacobians(arm: RobotArm, tool: Transform) -> None:
    q = joints(500, 5)
    assert np.abs(arm.batch.jacobian(q, tool) - [arm.jacobian(row, tool) for row in rows(q)]).max() < 1e-15


@pytest.mark.parametrize("arm", [ARM, SHOULDERED])
@pytest.mark.parametrize("tool", [IDENTITY, TOOL])
def test_the_rates_of_two_systems_of_three_are_those_of_six_equations(arm: RobotArm, tool: Transform) -> None:
    q = np.random.default_rng(11).uniform(-1.0, 1.0, (500, 6)) + 0.1
    q = q[np.abs(np.linalg.det(arm.batch.jacobian(q, tool))) > 1e-3]
    twists, changes = np.random.default_rng(12).uniform(-1.0, 1.0, (2, len(q), 6))
    whole = SerialBatch.rates(arm.batch, q, twists, changes, tool)
    for found, expected in zip(arm.batch.rates(q, twists, changes, tool), whole, strict=True):
        assert np.abs(found - expected).max() < 1e-9 * np.abs(expected).max()


@pytest.mark.parametrize("arm", [ARM, SHOULDERED])
@pytest.mark.parametrize("tool", [IDENTITY, TOOL])
def test_a_twist_that_is_possible_at_a_singularity_has_its_rates(arm: RobotArm, tool: Transform) -> None:
    """Singular wrists and stretched arms: what some rates give, is given by the rates that are found."""
    q = joints(500, 9)
    J = arm.batch.jacobian(q, tool)
    twists = np.einsum("nij,nj->ni", J, np.random.default_rng(10).uniform(-1.0, 1.0, (500, 6)))
    found = [arm.joint_velocity(row, twist, tool) for row, twist in zip(rows(q), rows(twists), strict=True)]  # type: ignore[arg-type]
    assert np.abs(np.einsum("nij,nj->ni", J, found) - twists).max() < 1e-7


def test_degrees_of_the_reference_table_through_arrays() -> None:
    T = ARM.batch.forward(np.array([[radians(d) for d in (0, -45, 180, 0, 45, 0)]]))
    assert T[0, :, 3] * 1000 == pytest.approx([625.92, 149.09, -42.78], abs=0.006)
