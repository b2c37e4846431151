"""Tests of accelerations and jerks of the joints along a line: they are the derivatives of g, whatever part of a pose
counts.
"""

from __future__ import annotations

from random import Random

import pytest

from tests.kinematics.pointing import CLOSED, FIVE, SEVEN
from vrs_cli.engine.problem import (
    Here,
    Problem,
    joint_acceleration,
    joint_acceleration_and_jerk,
    joint_velocity,
    segment_joints,
)
from vrs_cli.engine.single_motion import plan_motion
from vrs_cli.errors import MotionError
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.joints import Joints, Profile
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import IDENTITY, Transform, compose, from_oat
from vrs_cli.trajectory.segment import CartesianPath, Segment
from vrs_cli.trajectory.state import JointState
from vrs_cli.values.commands import Frames, Motion, MotionKind, Start

STEP = 1e-4  # [s] of differences
POINTING = [FIVE, SEVEN, CLOSED]
OTHERS = [load_robot(name) for name in ("puma560", "ur5e", "cobra600", "planar2", "planar3")]
TOOL = from_oat(0.0, 0.0, 0.1, 0.3, 0.4, 0.5)  # its tip on the axis whose turn does not count
ROBOTS = [*((model, TOOL) for model in POINTING), *((model, IDENTITY) for model in OTHERS)]


def lines(arm: RobotArm, tool: Transform) -> list[Segment]:
    """Yield the segments of random jerk-limited lines from rest."""
    source, model = Random(560), arm.model
    found: list[Segment] = []
    for _ in range(6):
        start = tuple(low + source.uniform(0.2, 0.8) * (high - low) for low, high in _ranges(model))
        goal = tuple(
            q + source.gauss(0.0, 0.05) * (high - low) for q, (low, high) in zip(start, _ranges(model), strict=True)
        )
        pose = compose(arm.forward(goal), tool)
        motion = Motion(1, MotionKind.STRAIGHT, Start.AT, pose=pose, frames=Frames(tool=tool), profile=Profile.SCURVE)
        try:
            found += plan_motion(Problem(arm, Here(JointState(start, (0.0,) * len(start))), motion, 0.0))
        except MotionError:
            continue
    return found


def _ranges(model: RobotModel) -> list[tuple[float, float]]:
    return list(zip(model.lower, model.upper, strict=True))


def rates(arm: RobotArm, segment: Segment, s: float) -> tuple[Joints, Joints, Joints, Joints]:
    """Return joints, velocity, acceleration and jerk."""
    path, tool = segment.path, segment.motion.frames.tool
    assert isinstance(path, CartesianPath)
    q = segment_joints(arm, segment, s)
    qd = joint_velocity(arm, path, s, q, path.twist(s), tool)
    qdd, jerk = joint_acceleration_and_jerk(arm, path, s, q, qd, tool)
    assert qdd == joint_acceleration(arm, path, s, q, qd, tool)
    return q, qd, qdd, jerk


@pytest.mark.parametrize(("model", "tool"), ROBOTS, ids=lambda value: getattr(value, "name", ""))
def test_each_is_the_derivative_of_the_one_before(model: RobotModel, tool: Transform) -> None:
    arm, checked = arm_for(model), 0
    for segment in lines(arm, tool):
        for part in (0.2, 0.5, 0.8):
            s = part * segment.duration
            step = min(STEP, 0.1 * segment.duration)
            before, here, after = (rates(arm, segment, s + side) for side in (-step, 0.0, step))
            if min(arm.singularity(here[0])) < 0.05:
                continue
            for a, b, derivative, size in zip(before, after, here[1:], (1e-4, 1e-3, 1e-2), strict=False):
                slope = tuple((y - x) / (2.0 * step) for x, y in zip(a, b, strict=True))
                assert derivative == pytest.approx(slope, rel=size, abs=size)
            checked += 1
    assert checked > 10
