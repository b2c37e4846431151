"""Laws of streams of targets, over all kinds and all pairs of users: no tool, button or key that is still held moves
the arm after a stop, a refusal, a lost connection or another driver, whatever another user does meanwhile; one stream
moves the arm at a time.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import product
from math import inf
from typing import Any

import pytest

from tests.engine.wall import ManualWall
from tests.interfaces.holders.holder import Holder
from tests.interfaces.terminals import RecordingTerminal
from vrs_cli.engine.clock import RobotClock
from vrs_cli.errors import FileError, LeaseHeld, RequestRefused, StreamIsOver, VrsError
from vrs_cli.interfaces.dialogue import Ticket
from vrs_cli.interfaces.jog.jogger import Jogger
from vrs_cli.interfaces.session.acts import act_on
from vrs_cli.interfaces.session.session import Session
from vrs_cli.interfaces.targets import TargetControl
from vrs_cli.interfaces.users import RobotLease
from vrs_cli.kinematics.transform import at_position
from vrs_cli.language.words.word import Role
from vrs_cli.values.acts import DragTool, FollowChunk, Steer
from vrs_cli.values.hand import Axis, Frame, Look, Press, StopJog
from vrs_cli.values.results import Act, UserAct


class User(Holder):
    """A user of the robot who sends one stream."""

    def __init__(self, session: Session, name: str) -> None:
        super().__init__(session, Role.SUPERVISOR, name)
        self.targets, self.until = 0, 0.0

    def carry_out_act(self, act: Act[Any]) -> Ticket[Any]:
        """Carry out an act as a message of this user is carried out."""
        doing = self.conversation.act(act) if isinstance(act, UserAct) else act_on(self.session, act)
        ticket = self.put(doing)
        while not ticket.done():
            self.session.actor.step()
        return ticket

    def line(self, text: str) -> None:
        self.session.actor.finish(self.ask(text), self.session.terminal)

    # --- kinds of streams: `send` sends the next target, the first one opens the stream; `close` closes it ---

    def steer(self) -> Ticket[Any]:
        self.targets += 1
        joints, step = self.session.engine.position().joints, 0.02 * self.targets
        goal = (joints[0] + step, *joints[1:])
        return self.carry_out_act(Steer(goal, (0.5,) + (0.0,) * 5 if self.targets > 1 else None, lasting=0.1))

    def follow(self) -> Ticket[Any]:
        """Each chunk begins at the end of the one before."""
        engine = self.session.engine
        begin = self.until if self.targets else max(engine.now, self.until + 0.01)
        self.targets, self.until = self.targets + 1, begin + 0.2
        joints = engine.position().joints
        return self.carry_out_act(FollowChunk((begin, self.until), (joints, (joints[0] + 0.05, *joints[1:]))))

    def drag(self) -> Ticket[Any]:
        self.targets += 1
        tool = self.session.engine.position().T_world_tool
        return self.carry_out_act(DragTool(at_position(tool, tool.px, tool.py, tool.pz - 0.05)))

    def pull(self) -> Ticket[Any]:
        """As `drag`, by messages, which a page sends."""
        tool = self.session.engine.position().T_world_tool
        wish = at_position(tool, tool.px, tool.py, tool.pz - 0.05)
        ticket = self.call(lambda session: TargetControl(session).pull(wish))
        while not ticket.done():
            self.session.actor.step()
        return ticket

    def press(self) -> Ticket[Any]:
        return self.carry_out_act(Press(Axis(Frame.JOINT, 1), 5.0, 20.0))

    def press_key(self) -> Ticket[Any]:
        """As `press`, while the arm of JOG fills the screen."""
        self.user_state.on_screen = self.user_state.on_screen or Jogger(self.session)
        return self.press()

    def close(self, kind: str) -> None:
        self.targets = 0
        if kind in ("steer", "follow"):
            return
        if kind == "pull":
            self.session.actor.finish(
                self.call(lambda session: TargetControl(session).pull(None)), self.session.terminal
            )
        else:
            self.carry_out_act(DragTool() if kind == "drag" else StopJog())


KINDS: dict[str, Callable[[User], Ticket[Any]]] = {
    "steer": User.steer,
    "follow": User.follow,
    "drag": User.drag,
    "pull": User.pull,
    "press": User.press,
    "press_key": User.press_key,
}
PAIRS = list(product(KINDS, KINDS))
HELD = ("pull", "press", "press_key")  # a stream of these is held: its later targets are refused, too


class World:
    """A robot in real or in virtual time, with two users who send streams."""

    def __init__(self, clock: RobotClock | None, wall: ManualWall) -> None:
        self.wall, self.session = wall, Session(RecordingTerminal(), clock=clock)
        self.ann, self.ben, self.carl = (User(self.session, name) for name in ("ann", "ben", "carl"))
        self.ann.line("MOVE TRANS(0, 450, -150, 90, 90, 0)")
        self.pass_time(3.0)

    def pass_time(self, seconds: float) -> None:
        """Let time pass, with everything that is due meanwhile."""
        engine, until = self.session.engine, self.wall.seconds + seconds
        while engine.realtime and self.wall.seconds < until:
            if self.session.actor.peek() <= engine.clock.reached:
                self.session.actor.step()
            self.wall.seconds = min(self.wall.seconds + 0.01, until)
        self.session.settle()

    def send(self, user: User, kind: str, times: int = 3) -> None:
        for _ in range(times):
            KINDS[kind](user)
            self.pass_time(0.1)

    @property
    def version(self) -> int:
        return self.session.engine.timeline.version


@pytest.fixture(params=["real", "virtual"])
def world(request: pytest.FixtureRequest) -> World:
    wall = ManualWall()
    return World(wall.clock() if request.param == "real" else None, wall)


@pytest.mark.parametrize("kind", KINDS)
def test_each_kind_moves_the_arm(world: World, kind: str) -> None:
    before = world.version
    world.send(world.ann, kind)
    assert world.version > before


def check_refused(world: World, user: User, kind: str) -> None:
    """Check that the next target of a stream is refused and moves nothing."""
    before = world.version
    ticket = KINDS[kind](user)
    world.pass_time(0.2)
    assert world.version == before, f"{kind} moves the arm"
    error = ticket.error(0.0)
    if kind == "press_key":  # the message stays on the screen until the next key
        assert ticket.result().said == user.carry_out_act(Look()).result().said != ""
    else:
        assert isinstance(error, RequestRefused | StreamIsOver)


def check_told(ticket: Ticket[Any], kind: type[VrsError], why: str) -> None:
    """Check that a user was told why a target was refused: by an error, or on the screen of JOG."""
    error = ticket.error(0.0)
    assert isinstance(error, kind) or (error is None and why in ticket.result().said)


def emergency_stop(world: World, _kind: str) -> None:
    world.session.actor.finish(world.carl.stop(), world.session.terminal)


def let_another_drive(world: World, kind: str) -> None:
    world.session.lease = RobotLease("ben", inf)
    check_told(KINDS[kind](world.ann), LeaseHeld, "ben drives")
    world.session.lease = RobotLease("ann", inf)


def fill_disk(world: World, kind: str) -> None:
    def fail() -> None:
        raise FileError("the disk is full")

    world.session.check_room = fail
    check_told(KINDS[kind](world.ann), FileError, "the disk is full")
    world.session.check_room = lambda: None


def lose_connection(world: World, kind: str) -> None:
    TargetControl(world.session).lose(world.ann.user_state)
    if kind == "follow":  # a chunk is for a time: the next one comes in time, or begins a new stream
        world.carl.line("ABORT")


ENDS: dict[str, Callable[[World, str], None]] = {
    "abort": lambda world, _kind: world.carl.line("ABORT"),
    "emergency stop": emergency_stop,
    "another driver": let_another_drive,
    "full disk": fill_disk,
    "lost connection": lose_connection,
}


def check_new_press_needed(world: World, kind: str, *, refused: bool) -> None:
    """Check that nothing which Ann holds moves the arm after her stream has ended, and that a new stream moves it.
    `refused`: whether the next target is refused also if she holds nothing."""
    ann = world.ann
    if refused:
        check_refused(world, ann, kind)
    if kind in HELD:
        for _ in range(5):
            check_refused(world, ann, kind)
        ann.close(kind)
    ann.targets = 0
    before = world.version
    world.send(ann, kind)
    assert world.version > before, "a new stream moves the arm"


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(("end", "targets"), [*((end, 3) for end in ENDS), ("another driver", 0), ("full disk", 0)])
def test_nothing_moves_until_a_new_press(world: World, kind: str, end: str, targets: int) -> None:
    """Before the end the stream has moved the arm, or its first target is refused."""
    world.send(world.ann, kind, targets)
    ENDS[end](world, kind)
    world.pass_time(3.0)
    # a call of `drag` is refused once
    check_new_press_needed(world, kind, refused=kind != "drag" or end not in ("another driver", "full disk"))


@pytest.mark.parametrize(("kind", "other"), PAIRS)
@pytest.mark.parametrize("stopper", ["ann", "ben", "carl"])
def test_a_stream_moves_nothing_after_a_stop_whatever_others_do(
    world: World, kind: str, other: str, stopper: str
) -> None:
    """Ann's stream is stopped; Ben opens and closes one of his own; Ann still sends."""
    ann, ben = world.ann, world.ben
    world.send(ann, kind)
    getattr(world, stopper).line("ABORT")
    world.pass_time(0.2)
    world.send(ben, other)
    ben.close(other)
    world.pass_time(3.0)
    # a program that stops the robot may send the next chunk
    check_new_press_needed(world, kind, refused=(kind, stopper) != ("follow", "ann"))


