"""A tool dragged at a robot that is served: it follows by itself, and is let go when nothing is heard any more."""

from __future__ import annotations

from collections.abc import Iterator
from math import cos, pi, radians, sin, sqrt
from random import Random

import pytest

from tests.engine.wall import ManualWall
from tests.interfaces.holders.holder import Holder
from tests.interfaces.terminals import RecordingTerminal
from vrs_cli.engine.clock import RobotClock
from vrs_cli.errors import IllegalValue, LeaseHeld, RequestRefused, RoleWanted, UsageError
from vrs_cli.interfaces.dragging import Dragging
from vrs_cli.interfaces.session.session import Session
from vrs_cli.interfaces.targets import RELEASE_AFTER_S, TargetControl
from vrs_cli.interfaces.users import RobotLease
from vrs_cli.kinematics.transform import Transform, at_position, distance, from_oat
from vrs_cli.language.words.word import Role
from vrs_cli.values.dragging import DragState, Hold, Limit, Shortfall

TABLE = from_oat(0.0, 0.45, -0.15, radians(90), radians(90), 0.0)


def moved(x: float, y: float, z: float) -> Transform:
    return at_position(TABLE, TABLE.px + x, TABLE.py + y, TABLE.pz + z)


class Served:
    """A robot in real time, which passes when the robot waits, and one who holds it."""

    def __init__(self, clock: RobotClock | None = None) -> None:
        self.wall = ManualWall()
        self.session = Session(RecordingTerminal(), clock=clock or self.wall.clock())
        self.targets = TargetControl(self.session)
        self.ann = Holder(self.session, Role.SUPERVISOR, "ann")
        self.do("MOVE TRANS(0, 450, -150, 90, 90, 0)")
        self.pass_time(3.0)

    def do(self, line: str) -> None:
        self.session.actor.finish(self.ann.ask(line), self.session.terminal)

    def pull(self, wish: Transform | None, who: Holder | None = None, issued: float | None = None) -> None:
        self.session.actor.finish(
            (who or self.ann).call(lambda _session: self.targets.pull(wish, issued)), self.session.terminal
        )

    def pass_time(self, seconds: float) -> None:
        """What the robot does meanwhile is done."""
        until = self.wall.seconds + seconds
        while self.wall.seconds < until:
            before = self.wall.seconds
            if self.session.actor.peek() < self.session.engine.clock.reached + until - before:
                self.session.actor.step()
            if self.wall.seconds == before:
                self.wall.seconds = min(before + 0.005, until)

    @property
    def tool(self) -> Transform:
        engine = self.session.engine
        return engine.position(engine.clock.reached).T_world_tool

    @property
    def stands(self) -> bool:
        engine = self.session.engine
        return engine.end <= engine.clock.reached


@pytest.fixture
def served() -> Served:
    return Served()


def test_one_wish_is_enough_to_get_there(served: Served) -> None:
    """The robot goes on by itself: nobody has to say where it is now."""
    wish = moved(0.1, 0.0, 0.1)
    served.pull(wish)
    for _ in range(10):
        served.pass_time(0.25)
        served.pull(wish)
    assert distance(served.tool, wish) < 1e-6
    assert served.session.pulled == DragState("ann")


def test_who_is_not_heard_of_lets_go_and_the_arm_comes_to_rest(served: Served) -> None:
    served.pull(moved(0.3, 0.3, 0.3))
    served.pass_time(RELEASE_AFTER_S + 1.0)
    assert served.stands
    assert served.session.pulled == DragState(why="nothing was heard any more")
    served.pull(moved(0.1, 0.0, 0.0))  # it needs nothing to go on
    assert served.session.pulled.by == "ann"


def test_let_go_it_rests_soon(served: Served) -> None:
    for k in range(20):
        served.pull(moved(0.01 * k, 0.0, 0.0))
        served.pass_time(0.02)
    assert not served.stands
    served.pull(None)
    assert served.session.pulled == DragState()
    served.pass_time(0.4)
    assert served.stands


def test_it_tells_which_wish_it_goes_after_and_the_motion_is_as_old_as_the_first(served: Served) -> None:
    engine = served.session.engine
    begin = engine.clock.reached
    served.pull(moved(0.1, 0.0, 0.0), issued=begin - 0.25)
    assert served.session.pulled.issued == begin - 0.25
    served.pull(moved(0.2, 0.0, 0.0), issued=begin - 0.2)
    assert served.session.pulled.issued == begin - 0.25, "until its next tick"
    served.pass_time(0.1)
    assert served.session.pulled == DragState("ann", served.session.pulled.held, issued=begin - 0.2)
    served.pull(None, issued=begin - 0.1)
    assert served.session.pulled == DragState(issued=begin - 0.1)
    last = engine.book.records()[-1]
    assert last.issued == pytest.approx(begin - 0.25, abs=1e-6)
    assert last.executed == pytest.approx(begin, abs=1e-6)


def test_a_wish_that_is_refused_or_passed_over_is_told_too(served: Served) -> None:
    served.session.lease = RobotLease("carl", 1e9)
    with pytest.raises(LeaseHeld):
        served.pull(TABLE, issued=1.5)
    assert served.session.pulled == DragState(issued=1.5)
    served.session.lease = None
    served.pull(None)
    served.pull(TABLE, issued=1.6)
    served.do("ABORT")
    served.pass_time(0.1)
    with pytest.raises(RequestRefused):
        served.pull(TABLE, issued=1.7)
    assert served.session.pulled.by == ""
    assert served.session.pulled.issued == 1.7


