"""Every law after every command of long random sessions; `python -m tests.laws.long` runs more of them."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.examples import first, some
from tests.laws.sessions import Session
from tests.robots import QUICK, SEARCHED
from vrs_cli.kinematics.robot_file import load_robot

URDF = Path(__file__).parent.parent / "kinematics" / "urdf"


COMMANDS = some(600)
FEW = some(64)


@pytest.mark.parametrize("seed", range(some(4) // 2))
@pytest.mark.parametrize("robot", QUICK)
def test_a_random_session_keeps_every_law_after_every_command(robot: str, seed: int) -> None:
    tally = Session(seed, load_robot(robot)).run(COMMANDS)
    assert tally.commands == COMMANDS
    assert tally.edits > COMMANDS // 4, "many commands change the timeline"
    assert tally.undone
    assert tally.explained, "WHY was asked"
    assert tally.told, "motions were told before they were done"


@pytest.mark.parametrize("name", first(2, ["gantry.urdf", "crooked.urdf", *SEARCHED]))
def test_a_session_of_a_robot_without_a_closed_form(name: str) -> None:
    session = Session(1, load_robot(URDF / name if name.endswith(".urdf") else name))
    assert session.run(FEW).edits > FEW // 4
    session.explain()
