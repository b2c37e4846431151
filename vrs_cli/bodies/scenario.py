"""Define disturbances of a simulated arm, read the scenario files that list them, and simulate an arm without MuJoCo
(`ServoArm`).

A scenario is a TOML file of [[push]], [[payload]], [[block]], [[slip]], [[stop]] and [[drift]] tables. The same
disturbances can be typed while the arm is simulated: `push force = [0, 40, 0] for = 0.2`.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable, Mapping, Sequence
from math import exp
from pathlib import Path
from typing import NamedTuple

import numpy as np
from msgspec import Struct

from vrs_cli.errors import FileDamaged, FileError, NonexistentFile, NotAvailable, did_you_mean
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.arrays import Floats
from vrs_cli.kinematics.data_reader import LENGTH, PLAIN, POSITIVE, DataReader
from vrs_cli.kinematics.joints import JointKind, Joints
from vrs_cli.kinematics.transform import Vector
from vrs_cli.twin.healthy import load_torque
from vrs_cli.values.measured import BodyMode, Report

MAX_DISTURBANCES = 10_000  # maximum number of disturbances in a scenario


class Disturbance(Struct, frozen=True, tag_field="kind"):
    """A disturbance of a simulated arm, from `at` [s] of the robot's clock (None: immediately) for `lasting` [s]
    (None: without end). Scenarios and commands name it by the tag of its class.
    """

    at: float | None = None
    lasting: float | None = None


class Push(Disturbance, frozen=True, tag="push"):
    """A force on the flange [N], in the robot's frame; or a torque at a joint, counted from 1 [N m, N]."""

    force: Vector = (0.0, 0.0, 0.0)
    joint: int = 0
    torque: float = 0.0


class Payload(Disturbance, frozen=True, tag="payload"):
    """A load at the flange that the controller does not know: mass [kg] and its centre [m] in the flange's frame."""

    mass: float = 0.0
    centre: Vector = (0.0, 0.0, 0.0)


class BlockedJoint(Disturbance, frozen=True, tag="block"):
    """A joint, counted from 1, that stays at its current position."""

    joint: int = 1


class SlippingBrake(Disturbance, frozen=True, tag="slip"):
    """A brake of a joint, counted from 1, that holds at most this torque [N m, N]."""

    joint: int = 1
    torque: float = 0.0


class EmergencyStop(Disturbance, frozen=True, tag="stop"):
    """An emergency stop of the arm itself: motors off, brakes on."""


class ClockDrift(Disturbance, frozen=True, tag="drift"):
    """An error of the arm's clock: it gains `rate` [s/s], and jumps by `jump` [s] at the start."""

    rate: float = 0.0
    jump: float = 0.0


class Release(Struct, frozen=True):
    """A command that ends all disturbances of a kind; None: of all kinds."""

    kind: type[Disturbance] | None = None


KINDS: dict[str, type[Disturbance]] = {
    str(kind.__struct_config__.tag): kind
    for kind in (Push, Payload, BlockedJoint, SlippingBrake, EmergencyStop, ClockDrift)
}
RELEASE = "release"
EXAMPLES = {
    "push": "force = [0, 40, 0] for = 0.2",
    "payload": "mass = 2",
    "block": "joint = 3",
    "slip": "joint = 2 torque = 20",
    "stop": "for = 5",
    "drift": "rate = 1e-4",
}
PAIR = re.compile(r"(\w+)\s*=\s*(\[[^\]]*\]|\S+)")


class Scenario(NamedTuple):
    """The disturbances of a simulated arm, and the seed of its noise."""

    disturbances: tuple[Disturbance, ...] = ()
    seed: int = 0


def load_scenario(path: Path, kinds: tuple[JointKind, ...]) -> Scenario:
    """Read a scenario for a robot with joints of these kinds. Raises NonexistentFile, FileError, FileDamaged."""
    reader = ScenarioReader(str(path), human=True)
    table = reader.table(load_toml(path, "a scenario"), "the file", (), ("seed", *KINDS))
    seed = table.get("seed", 0)
    if isinstance(seed, bool) or not isinstance(seed, int) or not 0 <= seed < 2**32:
        raise reader.wrong("seed", f"{seed!r} is none", "give a whole number from 0 to 4294967295")
    found = list[Disturbance]()
    for word in KINDS:
        rows = table.get(word, [])
        if not isinstance(rows, list) or len(rows) > MAX_DISTURBANCES:
            raise reader.wrong(word, "is not a list of tables", f"write [[{word}]], at most {MAX_DISTURBANCES}")
        found += [reader.disturbance(word, row, f"{word} {i}", kinds) for i, row in enumerate(rows, 1)]
    if timeless := next((one for one in found if one.at is None), None):
        word = str(timeless.__struct_config__.tag)
        raise reader.wrong(word, "has no at", "give the second of the robot's clock when it begins")
    return Scenario(tuple(found), seed)


