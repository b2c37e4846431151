"""An arm of ROS as the body: a stand-in for rosbridge and its controller, in simulated time."""

from __future__ import annotations

import itertools
import json
from collections.abc import Callable
from math import nan
from types import SimpleNamespace
from typing import Any

import pytest

from tests.bodies.bridge import Bridge, stamp
from tests.bodies.controller import Controller, seconds
from vrs_cli.bodies.joint_trajectory import RosJoint
from vrs_cli.bodies.rosbridge import RosArm, RosSettings
from vrs_cli.engine.engine import Engine
from vrs_cli.engine.position import joint_state_at
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.net.messages import BodyOrder
from vrs_cli.trajectory.state import JointState
from vrs_cli.trajectory.timeline import Timeline, TimelineDelta
from vrs_cli.values.commands import JointTarget, Move
from vrs_cli.values.measured import BodyMode, Report

OFFSET = 5000.0  # [s] the clock of ROS minus the robot's
TICK = 0.01
PUMA = load_robot("puma560")
NAMES = tuple(RosJoint(f"j{i}", 1 if i % 2 else -1, 0.25 * i) for i in range(1, 7))
AWAY = (0.5, -1.2, 2.2, 0.3, 0.6, -0.4)
BACK = (-0.3, -1.0, 2.0, 0.0, 0.4, 0.2)


class Body:
    """What RosArm uses of BodyClient, with an engine and a clock of its own."""

    def __init__(self) -> None:
        self.engine = Engine(PUMA)
        self.engine.clock.realtime = True
        self.model, self.rate, self.mirror = PUMA, 100.0, self
        self.far = SimpleNamespace(rate=1.0)
        self.arm = self.engine.arm
        self.order, self.life, self.embodied = BodyOrder(BodyMode.FOLLOWS, 0.0), "first", True
        self.reports = list[Report]()

    @property
    def timeline(self) -> Timeline:
        return self.engine.timeline

    def now(self) -> float:
        return self.engine.now

    def setpoint(self, t: float) -> JointState:
        return joint_state_at(self.arm, self.timeline, t)

    def report(self, t: float, joints: Joints, velocity: Joints, effort: Joints, mode: BodyMode) -> None:
        assert not self.reports or t > self.reports[-1].t
        self.reports.append(Report(t, joints, velocity, effort, mode))


class Run:
    """A body and its arm. `mangle` changes messages of joint_states, or gives others; `rate`: of these [1/s]."""

    def __init__(self, *, replaces: bool = False, by_action: bool = False, delay: float = 0.0) -> None:
        self.body, self.told = Body(), list[str]()
        start = [one.sign * q + one.offset for one, q in zip(NAMES, self.body.setpoint(0.0).joints, strict=True)]
        names = ["gripper", *[one.name for one in reversed(NAMES)]]
        self.controller = Controller(names[1:], start[::-1], replaces=replaces)
        self.bridge = Bridge(self.controller, OFFSET)
        self.delay = delay  # [s] each way, of trajectories only
        self.on_way = list[tuple[float, str]]()
        self.mangle: Callable[[dict[str, Any]], object] = lambda message: message
        settings = RosSettings("ws://arm", NAMES, replaces=replaces, by_action=by_action)
        self.arm = RosArm(self.body, settings, self.told.append)  # type: ignore[arg-type]
        self.tells_state = True  # the controller publishes its state
        self.connect()
        hearing = self.body.engine.events.subscribe(woken=lambda: None)
        self.changes = hearing.take_all

    def connect(self) -> None:
        self.arm.begin(self.body.now())
        for message in self.arm.first_messages():
            assert not list(self.bridge.receive(json.dumps(message), self.body.now()))

    def move(self, *joints: float) -> None:
        """Move to joints [rad], after what is scheduled."""
        self.body.engine.begin(Move(JointTarget(joints), straight=False), program=False)

    def until(self, end: float, states: int = 1) -> None:
        """Let time pass to `end` [s]."""
        body = self.body
        while body.now() < end:
            body.engine.clock.set(body.now() + TICK)
            now = body.now()
            for change in self.changes():
                self.arm.change(change.cut if isinstance(change, TimelineDelta) else -1.0)
            self.on_way += [(now + self.delay, json.dumps(message, allow_nan=False)) for message in self.arm.due(now)]
            while self.on_way and self.on_way[0][0] <= now:
                for answer in self.bridge.receive(self.on_way.pop(0)[1], now):
                    self.arm.hear(json.dumps(answer))
            for state in self.bridge.controller_states() if self.tells_state else ():
                self.arm.hear(json.dumps(state))
            for k in range(states):
                message = self.mangle(self.bridge.states(now - TICK + (k + 1) * TICK / states))
                self.arm.hear(message if isinstance(message, str) else json.dumps(message))

    def error(self, since: float = 0.0) -> float:
        """The largest difference of reports from the timeline at their own times [rad]."""
        return max(
            abs(p - q)
            for one in self.body.reports
            if one.t >= since
            for p, q in zip(one.joints, self.body.setpoint(one.t).joints, strict=True)
        )

    def fastest(self, since: float) -> float:
        """The greatest share of the greatest velocity of a joint that reports show."""
        return max(
            abs(b - a) / (there.t - here.t) / most
            for here, there in itertools.pairwise(one for one in self.body.reports if one.t >= since)
            for a, b, most in zip(here.joints, there.joints, PUMA.max_velocity, strict=True)
        )


