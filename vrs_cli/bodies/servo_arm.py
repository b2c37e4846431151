"""A body without MuJoCo and without masses: each joint is a servo of second order, which follows g and gives way.

The error of a joint is that of a critically damped servo under friction, loads and pushes. Masses are ours, so that the
sizes of errors are plausible and no more.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import exp

import numpy as np

from vrs_cli.bodies.scenario import BlockedJoint, ClockDrift, Disturbance, EmergencyStop, Payload, Push, SlippingBrake
from vrs_cli.errors import NotAvailable
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.arrays import Floats
from vrs_cli.kinematics.joints import Joints
from vrs_cli.twin.healthy import load_torque
from vrs_cli.values.measured import BodyMode, Report

SetPoint = Callable[[float], tuple[Sequence[float], Sequence[float], Sequence[float]]]

STEP = 0.008  # [s] between two reports
BANDWIDTH = 30.0  # [rad/s] of the servos
VISCOUS, COULOMB = 0.3, 0.2  # [1/s], [rad/s2 or m/s2] of their friction
STICKS_BELOW = 1e-3  # [rad/s, m/s]
MISSED = 0.1  # of an acceleration, which the servos do not know
MASS, LEAST_INERTIA = 10.0, 0.1  # [kg] that a joint moves at the flange, [kg m2]
NOISE, ENCODER = 2e-5, 1e-4  # [rad, m]


class ServoArm:
    """An arm that follows set points and reports its joints, as `bodies.mujoco_arm.MujocoArm` does. `seed`: of the
    noise of its encoders. It stands at READY at 0 s. Raises NotAvailable for a brake that slips.
    """

    def __init__(self, arm: RobotArm, *, seed: int = 0, disturbances: Sequence[Disturbance] = ()) -> None:
        if any(isinstance(one, SlippingBrake) for one in disturbances):
            raise NotAvailable("a brake that slips needs an arm of MuJoCo", "pip install 'vrs-cli[physics]'")
        self.arm, self.mode = arm, BodyMode.FOLLOWS
        self._random = np.random.default_rng(seed)
        ready = np.array(arm.model.poses["ready"])
        self._joints: Floats = ready
        self._error, self._rate = np.zeros_like(ready), np.zeros_like(ready)
        levers = np.linalg.norm(np.array(arm.jacobian(arm.model.poses["ready"]))[:3], axis=0)
        self._inertia = LEAST_INERTIA + MASS * levers**2
        self._disturbances = disturbances
        self._standing: dict[int, float] = {}  # blocked joints, from 0, and where they stand
        self._stopped: Floats | None = None
        self._steps = 0

    @property
    def time(self) -> float:
        """The robot's clock [s]."""
        return self._steps * STEP

    @property
    def joints(self) -> Joints:
        """Where the joints really are [rad, m]."""
        return tuple(self._joints.tolist())

    def own_time(self, t: float) -> float:
        """What its own clock shows at a time of the robot's clock [s]."""
        drifts = (one for one in self._on(t) if isinstance(one, ClockDrift))
        return t + sum(one.jump + one.rate * (t - (one.at or 0.0)) for one in drifts)

    def advance(self, until: float, setpoint: SetPoint) -> list[Report]:
        """Go to a time of the robot's clock [s], after `setpoint` (joints, velocities, accelerations at a time of its
        own clock), and return a report of each step, stamped by its own clock.
        """
        found = []
        while self.time < until - 1e-9:
            self._steps += 1
            self._step(self.own_time(self.time), setpoint)
            noise = self._random.normal(0.0, NOISE, len(self._joints))
            measured = np.round((self._joints + noise) / ENCODER) * ENCODER
            found.append(Report(self.own_time(self.time), tuple(measured.tolist()), mode=self.mode))
        return found

    def _on(self, t: float) -> list[Disturbance]:
        """Return the disturbances that act at a time."""
        return [
            one
            for one in self._disturbances
            if (begin := one.at or 0.0) <= t and (one.lasting is None or t < begin + one.lasting)
        ]

    def _step(self, own: float, setpoint: SetPoint) -> None:
        on = self._on(self.time)
        goal, velocity, acceleration = (np.array(row) for row in setpoint(own))
        torque = np.zeros_like(goal)
        for one in on:
            if isinstance(one, Payload):
                torque += one.mass * load_torque(self.arm, *(tuple(x.tolist()) for x in (goal, velocity, acceleration)))
            elif isinstance(one, Push):
                torque -= np.array(self.arm.jacobian(tuple(goal.tolist())))[:3].T @ np.array(one.force)
                if one.joint:
                    torque[one.joint - 1] -= one.torque
        friction = VISCOUS * velocity + COULOMB * np.tanh(velocity / STICKS_BELOW)
        self._lag(-(MISSED * acceleration + friction + torque / self._inertia))
        stops = any(isinstance(one, EmergencyStop) for one in on)
        self._stopped = (self._joints if self._stopped is None else self._stopped) if stops else None
        self.mode = BodyMode.STOPPED if stops else BodyMode.FOLLOWS
        blocked = {one.joint - 1 for one in on if isinstance(one, BlockedJoint)}
        self._standing = {joint: self._standing.get(joint, float(self._joints[joint])) for joint in blocked}
        self._joints = goal + self._error if self._stopped is None else self._stopped
        for joint, stands in self._standing.items():
            self._joints[joint] = stands

    def _lag(self, force: Floats) -> None:
        """Go on by a step of the error of critically damped servos, under a constant force [rad/s2, m/s2]."""
        rest, decay = force / BANDWIDTH**2, exp(-BANDWIDTH * STEP)
        a, b = self._error - rest, self._rate + BANDWIDTH * (self._error - rest)
        self._error = rest + (a + b * STEP) * decay
        self._rate = (b - BANDWIDTH * (a + b * STEP)) * decay
