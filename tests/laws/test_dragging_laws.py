"""A tool that is dragged anyhow, beyond its reach and through singularities: no limit is exceeded, nothing jumps, the
elbow stays, what is said to hold it does, and it goes on from wherever it is held.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.examples import in_full, some
from tests.laws.drags import Hand, follow
from tests.robots import KINDS
from vrs_cli.kinematics.numeric.search import Miss
from vrs_cli.kinematics.robot_file import load_robot

URDF = Path(__file__).parent.parent / "kinematics" / "urdf"
SOME = some(4) // 2  # seeds
RMS = Miss(0.004, 0.015)  # [m, rad] of a tool that follows a hand inside its reach


@pytest.mark.parametrize("seed", range(1, 1 + SOME))
@pytest.mark.parametrize("name", [*KINDS, "crooked.urdf"])
def test_a_tool_that_is_dragged_anyhow_keeps_the_laws(name: str, seed: int) -> None:
    model = load_robot(URDF / name if name.endswith(".urdf") else name)
    hand = Hand(seed, model, ("LSPB", "SCURVE")[seed % 2])
    hand.drag(4.0 if in_full() else 0.8)
    hand.settle()


@pytest.mark.parametrize(("name", "seed", "profile"), [("irb120", 101, "SCURVE"), ("lrmate200id", 10, "LSPB")])
def test_a_fast_arm_is_not_thrown_over_the_axis_of_joint_1(name: str, seed: int, profile: str) -> None:
    """Its elbow comes down to the axis at full speed."""
    hand = Hand(seed, load_robot(name), profile)
    hand.drag(3.0)


@pytest.mark.parametrize("name", KINDS)
def test_inside_its_reach_it_follows_a_hand(name: str) -> None:
    rms = follow(load_robot(name), 1, 3.0)
    assert rms.within(*RMS), rms
