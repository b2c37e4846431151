"""The steps of closed forms: each beside the textbook, and what they lead to beside the links."""

from __future__ import annotations

from math import pi
from random import Random

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.robots import QUICK
from vrs_cli.kinematics.forms import MappedArm, arm_for
from vrs_cli.kinematics.joints import ALL, Joints
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import Transform

Matrix = NDArray[np.float64]
D2, A2, A3, D4, D6 = 0.14909, 0.4318, -0.02032, 0.43307, 0.05625  # of the PUMA 560 [m] (Fu, Gonzalez, Lee, table 2.1)
LINKS = ((0.0, 0.0, -90), (D2, A2, 0), (0.0, A3, 90), (D4, 0.0, -90), (0.0, 0.0, 90), (D6, 0.0, 0))  # d, a, alpha


def link(theta: float, d: float, a: float, alpha: float) -> Matrix:
    """A_i of Denavit and Hartenberg, as the textbook prints it."""
    ct, st, ca, sa = np.cos(theta), np.sin(theta), np.cos(np.radians(alpha)), np.sin(np.radians(alpha))
    return np.array([[ct, -ca * st, sa * st, a * ct], [st, ca * ct, -sa * ct, a * st], [0, sa, ca, d], [0, 0, 0, 1]])


def flange(q: Joints) -> Matrix:
    T = np.eye(4)
    for theta, (d, a, alpha) in zip(q, LINKS, strict=True):
        T = T @ link(theta, d, a, alpha)
    return T


def transform(T: Matrix) -> Transform:
    return Transform(*T[:3].ravel().tolist())


def same_angle(a: float, b: float) -> bool:
    return abs((a - b + pi) % (2.0 * pi) - pi) < 1e-9


@pytest.mark.parametrize("seed", range(4))
def test_the_steps_of_the_puma_are_those_of_the_textbook(seed: int) -> None:
    """Fu, Gonzalez and Lee, section 2.3.3: joints 1 to 3 by their sines and cosines."""
    random, arm = Random(seed), arm_for(load_robot("puma560"))
    T = flange(tuple(random.uniform(-1.5, 1.5) for _ in range(6)))
    p = T[:3, 3] - D6 * T[:3, 2]
    r, R = np.sqrt(p[0] ** 2 + p[1] ** 2 - D2**2), np.sqrt(p @ p - D2**2)
    bars = np.hypot(D4, A3)
    for way in ALL:
        steps = arm.branch_steps(transform(T), way, arm.middle)
        found = arm.branch_joints(transform(T), way, arm.middle)
        if found is None:
            continue
        ARM, ELBOW, WRIST = steps["arm"], steps["elbow"], steps["wrist"]
        assert way.signs == (ARM, ELBOW, WRIST)
        assert (steps["x"], steps["y"], steps["v"]) == pytest.approx((p[0], p[1], -p[2]), abs=1e-12)
        assert steps["u2"] == pytest.approx(r * r)
        theta1 = np.arctan2(-ARM * p[1] * r - p[0] * D2, -ARM * p[0] * r + p[1] * D2)
        alpha = np.arctan2(-p[2] / R, -ARM * r / R)
        beta = np.arccos((A2**2 + R**2 - bars**2) / (2.0 * A2 * R))
        phi = np.arctan2(
            ARM * ELBOW * np.sqrt(1.0 - ((A2**2 + bars**2 - R**2) / (2.0 * A2 * bars)) ** 2),
            (A2**2 + bars**2 - R**2) / (2.0 * A2 * bars),
        )
        assert same_angle(steps["q1"], theta1)
        assert same_angle(steps["q2"], alpha + ARM * ELBOW * beta)
        assert same_angle(steps["q3"], phi - np.arctan2(D4, abs(A3)))
        q = tuple(steps[f"q{i}"] for i in range(1, 7))
        assert flange(q) == pytest.approx(T, abs=1e-9)
        assert steps["s5"] == pytest.approx(abs(np.sin(steps["q5"])))
        assert np.sign(np.sin(steps["q5"])) == WRIST
        assert all(map(same_angle, q, found))


@pytest.mark.parametrize("name", [one for one in QUICK if one != "xarm6"])
def test_the_steps_lead_to_the_joints_that_are_used(name: str) -> None:
    random, arm = Random(7), arm_for(load_robot(name))
    for _ in range(5):
        q = tuple(random.uniform(low, high) for low, high in zip(arm.model.lower, arm.model.upper, strict=True))
        T = arm.forward(q)
        for solution in arm.inverse_all(T):
            steps = arm.branch_steps(T, solution.configuration, arm.middle)
            found = arm.branch_joints(T, solution.configuration, arm.middle)
            assert (found is None) == (solution.joints is None)
            assert steps
            if solution.joints is None or found is None:
                continue
            counted = slice(None) if arm.model.joint_count > 2 else slice(3, 8, 4)  # two joints choose X and Y alone
            assert arm.forward(solution.joints)[counted] == pytest.approx(T[counted], abs=1e-8)
            angles = [steps[f"q{i}"] for i in range(1, 7) if f"q{i}" in steps]
            if isinstance(arm, MappedArm):
                angles = [s * (x - z) for x, (s, z) in zip(angles, arm.senses, strict=True)]
            assert all(map(same_angle, angles, solution.joints))


def test_a_search_has_no_steps() -> None:
    arm = arm_for(load_robot("panda"))
    q = arm.model.poses["ready"]
    assert not arm.branch_steps(arm.forward(q), arm.ways[0], q)
    assert not arm.constants
