"""The laws of lines next to boundaries, on a few of each robot; `python -m tests.laws.boundary_lines` has more."""

from __future__ import annotations

import pytest

from tests.laws.boundary_lines import check_line
from vrs_cli.kinematics.robot_file import load_robot, robot_names

HARDER = {"puma560": (2221, 2463, 5031), "puma260": (30, 2832), "irb120": (2934, 5346), "ur5e": (4495,)}  # than others


@pytest.mark.parametrize("robot", robot_names())
def test_a_line_next_to_a_boundary_keeps_every_law(robot: str) -> None:
    model = load_robot(robot)
    seeds = range(9 if model.joint_count == 6 else 30)  # most lines on the edge of a plane's reach leave it
    assert sum([check_line(model, seed) for seed in (*seeds, *HARDER.get(robot, ()))]) > 0
