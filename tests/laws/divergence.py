"""Alarms of bodies with faults, and none of healthy ones: random motions of an arm in virtual time. The arm is a small
one of servos, or the simulated one of `vrs_cli.bodies`.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from copy import copy, deepcopy
from functools import partial
from math import inf
from random import Random
from typing import Literal, NamedTuple, Protocol

import numpy as np

from tests.by_hand import command
from tests.twin.servo_arm import STEP, Commands, ServoArm
from vrs_cli.bodies.mujoco_arm import MujocoArm
from vrs_cli.bodies.scenario import BlockedJoint, Payload
from vrs_cli.engine.position import joint_state_at, joints_at
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.joints import put_inside
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.twin.divergence import DivergenceWatch
from vrs_cli.values.measured import DivergenceAlarm, DivergenceCause, Report

BACK = 0.2  # [s] D_b: how old reports are when they come
IN_TIME = BACK + 0.5  # [s] in which an alarm is to come
PATIENCE = 15.0  # [s] in which something has to move
CAUSES = {
    "blocked": DivergenceCause.BLOCKED,
    "payload": DivergenceCause.PAYLOAD,
    "lost": DivergenceCause.LOST_COMMAND,
    "delay": DivergenceCause.DELAY,
    "other": DivergenceCause.OTHER_COMMANDER,
}


class Outcome(NamedTuple):
    """The alarm of a fault, and how long it took from the first residual beyond 5 standard deviations on [s], infinite
    if none came; None: no residual was so large until then. `false`: how many came before the fault.
    """

    alarm: DivergenceAlarm | None
    after: float | None
    false: int = 0


class Body(Protocol):
    """An arm that reports 100 times a second. `delay`: how late it follows, by the time [s]."""

    delay: Callable[[float], float]

    def advance(self, timeline: Timeline, t: float) -> list[Report]:
        """Go on to t, which is STEP later, and measure."""

    def block(self, joint: int) -> None:
        """Let a joint, from 0, stand where it is from now on."""

    def carry(self, mass: float) -> None:
        """Put so much more [kg] to the flange."""

    def twin(self) -> Body:
        """Return an arm that does from now on what this one would do without a fault."""


class Servo(ServoArm):
    def advance(self, timeline: Timeline, t: float) -> list[Report]:
        return [self.report(timeline, t)]

    def block(self, joint: int) -> None:
        self.blocked = {joint: self.joints[joint]}

    def carry(self, mass: float) -> None:
        self.load += mass

    def twin(self) -> Body:
        return copy(self)


class Simulated:
    """The arm of MuJoCo."""

    def __init__(self, arm: RobotArm, seed: int) -> None:
        self._arm, self._mujoco = arm, MujocoArm(arm.model, seed=seed)
        self.delay: Callable[[float], float] = lambda _t: 0.0

    def advance(self, timeline: Timeline, t: float) -> list[Report]:
        return self._mujoco.advance(t, lambda at: joint_state_at(self._arm, timeline, max(at - self.delay(at), 0.0)))

    def block(self, joint: int) -> None:
        self._mujoco.disturb(BlockedJoint(joint=joint + 1))

    def carry(self, mass: float) -> None:
        self._mujoco.disturb(Payload(mass=mass))

    def twin(self) -> Body:
        well = copy(self)
        well._mujoco = _copied(self._mujoco)
        return well


def _copied(arm: MujocoArm) -> MujocoArm:
    """Return an arm in the same state, which shares nothing that changes with this one."""
    found = copy(arm)
    found._m, found._d, found._guess = copy(arm._m), copy(arm._d), copy(arm._guess)
    found._seen, found._rate = found._guess.qpos, found._guess.qvel
    found._random, found._effort, found._push = deepcopy(arm._random), arm._effort.copy(), arm._push.copy()
    found._waiting, found._active = [*arm._waiting], [*arm._active]
    return found


Kind = Literal["servo", "mujoco"]


class Course:
    """A robot, its body and its watch in virtual time. `followed`: the timeline of the body, if it is another one."""

    def __init__(self, seed: int, kind: Kind = "servo") -> None:
        self.commands, self.watch = Commands(seed), DivergenceWatch(Commands(seed).engine.arm)
        self.engine = self.commands.engine
        arm = self.engine.arm
        self.body: Body = Servo(arm, seed) if kind == "servo" else Simulated(arm, seed)
        self.followed: Timeline | None = None
        self.steps = 0

    @property
    def t(self) -> float:
        return self.steps * STEP

    def healthy(self, seconds: float) -> list[DivergenceAlarm]:
        """Let a healthy body move for so long; return all alarms."""
        alarms = []
        for _ in range(round(seconds / STEP)):
            self.steps += 1
            self.commands.until(self.t)
            alarms += self.watched(self.body.advance(self.engine.timeline, self.t))
        return alarms

    def watched(self, reports: list[Report]) -> list[DivergenceAlarm]:
        """Give reports to the watch; return its alarms."""
        return [alarm for one in reports if (alarm := self.watch.take(self.engine.timeline, one)) is not None]

    def fault(self, name: str, random: Random) -> Outcome:
        """Let a fault happen, and wait for its alarm."""
        begun, exceeded, last = False, None, self.t + 4.0 * PATIENCE
        well = self.body
        while self.t < last:
            self.steps += 1
            before, t = self.engine.timeline, self.t
            gave = self.commands.until(t)
            if not begun and self._begins(name, gave):
                begun, well, last = True, self.body.twin(), t + PATIENCE
                FAULTS[name](self, before, random)
            timeline = self.engine.timeline
            reports = self.body.advance(self.followed or timeline, t)
            if begun:
                noise = 5.0 * self.watch.healthy.noise[-1]
                for one, right in zip(reports, well.advance(timeline, t), strict=True):
                    if exceeded is None and (np.abs(np.subtract(one.joints, right.joints)) > noise).any():
                        exceeded = one.t
            for alarm in self.watched(reports):
                return Outcome(alarm, None if exceeded is None else t + BACK - exceeded)
        return Outcome(None, None if exceeded is None else inf)

    def _begins(self, name: str, gave: bool) -> bool:
        """Return whether a fault can show now: a command came, or all joints move."""
        velocity = self.engine.position().velocity
        return gave if name == "lost" else name == "delay" or all(abs(rate) > 0.05 for rate in velocity)


def _blocked(course: Course, _before: Timeline, random: Random) -> None:
    course.body.block(random.randrange(course.engine.model.joint_count))


def _payload(course: Course, _before: Timeline, _random: Random) -> None:
    course.body.carry(2.0)


def _lost(course: Course, before: Timeline, _random: Random) -> None:
    course.followed = before


def _delay(course: Course, _before: Timeline, random: Random) -> None:
    growth, begin = random.uniform(0.02, 0.1), course.t
    course.body.delay = lambda t: growth * (t - begin)


def _other(course: Course, _before: Timeline, random: Random) -> None:
    other, model = course.engine.aside(), course.engine.model
    here = joints_at(other.arm, other.timeline, other.now)
    ways = [random.uniform(-0.3, 0.3) * (high - low) for low, high in zip(model.lower, model.upper, strict=True)]
    goal = put_inside(tuple([q + way for q, way in zip(here, ways, strict=True)]), model.lower, model.upper)
    other.redirect(goal, speed=random.uniform(0.2, 1.0))
    course.followed = other.timeline


FAULTS: dict[str, Callable[[Course, Timeline, Random], None]] = {
    "blocked": _blocked,
    "payload": _payload,
    "lost": _lost,
    "delay": _delay,
    "other": _other,
}


def outcome(name: str, seed: int, learned: float = 40.0, kind: Kind = "servo") -> Outcome:
    """Let a fault come after so many healthy seconds."""
    course = Course(seed, kind)
    false = course.healthy(learned)
    return course.fault(name, Random(seed))._replace(false=len(false))


def _half_an_hour(kind: Kind, seed: int) -> list[DivergenceAlarm]:
    return Course(seed, kind).healthy(1800.0)


def main(what: Literal["faults", "healthy"], count: int = 60, kind: Kind = "servo") -> int:
    """`faults`: so many seeds of each; `healthy`: so many hours, of which each half is a robot of its own."""
    wrong = 0
    with ProcessPoolExecutor() as pool:
        if what == "healthy":
            for seed, alarms in enumerate(pool.map(partial(_half_an_hour, kind), range(2 * count))):
                wrong += len(alarms)
                print(f"{0.5 * (seed + 1):g} h: {wrong} false alarms {alarms[:3]}", flush=True)
            return wrong
        for name, cause in CAUSES.items():
            found = list(pool.map(partial(outcome, name, kind=kind), range(count)))
            right = sum(one.alarm is not None and one.alarm.cause is cause for one in found)
            times = [one.after for one in found if one.after is not None]
            false = sum(one.false for one in found)
            late = sum((one.after or 0.0) > IN_TIME for one in found)
            named = Counter(one.alarm.cause.value if one.alarm else "no alarm" for one in found)
            print(f"{name}: cause right {right} of {count}, {late} too late, median {np.median(times):.2f} s,", end=" ")
            print(
                f"at most {max(times):.2f} s after 5 sigma, D_b {BACK:g} s included; {false} false; {dict(named)}",
                flush=True,
            )
            wrong += false + late + (right < 0.9 * count)
    return wrong


if __name__ == "__main__":
    command(main)
