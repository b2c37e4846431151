"""Every law on random straight lines out of any state of motion; `python -m tests.laws.lines` runs more of them."""

from __future__ import annotations

import pytest

from tests.examples import some
from tests.laws.lines import check_line
from vrs_cli.kinematics.robot_file import load_robot

SEEDS = {  # that have been harder than others: too much jerk or acceleration of a joint where the line starts
    "puma560": (412, 574, 627, 1322, 7694, 20229),
    "ur5e": (683, 694),
    "irb120": (3149, 3196, 3724, 4974, 5417),
}


@pytest.mark.parametrize("robot", SEEDS)
def test_a_random_line_keeps_every_law(robot: str) -> None:
    model = load_robot(robot)
    possible = [check_line(model, seed) for seed in (*range(some(64)), *SEEDS[robot])]
    assert sum(possible) > len(possible) // 3
