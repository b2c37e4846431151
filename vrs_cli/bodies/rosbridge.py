"""Let an arm of ros2_control follow the timeline: send each change of the timeline to joint_trajectory_controller, and
report joint_states. Both go over a rosbridge server (RobotWebTools/rosbridge_suite, ROSBRIDGE_PROTOCOL.md).

The arm follows the timeline only if its joints are near the timeline. Otherwise the arm holds still until RESYNC has
brought the timeline to the measured joints. If the server has restarted, its timeline may be a different one; then all
state of the connection is discarded.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping
from contextlib import suppress
from math import inf
from random import Random
from typing import Any, NamedTuple

from msgspec import Struct
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import WebSocketException

from vrs_cli.bodies import joint_trajectory
from vrs_cli.engine.book import Book
from vrs_cli.engine.engine import Bookmark, Engine
from vrs_cli.engine.settings import Settings
from vrs_cli.errors import IllegalValue, RequestRefused, VrsError
from vrs_cli.kinematics.joints import JointKind, Joints, put_inside
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.net.body_client import BodyClient
from vrs_cli.net.client import waits
from vrs_cli.net.timesync import OneWay, TimeSync
from vrs_cli.trajectory.timeline import Timeline, TimelineDelta
from vrs_cli.values.measured import BodyMode
from vrs_cli.wire import reports

TRAJECTORY = "trajectory_msgs/msg/JointTrajectory"
STATES = "sensor_msgs/msg/JointState"
CONTROLLER_STATE = "control_msgs/msg/JointTrajectoryControllerState"
ACTION = "control_msgs/action/FollowJointTrajectory"
GET_TIME = "/rosapi/get_time"
ABORTED = 6  # status of a goal that was aborted (action_msgs/msg/GoalStatus)
# [rad, m] maximum distance of each joint from the timeline at which the arm counts as following it
NEAR = {JointKind.REVOLUTE: 0.1, JointKind.PRISMATIC: 0.02}
MAX_AGE_S = 1.0  # [s] an older measurement of the arm's position counts as unknown
HORIZON = 10.0  # [s] minimum duration of a sent trajectory, which then ends where the robot is next at rest
MIN_JOIN, MAX_JOIN = 0.1, 0.5  # [s] minimum and maximum time in which the arm joins a changed timeline
SHARE = 0.5  # fraction of the joint limits used to join the timeline (our choice)
AHEAD = 2.0  # [s] time before the end of a trajectory at which the next one is sent
FIRST_ASKED, ASKED = 0.1, 5.0  # [s] interval between the first, and between later requests for the time of ROS
FIRST_ANSWERS = 4
EARLIER, LATER = 60.0, 1.0  # [s] reports whose stamps are older than this, or farther in the future, are refused
SET_BACK = 1.0  # [s] if stamps go back by more than this, the clock of ROS was set
SETTLING = 2.0  # [s] maximum wait for the first answers; then the arm follows without them
SILENT = 3.0  # [s] time without joint_states after which the user gets a message
STATE_PERIOD_MS = 200  # [ms] period of the states that an active controller publishes
MAX_STATE_GAP_S = 1.0  # [s] maximum gap between states; after a longer one the arm counts as stopped
OPENING = 10.0  # [s] maximum time to open a connection
MAX_SHOWN_MESSAGES = 5  # maximum number of different rosbridge messages shown in one connection


class Trajectory(NamedTuple):
    """A trajectory: the time of its stamp [s], and its points. `at_once`: it has no stamp, and starts on arrival."""

    begin: float
    points: list[joint_trajectory.TrajectoryPoint]
    at_once: bool = False


class RosSettings(Struct, frozen=True):
    """Settings of the connection to the arm: the address of rosbridge, joints, the controller, and the topic of
    joint_states.

    `replaces`: the controller has `allow_trajectory_replacement`. `by_action`: send trajectories as goals of the
    controller's action instead of messages on its topic.
    """

    url: str
    joints: tuple[joint_trajectory.RosJoint, ...]
    controller: str = "/joint_trajectory_controller"
    states: str = "/joint_states"
    replaces: bool = False
    by_action: bool = False


class RosArm:
    """The protocol with rosbridge, without the socket: `due` returns messages to send, `hear` takes messages.

    `mode`: the mode in reports. If the arm cannot follow, it holds still until RESYNC. The arm counts as stopped while
    its controller, which was active before, publishes no state. `tell`: shows a message to the user; each kind of
    message is shown once per connection.
    """

    def __init__(self, body: BodyClient, settings: RosSettings, tell: Callable[[str], None]) -> None:
        self.body, self.settings, self.mode = body, settings, BodyMode.HOLDS
        self._tell, self._told = tell, set[str]()
        self._names = [one.name for one in settings.joints]
        self._state_topic = f"{settings.controller}/controller_state"
        self.begin(0.0)

    def begin(self, now: float) -> None:
        """Begin a new connection, and forget the state of the last one."""
        self._told.clear()
        self._sync, self._stamps = TimeSync(), OneWay()
        self._asked: dict[str, float] = {}  # times of the requests for the time of ROS, by their ids
        self._ask_at, self._answers = -inf, 0
        self._measured: tuple[float, Joints, Joints] | None = None
        self._last_stamp, self._next_report = -inf, -inf
        self._begun = self._came = now
        self._active_at: float | None = None  # when the controller last published its state
        self._starts, self._retried = True, False
        self._order = self.body.order
        self._cut, self._waiting, self._until = inf, -inf, inf
        self._number, self._life = 0, self.body.life

    @property
    def _is_outdated(self) -> bool:
        """Return whether the server has restarted, so that the known clock offsets and arm states are out of date."""
        return self.body.life != self._life

    def tell(self, kind: str, text: str) -> None:
        """Show a message to the user, unless one of this kind was shown in this connection."""
        if kind not in self._told:
            self._told.add(kind)
            self._tell(text)

    # --- messages to rosbridge ---

    def first_messages(self) -> list[Mapping[str, Any]]:
        """Return the first messages of a connection."""
        settings = self.settings
        state = {"topic": self._state_topic, "type": CONTROLLER_STATE, "throttle_rate": STATE_PERIOD_MS}
        asked: list[Mapping[str, Any]] = [
            {"op": "subscribe", "id": "states", "topic": settings.states, "type": STATES},
            {"op": "subscribe", "id": "controller", **state},
        ]
        if not settings.by_action:
            topic = f"{settings.controller}/joint_trajectory"
            asked.append({"op": "advertise", "id": "trajectories", "topic": topic, "type": TRAJECTORY})
        return asked

    def due(self, now: float) -> list[Mapping[str, Any]]:
        """Return the messages to send at the time `now` of the robot's clock [s]."""
        if self._is_outdated:
            if not self.body.embodied:
                return []
            told = self._told.copy()
            self.begin(now)
            self._told |= told
        found = self._questions(now)
        if now - self._came > SILENT:
            self.tell("silent", f"no joints come on {self.settings.states} of {self.settings.url}")
        if self._measured is None or (self._answers < FIRST_ANSWERS and now - self._begun < SETTLING):
            return found
        if self._active_at is not None and now - self._active_at > MAX_STATE_GAP_S:
            if self.mode is not BodyMode.STOPPED:
                self.tell(f"stopped {self._active_at}", "the controller is not active: the arm has stopped")
            self.mode, self._cut = BodyMode.STOPPED, inf
            return found
        if self.mode is BodyMode.STOPPED:
            self.mode = BodyMode.HOLDS
        if self.body.far.rate == 1.0:
            return found + [self._message(one) for one in self._trajectories(now)]
        self.tell("rate", "the robot's clock does not run as fast as real time: the arm of ROS holds")
        trajectories = self._hold(now) if self.mode is BodyMode.FOLLOWS else []
        self.mode, self._starts = BodyMode.HOLDS, True
        return found + [self._message(one) for one in trajectories]

    def _trajectories(self, now: float) -> list[Trajectory]:
        """Return the trajectories to send now."""
        order = self.body.order
        ordered = order is not self._order and order.at <= now
        if self._starts or ordered:
            # until the time of an order, the opposite mode applies
            holds = (order.mode is BodyMode.HOLDS) is (order.at <= now)
            self._starts, self._order, self._retried = False, order if order.at <= now else self._order, False
            return self._hold(now) if holds else self._follow(now)
        is_due = self.mode is BodyMode.FOLLOWS and (self._cut < inf or now > self._until - AHEAD)
        return self._along(self.body.timeline, now, self._cut if self._cut < inf else self._until) if is_due else []

    def _follow(self, now: float) -> list[Trajectory]:
        if (far := self._apart()) is not None:
            self.mode, self._cut = BodyMode.HOLDS, inf
            self.tell(f"apart {self._order.at}", f"the arm does not follow: {far} (RESYNC brings both together)")
            return []
        self.mode = BodyMode.FOLLOWS
        return self._along(self.body.timeline, now, -inf)

    def _hold(self, now: float) -> list[Trajectory]:
        follows, self.mode = self.mode is BodyMode.FOLLOWS, BodyMode.HOLDS
        if follows and self._apart() is None:
            return self._along(brake_timeline(self.body.model, self.body.timeline, now), now, now)
        assert self._measured is not None, "it is called only with a measurement"
        t, joints, speed = self._measured
        lasts = max(MIN_JOIN, *(2.0 * abs(v) / a for v, a in zip(speed, self.body.model.max_acceleration, strict=True)))
        age = min(max(now - t, 0.0), MIN_JOIN)
        stands = tuple(q + v * (age + 0.5 * lasts) for q, v in zip(joints, speed, strict=True))
        points = joint_trajectory.standing_points(
            put_inside(stands, self.body.model.lower, self.body.model.upper), now + lasts
        )
        return [Trajectory(begin, points, at_once=begin < now) for begin in self._begins(now, now)]

    def _along(self, timeline: Timeline, now: float, cut: float) -> list[Trajectory]:
        """Return the trajectories for a timeline that has changed at `cut` [s].

        If `cut` has passed, the arm is no longer on the timeline. It then gets so much time to join the timeline that
        no joint needs more than SHARE of its limits. A quintic over a distance s in T seconds has the peak velocity
        15/8 s / T and the peak acceleration 5.8 s / T^2.
        """
        arm, begins = self.body.mirror.arm, self._begins(now, cut)
        assert self._measured is not None, "it is called only with a measurement"
        t, joints, _ = self._measured
        model, needed = self.body.model, MIN_JOIN
        rows = zip(joints, self.body.setpoint(t).joints, model.max_velocity, model.max_acceleration, strict=True)
        for p, q, v, a in rows:
            needed = max(needed, 1.875 * abs(p - q) / (SHARE * v), (5.8 * abs(p - q) / (SHARE * a)) ** 0.5)
        joins = now + max(min(2.0 * (now - cut), MAX_JOIN), needed)
        found = [
            Trajectory(
                begin,
                joint_trajectory.trajectory_points(
                    arm, timeline, begin if begin >= now or cut >= now else joins, HORIZON
                ),
            )
            for begin in begins
        ]
        end = found[-1].points[-1].t
        self._until = end if end < timeline.end else inf
        return found

    def _begins(self, now: float, cut: float) -> list[float]:
        begins = joint_trajectory.trajectory_begins(
            now, cut, self._waiting if self._waiting > now else None, replaces=self.settings.replaces
        )
        self._cut, self._waiting, self._until = inf, begins[-1], inf
        return begins

    def change(self, cut: float) -> None:
        """Record that the timeline has changed after `cut` [s]."""
        self._cut, self._retried = min(self._cut, cut), False

    def _message(self, one: Trajectory) -> Mapping[str, Any]:
        settings = self.settings
        trajectory = joint_trajectory.trajectory_message(
            one.points, settings.joints, None if one.at_once else self._offset(one.begin), one.begin
        )
        if not settings.by_action:
            return {"op": "publish", "topic": f"{settings.controller}/joint_trajectory", "msg": trajectory}
        self._number += 1
        return {
            "op": "send_action_goal",
            "id": f"trajectory-{self._number}",
            "action": f"{settings.controller}/follow_joint_trajectory",
            "action_type": ACTION,
            "args": {"trajectory": trajectory},
            "feedback": False,
        }

    def _apart(self) -> str | None:
        """Return the reason why the measured arm is not near the timeline; None if it is near."""
        assert self._measured is not None, "it is called only with a measurement"
        t, joints, _ = self._measured
        if self.body.now() - t > MAX_AGE_S:
            return f"its last measurement is of {t:.3f} s"
        units = self.body.model.units
        expected = self.body.setpoint(t).joints
        for number, (p, q, link) in enumerate(zip(joints, expected, self.body.model.links, strict=True), 1):
            if abs(p - q) > NEAR[link.kind]:
                here, there = units.one_shown(number, p), units.one_shown(number, q)
                return f"joint {number} is at {here:.2f} {units.unit(number)}, and the timeline at {there:.2f}"
        return None

    # --- the clock of ROS ---

    def _questions(self, now: float) -> list[Mapping[str, Any]]:
        """Return a list with a request for the time of ROS; an empty list if none is needed yet."""
        if now < self._ask_at <= now + ASKED:  # a later `_ask_at` means that the robot's clock was set back
            return []
        self._ask_at = now + (FIRST_ASKED if self._answers < FIRST_ANSWERS else ASKED)
        self._number += 1
        id = f"time-{self._number}"
        self._asked[id] = now
        while len(self._asked) > 100:
            del self._asked[next(iter(self._asked))]
        return [{"op": "call_service", "id": id, "service": GET_TIME}]

    def _offset(self, now: float) -> float:
        """Return the clock of ROS minus the robot's clock [s], estimated from the requests if they were answered,
        otherwise from the stamps of joint_states."""
        estimate = self._sync.estimate or self._stamps.estimate
        return 0.0 if estimate is None else estimate.there(now) - now

    # --- messages from rosbridge ---

    def hear(self, text: str | bytes) -> None:
        """Process a message from rosbridge."""
        now = self.body.now()
        try:
            message = reports.read_message(text)
            match message.op:
                case "publish" if message.topic == self.settings.states:
                    self._take_states(reports.read_joint_states(message), now)
                case "publish" if message.topic == self._state_topic:
                    self._active_at = now
                case "service_response" if message.id in self._asked:
                    asked, time = self._asked.pop(message.id), reports.read_time(message)
                    self._answers += 1
                    if time is not None:
                        self._sync.hear(asked, time, time, now)
                    else:
                        known = "the clock of ROS is known by the stamps of joint_states alone"
                        self.tell("time", f"{GET_TIME} does not answer: {known}")
                case "action_result" if message.id == f"trajectory-{self._number}" or message.id is None:
                    self._take_result(message)
                case "status" if message.level in ("error", "warning"):
                    if sum(kind.startswith("status ") for kind in self._told) < MAX_SHOWN_MESSAGES:
                        self.tell(f"status {message.msg}", f"rosbridge: {message.level}: {str(message.msg)[:300]}")
        except IllegalValue as error:
            self.tell("garbage", f"{error} (this and others like it are left out)")

    def _take_states(self, states: reports.JointStates, now: float) -> None:
        """Report joint_states, unless joints are missing or the stamp is wrong."""
        if self._is_outdated:
            return
        stamp = states.header.stamp.seconds
        if stamp <= self._last_stamp:
            if stamp > self._last_stamp - SET_BACK:
                self.tell("earlier", f"{self.settings.states} went back in time: what is not newer is left out")
                return
            self.tell(
                "set back", f"the clock of ROS went back by {self._last_stamp - stamp:.3f} s: it is measured anew"
            )
            self._sync, self._stamps, self._answers, self._ask_at = TimeSync(), OneWay(), 0, -inf
            self._begun, self._next_report = now, -inf
            self._asked.clear()
            self._starts = self._starts or self.mode is BodyMode.FOLLOWS
        self._last_stamp, self._came = stamp, now
        self._stamps.hear(stamp, now)
        t = stamp - self._offset(now)
        if not now - EARLIER <= t <= now + LATER:
            self._ask_at = min(self._ask_at, now + FIRST_ASKED)
            self.tell("stamp", f"{self.settings.states} is stamped {t - now:+.3f} s from now: it is left out")
            return
        if t < self._next_report:
            return
        position, velocity, effort = (
            states.column(values, self._names) for values in (states.position, states.velocity, states.effort)
        )
        if position is None:
            missing = [name for name in self._names if states.column(states.position, [name]) is None]
            self.tell("missing", f"{self.settings.states} has no number for {', '.join(missing)}: it is left out")
            return
        joints = self.settings.joints
        measured = tuple(one.sign * (q - one.offset) for one, q in zip(joints, position, strict=True))
        self._next_report = max(self._next_report + 1.0 / self.body.rate, t + 1e-6)
        speed, force = (
            None if row is None else tuple(one.sign * v for one, v in zip(joints, row, strict=True))
            for row in (velocity, effort)
        )
        self._measured = (t, measured, speed or (0.0,) * len(measured))
        self.body.report(t, measured, speed, force, self.mode)

    def _take_result(self, message: reports.RosbridgeMessage) -> None:
        """Process the end of the last goal. A refused trajectory is sent again, once, starting now."""
        values = message.values if isinstance(message.values, Mapping) else {"error_string": message.values}
        if message.result and message.status != ABORTED and not values.get("error_code", 0):
            return
        if self.mode is BodyMode.FOLLOWS and not self._retried:
            self._cut, self._retried, self._waiting = -inf, True, -inf
            return
        self.mode = BodyMode.HOLDS
        why = str(values.get("error_string") or values.get("error_code") or "no reason given")[:300]
        self.tell("refused", f"the controller refuses the trajectory: {why} (RESYNC makes the arm follow again)")


