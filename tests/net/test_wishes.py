"""Wishes on their way: known from their sending until the robot tells of them, or for so long that it never will."""

from __future__ import annotations

from vrs_cli.kinematics.transform import translation
from vrs_cli.net.wishes import PASSED_OVER, Wishes

HERE, THERE = translation(0.1, 0.0, 0.0), translation(0.2, 0.0, 0.0)


def test_the_oldest_is_the_first_that_nothing_was_told_of() -> None:
    wishes = Wishes()
    assert wishes.oldest(1.0, 0.5) is None
    wishes.sent(HERE, 1.0)
    wishes.sent(THERE, 1.1)
    wishes.sent(HERE, 1.2)
    assert wishes.oldest(1.2, 0.5) == 1.0
    wishes.counted(1.1)
    assert wishes.oldest(1.2, 0.5) == 1.2
    wishes.counted(1.2)
    assert wishes.oldest(1.2, 0.5) is None


def test_what_is_said_again_and_to_let_go_change_nothing() -> None:
    wishes = Wishes()
    wishes.sent(HERE, 1.0)
    wishes.counted(1.0)
    wishes.sent(HERE, 1.1)
    wishes.sent(None, 1.2)
    assert wishes.oldest(1.2, 0.5) is None
    wishes.sent(HERE, 1.3)
    assert wishes.oldest(1.3, 0.5) == 1.3, "it is taken again"


def test_one_that_is_never_told_of_is_forgotten() -> None:
    wishes = Wishes()
    wishes.sent(HERE, 1.0)
    assert wishes.oldest(1.4 + PASSED_OVER, 0.5) == 1.0
    assert wishes.oldest(1.6 + PASSED_OVER, 0.5) is None
