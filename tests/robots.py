"""The built-in robots by how they are solved, for laws that hold whatever the figures of a robot are.

What a robot's own file decides (its figures, its shapes, its words) is tried with `robot_names()`: all of them.
"""

from __future__ import annotations

from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.robot_file import load_robot

QUICK = ("cobra600", "irb120", "planar2", "planar3", "puma560", "ur5e", "xarm6")
SEARCHED = ("panda", "so100")  # their joints are found by searches, which take ten times as long
KINDS = (*QUICK, *SEARCHED)


def kind_of(name: str) -> tuple[str, str, str, int]:
    """How an arm is solved, what for, and by how many joints."""
    arm = arm_for(load_robot(name))
    return type(arm).__name__, arm.method, arm.model.task.name, arm.model.joint_count
