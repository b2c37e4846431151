"""RESYNC after faults: a served robot, its simulated body over delay lines, and an operator, all in virtual time. The
time from the alarm (from the end of the fault, if that is later) until the body follows the timeline again is compared
with D_f + D_b + 1 s + the motion to the measured joints, which is the shortest inside the limits.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from contextlib import suppress
from functools import partial
from random import Random
from typing import NamedTuple

import numpy as np

from tests.by_hand import command
from tests.interfaces.terminals import RecordingTerminal
from tests.twin.servo_arm import Commands
from vrs_cli.bodies.mujoco_arm import MujocoArm
from vrs_cli.bodies.scenario import BlockedJoint, EmergencyStop, Payload, Push, Release, SlippingBrake
from vrs_cli.engine.clock import WallClock
from vrs_cli.engine.position import joint_state_at, joints_at, positions_at
from vrs_cli.errors import RequestRefused
from vrs_cli.interfaces.dialogue import Work
from vrs_cli.interfaces.session.acts import act_on
from vrs_cli.interfaces.session.session import Session
from vrs_cli.interfaces.station.body import BodyChange, BodyNews
from vrs_cli.kinematics.joints import put_inside
from vrs_cli.trajectory.state import JointState
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.acts import ResyncBody
from vrs_cli.values.measured import BodyMode, DivergenceAlarm, Report
from vrs_cli.values.results import ResyncReport

STEP = 0.01  # [s]
MEAN, DEVIATION = 0.2, 0.08  # [s] of the delay of each line, gamma distributed
LEAD = 0.8  # [s] from a command to its motion: more than the delay
HEALTHY = 12.0  # [s] before a fault
OUTAGE = 3.0  # [s]
FOLLOWS = 5e-3  # [rad] the body follows if it is so near to the timeline, for LASTING
LASTING = 0.1  # [s]
ALLOWED = 1.0  # [s]
NAME = "arm"


class Line:
    """A delay line that keeps the order. While it is `cut`, what is sent waits."""

    def __init__(self, random: Random) -> None:
        self._random = random
        self._waiting: list[tuple[float, Callable[[], None]]] = []
        self.last = self.largest = 0.0  # [s] when the last one comes, and the greatest delay that there was
        self.cut = False

    def send(self, t: float, act: Callable[[], None]) -> None:
        delay = self._random.gammavariate((MEAN / DEVIATION) ** 2, DEVIATION**2 / MEAN)
        self.last = max(self.last, t + delay)
        self.largest = max(self.largest, self.last - t)
        self._waiting.append((self.last, act))

    def arrive(self, t: float) -> None:
        while self._waiting and self._waiting[0][0] <= t and not self.cut:
            self._waiting.pop(0)[1]()


class Outcome(NamedTuple):
    """`after`: from the alarm to when the body followed [s]; `bound` [s]; `jump`: the greatest change of g within 1 ms
    for the greatest velocity. None: no alarm came, for the fault hardly showed.
    """

    after: float | None
    bound: float
    jump: float


class Course:
    """One run. The robot's clock is the wall's less `outage`."""

    def __init__(self, seed: int) -> None:
        random = Random(seed)
        self.random, self.wall, self.outage = random, 0.0, 0.0
        clock = WallClock(lambda: self.wall, lambda _seconds: None)
        self.session = Session(RecordingTerminal(), clock=clock)
        self.engine, self.body = self.session.engine, self.session.body
        self.commands = Commands(seed, self.engine, LEAD)
        self.forth, self.back = Line(random), Line(random)
        self.arm = MujocoArm(self.engine.model, seed=seed)
        self.known: Timeline = self.engine.timeline  # by the body
        self.other: Timeline | None = None  # that another commander has given it
        self.loses = False  # the next change does not come
        self.late: Callable[[float], float] = lambda _wall: 0.0  # how late the body follows [s]
        self.known_outage = 0.0
        self.orders: list[tuple[float, BodyMode]] = []
        self.alarm: float | None = None  # [s] of the wall
        self.number = 0
        self.dead = False
        self._batch: list[Report] = []
        self._sent = self.engine.timeline
        self.body.embody(NAME)
        self.body.listeners.append(self._told)

    @property
    def now(self) -> float:
        return self.wall - self.outage

    def _told(self, news: BodyNews) -> None:
        if isinstance(news, DivergenceAlarm) and self.alarm is None:
            self.alarm = self.wall
        elif isinstance(news, BodyChange) and news.name:
            self.forth.send(self.wall, partial(self.orders.append, (news.at, news.order)))

    def step(self, *, gives: bool = True) -> None:
        self.wall += STEP
        self.session.settle()
        if gives:
            self.commands.until(self.now)
        if self.engine.timeline is not self._sent:
            self._sent = self.engine.timeline
            if self.loses:
                self.loses = False
            else:
                self.forth.send(self.wall, partial(self._learn, self._sent))
        self.forth.arrive(self.wall)
        if not self.dead:
            self._advance()
        self.back.arrive(self.wall)
        while self.session.actor.has_requests:
            self.session.actor.step()

    def _learn(self, timeline: Timeline) -> None:
        self.known = timeline

    def _advance(self) -> None:
        own = self.wall - self.known_outage
        for order in [order for order in self.orders if order[0] <= own]:
            self.orders.remove(order)
            self.other = None
            self.arm.order(order[1])
        for one in self.arm.advance(self.wall, self._setpoint):
            t = one.t - self.known_outage
            self._batch.append(Report(t, one.joints, one.velocity, mode=one.mode))
        if len(self._batch) >= 2:
            batch, self._batch = self._batch, []
            self.back.send(self.wall, partial(self._take, batch, self.number))
            self.number += len(batch)

    def _take(self, batch: list[Report], number: int) -> None:
        if self.body.name == NAME:
            self.body.take(batch, number, NAME)
            self.body.clock = self.body.clock.__class__(0.0, 0.0, max(0.0, self.now - batch[-1].t))

    def _setpoint(self, at: float) -> JointState:
        t = at - self.known_outage - self.late(at)
        return joint_state_at(self.engine.arm, self.other or self.known, max(t, 0.0))

    def restart_body(self) -> None:
        """Kill the body, let its arm stop where it is, and start it again after a while."""
        joints = self.arm.joints
        self.body.leave(NAME)
        self.dead = True
        for _ in range(round(OUTAGE / STEP)):
            self.step(gives=False)
        self.arm = MujocoArm(self.engine.model, seed=self.number, joints=joints, start=self.wall)
        self._enter()

    def restart_server(self) -> None:
        """Let the robot's clock stand for a while; the body follows on along the timeline that it knows."""
        self.body.leave(NAME)
        self.forth.cut = self.back.cut = True
        for _ in range(round(OUTAGE / STEP)):
            self.wall += STEP
            self.outage += STEP
            self._advance()
        self.engine.clock.set(self.now)
        self._enter()

    def _enter(self) -> None:
        """Be the body anew: the answer tells clock, timeline and order at once."""
        self.forth, self.back = Line(self.random), Line(self.random)
        self._batch, self.orders, self.dead = [], [], False
        self.number = self.body.embody(NAME, self.number)
        self.body.command(BodyMode.HOLDS)
        self.alarm = self.wall
        self.arm.order(BodyMode.HOLDS)
        self.known, self.known_outage = self.engine.timeline, self.outage

    def resync(self) -> ResyncReport:
        """Ask for RESYNC as an operator does; time goes on while the body is waited for."""
        dialogue = act_on(self.session, ResyncBody())
        work = next(dialogue)
        assert isinstance(work, Work)
        last = self.wall + 10.0
        while self.wall < last:
            with suppress(RequestRefused):
                self.body.wait_for_rest(0.0)
                break
            self.step(gives=False)
        work.run()
        try:
            dialogue.send(None)
        except StopIteration as over:
            report: ResyncReport = over.value
            return report
        raise AssertionError("RESYNC says no more")


