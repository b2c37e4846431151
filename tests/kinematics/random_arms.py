"""Arms that nobody built, as URDF text, with kinematics of their own: the product of the turns and slides that it says.

Axes are any of the six directions or askew, offsets are often zero, ranges narrow or wide, off zero, beyond a turn.
"""

from __future__ import annotations

from math import cos, pi, sin
from pathlib import Path
from random import Random
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.robot_file import load_robot

Floats = NDArray[np.float64]
Vector = tuple[float, float, float]

DIRECTIONS = [(1, 0, 0), (0, 1, 0), (0, 0, 1), (-1, 0, 0), (0, -1, 0), (0, 0, -1)]
ASKEW, SLIDES, NOTHING = 0.15, 0.1, 0.55  # parts of all axes, joints, offsets
REACH = (0.05, 0.5)  # [m]
TRAVEL = (0.1, 0.6)  # [m] of a joint that slides
SPANS = ((0.5, 2.0), (2.0, 2.0 * pi), (2.0 * pi, 4.0 * pi))  # [rad]


class Joint(NamedTuple):
    """A joint whose axis passes through `offset`, in the frame of the one before."""

    offset: Vector
    axis: Vector
    slides: bool
    lower: float
    upper: float


class DrawnArm(NamedTuple):
    joints: tuple[Joint, ...]
    hand: Vector

    def forward(self, q: Joints) -> Floats:
        """(3, 4), the pose of the flange."""
        R, p = np.eye(3), np.zeros(3)
        for joint, x in zip(self.joints, q, strict=True):
            p = p + R @ joint.offset
            if joint.slides:
                p = p + R @ (np.array(joint.axis) * x)
            else:
                R = R @ turn(joint.axis, x)
        return np.column_stack((R, p + R @ self.hand))

    def urdf(self) -> str:
        count = len(self.joints)
        rows = [_joint_text(i, joint) for i, joint in enumerate(self.joints, 1)]
        links = [f'<link name="l{i}"/>' for i in range(count + 1)]
        end = f'<origin xyz="{_text(self.hand)}"/><parent link="l{count}"/><child link="end"/>'
        hand = f'<joint name="hand" type="fixed">{end}</joint><link name="end"/>'
        return "\n".join(('<robot name="drawn">', *links, *rows, hand, "</robot>"))

    def model(self, folder: Path) -> RobotModel:
        file = folder / "drawn.urdf"
        file.write_text(self.urdf(), encoding="utf-8")
        return load_robot(file)

    def some_joints(self, source: Random) -> Joints:
        return tuple(source.uniform(joint.lower, joint.upper) for joint in self.joints)


def turn(axis: Vector, angle: float) -> Floats:
    """The rotation about an axis, by Rodrigues's formula."""
    x, y, z = axis
    K = np.array(((0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0)))
    return np.asarray(np.eye(3) + sin(angle) * K + (1.0 - cos(angle)) * (K @ K))


def draw_arm(source: Random, count: int) -> DrawnArm:
    """Of so many joints; two that follow each other never have one axis, and never both slide alike."""
    joints = [_draw_joint(source)]
    while len(joints) < count:
        joint = _draw_joint(source)
        before = joints[-1]
        alike = abs(np.dot(joint.axis, before.axis)) > 0.99
        if not (alike and (joint.slides or before.slides or not _across(joint))):
            joints.append(joint)
    return DrawnArm(tuple(joints), _offset(source))


def _draw_joint(source: Random) -> Joint:
    slides = source.random() < SLIDES
    axis = source.choice(DIRECTIONS)
    if source.random() < ASKEW:
        drawn = np.array([source.gauss(0.0, 1.0) for _ in range(3)])
        axis = tuple((drawn / np.linalg.norm(drawn)).tolist())
    span = source.uniform(*(TRAVEL if slides else source.choice(SPANS)))
    middle = source.uniform(-0.5, 0.5) * span
    return Joint(_offset(source), axis, slides, middle - span / 2, middle + span / 2)


def _offset(source: Random) -> Vector:
    x, y, z = (0.0 if source.random() < NOTHING else source.choice((-1, 1)) * source.uniform(*REACH) for _ in range(3))
    return x, y, z


def _across(joint: Joint) -> bool:
    """Whether its axis is away from one that is parallel to it and passes through the origin."""
    return float(np.linalg.norm(np.cross(joint.offset, joint.axis))) > REACH[0] / 2


def _joint_text(i: int, joint: Joint) -> str:
    kind = "prismatic" if joint.slides else "revolute"
    ends = f'<parent link="l{i - 1}"/><child link="l{i}"/><origin xyz="{_text(joint.offset)}"/>'
    limit = f'<limit lower="{joint.lower!r}" upper="{joint.upper!r}" effort="1" velocity="1"/>'
    return f'<joint name="j{i}" type="{kind}">{ends}<axis xyz="{_text(joint.axis)}"/>{limit}</joint>'


def _text(v: Vector) -> str:
    return " ".join(map(repr, v))
