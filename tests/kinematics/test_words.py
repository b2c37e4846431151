"""The words of a configuration follow from where the joints are in space: not from the signs and zeros of a file."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import product
from math import pi
from random import Random
from typing import NamedTuple

import numpy as np
import pytest

from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.axes import Line, chain_of
from vrs_cli.kinematics.configuration import Arm, Elbow, Wrist
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.model import RobotModel, joint_axes, link_frames
from vrs_cli.kinematics.robot_file import load_robot

PUMA = load_robot("puma560")
FORWARD = 0.15  # [m] of a shoulder before the axis of joint 1


def with_links(model: RobotModel, **changes: dict[int, dict[str, float]]) -> RobotModel:
    links = [link._replace(**changes["links"].get(i, {})) for i, link in enumerate(model.links, 1)]
    return replace(model, links=tuple(links), name="other")


STRAIGHT = with_links(PUMA, links={1: {"a": FORWARD}, 2: {"d": 0.0}})
LEFT = with_links(PUMA, links={2: {"d": -0.2}})
ARMS = {"puma560": PUMA, "straight": STRAIGHT, "left": LEFT, "ur5e": load_robot("ur5e"), "irb120": load_robot("irb120")}
SIGNS = [tuple(signs) for signs in product((1.0, -1.0), repeat=6)]


def reversed_axes(model: RobotModel, signs: Joints) -> RobotModel:
    """The same arm, some of whose joints count the other way."""
    axes = [
        Line(axis.point, (s * axis.direction[0], s * axis.direction[1], s * axis.direction[2]))
        for s, axis in zip(signs, joint_axes(model), strict=True)
    ]
    chain = chain_of(axes, model.units.kinds, link_frames(model, (0.0,) * 6)[-1])
    assert chain is not None
    assert chain.signs == (1.0,) * 6
    ends = [sorted((s * low, s * high)) for s, low, high in zip(signs, model.lower, model.upper, strict=True)]
    lower, upper = (tuple(end[k] for end in ends) for k in (0, 1))
    return replace(model, links=chain.links, base=chain.base, flange=chain.flange, lower=lower, upper=upper)


def some_joints(model: RobotModel, source: Random) -> Joints:
    return tuple(source.uniform(low, high) for low, high in zip(model.lower, model.upper, strict=True))


class Points(NamedTuple):
    """Where the joints are [m]: shoulder and elbow in the plane in which the arm is bent, the joints of the wrist (one
    point, where it has one), the direction of joint 2.
    """

    shoulder: np.ndarray
    elbow: np.ndarray
    wrist: np.ndarray
    hand: np.ndarray
    across: np.ndarray


def points(model: RobotModel, q: Joints) -> Points:
    """From the axes at rest, carried by the frames of the links."""
    axes = joint_axes(model)
    rest, now = (
        [np.vstack((np.reshape(T, (3, 4)), (0, 0, 0, 1))) for T in link_frames(model, joints)]
        for joints in ((0.0,) * 6, q)
    )

    def axis(joint: int) -> tuple[np.ndarray, np.ndarray]:
        carried = now[joint - 1] @ np.linalg.inv(rest[joint - 1])
        point, direction = axes[joint - 1]
        return (carried @ (*point, 1.0))[:3], carried[:3, :3] @ direction

    across = axis(2)[1]
    wrist, hand = crossing(axis(4), axis(5)), crossing(axis(6), axis(5))
    shoulder, elbow = (p + across * (across @ (wrist - p)) for p, _ in (axis(2), axis(3)))
    return Points(shoulder, elbow, wrist, hand, across)


def crossing(a: tuple[np.ndarray, np.ndarray], b: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    """The point of line b that is nearest to line a."""
    (p, u), (q, v) = a, b
    normal = np.cross(u, np.cross(u, v))
    return np.asarray(q + v * ((p - q) @ normal) / (v @ normal))


def some_arms(name: str) -> Iterator[tuple[RobotModel, Random]]:
    source = Random(name)
    for signs in source.sample(SIGNS, 6):
        yield reversed_axes(ARMS[name], signs), source


@pytest.mark.parametrize("name", ARMS)
def test_above_is_the_elbow_above_the_line_from_shoulder_to_wrist(name: str) -> None:
    """Outward is where the hand is from joint 1: over the shoulder that may be the other way than the wrist."""
    seen = []
    for model, source in some_arms(name):
        arm = arm_for(model)
        for _ in range(50):
            q = some_joints(model, source)
            at = points(model, q)
            way, elbow = at.wrist - at.shoulder, at.elbow - at.shoulder
            if way[:2] @ at.hand[:2] <= 0.0 or np.linalg.norm(np.cross(way, elbow)) < 1e-3:
                continue
            above = elbow[2] > way[2] * (elbow[:2] @ way[:2]) / (way[:2] @ way[:2])
            assert arm.configuration(q).elbow is (Elbow.ABOVE if above else Elbow.BELOW)
            seen.append(bool(above))
    assert min(seen.count(True), seen.count(False)) > 50


@pytest.mark.parametrize("name", ["puma560", "left", "ur5e"])
def test_righty_is_the_arm_on_the_right(name: str) -> None:
    seen = []
    for model, source in some_arms(name):
        arm = arm_for(model)
        for _ in range(50):
            q = some_joints(model, source)
            at = points(model, q)
            beside = at.across * (at.across @ at.hand)  # of the hand, from the axis of joint 1
            outward = at.hand - beside
            righty = outward[0] * beside[1] - outward[1] * beside[0] < 0.0
            assert arm.configuration(q).arm is (Arm.RIGHTY if righty else Arm.LEFTY)
            seen.append(bool(righty))
    assert min(seen.count(True), seen.count(False)) > 50


def test_righty_reaches_forward_where_the_shoulder_stands_before_joint_1() -> None:
    seen = []
    for model, source in some_arms("straight"):
        arm = arm_for(model)
        for _ in range(50):
            q = some_joints(model, source)
            at = points(model, q)
            forward = bool(at.shoulder[:2] @ at.wrist[:2] > 0.0)
            assert arm.configuration(q).arm is (Arm.RIGHTY if forward else Arm.LEFTY)
            seen.append(forward)
    assert min(seen.count(True), seen.count(False)) > 50


@pytest.mark.parametrize("name", ARMS)
def test_every_way_is_found_under_its_words(name: str) -> None:
    for model, source in some_arms(name):
        arm: RobotArm = arm_for(model)
        for _ in range(10):
            T = arm.forward(some_joints(model, source))
            batch, _ = arm.inverse_batch(np.reshape(T, (1, 3, 4)))
            for way, q, row in zip(arm.ways, arm.branches(T), batch[0], strict=True):
                if q is None:
                    assert np.isnan(row).any()
                    continue
                assert arm.configuration(q) in (way, *arm.twins(q))
                assert row == pytest.approx(q, abs=1e-9)
                one = arm.branch_joints(T, way, q)
                assert one == pytest.approx(q, abs=1e-9)
                (many,) = arm.inverse_branch_batch(np.reshape(T, (1, 3, 4)), way, np.array([q]))
                assert many == pytest.approx(q, abs=1e-9)


def test_a_wrist_is_judged_by_joint_5() -> None:
    for signs in ((1.0,) * 6, (-1.0,) * 6):
        arm = arm_for(reversed_axes(PUMA, signs))
        assert arm.configuration((0.3, -1.0, 1.0, 0.2, 0.5, 0.0)).wrist is Wrist.NOFLIP
        assert arm.configuration((0.3, -1.0, 1.0, 0.2, -0.5, 0.0)).wrist is Wrist.FLIP


def test_an_arm_goes_back_to_where_it_was_taught_by_its_words() -> None:
    """With joint 1 pointing down, as on many arms, an elbow that is up was called BELOW."""
    model = reversed_axes(STRAIGHT, (-1.0, 1.0, 1.0, -1.0, 1.0, -1.0))
    arm = arm_for(model)
    taught = (0.4, -pi / 3, pi, 0.1, 0.6, 0.2)
    at = points(model, taught)
    assert at.elbow[2] > max(at.shoulder[2], at.wrist[2])
    q = arm.select(arm.forward(taught), (0.0,) * 6, elbow=Elbow.ABOVE)
    assert arm.configuration(q).elbow is Elbow.ABOVE
    assert q == pytest.approx(taught, abs=1e-9)