@pytest.mark.parametrize("replaces", [False, True])
@pytest.mark.parametrize("by_action", [False, True])
def test_the_arm_follows_changes_of_the_timeline(replaces: bool, by_action: bool) -> None:
    run = Run(replaces=replaces, by_action=by_action)
    run.until(0.5)
    run.move(*AWAY)
    run.until(1.0)
    run.move(*BACK)  # begins where the first one ends
    run.until(1.5)
    run.body.engine.stop()
    run.until(2.5)
    run.move(*AWAY)
    run.until(6.0)
    assert run.body.reports[-1].t > 5.9
    assert len(run.body.reports) > 540
    assert {one.mode for one in run.body.reports if one.t > 1.0} == {BodyMode.FOLLOWS}
    assert run.error() < 0.02  # a command is known a tick late
    assert run.error(3.5) < 1e-6
    assert not run.told
    assert not run.bridge.refused
    stamps = [one["header"]["stamp"]["sec"] for one in run.controller.received]
    assert len(stamps) == (5 if not replaces else len(stamps))


def test_a_change_that_is_due_later_waits_in_the_controller() -> None:
    run = Run(replaces=True, delay=0.1)
    run.until(0.5)
    run.move(*AWAY)
    run.until(0.7)
    end, count = run.body.timeline.end, len(run.controller.received)
    run.move(*BACK)
    run.until(end + 3.0)
    (waited,) = run.controller.received[count:]
    assert seconds(waited["header"]["stamp"]) > OFFSET + 0.9
    assert run.error(1.5) < 1e-6


def test_an_order_to_hold_brakes_and_one_to_follow_goes_on() -> None:
    run = Run()
    run.until(0.5)
    run.move(*AWAY)
    run.until(0.72)
    run.body.order = BodyOrder(BodyMode.HOLDS, 0.75)
    run.until(2.5)
    held = [one for one in run.body.reports if one.t > 2.0]
    assert {one.mode for one in held} == {BodyMode.HOLDS}
    assert {one.joints for one in held} == {held[0].joints}
    assert held[0].joints != run.body.setpoint(2.5).joints
    speed = [one.velocity for one in run.body.reports]
    steps = max(abs(b - a) for u, v in itertools.pairwise(speed) for a, b in zip(u or (), v or (), strict=True))
    assert steps < 1.01 * TICK * max(PUMA.max_acceleration)
    run.body.order = BodyOrder(BodyMode.FOLLOWS, 3.0)  # nobody has resynchronised: it stays
    run.until(4.0)
    assert run.body.reports[-1].mode is BodyMode.HOLDS
    assert len(run.told) == 1
    assert "the arm does not follow: joint" in run.told[0]
    run.body.engine.stop()
    run.move(*held[0].joints)
    run.body.engine.clock.realtime = True
    end = run.body.timeline.end
    run.body.order = BodyOrder(BodyMode.HOLDS, 4.1)
    run.until(end)
    run.body.order = BodyOrder(BodyMode.FOLLOWS, end)
    run.move(*AWAY)
    run.until(end + 3.0)
    assert run.error(end + 0.6) < 1e-6
    assert run.body.reports[-1].mode is BodyMode.FOLLOWS


def test_an_arm_that_stands_elsewhere_does_not_follow() -> None:
    run = Run()
    run.controller._rest = ((1.0,) * 6, (0.0,) * 6, (0.0,) * 6)
    run.move(*AWAY)
    run.until(3.0)
    assert not run.controller.received
    assert {one.mode for one in run.body.reports} == {BodyMode.HOLDS}
    assert len(run.told) == 1


