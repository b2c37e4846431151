"""A preview is what the robot will do, with all that is on its way, and says how far that is confirmed."""

from __future__ import annotations

from itertools import pairwise
from math import inf, radians
from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec import structs

from tests.engine.wall import ManualWall
from tests.examples import examples, some
from vrs_cli.engine.engine import Engine
from vrs_cli.engine.feed import Snapshot
from vrs_cli.engine.position import joints_at
from vrs_cli.errors import JointOutOfRange, TooLate, VrsError
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import translation
from vrs_cli.net.mirror import Mirror
from vrs_cli.net.preview import MAX_TARGET_AGE_S, DragTargets, Flags, FlagWindow, Preview, merge_windows
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.commands import JointTarget, Move, Request, SetParameter, SetSpeed, Stamp

MODEL = load_robot("puma560")
ARM = arm_for(MODEL)
FORWARD, BACKWARD = 0.25, 0.125
READY = MODEL.poses["ready"]


def move(jt1: float, at: float | None = None) -> Move:
    target = JointTarget((radians(jt1), *READY[1:]))
    return Move(target, False, stamp=None if at is None else Stamp(at), text=f"MOVE {jt1:g}")


class Line:
    """A robot, who commands it from afar, and constant delays between them."""

    def __init__(self, policy: str = "ABORT", forward: float = FORWARD) -> None:
        self.wall = ManualWall(0.0)
        self.robot = Engine(MODEL, clock=self.wall.clock())
        self.robot.perform(SetParameter("CAUSALITY", policy))
        self.heard = self.robot.events.subscribe()
        self.heard.take()
        self.mirror = Mirror(self.robot.arm, Snapshot.of(self.robot.timeline, self.robot.settings), 0, self.wall)
        self.preview = Preview(self.mirror, forward)

    def carried_out(self, id: int, request: Request, issued: float) -> bool:
        """The command arrives at the robot; its answer comes back, and the change not yet."""
        done = self.arrived(request, issued)
        if done:
            self.preview.finish(id, self.robot.timeline.version)
        else:
            self.preview.refuse(id)
        return done

    def arrived(self, request: Request, issued: float) -> bool:
        self.wall.seconds = issued + FORWARD
        self.robot.clock.advance(self.robot.clock.reached)
        try:
            self.robot.begin(request, program=False, issued=issued)
        except VrsError:
            return False
        return True

    def changes_arrive(self) -> None:
        for event in self.heard.take_all():
            self.mirror.change(event, self.mirror.seq + 1)  # type: ignore[arg-type]


def paths(timeline: Timeline) -> list[object]:
    """All but the numbers of motions, which a preview does not know."""
    return [(it.start, it.finish, it.path, it.phase, structs.replace(it.motion, number=0)) for it in timeline]


def test_a_command_is_seen_at_once_and_confirmed_when_its_change_has_come() -> None:
    line, request = Line(), move(30.0, at=1.0)
    expected = line.preview.send(1, request, 0.5)
    assert (expected.begin, expected.refused) == (1.0, None)
    assert line.preview.unconfirmed_from == 1.0
    before = paths(line.preview.timeline)
    assert len(line.mirror.timeline) < len(line.preview.timeline)
    assert line.carried_out(1, request, 0.5)
    assert line.preview.unconfirmed_from == 1.0, "the answer has come, the change has not"
    line.changes_arrive()
    assert line.preview.unconfirmed_from == inf
    assert line.preview.timeline is line.mirror.timeline
    assert paths(line.robot.timeline) == before, "the robot did what was seen"


def test_the_change_may_come_before_the_answer() -> None:
    line, request = Line(), move(30.0, at=1.0)
    line.preview.send(1, request, 0.5)
    assert line.arrived(request, 0.5)
    line.changes_arrive()
    assert line.preview.unconfirmed_from == 1.0
    line.preview.finish(1, line.robot.timeline.version)
    assert line.preview.unconfirmed_from == inf


def test_a_command_that_will_come_too_late_is_told_when_it_is_sent() -> None:
    expected = Line().preview.send(1, move(30.0, at=0.6), 0.5)
    assert isinstance(expected.refused, TooLate)
    assert expected.begin is None


def test_a_command_that_will_be_postponed_is_seen_where_it_will_be() -> None:
    line, first, second = Line("POSTPONE"), move(30.0, at=1.0), move(-30.0, at=1.2)
    line.preview.send(1, first, 0.5)
    expected = line.preview.send(2, second, 1.1)
    seen = paths(line.preview.timeline)
    assert line.carried_out(1, first, 0.5)
    assert line.carried_out(2, second, 1.1)
    assert expected.begin == line.robot.book.deltas[-1].cut > 1.1 + FORWARD
    assert paths(line.robot.timeline) == seen


def test_what_is_refused_is_seen_no_longer() -> None:
    line = Line()
    assert isinstance(line.preview.send(1, move(400.0, at=2.0), 0.5).refused, JointOutOfRange)
    line.preview.send(2, move(30.0, at=2.0), 0.6)
    line.preview.refuse(2)
    assert line.preview.timeline == line.mirror.timeline
    assert line.preview.unconfirmed_from == inf