@pytest.mark.parametrize(("kind", "other"), PAIRS)
def test_a_stream_ends_when_another_user_opens_one(world: World, kind: str, other: str) -> None:
    world.send(world.ann, kind)
    KINDS[other](world.ben)
    before = world.session.stream
    ticket = KINDS[kind](world.ann)
    assert world.session.stream is before, "Ben moves the arm"
    assert kind == "press_key" or isinstance(ticket.error(0.0), VrsError)


@pytest.mark.parametrize("kind", HELD)
def test_a_stream_that_paused_is_not_followed_after_a_stop(world: World, kind: str) -> None:
    """The connection is slow: the robot lets the tool go, then it is stopped, then the next target arrives."""
    world.send(world.ann, kind, 1)
    world.pass_time(5.0)
    world.carl.line("ABORT")
    check_refused(world, world.ann, kind)


@pytest.mark.parametrize("kind", HELD)
def test_a_stream_that_began_during_a_program_is_not_followed_after_its_stop(world: World, kind: str) -> None:
    world.session.load_text(".PROGRAM go\n10 TYPE 1\nDELAY 0.1\nGOTO 10\n.END\n")
    track = world.session.begin("go")
    error = KINDS[kind](world.ann).error(0.0)
    assert kind == "press_key" or isinstance(error, VrsError)
    world.carl.line("ABORT")
    world.pass_time(0.2)
    assert not track.running
    check_refused(world, world.ann, kind)