def load_toml(path: Path, what: str) -> Mapping[str, object]:
    """Return the tables of a TOML file. Raises NonexistentFile, FileError, FileDamaged."""
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise NonexistentFile(str(path)) from None
    except OSError as error:
        raise FileError(f"{path}: {error.strerror}") from error
    except (ValueError, RecursionError) as error:
        raise FileDamaged(f"{path}: {error}", f"{what} is a TOML file") from None


def read_command(line: str, kinds: tuple[JointKind, ...]) -> Disturbance | Release:
    """Read a typed line: `payload mass = 2 centre = [0, 0, 100]`, `release payload`. Raises FileDamaged."""
    word, _, rest = line.strip().partition(" ")
    reader = ScenarioReader("body", human=True)
    if word == RELEASE:
        if rest.strip() not in ("", *KINDS):
            raise reader.wrong(RELEASE, f"{rest.strip()!r} is none", f"give one of {', '.join(KINDS)}, or nothing")
        return Release(KINDS.get(rest.strip()))
    if word not in KINDS:
        raise reader.wrong(
            word or "a line", "is no word", did_you_mean(word, KINDS, f"known here: {', '.join(KINDS)}, {RELEASE}")
        )
    left = PAIR.sub("", rest).strip(" ,")
    try:
        table = tomllib.loads("\n".join(f"{key} = {value.rstrip(',')}" for key, value in PAIR.findall(rest)))
    except ValueError:
        left, table = rest.strip(), {}
    if left:
        raise reader.wrong(word, f"{left!r} is not read", f"write it as {word} {EXAMPLES[word]}")
    return reader.disturbance(word, table, word, kinds)


class ScenarioReader(DataReader, frozen=True):
    """Reads disturbances from tables in millimetres, newtons, kilograms and seconds."""

    def disturbance(self, word: str, data: object, key: str, kinds: tuple[JointKind, ...]) -> Disturbance:
        keys = [name for name in KINDS[word].__struct_fields__ if name not in ("at", "lasting")]
        table = self.table(data, key, (), ("at", "for", *keys))
        times = {
            field: self.number(table[name], f"{key}: {name}", POSITIVE if name == "for" else PLAIN)
            for name, field in (("at", "at"), ("for", "lasting"))
            if name in table
        }
        match KINDS[word]:
            case kind if kind is Push:
                force = self.three(table, "force", key)
                joint = self.joint(table, key, kinds) if "joint" in table else 0
                torque = self.figure(table, "torque", key)
                if not (any(force) or (joint and torque)):
                    raise self.wrong(key, "pushes nothing", "give force = [x, y, z] in N, or joint and torque")
                return Push(**times, force=force, joint=joint, torque=torque)
            case kind if kind is Payload:
                mass = self.figure(table, "mass", key)
                if not mass > 0.0:
                    raise self.wrong(key, "has no mass", "give mass in kg, above 0")
                return Payload(**times, mass=mass, centre=self.three(table, "centre", key))
            case kind if kind is BlockedJoint:
                return BlockedJoint(**times, joint=self.joint(table, key, kinds))
            case kind if kind is SlippingBrake:
                torque = self.figure(table, "torque", key)
                if torque < 0.0:
                    raise self.wrong(f"{key}: torque", f"{torque:g} is below zero", "give it without a sign")
                return SlippingBrake(**times, joint=self.joint(table, key, kinds), torque=torque)
            case kind if kind is EmergencyStop:
                return EmergencyStop(**times)
            case _:
                rate, jump = self.figure(table, "rate", key), self.figure(table, "jump", key)
                if abs(rate) >= 1.0:
                    raise self.wrong(f"{key}: rate", f"{rate:g} is no clock", "give seconds a second, as 1e-4")
                return ClockDrift(**times, rate=rate, jump=jump)

    def figure(self, table: Mapping[str, object], name: str, key: str) -> float:
        return self.number(table.get(name, 0.0), f"{key}: {name}", PLAIN)

    def three(self, table: Mapping[str, object], name: str, key: str) -> Vector:
        quantity = LENGTH if name == "centre" else PLAIN
        right = f"give [x, y, z]{self.in_unit(quantity)}"
        x, y, z = self.number_list(table.get(name, [0.0, 0.0, 0.0]), f"{key}: {name}", [quantity] * 3, right)
        return x, y, z

    def joint(self, table: Mapping[str, object], key: str, kinds: tuple[JointKind, ...]) -> int:
        joint = table.get("joint")
        if isinstance(joint, bool) or not isinstance(joint, int) or not 1 <= joint <= len(kinds):
            raise self.wrong(f"{key}: joint", f"{joint!r} is none of this robot", f"give 1 to {len(kinds)}")
        return joint