def test_what_a_long_timeline_has_later_is_sent_in_time() -> None:
    run = Run()
    run.until(0.6)
    for _ in range(10):
        run.move(*AWAY)
        run.move(*BACK)
    run.until(run.body.timeline.end + 0.5)
    assert run.body.timeline.end > 15.0
    assert len(run.controller.received) > 1
    assert run.error(2.0) < 1e-6


@pytest.mark.parametrize("lost", [5.0, 0.04])
def test_a_server_that_began_anew_is_followed_only_from_where_the_arm_is(lost: float) -> None:
    """The robot's clock loses some seconds, in which the arm went on."""
    run = Run()
    run.until(0.6)
    run.move(*AWAY)
    run.move(*BACK)
    run.until(1.0)
    run.bridge.offset += lost
    run.body.life, run.body.embodied = "second", False
    count = len(run.body.reports)
    run.until(1.1)
    assert len(run.body.reports) == count  # its clock is not known yet
    run.body.embodied = True
    run.until(5.0)
    assert run.fastest(1.1) < 1.05
    if lost < 1.0:
        assert not run.told
        assert run.error(2.0) < 1e-6
        return
    assert len(run.told) == 1
    assert "the arm does not follow: joint" in run.told[0]
    assert run.body.reports[-1].mode is BodyMode.HOLDS
    run.body.order = BodyOrder(BodyMode.HOLDS, 5.0)  # as RESYNC does, and the arm is where the timeline ends
    run.until(5.5)
    run.body.order = BodyOrder(BodyMode.FOLLOWS, 5.6)
    run.move(*AWAY)
    run.until(9.0)
    assert run.error(7.0) < 1e-6
    assert run.body.reports[-1].mode is BodyMode.FOLLOWS


def test_an_arm_whose_controller_is_not_active_has_stopped() -> None:
    run = Run()
    run.until(1.0)
    run.move(*AWAY)
    run.until(1.5)
    assert run.body.reports[-1].mode is BodyMode.FOLLOWS
    run.controller.stop(run.body.now() + OFFSET)
    run.until(4.0)
    stands = run.body.reports[-1].joints
    received = len(run.controller.received)
    assert run.body.reports[-1].mode is BodyMode.STOPPED
    assert run.told == ["the controller is not active: the arm has stopped"]
    run.move(*BACK)
    run.until(5.0)
    assert len(run.controller.received) == received, "nothing is sent to an arm that has stopped"
    run.controller.release()
    run.until(6.0)
    assert (run.body.reports[-1].mode, run.body.reports[-1].joints) == (BodyMode.HOLDS, stands), "until RESYNC"


def test_a_controller_that_never_publishes_its_state_counts_as_active() -> None:
    run = Run()
    run.tells_state = False
    run.until(1.0)
    run.move(*AWAY)
    run.until(4.0)
    assert run.body.reports[-1].mode is BodyMode.FOLLOWS
    assert run.error(1.0) < 0.01


def test_an_arm_that_moves_elsewhere_is_stopped_gently() -> None:
    """The timeline is replaced while the arm is under way, and then the body is ordered to hold."""
    run = Run()
    run.until(0.6)
    run.move(*AWAY)
    run.until(1.0)
    run.body.order = BodyOrder(BodyMode.HOLDS, 1.2)
    run.body.setpoint = lambda t: joint_state_at(run.body.arm, Engine(PUMA).timeline, t)  # type: ignore[method-assign]
    run.until(3.0)
    speed = [one.velocity for one in run.body.reports if one.t > 0.9]
    steps = max(abs(b - a) for u, v in itertools.pairwise(speed) for a, b in zip(u or (), v or (), strict=True))
    assert steps < 2.0 * TICK * max(PUMA.max_acceleration)
    assert not any(speed[-1] or ())
    assert seconds(run.controller.received[-1]["header"]["stamp"]) == 0.0  # it begins whenever it comes


# --- what is wrong with what comes ---------------------------------------------------------------------------------


def without(joint: str) -> Callable[[dict[str, Any]], object]:
    def mangle(message: dict[str, Any]) -> object:
        message["msg"]["name"] = ["none" if name == joint else name for name in message["msg"]["name"]]
        return message

    return mangle


def unsorted(message: dict[str, Any]) -> object:
    msg = message["msg"]
    msg["name"] = [*msg["name"][::-1], "gripper"]
    msg["position"] = [*msg["position"][::-1], None]
    msg["velocity"], msg["effort"] = [*msg["velocity"][::-1], 0.0], []
    return message


def not_finite(value: float | None) -> Callable[[dict[str, Any]], object]:
    def mangle(message: dict[str, Any]) -> object:
        message["msg"]["position"] = [value, *message["msg"]["position"][1:]]
        return message

    return mangle