@pytest.mark.parametrize("kind", HELD)
def test_a_stream_that_began_without_the_lease_is_not_followed_after_a_stop(world: World, kind: str) -> None:
    world.session.lease = RobotLease("ben", inf)
    check_told(KINDS[kind](world.ann), LeaseHeld, "ben drives")
    world.carl.line("ABORT")
    world.session.lease = RobotLease("ann", inf)
    for _ in range(3):
        check_refused(world, world.ann, kind)
    world.ann.close(kind)
    before = world.version
    world.send(world.ann, kind)
    assert world.version > before, "a new stream moves the arm"


@pytest.mark.parametrize("kind", HELD)
def test_a_stream_is_closed_without_the_lease_too(world: World, kind: str) -> None:
    """Ann lets go while Ben drives, and begins anew when she drives."""
    world.session.lease = RobotLease("ben", inf)
    KINDS[kind](world.ann)
    world.carl.line("ABORT")
    world.ann.close(kind)
    world.session.lease = RobotLease("ann", inf)
    before = world.version
    world.send(world.ann, kind)
    assert world.version > before


def test_a_line_of_a_slider_that_waits_is_refused_by_a_stop(world: World) -> None:
    """A slider of the page sends JOG of a joint when it rests."""
    before = world.version
    waiting = world.ann.ask("JOG 1, 20")
    world.carl.line("ABORT")
    while not waiting.done():
        world.session.actor.step()
    assert isinstance(waiting.error(0.0), RequestRefused)
    assert world.version == before