SetPoint = Callable[[float], tuple[Sequence[float], Sequence[float], Sequence[float]]]

STEP = 0.008  # [s] time between two reports
BANDWIDTH = 30.0  # [rad/s] bandwidth of the servos
VISCOUS, COULOMB = 0.3, 0.2  # [1/s], [rad/s2 or m/s2] viscous and Coulomb friction of the servos
STICKS_BELOW = 1e-3  # [rad/s, m/s] speed at which Coulomb friction nearly reaches its full size
MISSED = 0.1  # fraction of an acceleration that the servos do not compensate
# [kg] mass at the flange that sets the inertia of each joint; [kg m2] minimum inertia of a joint
MASS, LEAST_INERTIA = 10.0, 0.1
NOISE, ENCODER = 2e-5, 1e-4  # [rad, m] standard deviation of the noise, and resolution of the encoders


class ServoArm:
    """An arm that follows set points and reports its joints, with the same methods as `bodies.mujoco_arm.MujocoArm`.

    `seed`: the seed of the noise of its encoders. At 0 s it is at READY. Each joint is a critically damped servo under
    friction, loads and pushes. We chose the masses so that errors have a plausible size. Raises NotAvailable for a
    slipping brake.
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
        self._standing: dict[int, float] = {}  # positions of blocked joints by index from 0 [rad, m]
        self._stopped: Floats | None = None
        self._steps = 0

    @property
    def time(self) -> float:
        """Return the robot's clock [s]."""
        return self._steps * STEP

    @property
    def joints(self) -> Joints:
        """Return the real joints [rad, m]."""
        return tuple(self._joints.tolist())

    def own_time(self, t: float) -> float:
        """Return the time of the arm's own clock at a time of the robot's clock [s]."""
        drifts = (one for one in self._on(t) if isinstance(one, ClockDrift))
        return t + sum(one.jump + one.rate * (t - (one.at or 0.0)) for one in drifts)

    def advance(self, until: float, setpoint: SetPoint) -> list[Report]:
        """Simulate up to a time of the robot's clock [s], and return a report for each step, stamped by the arm's own
        clock. `setpoint` returns joints, velocities and accelerations at a time of this clock."""
        found = []
        while self.time < until - 1e-9:
            self._steps += 1
            self._step(self.own_time(self.time), setpoint)
            measured = np.round((self._joints + self._random.normal(0.0, NOISE, len(self._joints))) / ENCODER) * ENCODER
            found.append(Report(self.own_time(self.time), tuple(measured.tolist()), mode=self.mode))
        return found

    def _on(self, t: float) -> list[Disturbance]:
        """Return the disturbances that act at a time [s]."""
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
        rest = -(MISSED * acceleration + friction + torque / self._inertia) / BANDWIDTH**2
        decay = exp(-BANDWIDTH * STEP)  # the factor by which the error of a critically damped servo shrinks in a step
        a, b = self._error - rest, self._rate + BANDWIDTH * (self._error - rest)
        self._error = rest + (a + b * STEP) * decay
        self._rate = (b - BANDWIDTH * (a + b * STEP)) * decay
        stops = any(isinstance(one, EmergencyStop) for one in on)
        self._stopped = (self._joints if self._stopped is None else self._stopped) if stops else None
        self.mode = BodyMode.STOPPED if stops else BodyMode.FOLLOWS
        blocked = {one.joint - 1 for one in on if isinstance(one, BlockedJoint)}
        self._standing = {joint: self._standing.get(joint, float(self._joints[joint])) for joint in blocked}
        self._joints = goal + self._error if self._stopped is None else self._stopped
        for joint, stands in self._standing.items():
            self._joints[joint] = stands