def brake_timeline(model: RobotModel, timeline: Timeline, t: float) -> Timeline:
    """Return the timeline with a stop at t [s] within all limits."""
    engine = Engine(model)
    engine.take_up(Bookmark(Book(timeline, timeline, number=timeline.version), Settings(), t))
    engine.stop()
    return engine.timeline


async def follow(body: BodyClient, settings: RosSettings, tell: Callable[[str], None]) -> None:
    """Let an arm of ROS execute the motions until another client replaces it; reconnect if the connection is cut.
    Raises RequestRefused if rosbridge does not answer at first, or if another client already executes the motions."""
    arm, random, attempt, begun = RosArm(body, settings, tell), Random(), 0, False

    async def hear_changes() -> None:
        with suppress(VrsError):  # ignore the error here, because `ticks` raises it too
            async for change in body.changes():
                arm.change(change.cut if isinstance(change, TimelineDelta) else -inf)

    hearing = asyncio.create_task(hear_changes())
    try:
        while True:
            try:
                async with connect(settings.url, open_timeout=OPENING) as socket:
                    if attempt:
                        tell(f"rosbridge at {settings.url} is back")
                    attempt, begun = 0, True
                    await _converse(body, arm, socket)
                why = "it has closed the connection"
            except (OSError, WebSocketException, TimeoutError) as error:
                why = str(error) or type(error).__name__
            if not begun:
                raise RequestRefused(f"no rosbridge answers at {settings.url}", why)
            if not attempt:
                tell(f"rosbridge at {settings.url} is gone ({why}): trying again")
            attempt += 1
            await _wait(body, waits(attempt, random))
    finally:
        hearing.cancel()


async def _wait(body: BodyClient, seconds: float) -> None:
    """Wait for some seconds. If an error ends the client `body` meanwhile, raises this error."""
    loop = asyncio.get_running_loop()
    due = loop.time() + seconds
    async for _ in body.ticks():
        if loop.time() >= due:
            return


async def _converse(body: BodyClient, arm: RosArm, socket: ClientConnection) -> None:
    """Send and receive messages until the connection ends."""

    async def read() -> None:
        async for text in socket:
            arm.hear(text)

    arm.begin(body.now())
    for message in arm.first_messages():
        await socket.send(reports.write_message(message))
    reading = asyncio.create_task(read())
    try:
        async for t in body.ticks():
            if reading.done():
                await reading
                return
            for message in arm.due(t):
                await socket.send(reports.write_message(message))
    finally:
        reading.cancel()
        with suppress(asyncio.CancelledError, WebSocketException):
            await reading
