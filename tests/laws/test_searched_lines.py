"""The law of lines of arms without a closed form, on a few; `python -m tests.laws.searched_lines` has more."""

from __future__ import annotations

import pytest

from tests.laws.searched_lines import check_line
from vrs_cli.kinematics.robot_file import load_robot

LINES = {"so100": (9, 186), "xarm6": range(2), "panda": range(2)}  # of 9 joints jumped; 186 was told of wrongly


@pytest.mark.parametrize("robot", LINES)
def test_no_joint_of_a_line_jumps(robot: str) -> None:
    assert sum([check_line(load_robot(robot), seed) for seed in LINES[robot]]) > 0
