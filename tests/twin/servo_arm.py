"""A small arm for tests: each joint is a servo that lags, sticks and sags a little, with noise and an encoder."""

from __future__ import annotations

from collections.abc import Callable
from math import exp
from random import Random

import numpy as np

from vrs_cli.engine.clock import WallClock
from vrs_cli.engine.engine import Engine
from vrs_cli.engine.position import position_at
from vrs_cli.errors import MotionError
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.arrays import Floats
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.commands import JointTarget, Move, Stamp
from vrs_cli.values.measured import BodyMode, Report

STEP = 0.01  # [s] between two reports
RATE = 30.0  # [rad/s] of the servos, critically damped
INERTIA = (4.0, 4.0, 1.5, 0.3, 0.3, 0.15)  # [kg m2] that the servos move
UNKNOWN_MASS = 0.3  # [kg] at the flange that the servos do not know of
NOISE = 5e-5  # [rad]
ENCODER = 2e-4  # [rad]
SOON = 0.25  # [s] from a command to its motion


class ServoArm:
    """Follows `timeline` (that of the robot, unless somebody gives it another) at `t - delay(t)`."""

    def __init__(self, arm: RobotArm, seed: int) -> None:
        self.arm, self._random = arm, np.random.default_rng(seed)
        n = arm.model.joint_count
        self._inertia = np.array(INERTIA[:n])
        self._error, self._rate = np.zeros(n), np.zeros(n)
        self.load = UNKNOWN_MASS  # [kg]
        self.delay: Callable[[float], float] = lambda _t: 0.0
        self.blocked: dict[int, float] = {}  # joints, from 0, and where they stand
        self.pushed = np.zeros(n)  # [N m]
        self.place: Floats | None = None  # where it has stopped by itself
        self.mode = BodyMode.FOLLOWS
        self.joints: Floats = np.zeros(n)

    def report(self, timeline: Timeline, t: float) -> Report:
        """Go on to t, a step after the time before, and measure."""
        here = position_at(self.arm, timeline, t - self.delay(t))
        velocity, acceleration = np.array(here.velocity), np.array(here.acceleration)
        torque = self.load * load_torque(self.arm, here.joints, here.velocity, here.acceleration) - self.pushed
        force = 0.1 * acceleration + 0.3 * velocity + 0.2 * np.tanh(velocity / 1e-3) + torque / self._inertia
        self._error, self._rate = _critically_damped(self._error, self._rate, -force)
        self.joints = np.array(here.joints) + self._error if self.place is None else self.place
        for joint, stands in self.blocked.items():
            self.joints[joint] = stands
        measured = np.round((self.joints + self._random.normal(0.0, NOISE, len(self._error))) / ENCODER) * ENCODER
        return Report(t, tuple(measured.tolist()), mode=self.mode)


def _critically_damped(error: Floats, rate: Floats, force: Floats) -> tuple[Floats, Floats]:
    """Return error and rate a step later under a constant force [rad/s2]."""
    rest, decay = force / RATE**2, exp(-RATE * STEP)
    a, b = error - rest, rate + RATE * (error - rest)
    return rest + (a + b * STEP) * decay, (b - RATE * (a + b * STEP)) * decay


def load_torque(arm: RobotArm, q: tuple[float, ...], qd: tuple[float, ...], qdd: tuple[float, ...]) -> Floats:
    """Return the torques [N m] that a mass of 1 kg at the flange takes."""
    jacobian = np.array(arm.jacobian(q))[:3]
    acceleration = jacobian @ np.array(qdd) + np.array(arm.acceleration_bias(q, qd)[:3])
    torque: Floats = jacobian.T @ (acceleration + np.array([0.0, 0.0, 9.81]))
    return torque


class Commands:
    """An operator who gives random motions, some while others are under way, from a seed. `soon`: how early [s]."""

    def __init__(self, seed: int, engine: Engine | None = None, soon: float = SOON) -> None:
        self._random, self._soon = Random(seed), soon
        self.engine = Engine(load_robot("puma560")) if engine is None else engine
        if engine is None:
            self.engine.clock.realtime = True
        self.next = 0.5

    def until(self, t: float) -> bool:
        """Let time go on to t [s]; return whether a command was given."""
        engine, random = self.engine, self._random
        if not isinstance(engine.clock, WallClock):
            engine.clock.set(t)
        if t < self.next:
            return False
        model = engine.model
        here = engine.destination(engine.end).joints
        goal = []
        for q, low, high in zip(here, model.lower, model.upper, strict=True):
            way = random.uniform(-0.5, 0.5) * (high - low)
            goal.append(min(max(q + way, low + 0.1), high - 0.1))
        try:
            engine.perform(
                Move(JointTarget(tuple(goal)), False, speed=random.uniform(0.2, 1.0), stamp=Stamp(self._soon, True))
            )
        except MotionError:
            return False
        interrupts = random.random() < 0.3
        self.next = t + random.uniform(0.2, 1.0) if interrupts else engine.end + random.uniform(0.0, 2.0)
        return True
