"""The laws of lines next to boundaries, on a few of each kind; `python -m tests.laws.boundary_lines` has more."""

from __future__ import annotations

import pytest

from tests.examples import some
from tests.laws.boundary_lines import check_line
from tests.robots import KINDS, SEARCHED
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.robot_file import load_robot

HARDER = {"puma560": (2221, 2463, 5031), "puma260": (30, 2832), "irb120": (2934, 5346), "ur5e": (4495,)}  # than others


@pytest.mark.parametrize("robot", dict.fromkeys((*KINDS, *HARDER)))
def test_a_line_next_to_a_boundary_keeps_every_law(robot: str) -> None:
    model = load_robot(robot)
    planar = "all axes parallel" in arm_for(model).method  # most lines on the edge of a plane's reach leave it
    seeds = range(some(200) if planar else some(14) if robot in SEARCHED else some(34))
    assert sum([check_line(model, seed) for seed in (*seeds, *HARDER.get(robot, ()))]) > 0
