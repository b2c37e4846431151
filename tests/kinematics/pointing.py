"""Robots whose task is `pointing`: with five joints, with more, and with a closed form for the whole pose."""

from __future__ import annotations

from pathlib import Path

from msgspec import structs

from vrs_cli.kinematics.model import ArmTask, RobotModel
from vrs_cli.kinematics.robot_file import load_robot

URDF = Path(__file__).parent / "urdf"


def without_last_joint(model: RobotModel) -> RobotModel:
    return structs.replace(
        model,
        name=f"{model.name} without its last joint",
        task=ArmTask.POINTING,
        links=model.links[:-1],
        lower=model.lower[:-1],
        upper=model.upper[:-1],
        max_velocity=model.max_velocity[:-1],
        max_acceleration=model.max_acceleration[:-1],
        max_jerk=model.max_jerk[:-1],
        poses={name: joints[:-1] for name, joints in model.poses.items()},
    )


FIVE = without_last_joint(load_robot("puma560"))
SEVEN = structs.replace(load_robot(URDF / "seven.urdf"), task=ArmTask.POINTING)
CLOSED = structs.replace(load_robot("ur5e"), task=ArmTask.POINTING)
