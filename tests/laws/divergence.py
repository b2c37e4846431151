"""Alarms of bodies with faults, and none of healthy ones: random motions of a small arm in virtual time."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable
from copy import copy
from random import Random
from typing import Literal, NamedTuple

import numpy as np

from tests.by_hand import command
from tests.twin.servo_arm import STEP, Commands, ServoArm
from vrs_cli.engine.position import joints_at
from vrs_cli.kinematics.joints import put_inside
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.twin.divergence import DivergenceWatch
from vrs_cli.values.measured import DivergenceAlarm, DivergenceCause

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
    """The alarm of a fault, and how long it took from the first residual beyond 5 standard deviations on [s]; None:
    the fault showed nothing, or no alarm came.
    """

    alarm: DivergenceAlarm | None
    after: float | None


class Course:
    """A robot, its body and its watch in virtual time. `followed`: the timeline of the body, if it is another one."""

    def __init__(self, seed: int) -> None:
        self.commands, self.watch = Commands(seed), DivergenceWatch(Commands(seed).engine.arm)
        self.engine = self.commands.engine
        self.body = ServoArm(self.engine.arm, seed)
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
            alarm = self.watch.take(self.engine.timeline, self.body.report(self.engine.timeline, self.t))
            if alarm is not None:
                alarms.append(alarm)
        return alarms

    def fault(self, name: str, random: Random) -> Outcome:
        """Let a fault happen, and wait for its alarm."""
        begun, exceeded, last = False, None, self.t + PATIENCE
        well = self.body
        while self.t < last:
            self.steps += 1
            before, t = self.engine.timeline, self.t
            gave = self.commands.until(t)
            if not begun and self._begins(name, gave):
                begun, well, self.body = True, self.body, copy(self.body)
                FAULTS[name](self, before, random)
            timeline = self.engine.timeline
            report, right = self.body.report(self.followed or timeline, t), None
            if begun:
                right = well.report(timeline, t)
                noise = self.watch.healthy.noise[-1]
                if exceeded is None and (np.abs(np.subtract(report.joints, right.joints)) > 5.0 * noise).any():
                    exceeded = t
            alarm = self.watch.take(timeline, report)
            if alarm is not None:
                return Outcome(alarm, None if exceeded is None else t + BACK - exceeded)
        return Outcome(None, None)

    def _begins(self, name: str, gave: bool) -> bool:
        """Return whether a fault can show now: a command came, or all joints move."""
        velocity = self.engine.position().velocity
        return gave if name == "lost" else name == "delay" or all(abs(rate) > 0.05 for rate in velocity)


def _blocked(course: Course, _before: Timeline, random: Random) -> None:
    joint = random.randrange(len(course.body.joints))
    course.body.blocked = {joint: course.body.joints[joint]}


def _payload(course: Course, _before: Timeline, _random: Random) -> None:
    course.body.load += 2.0


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


def outcome(name: str, seed: int, learned: float = 40.0) -> Outcome:
    """Let a fault come after so many healthy seconds."""
    course = Course(seed)
    false = course.healthy(learned)
    assert not false, f"seed {seed}: a false alarm, {false[0]}"
    return course.fault(name, Random(seed))


def main(what: Literal["faults", "healthy"], count: int = 60) -> int:
    """`faults`: so many seeds of each; `healthy`: so many hours, of which each tenth is a robot of its own."""
    wrong = 0
    begun = time.process_time()
    if what == "healthy":
        for seed in range(10):
            alarms = Course(seed).healthy(360.0 * count)
            wrong += len(alarms)
            spent = time.process_time() - begun
            print(
                f"robot {seed}: {0.1 * count:g} h, {len(alarms)} false alarms {alarms[:3]} ({spent:.0f} s CPU)",
                flush=True,
            )
        return wrong
    for name, cause in CAUSES.items():
        found = [outcome(name, seed) for seed in range(count)]
        right = sum(one.alarm is not None and one.alarm.cause is cause for one in found)
        times = [one.after for one in found if one.after is not None]
        late = sum(one.alarm is None or (one.after or 0.0) > IN_TIME for one in found)
        named = Counter(one.alarm.cause.value if one.alarm else "no alarm" for one in found)
        print(f"{name}: cause right {right} of {count}, {late} too late, median {np.median(times):.2f} s,", end=" ")
        print(f"at most {max(times):.2f} s after 5 sigma, D_b {BACK:g} s included; {dict(named)}", flush=True)
        wrong += late + (right < 0.9 * count)
    return wrong


if __name__ == "__main__":
    command(main)
