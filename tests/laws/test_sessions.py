"""Every law after every command of long random sessions; `python -m tests.laws.long` runs more of them."""

from __future__ import annotations

import pytest

from tests.laws.sessions import Session
from vrs_cli.kinematics.robot_file import load_robot, robot_names


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("robot", robot_names())
def test_a_random_session_keeps_every_law_after_every_command(robot: str, seed: int) -> None:
    tally = Session(seed, load_robot(robot)).run(200)
    assert tally.commands == 200
    assert tally.edits > 50, "most commands change the timeline"
    assert tally.undone
    assert tally.explained
