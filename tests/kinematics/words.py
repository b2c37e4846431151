"""The words of a configuration from positions alone: where the joints and their axes are in space, in the base frame.

`python -m tests.kinematics.words POSES` checks so many poses of each arm of six joints; of those that are not built in
under some of the signs that their joints may have.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from functools import cache
from itertools import product
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np
from msgspec import structs

from tests.by_hand import command
from tests.kinematics.offset_arms import OFFSET_ARMS
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.joints import Arm, Elbow, Flag, Joints, Wrist
from vrs_cli.kinematics.model import AxisLine, RobotModel, chain_of, joint_axes, link_frames
from vrs_cli.kinematics.robot_file import load_robot, robot_names

PUMA = load_robot("puma560")
OFF = 1e-6  # [m] of a shoulder that is not on the axis of joint 1
FORWARD = 0.15  # [m] of a shoulder before the axis of joint 1


def with_links(model: RobotModel, **changes: dict[int, dict[str, float]]) -> RobotModel:
    links = [structs.replace(link, **changes["links"].get(i, {})) for i, link in enumerate(model.links, 1)]
    return structs.replace(model, links=tuple(links), name="other")


STRAIGHT = with_links(PUMA, links={1: {"a": FORWARD}, 2: {"d": 0.0}})
LEFT = with_links(PUMA, links={2: {"d": -0.2}})
SIX = {name: model for name in robot_names() if (model := load_robot(name)).joint_count == 6}
ARMS = {**SIX, "straight": STRAIGHT, "left": LEFT}
EVERY = (*ARMS, *OFFSET_ARMS)
SIGNS = [tuple(signs) for signs in product((1.0, -1.0), repeat=6)]


def reversed_axes(model: RobotModel, signs: Joints) -> RobotModel:
    """The same arm, some of whose joints count the other way."""
    axes = [
        AxisLine(axis.point, (s * axis.direction[0], s * axis.direction[1], s * axis.direction[2]))
        for s, axis in zip(signs, joint_axes(model), strict=True)
    ]
    chain = chain_of(axes, model.units.kinds, link_frames(model, (0.0,) * 6)[-1])
    assert chain is not None
    assert chain.signs == (1.0,) * 6
    ends = [sorted((s * low, s * high)) for s, low, high in zip(signs, model.lower, model.upper, strict=True)]
    lower, upper = (tuple(end[k] for end in ends) for k in (0, 1))
    return structs.replace(model, links=chain.links, base=chain.base, flange=chain.flange, lower=lower, upper=upper)


def some_joints(model: RobotModel, source: Random) -> Joints:
    return tuple(source.uniform(low, high) for low, high in zip(model.lower, model.upper, strict=True))


class Points(NamedTuple):
    """Where the joints are [m]: shoulder and elbow in the plane in which the arm is bent, the joints of the wrist (one
    point, where axes 4 and 5 meet), the direction of joint 2. `forearm`: along axis 4 to the wrist, of an arm whose
    joints 2 to 4 are parallel to the side on which it is; `pointing`: along axis 6 to the flange; `turning`: axis 5.
    """

    shoulder: np.ndarray
    elbow: np.ndarray
    wrist: np.ndarray
    hand: np.ndarray
    across: np.ndarray
    forearm: np.ndarray
    pointing: np.ndarray
    turning: np.ndarray


@cache
def at_rest(model: RobotModel) -> tuple[tuple[AxisLine, ...], list[np.ndarray]]:
    """The axes, and the inverses of the frames that carry them."""
    frames = link_frames(model, (0.0,) * 6)
    return joint_axes(model), [np.linalg.inv(np.vstack((np.reshape(T, (3, 4)), (0, 0, 0, 1)))) for T in frames]


def points(model: RobotModel, q: Joints) -> Points:
    """From the axes at rest, carried by the frames of the links."""
    axes, rest = at_rest(model)
    now = [np.reshape(T, (3, 4)) for T in link_frames(model, q)]

    def axis(joint: int) -> tuple[np.ndarray, np.ndarray]:
        carried = now[joint - 1] @ rest[joint - 1]
        point, direction = axes[joint - 1]
        return carried @ (*point, 1.0), carried[:, :3] @ direction

    across, along, (_, turning), last = axis(2)[1], axis(4), axis(5), axis(6)
    wrist = crossing(along, axis(5))
    parallel = np.linalg.norm(np.cross(across, along[1])) < 1e-9
    hand = crossing(last, axis(5)) if parallel else wrist
    shoulder, elbow = (p + across * (across @ (wrist - p)) for p, _ in (axis(2), axis(3)))
    forearm = towards(across, hand) if parallel else towards(along[1], wrist - elbow)
    pointing = towards(last[1], now[-1][:3, 3] - crossing(axis(5), last))
    return Points(shoulder, elbow, wrist, hand, across, forearm, pointing, turning)


def towards(direction: np.ndarray, way: np.ndarray) -> np.ndarray:
    return direction if direction @ way > 0.0 else -direction


def crossing(a: tuple[np.ndarray, np.ndarray], b: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    """The point of line b that is nearest to line a."""
    (p, u), (q, v) = a, b
    normal = np.cross(u, np.cross(u, v))
    return np.asarray(q + v * ((p - q) @ normal) / (v @ normal))


@cache
def model_of(name: str) -> RobotModel:
    if name in ARMS:
        return ARMS[name]
    with TemporaryDirectory() as folder:
        return OFFSET_ARMS[name].model(Path(folder))


def some_arms(name: str) -> Iterator[tuple[RobotModel, Random]]:
    source = Random(name)
    for signs in source.sample(SIGNS, 6):
        yield reversed_axes(model_of(name), signs), source


def arm_word(model: RobotModel, at: Points) -> Arm:
    (p, u), (o, v), *_ = joint_axes(model)
    before = abs(np.subtract(o, p) @ np.cross(u, v))  # of axis 2, from axis 1
    beside = at.across * (at.across @ at.hand)  # of the hand
    if np.linalg.norm(beside) > OFF:
        outward = at.hand - beside
        righty = outward[0] * beside[1] - outward[1] * beside[0] < 0.0
    elif before > OFF:
        righty = at.shoulder[:2] @ at.wrist[:2] > 0.0
    else:
        righty = np.cross(at.across, at.wrist - at.shoulder)[2] > 0.0
    return Arm.RIGHTY if righty else Arm.LEFTY


def elbow_word(at: Points) -> Elbow | None:
    """None where the wrist is over the shoulder, seen from the axis of joint 1, or the arm is straight."""
    way, elbow = at.wrist - at.shoulder, at.elbow - at.shoulder
    if way[:2] @ at.hand[:2] <= 0.0 or np.linalg.norm(np.cross(way, elbow)) < 1e-3:
        return None
    above = elbow[2] > way[2] * (elbow[:2] @ way[:2]) / (way[:2] @ way[:2])
    return Elbow.ABOVE if above else Elbow.BELOW


def wrist_word(at: Points) -> Wrist:
    return Wrist.NOFLIP if at.turning @ np.cross(at.forearm, at.pointing) > 0.0 else Wrist.FLIP


def check_words(name: str, model: RobotModel, q: Joints) -> tuple[Flag, ...]:
    """The words, which are those that the arm says."""
    at, said = points(model, q), arm_for(model).configuration(q)
    words = arm_word(model, at), elbow_word(at) or said.elbow, wrist_word(at)
    assert said.flags == words, (name, q, said)
    return tuple(word for word in said.flags if word is not None)


def main(poses: int) -> None:
    for name in EVERY:
        source = Random(name)
        models = [SIX[name]] if name in SIX else [model for model, _ in some_arms(name)]
        counted = Counter[str]()
        for k in range(poses):
            model = models[k % len(models)]
            counted.update(word.name for word in check_words(name, model, some_joints(model, source)))
        print(name, dict(counted), flush=True)


if __name__ == "__main__":
    command(main)
