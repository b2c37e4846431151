"""Keys of JOG that are held down at a robot behind a port."""

from __future__ import annotations

from collections.abc import Callable

from vrs_cli.errors import RequestRefused
from vrs_cli.interfaces.port.port import FarHand
from vrs_cli.kinematics.joints import JointUnits
from vrs_cli.kinematics.transform import IDENTITY
from vrs_cli.values.hand import Axis, Frame, Press, Seen, StopJog
from vrs_cli.values.results import Position
from vrs_cli.wire.messages import At, Done, Refusal, Refused, Request, ServerMessage

STEP = Press(Axis(Frame.JOINT, 0), 1.0, 50.0)


def seen_at(time: float, said: str = "") -> Seen:
    rest = (0.0,) * 6
    return Seen(Position(time, rest, rest, rest, IDENTITY, 0.0, moving=False, text=""), time, said=said)


class Robot:
    """Keeps the requests that begin, with who hears of them."""

    def __init__(self) -> None:
        self.begun: list[tuple[Request, Callable[[ServerMessage], None]]] = []

    def begin(self, make: Callable[[int], Request], outlet: Callable[[ServerMessage], None]) -> None:
        self.begun.append((make(len(self.begun) + 1), outlet))


def hand_of(robot: Robot) -> FarHand:
    return FarHand(robot.begin, 6, JointUnits(), seen_at(0.0))


def test_a_key_that_is_held_sends_its_next_step_when_the_arm_has_answered() -> None:
    robot = Robot()
    hand = hand_of(robot)
    assert hand.do(STEP) == hand.do(STEP) == seen_at(0.0)
    assert [request for request, _ in robot.begun] == [At(1, STEP)]
    robot.begun[0][1](Done(1, found=seen_at(1.0)))
    assert hand.do(STEP) == seen_at(1.0)
    assert [request for request, _ in robot.begun] == [At(1, STEP), At(2, STEP)]


def test_a_stop_is_always_sent() -> None:
    robot = Robot()
    hand = hand_of(robot)
    for _ in range(2):
        hand.do(StopJog())
    assert [request for request, _ in robot.begun] == [At(1, StopJog()), At(2, StopJog())]


def test_a_refusal_is_shown() -> None:
    robot = Robot()
    hand = hand_of(robot)
    hand.do(STEP)
    refused = RequestRefused("ada drives")
    robot.begun[0][1](Refused(Refusal.of(refused), 1))
    assert hand.do(STEP) == seen_at(0.0, said=str(refused))