def _other(course: Course) -> None:
    other, model = course.engine.aside(), course.engine.model
    here = joints_at(other.arm, other.timeline, other.now)
    goal = tuple([q + course.random.uniform(-0.6, 0.6) for q in here])
    other.redirect(put_inside(goal, model.lower, model.upper), speed=0.5)
    course.other = other.timeline


def _drift(course: Course, rate: float, jump: float) -> None:
    begin = course.wall
    course.late = lambda wall: jump + rate * (wall - begin)


def _cut(course: Course) -> None:
    course.forth.cut = course.back.cut = True
    for _ in range(round(OUTAGE / STEP)):
        course.step()
    course.forth.cut = course.back.cut = False


def _disturb(course: Course, *which: object) -> None:
    for one in which:
        course.arm.disturb(one)  # type: ignore[arg-type]


FAULTS: dict[str, Callable[[Course], None]] = {
    "blocked joint": lambda it: _disturb(it, BlockedJoint(joint=it.random.randint(1, 6))),
    "payload": lambda it: _disturb(it, Payload(mass=4.0)),
    "lost command": lambda it: setattr(it, "loses", True),
    "growing delay": lambda it: _drift(it, 0.08, 0.0),
    "clock jumps": lambda it: _drift(it, 0.0, 0.3),
    "another commander": _other,
    "emergency stop": lambda it: _disturb(it, EmergencyStop()),
    "slipping brake": lambda it: _disturb(it, SlippingBrake(joint=2, torque=20.0), EmergencyStop()),
    "push": lambda it: _disturb(it, Push(force=(0.0, 300.0, 0.0), lasting=0.5)),
    "line cut": _cut,
    "body restarts": Course.restart_body,
    "server restarts": Course.restart_server,
}


