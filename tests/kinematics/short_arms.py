"""Random arms of four and five joints that tilt their tools, with kinematics of their own, in numpy alone."""

from __future__ import annotations

from collections.abc import Callable
from math import pi
from random import Random

import numpy as np
from numpy.typing import NDArray

from vrs_cli.kinematics.joints import JointKind
from vrs_cli.kinematics.model import ArmTask, Link, RobotModel

Array = NDArray[np.float64]
RIGHT = pi / 2


def classical(random: Random, joints: int) -> list[Link]:
    """A waist, a shoulder, an elbow and a wrist that pitch, and a roll: as most arms for teaching have them."""
    sign, tool = random.choice((1.0, -1.0)), random.uniform(0.03, 0.15)
    links = [
        Link(random.uniform(-0.05, 0.05), random.uniform(0.05, 0.3), sign * RIGHT, random.uniform(-3, 3)),
        Link(random.uniform(0.1, 0.5), random.uniform(-0.05, 0.05), random.choice((0.0, pi)), random.uniform(-3, 3)),
        Link(random.uniform(0.1, 0.5), 0.0, random.choice((0.0, pi)), random.uniform(-3, 3)),
    ]
    if joints == 4:
        return [*links, Link(tool, 0.0, RIGHT, random.uniform(-3, 3))]
    return [*links, Link(0.0, 0.0, RIGHT, random.uniform(-3, 3)), Link(0.0, 2.0 * tool, 0.0, 0.0)]


def any_links(random: Random, joints: int) -> list[Link]:
    """Axes at all angles; one of them may slide."""
    slides = random.randrange(1, joints) if random.random() < 0.3 else None
    links = []
    for i in range(joints):
        alpha = random.choice((0.0, RIGHT, -RIGHT, random.uniform(-2, 2)))
        kind = JointKind.PRISMATIC if i == slides else JointKind.REVOLUTE
        links.append(Link(random.uniform(-0.4, 0.4), random.uniform(-0.3, 0.3), alpha, random.uniform(-3, 3), kind))
    return links


def random_arm(seed: int, joints: int) -> RobotModel:
    """One of every kind, by its seed."""
    random = Random(seed)
    links = (classical if seed % 2 else any_links)(random, joints)
    slides = [link.kind is JointKind.PRISMATIC for link in links]
    reach = [0.3 if slide else random.uniform(1.5, 2.8) for slide in slides]
    middle = [0.3 if slide else random.uniform(-0.3, 0.3) for slide in slides]
    rates = [0.4 if slide else random.uniform(1.0, 4.0) for slide in slides]
    ready = tuple(at + 0.37 * half for at, half in zip(middle, reach, strict=True))
    return RobotModel(
        name=f"arm{seed}",
        title=f"Random arm {seed}",
        links=tuple(links),
        lower=tuple(at - half for at, half in zip(middle, reach, strict=True)),
        upper=tuple(at + half for at, half in zip(middle, reach, strict=True)),
        max_velocity=tuple(rates),
        max_acceleration=tuple(4.0 * rate for rate in rates),
        max_jerk=tuple(40.0 * rate for rate in rates),
        linear_speed=0.25,
        linear_acceleration=1.0,
        linear_jerk=10.0,
        angular_speed=1.0,
        angular_acceleration=4.0,
        angular_jerk=40.0,
        poses={"ready": ready, "nest": tuple(middle)},
        task=ArmTask.STEADY,
    )


def forward(model: RobotModel, q: Array) -> Array:
    """T_base_flange (4, 4)."""
    T = np.eye(4)
    for link, x in zip(model.links, q, strict=True):
        turn, slide = (link.theta, link.d + x) if link.kind is JointKind.PRISMATIC else (link.theta + x, link.d)
        T = T @ _turned(turn, 2) @ _moved(0.0, 0.0, slide) @ _moved(link.a, 0.0, 0.0) @ _turned(link.alpha, 0)
    return T


def _turned(angle: float, axis: int) -> Array:
    T, (i, j) = np.eye(4), ((1, 2) if axis == 0 else (0, 1))
    T[i, i] = T[j, j] = np.cos(angle)
    T[i, j], T[j, i] = -np.sin(angle), np.sin(angle)
    return T


def _moved(x: float, y: float, z: float) -> Array:
    T = np.eye(4)
    T[:3, 3] = x, y, z
    return T


def turn_between(A: Array, B: Array) -> float:
    """Between two orientations (3, 3) [rad]: exact for small ones too."""
    return float(2.0 * np.arcsin(min(np.linalg.norm(A - B) / np.sqrt(8.0), 1.0)))


def slopes(function: Callable[[Array], Array], q: Array, step: float = 1e-6) -> Array:
    """(m, n) of a function of n joints."""
    return np.stack([(function(q + d) - function(q - d)) / (2.0 * step) for d in np.eye(len(q)) * step], axis=1)


def kept_place(model: RobotModel, q: Array, tip: Array, away: Array) -> Array | None:
    """Joints beside q, in the direction `away`, at which the tip is where it is at q; None where none are found."""

    def place(x: Array) -> Array:
        T = forward(model, x)
        return T[:3, :3] @ tip + T[:3, 3]

    goal, x = place(q), q + away
    for _ in range(20):
        miss = goal - place(x)
        if np.linalg.norm(miss) < 1e-12:
            return x
        x = x + np.linalg.pinv(slopes(place, x)) @ miss
    return None
