"""Which walks of an arm with joints too many are tried, and in which order."""

from __future__ import annotations

import pytest

from vrs_cli.kinematics.joints import Joints, Walk
from vrs_cli.kinematics.numeric.arm import NumericArm
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import IDENTITY

MODEL = load_robot("iiwa14")
MIDDLE = tuple((low + high) / 2 for low, high in zip(MODEL.lower, MODEL.upper, strict=True))
NEAR_AN_END = (MODEL.lower[0] + 0.01 * (MODEL.upper[0] - MODEL.lower[0]), *MIDDLE[1:])


def margins(monkeypatch: pytest.MonkeyPatch, begin: Joints, walked: dict[float, tuple[float, bool]]) -> list[float]:
    """The margins of the walks in their order; each part of the gradient gives a margin, and whether it arrives."""

    def walk(_arm: object, _begin: Joints, _poses: object, _asked: object, part: float) -> Walk:
        margin, arrives = walked[part]
        return Walk(begin, (), margin, arrives)

    monkeypatch.setattr(NumericArm, "_walk", walk)
    return [one.margin for one in NumericArm(MODEL).walks(begin, (IDENTITY,), ())]


def test_walks_far_from_the_ends_of_ranges_come_first_and_the_others_after_them(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    walked = {0.0: (0.01, True), 0.5: (0.02, True), 1.0: (0.05, True), 2.0: (0.04, True), 4.0: (0.03, True)}
    assert margins(monkeypatch, MIDDLE, walked) == [0.05, 0.04, 0.03, 0.02, 0.01]


def test_walks_that_do_not_arrive_or_leave_a_range_are_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    walked = {0.0: (-0.01, True), 0.5: (0.02, False), 1.0: (0.4, False), 2.0: (-0.03, True), 4.0: (0.0, True)}
    assert margins(monkeypatch, MIDDLE, walked) == [0.0, -0.01]


def test_a_walk_that_keeps_as_far_as_it_begins_is_far_enough(monkeypatch: pytest.MonkeyPatch) -> None:
    walked = {0.0: (0.005, True), 0.5: (0.01, True), 1.0: (0.02, True), 2.0: (0.009, True), 4.0: (0.4, False)}
    assert margins(monkeypatch, NEAR_AN_END, walked) == [0.01, 0.02, 0.009, 0.005]
