"""Names, order and signs of the eight configurations."""

from __future__ import annotations

import pickle
from math import radians

import pytest

from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.joints import ALL, Arm, Configuration, Elbow, Wrist
from vrs_cli.kinematics.robot_file import load_robot

ARM = arm_for(load_robot("puma560"))


def test_the_eight_in_their_order() -> None:
    assert [str(c) for c in ALL] == [
        "RIGHTY ABOVE NOFLIP",
        "RIGHTY ABOVE FLIP",
        "RIGHTY BELOW NOFLIP",
        "RIGHTY BELOW FLIP",
        "LEFTY ABOVE NOFLIP",
        "LEFTY ABOVE FLIP",
        "LEFTY BELOW NOFLIP",
        "LEFTY BELOW FLIP",
    ]
    assert [c.index for c in ALL] == list(range(8))
    assert ALL[5].signs == (-1.0, 1.0, -1.0)


def test_equal_by_value_and_fit_for_pickle() -> None:
    c = Configuration(Arm.LEFTY, Elbow.BELOW, Wrist.FLIP)
    assert c == ALL[7]
    assert hash(c) == hash(ALL[7])
    assert pickle.loads(pickle.dumps(c)) == c


def test_words_beside() -> None:
    assert ALL[7].words_beside((ALL[0],)) == ("LEFTY", "BELOW", "FLIP")
    assert ALL[5].words_beside((ALL[0], ALL[1])) == ("LEFTY",)


@pytest.mark.parametrize(
    ("degrees", "expected"),
    [
        ((0, -90, 90, 0, 0, 0), "RIGHTY ABOVE NOFLIP"),  # READY
        ((0, 0, 0, 0, 0, 0), "LEFTY BELOW NOFLIP"),  # forearm up from the end of a level upper arm
        ((0, -200, -30, 0, 50, 0), "RIGHTY ABOVE NOFLIP"),  # NEST
        ((20, -60, 150, 10, -30, -40), "LEFTY ABOVE FLIP"),  # forearm hangs from a raised upper arm
        ((20, -60, 30, 10, 30, -40), "RIGHTY ABOVE NOFLIP"),  # forearm laid back over the shoulder
    ],
)
def test_configuration_of_joints(degrees: tuple[float, ...], expected: str) -> None:
    assert str(ARM.configuration(tuple(map(radians, degrees)))) == expected


@pytest.mark.parametrize("q2", range(-220, 45, 9))
def test_righty_is_where_joint_2_raises_the_wrist(q2: int) -> None:
    here = tuple(map(radians, (10, q2, 150, 0, 30, 0)))
    there = (*here[:1], here[1] + 1e-6, *here[2:])

    def wrist_height(q: tuple[float, ...]) -> float:
        T = ARM.forward(q)
        return T.pz - 0.05625 * T.az

    raises = wrist_height(there) > wrist_height(here)
    assert (ARM.configuration(here).arm is Arm.RIGHTY) == raises