@pytest.mark.parametrize(
    ("mangle", "told"),
    [
        (without("j3"), "has no number for j3"),
        (not_finite(nan), "has no number for j6"),
        (not_finite(None), "has no number for j6"),
        (lambda _: "{", "a message of rosbridge"),
        (lambda _: "[" * 5000, "a message of rosbridge"),
        (lambda _: "17", "a message of rosbridge"),
        (lambda _: '{"op": 4}', "a message of rosbridge"),
        (lambda message: message | {"msg": 4}, "/joint_states: "),
        (lambda message: message | {"msg": {**message["msg"], "name": "j1"}}, "/joint_states: "),
        (lambda _: {"op": "status", "level": "error", "msg": "no such topic"}, "rosbridge: error: no such topic"),
    ],
)
def test_wrong_messages_are_told_once_and_nothing_is_lost(
    mangle: Callable[[dict[str, Any]], object], told: str
) -> None:
    run = Run()
    run.until(1.0)
    before = len(run.body.reports)
    run.mangle = mangle
    run.until(2.0)
    run.mangle = lambda message: message
    run.move(*AWAY)
    run.until(4.0)
    assert len(run.told) == 1
    assert told in run.told[0]
    assert len(run.body.reports) >= before + 199
    assert run.error(2.1) < 1e-3
    assert run.body.reports[-1].mode is BodyMode.FOLLOWS


def test_names_may_have_any_order_and_there_may_be_others() -> None:
    run = Run()
    run.mangle = unsorted
    run.until(0.6)
    run.move(*AWAY)
    run.until(3.0)
    assert not run.told
    assert run.error(1.5) < 1e-6
    assert run.body.reports[-1].effort is None


def test_joints_at_1_khz_are_reported_at_the_rate_of_the_body() -> None:
    run = Run()
    run.until(1.0)
    before = len(run.body.reports)
    run.until(3.0, states=10)
    assert len(run.body.reports) - before == pytest.approx(200, abs=2)
    assert not run.told


def test_a_time_that_goes_back_a_little_is_left_out() -> None:
    run, count = Run(), itertools.count()

    def mangle(message: dict[str, Any]) -> object:
        if next(count) % 2:
            message["msg"]["header"]["stamp"] = stamp(seconds(message["msg"]["header"]["stamp"]) - 0.05)
        return message

    run.mangle = mangle
    run.until(2.0)
    assert len(run.told) == 1
    assert "went back in time" in run.told[0]
    assert len(run.body.reports) == pytest.approx(100, abs=2)


@pytest.mark.parametrize("by", [-1000.0, 1000.0])
def test_the_clock_of_ros_may_be_set(by: float) -> None:
    run = Run()
    run.until(1.0)
    run.bridge.offset += by
    run.until(8.0)
    run.move(*AWAY)
    run.until(11.0)
    assert len(run.told) == 1
    assert run.body.reports[-1].t == pytest.approx(11.0, abs=0.02)
    assert run.error(9.5) < 1e-6


def test_without_rosapi_the_stamps_of_joints_tell_the_clock() -> None:
    run = Run()
    run.bridge.has_time = False
    run.until(0.6)
    run.move(*AWAY)
    run.until(3.0)
    assert len(run.told) == 1
    assert "/rosapi/get_time does not answer" in run.told[0]
    assert run.error(1.5) < 1e-6


def test_a_goal_that_is_refused_is_sent_again_once_and_then_told() -> None:
    run = Run(by_action=True)
    run.until(0.5)
    run.bridge.refuses = True
    run.move(*AWAY)
    sent = len(run.controller.received)
    run.until(2.0)
    assert len(run.told) == 1
    assert "the controller refuses the trajectory: Action goal was rejected" in run.told[0]
    assert run.body.reports[-1].mode is BodyMode.HOLDS
    assert len(run.controller.received) == sent
    assert run.body.reports[-1].t > 1.9


def test_another_connection_begins_from_where_the_arm_is() -> None:
    run = Run()
    run.until(0.6)
    run.move(*AWAY)
    run.until(0.7)
    run.connect()
    run.until(3.0)
    assert run.error(1.8) < 1e-6
    assert not run.told


def test_a_robot_that_is_paused_holds_its_arm() -> None:
    run = Run()
    run.until(0.6)
    run.move(*AWAY)
    run.until(1.0)
    run.body.far.rate = None
    run.until(1.2)
    assert run.body.reports[-1].mode is BodyMode.HOLDS
    assert len(run.told) == 1
