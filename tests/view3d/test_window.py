"""When a window is shown: each picture of what moves, what is read ten times a second, at once what has happened."""

from __future__ import annotations

from contextlib import nullcontext
from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import pytest

from vrs_cli.engine.engine import Engine
from vrs_cli.interfaces.roles.observer import RecordedRobot
from vrs_cli.interfaces.roles.playback import Playback
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.values.commands import Move, Stamp
from vrs_cli.values.motion import JointTarget
from vrs_cli.view3d.parts import Shown
from vrs_cli.view3d.window import OFTEN, PERIOD, RobotWindow

MODEL = load_robot("puma560")
SECOND = 5.03  # [s] when the second motion begins
WALL = 10.04  # [s] a time of the day at which nothing is due


class Watching:
    """A window at a trajectory of two motions, with a part that keeps what it is shown. It is shown when it is due."""

    def __init__(self) -> None:
        engine = Engine(MODEL)
        for at, joint in ((1.0, 0.5), (SECOND, -0.5)):
            engine.perform(Move(JointTarget((joint, *MODEL.poses["ready"][1:])), False, stamp=Stamp(at)))
        self.timeline, self.wall, self.woken = engine.timeline, 0.0, 0
        self.shown: list[tuple[float, Shown]] = []
        client: Any = SimpleNamespace(atomic=nullcontext)
        self.window = RobotWindow(client, RecordedRobot(engine.arm, self.timeline), lambda: self.wall, 1.0, self._wake)
        self.window.parts.append(self)

    def _wake(self) -> None:
        self.woken += 1

    def show(self, shown: Shown) -> None:
        self.shown.append((self.wall, shown))

    def until(self, wall: float) -> list[tuple[float, Shown]]:
        """What is shown up to that time of the day [s]."""
        before = len(self.shown)
        while (due := max(self.window.due, self.wall)) <= wall:
            self.wall = due
            self.window.tick(due)
        self.wall = wall
        return self.shown[before:]


def gaps(shown: list[tuple[float, Shown]]) -> list[float]:
    return [after - before for (before, _), (after, _) in pairwise(shown)]


def test_what_moves_is_shown_fifty_times_a_second() -> None:
    watching = Watching()
    watching.until(1.0)
    between = gaps(watching.until(1.5))
    assert between == pytest.approx([PERIOD] * len(between))
    assert len(between) in (23, 24)


def test_what_stands_is_looked_at_ten_times_a_second() -> None:
    watching = Watching()
    begin, end = watching.timeline[1].start, watching.timeline.end
    assert begin == 1.0
    before = gaps(watching.until(0.95))
    watching.until(end + 0.2)
    after = gaps(watching.until(end + 1.15))
    for between in (before, after):
        assert between == pytest.approx([OFTEN] * len(between))
        assert len(between) in (8, 9)


@pytest.mark.parametrize("rate", [0.25, 1.0, 4.0])
def test_a_motion_is_seen_from_its_beginning(rate: float) -> None:
    watching = Watching()
    watching.window.change(lambda playback, wall: playback.at_rate(rate, wall))
    shown = [now.t for _, now in watching.until(30.0)]
    assert min(abs(t - SECOND) for t in shown) < 1e-9


def test_what_is_read_is_looked_at_ten_times_a_second_while_it_moves() -> None:
    watching = Watching()
    watching.until(1.0)
    shown = watching.until(1.5)
    assert sum(now.reads for _, now in shown) == pytest.approx(0.5 / OFTEN, abs=1)
    assert len(shown) in (24, 25)


def test_a_picture_that_is_late_does_not_make_the_others_late() -> None:
    watching = Watching()
    watching.until(1.1)
    due = watching.window.due
    watching.window.tick(due + 0.7 * PERIOD)
    assert watching.window.due == pytest.approx(due + PERIOD)
    watching.window.tick(due + 5.0 * PERIOD)
    assert watching.window.due == pytest.approx(due + 6.0 * PERIOD), "pictures that were left out are not made up for"


def test_what_happens_is_shown_at_once_but_not_faster_than_pictures_come() -> None:
    watching = Watching()
    window = watching.window
    window.change(Playback.pause)
    watching.until(WALL)
    assert window.due > WALL
    before = watching.woken
    window.wake()
    assert window.due <= WALL
    assert watching.woken == before + 1
    window.wake()
    assert watching.woken == before + 1, "it is known already"
    window.tick(WALL)
    window.wake()
    assert window.due == pytest.approx(WALL + PERIOD)
    window.tick(window.due)
    window.doing(lambda: None)(None)
    assert window.due == pytest.approx(WALL + 2.0 * PERIOD)


def test_a_part_may_ask_to_be_shown_again() -> None:
    watching = Watching()
    window = watching.window
    window.change(Playback.pause)
    watching.until(WALL)
    window.tick(WALL)
    window.again(WALL + 0.05)
    assert window.due == pytest.approx(WALL + 0.05)
    window.again(WALL + 0.07)
    assert window.due == pytest.approx(WALL + 0.05), "somebody wants it sooner"
    window.again()
    assert window.due == pytest.approx(WALL + PERIOD)