def test_settings_count_for_what_is_sent_after_them() -> None:
    line, slow, request = Line(), SetSpeed(10.0, always=True), move(30.0, at=1.0)
    line.preview.send(1, slow, 0.4)
    line.preview.send(2, request, 0.5)
    seen = paths(line.preview.timeline)
    assert line.carried_out(1, slow, 0.4)
    line.changes_arrive()
    assert line.preview.plan.expected[0].id == 2, "a setting is confirmed by its answer: no change comes of it"
    assert paths(line.preview.timeline) == seen
    assert line.carried_out(2, request, 0.5)
    assert paths(line.robot.timeline) == seen


@pytest.mark.parametrize("policy", ["ABORT", "POSTPONE"])
@pytest.mark.parametrize("seed", range(some(8)))
def test_with_delays_that_are_known_the_robot_does_what_was_seen(seed: int, policy: str) -> None:
    """A supervisor alone at a robot: what is seen of any time, all that is commanded before being known, happens."""
    line, random, t = Line(policy), Random(seed), 0.0
    for number in range(12):
        t += random.uniform(FORWARD + BACKWARD, 1.0)
        request = move(random.uniform(-100, 100), at=t + random.uniform(0.0, 0.8))
        line.preview.send(number, request, t)
        looks = [t + random.uniform(0.0, 2.0) for _ in range(5)]
        seen = [joints_at(ARM, line.preview.timeline, look) for look in looks]
        expected = line.preview.plan.expected[-1]
        assert line.carried_out(number, request, t) is (expected.refused is None)
        assert [joints_at(ARM, line.robot.timeline, look) for look in looks] == seen
        line.changes_arrive()
        assert line.preview.unconfirmed_from == inf


HERE, THERE = translation(0.1, 0.0, 0.0), translation(0.2, 0.0, 0.0)


def test_the_oldest_is_the_first_that_nothing_was_told_of() -> None:
    wishes = DragTargets()
    assert wishes.oldest(1.0, 0.5) is None
    wishes.add(HERE, 1.0)
    wishes.add(THERE, 1.1)
    wishes.add(HERE, 1.2)
    assert wishes.oldest(1.2, 0.5) == 1.0
    wishes.drop_until(1.1)
    assert wishes.oldest(1.2, 0.5) == 1.2
    wishes.drop_until(1.2)
    assert wishes.oldest(1.2, 0.5) is None


def test_what_is_said_again_and_to_let_go_change_nothing() -> None:
    wishes = DragTargets()
    wishes.add(HERE, 1.0)
    wishes.drop_until(1.0)
    wishes.add(HERE, 1.1)
    wishes.add(None, 1.2)
    assert wishes.oldest(1.2, 0.5) is None
    wishes.add(HERE, 1.3)
    assert wishes.oldest(1.3, 0.5) == 1.3, "it is taken again"


def test_one_that_is_never_told_of_is_forgotten() -> None:
    wishes = DragTargets()
    wishes.add(HERE, 1.0)
    assert wishes.oldest(1.4 + MAX_TARGET_AGE_S, 0.5) == 1.0
    assert wishes.oldest(1.6 + MAX_TARGET_AGE_S, 0.5) is None


def test_what_a_change_makes_wrong_lies_between_its_cut_and_its_arrival() -> None:
    flags = Flags()
    assert flags.add_change(cut=2.0, applied=1.0, at=2.5) == FlagWindow(2.0, 2.5)


def test_a_change_of_the_past_was_right_until_it_was_made() -> None:
    assert Flags().add_change(cut=0.5, applied=1.0, at=1.2) == FlagWindow(1.0, 1.2)


def test_a_change_that_arrives_before_its_cut_makes_nothing_wrong() -> None:
    flags = Flags()
    assert flags.add_change(cut=3.0, applied=1.0, at=2.5) is None
    assert not flags.windows


def test_who_looks_ahead_was_shown_more() -> None:
    assert Flags(ahead=0.75).add_change(cut=3.0, applied=1.0, at=2.5) == FlagWindow(3.0, 3.25)


def test_what_ended_long_ago_is_forgotten() -> None:
    flags = Flags()
    flags.add_change(1.0, 1.0, 1.5)
    flags.add_change(4.0, 4.0, 4.5)
    flags.forget(before=2.0)
    assert flags.windows == (FlagWindow(4.0, 4.5),)


def test_windows_are_kept_merged_and_found_however_many_there_are() -> None:
    random, flags, told = Random(4), Flags(), []
    for _ in range(300):
        begin = random.uniform(0.0, 100.0)
        window = FlagWindow(begin, begin + random.uniform(0.0, 0.5))
        flags.add_change(window.begin, 0.0, window.end)
        told.append(window)
        assert flags.windows == merge_windows(told)
    flags.forget(50.0)
    assert flags.windows == tuple(one for one in merge_windows(told) if one.end >= 50.0)


numbers = st.integers(0, 40).map(lambda count: count / 4)


@examples(200)
@given(st.lists(st.tuples(numbers, numbers)))
def test_merged_windows_are_the_same_times(pairs: list[tuple[float, float]]) -> None:
    windows = [FlagWindow(min(pair), max(pair)) for pair in pairs]
    found = merge_windows(windows)
    for t in (count / 8 for count in range(81)):
        inside = any(window.begin <= t <= window.end for window in windows)
        assert any(window.begin <= t <= window.end for window in found) is inside
    assert all(one.end < other.begin for one, other in pairwise(found))