def outcome(name: str, seed: int) -> Outcome:
    """Let a fault happen, ask for RESYNC at its alarm, and wait until the body follows."""
    course = Course(seed)
    engine = course.engine
    while course.wall < HEALTHY or not all(abs(rate) > 0.05 for rate in engine.position().velocity):
        course.step()
        if course.alarm is not None:
            raise AssertionError(f"{name}, seed {seed}: a false alarm at {course.wall:.2f} s")
    FAULTS[name](course)
    last = course.wall + 15.0
    while course.alarm is None and course.wall < last:
        course.step()
    if course.alarm is None:
        return Outcome(None, 0.0, 0.0)
    course.arm.disturb(Release())
    course.late = lambda _wall: 0.0
    while course.body.view is None or course.body.view.mode is BodyMode.STOPPED:
        course.step(gives=False)
    course.forth.largest = course.back.largest = 0.0
    report = course.resync()
    course.known_outage = course.outage
    follows = 0
    while follows < round(LASTING / STEP):
        course.step(gives=False)
        g = joints_at(engine.arm, engine.timeline, course.arm.time - course.outage)  # its last step may end later
        near = np.abs(np.subtract(course.arm.joints, g)).max() < FOLLOWS
        follows = follows + 1 if near and course.arm.mode is BodyMode.FOLLOWS else 0
        if course.wall > course.alarm + 30.0:
            break
    after = course.wall - LASTING - course.alarm
    times = np.arange(0.0, engine.end, 1e-3)
    joints = positions_at(engine.arm, engine.timeline, times).joints
    jump = float((np.abs(np.diff(joints, axis=0)) / 1e-3 / np.array(engine.model.max_velocity)).max())
    delays = course.forth.largest + course.back.largest  # D_f + D_b, as they were meanwhile
    return Outcome(after, delays + ALLOWED + report.until - report.t, jump)


def main(count: int = 20) -> int:
    """So many seeds of each fault. Return how many took too long, or jumped."""
    wrong = 0
    with ProcessPoolExecutor() as pool:
        for name in FAULTS:
            rows = list(pool.map(partial(outcome, name), range(count)))
            found = [(one.after, one.bound, one.jump) for one in rows if one.after is not None]
            late = sum(after > bound for after, bound, _ in found)
            jumps = sum(jump > 1.0 + 1e-6 for *_, jump in found)
            wrong += late + jumps
            worst = max(after - bound for after, bound, _ in found) if found else 0.0
            median = float(np.median([after for after, *_ in found])) if found else 0.0
            print(
                f"{name}: {len(found)} of {count} raised an alarm, {late} late, {jumps} jumps, median {median:.2f} s, "
                f"nearest to its bound {worst:+.2f} s",
                flush=True,
            )
    return wrong


if __name__ == "__main__":
    command(main)