def test_what_holds_it_is_told(served: Served) -> None:
    for _ in range(30):
        served.pull(moved(0.0, 2.0, 0.0))
        served.pass_time(0.1)
    assert Hold(Limit.REACH, which="far") in served.session.pulled.held.holds
    for _ in range(30):
        served.pull(TABLE)
        served.pass_time(0.1)
    assert served.session.pulled == DragState("ann", Shortfall())


@pytest.mark.parametrize("line", ["ABORT", "MOVE #PPOINT(0, -90, 90, 0, 0, 0)"])
def test_whatever_else_moves_or_stops_the_robot_breaks_it_off_until_it_is_taken_again(
    served: Served, line: str
) -> None:
    served.pull(TABLE)  # the arm stands
    served.do(line)
    served.pass_time(0.1)
    assert "else" in served.session.pulled.why
    version = served.session.engine.timeline.version
    with pytest.raises(RequestRefused, match="else"):
        served.pull(moved(0.1, 0.0, 0.0))
    served.pass_time(0.1)
    assert served.session.engine.timeline.version == version
    served.pull(None)
    served.pull(moved(0.1, 0.0, 0.0))
    assert served.session.pulled.by == "ann"


def test_only_who_drives_may(served: Served) -> None:
    viewer = Holder(served.session, Role.OBSERVER, "bob")
    with pytest.raises(RoleWanted):
        served.pull(TABLE, viewer)
    served.session.lease = RobotLease("carl", 1e9)
    with pytest.raises(LeaseHeld):
        served.pull(TABLE)


def test_who_drives_no_longer_lets_go_at_once(served: Served) -> None:
    served.pull(moved(0.3, 0.0, 0.3))
    served.session.lease = RobotLease("carl", 1e9)
    with pytest.raises(LeaseHeld):
        served.pull(moved(0.3, 0.0, 0.3))
    assert "carl drives" in served.session.pulled.why
    served.pass_time(0.3)
    assert served.stands


def test_it_waits_for_no_program(served: Served) -> None:
    served.session.load_text(".PROGRAM go\n10 GOTO 10\n.END\n")
    served.session.begin("go", cycles=1)
    with pytest.raises(UsageError, match="until the program stops"):
        served.pull(TABLE)


def test_in_virtual_time_each_wish_takes_a_tick() -> None:
    session = Session(RecordingTerminal())
    targets, ann = TargetControl(session), Holder(session, Role.SUPERVISOR, "ann")
    session.perform("MOVE TRANS(0, 450, -150, 90, 90, 0)")
    before = session.engine.now
    for _ in range(100):
        session.actor.finish(ann.call(lambda _session: targets.pull(moved(0.05, 0.0, 0.0))), session.terminal)
    assert session.engine.now == pytest.approx(before + 2.0)
    assert distance(session.engine.position().T_world_tool, moved(0.05, 0.0, 0.0)) < 1e-6


def delayed(seconds: float) -> Iterator[tuple[float, float]]:
    """When a hand moves, 30 times a second, and when that comes to the robot: 0.2 s later, +- 0.08, in its order."""
    source, last = Random(13), 0.0
    for k in range(int(30 * seconds)):
        last = max(last, k / 30 + max(source.gauss(0.2, 0.08), 0.0))
        yield k / 30, last


def test_over_a_line_of_uneven_delay_it_goes_on_without_a_stop(served: Served) -> None:
    """The tool is where the hand was 0.2 s ago, and a little."""
    begin, squares, count = served.wall.seconds, 0.0, 0

    def hand(t: float) -> Transform:
        return moved(0.1 * sin(pi * t / 2.0), 0.0, 0.1 * (1.0 - cos(pi * t / 2.0)))

    for t, came in delayed(8.0):
        served.pass_time(max(begin + came - served.wall.seconds, 0.0))
        served.pull(hand(t))
        assert served.session.pulled.by == "ann"
        since = served.wall.seconds - begin
        if since > 1.0:
            assert not served.stands
            squares, count = squares + distance(served.tool, hand(since - 0.3)) ** 2, count + 1
    assert sqrt(squares / count) < 0.02


def test_a_wish_beyond_all_numbers_is_refused(served: Served) -> None:
    """Its square is none that a computer has."""
    served.pull(TABLE)
    with pytest.raises(IllegalValue):
        served.pull(at_position(TABLE, 1e160, 1e160, 0.0))
    assert served.session.pulled.by == "ann"


def test_a_tool_that_cannot_be_moved_is_held_by_nobody(served: Served, monkeypatch: pytest.MonkeyPatch) -> None:
    served.pull(moved(0.1, 0.0, 0.0))

    def fail(*_it: object) -> Shortfall:
        raise OverflowError

    monkeypatch.setattr(Dragging, "to", fail)
    with pytest.raises(OverflowError):
        served.pass_time(0.1)
    assert served.session.pulled.by == ""
    assert "internal error" in served.session.pulled.why
