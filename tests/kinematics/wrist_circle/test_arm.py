"""Arms whose wrist is not one point: all solutions are found, and MOVE takes the nearest of them."""

from __future__ import annotations

from itertools import pairwise, product
from math import acos, cos, pi
from pathlib import Path
from random import Random

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.kinematics.offset_arms import OFFSET_ARMS
from tests.kinematics.random_arms import DrawnArm
from vrs_cli.engine.engine import Engine
from vrs_cli.errors import JointOutOfRange, LocationOutOfRange
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.joints import ALL, NONE, Configuration, Elbow, Joints, nearest_turn
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import Transform, compose, translation
from vrs_cli.kinematics.wrist_circle import batch
from vrs_cli.kinematics.wrist_circle.arm import WristCircleArm
from vrs_cli.trajectory.segment import CartesianPath
from vrs_cli.values.commands import Move, PoseTarget, SetConfiguration

Floats = NDArray[np.float64]

STARTS, STEPS = 60, 30  # of the other search
MET = 1e-2  # the least singular value of the Jacobian, below which two solutions are about to meet
SAME = 1e-4  # [rad]


@pytest.fixture(params=OFFSET_ARMS)
def drawn(request: pytest.FixtureRequest) -> DrawnArm:
    return OFFSET_ARMS[request.param]


def arm_of(drawn: DrawnArm, folder: Path) -> WristCircleArm:
    arm = arm_for(drawn.model(folder))
    assert isinstance(arm, WristCircleArm)
    return arm


def pose_of(drawn: DrawnArm, q: Joints) -> Transform:
    return Transform(*drawn.forward(q).ravel().tolist())


def motion(drawn: DrawnArm, q: Floats) -> tuple[Floats, Floats]:
    """Of joints (K, 6) the poses (K, 3, 4) and the Jacobians (K, 6, 6), with axes and points carried along."""
    count = len(q)
    R, p = np.broadcast_to(np.eye(3), (count, 3, 3)), np.zeros((count, 3))
    axes, points = [], []
    for joint, angle in zip(drawn.joints, q.T, strict=True):
        p = p + R @ joint.offset
        axes.append(R @ joint.axis)
        points.append(p)
        x, y, z = joint.axis
        K = np.array(((0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0)))
        R = R @ (np.eye(3) + np.sin(angle)[:, None, None] * K + (1.0 - np.cos(angle))[:, None, None] * (K @ K))
    p = p + R @ drawn.hand
    J = [np.concatenate((np.cross(a, p - o), a), axis=1) for a, o in zip(axes, points, strict=True)]
    return np.concatenate((R, p[..., None]), axis=2), np.stack(J, axis=2)


def many_searches(drawn: DrawnArm, place: Floats, random: np.random.Generator) -> list[Floats]:
    """What Newton's method, damped, finds from many places, whatever the limits."""
    q = random.uniform(-pi, pi, (STARTS, 6))
    for _ in range(STEPS):
        T, J = motion(drawn, q)
        turned = 0.5 * np.cross(T[..., :3], place[:, :3], axis=1).sum(axis=2)
        error = np.concatenate((place[:, 3] - T[..., 3], turned), axis=1)
        damping = 0.1 * (error * error).sum(axis=1) + 1e-13
        Jt = np.swapaxes(J, 1, 2)
        step = np.linalg.solve(Jt @ J + damping[:, None, None] * np.eye(6), Jt @ error[..., None])[..., 0]
        q = q + step * np.minimum(1.0, 0.5 / np.abs(step).max(axis=1))[:, None]
    there = np.abs(motion(drawn, q)[0] - place).max(axis=(1, 2)) < 1e-9
    found: list[Floats] = []
    for row in q[there]:
        if not any(apart(row, other) < SAME for other in found):
            found.append(row)
    return found


def apart(a: Floats | Joints, b: Floats | Joints) -> float:
    """The most that a joint differs, whatever its turn [rad]."""
    return float(2.0 * np.abs(np.sin((np.array(a) - np.array(b)) / 2.0)).max())


def test_all_solutions_are_found_once(drawn: DrawnArm, tmp_path: Path) -> None:
    arm, source, random = arm_of(drawn, tmp_path), Random(6), np.random.default_rng(6)
    q = drawn.some_joints(source)
    found = arm.solutions(pose_of(drawn, q))
    assert np.abs(motion(drawn, np.array(found))[0] - drawn.forward(q)).max() < 1e-9
    assert min(apart(q, one) for one in found) < 1e-6
    for other in many_searches(drawn, drawn.forward(q), random):
        close = min(apart(other, one) for one in found)
        assert close < SAME or np.linalg.svd(motion(drawn, other[None])[1][0])[1][-1] < MET, (q, other)
    assert len(found) <= 16
    assert all(apart(a, b) > 1e-6 for i, a in enumerate(found) for b in found[:i])


@pytest.mark.parametrize("name", ["crx", "gofa", "xarm", "before"])
def test_solutions_with_the_wrist_next_to_the_axis_of_joint_1_are_found(name: str, tmp_path: Path) -> None:
    """Joint 1 turns about at once there, as the wrist goes round its circle."""
    drawn, source = OFFSET_ARMS[name], Random(12)
    arm, tried = arm_of(drawn, tmp_path), 0
    while tried < 6:
        q = with_wrist_at(arm, drawn.some_joints(source), 10.0 ** source.uniform(-6.0, -3.0))
        if q is not None and np.linalg.svd(motion(drawn, np.array([q]))[1][0])[1][-1] > MET:
            assert min(apart(q, one) for one in arm.solutions(pose_of(drawn, q))) < SAME, q
            tried += 1


def with_wrist_at(arm: WristCircleArm, q: Joints, away: float) -> Joints | None:
    """The joints with another joint 3, so that the wrist is so far [m] from the axis of joint 1."""
    chain, g = arm.chain, arm.circle.arm
    q2 = chain.of(q)[1]
    cosine = (away - g.a1 - g.a2 * cos(q2)) / g.forearm
    if abs(cosine) > 1.0:
        return None
    q3 = acos(cosine) - q2 + g.beta
    return (*q[:2], chain.signs[2] * (q3 - chain.links[2].theta), *q[3:])


def test_many_poses_are_solved_as_one_is(drawn: DrawnArm, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    arm, source = arm_of(drawn, tmp_path), Random(8)
    monkeypatch.setattr(batch, "POSES", 2)
    poses = [pose_of(drawn, drawn.some_joints(source)) for _ in range(3)]
    T = np.reshape(poses, (-1, 3, 4))
    joints, inside = arm.batch.inverse(T)
    near = arm.model.poses["ready"]
    rows = {way: arm.batch.inverse_branch(T, way, np.array(near)) for way in ALL[2:3]}
    for k in range(3):
        for i, (way, one) in enumerate(zip(ALL, arm.inverse_all(poses[k]), strict=True)):
            assert one.usable == inside[k, i]
            if one.joints is None:
                assert np.isnan(joints[k, i]).all()
                continue
            assert arm.configuration(one.joints) == way
            assert joints[k, i] == pytest.approx(one.joints, abs=1e-6)
            if way in rows:
                assert rows[way][k] == pytest.approx(arm.branch_joints(poses[k], way, near), abs=1e-6)


def test_the_own_joints_are_among_the_solutions_of_a_pose() -> None:
    """Two solutions may have the same words: a sixth of the poses of an xArm 6 has such."""
    arm, source = arm_for(load_robot("xarm6")), Random(2)
    q = np.array(
        [[source.uniform(*ends) for ends in zip(arm.model.lower, arm.model.upper, strict=True)] for _ in range(60)]
    )
    configurations, joints, inside = arm.batch.every_inverse(arm.batch.forward(q))
    assert len(configurations) == joints.shape[1] > len(ALL)
    off = np.abs(np.sin(0.5 * (joints - q[:, None]))).max(axis=2)
    assert (np.nanmin(off, axis=1) < 1e-6).all()
    best, usable = arm.batch.inverse(arm.batch.forward(q))
    assert np.array_equal(best, joints[:, : len(ALL)], equal_nan=True)
    assert np.array_equal(usable, inside[:, : len(ALL)])


def test_a_move_takes_the_nearest(drawn: DrawnArm, tmp_path: Path) -> None:
    """Of all solutions on all their turns within the limits."""
    arm, source = arm_of(drawn, tmp_path), Random(9)
    for _ in range(3):
        here, there = drawn.some_joints(source), drawn.some_joints(source)
        T = pose_of(drawn, there)
        goal = arm.select(T, here)
        assert np.abs(drawn.forward(goal) - drawn.forward(there)).max() < 1e-9
        turned = (turns(arm, q) for q in arm.solutions(T))
        shortest = min(way_to(arm, here, q) for one in turned for q in one)
        assert way_to(arm, here, goal) == pytest.approx(shortest)


def turns(arm: WristCircleArm, q: Joints) -> list[Joints]:
    """Within the limits."""
    ranges = zip(q, arm.model.lower, arm.model.upper, strict=True)
    return list(
        product(*([y for k in range(-3, 4) if low <= (y := x + 2 * pi * k) <= high] for x, low, high in ranges))
    )


def way_to(arm: WristCircleArm, a: Joints, b: Joints) -> float:
    return max(abs(y - x) / v for x, y, v in zip(a, b, arm.model.max_velocity, strict=True))


def test_words_are_kept_and_others_are_said(tmp_path: Path) -> None:
    drawn = OFFSET_ARMS["xarm"]
    arm, source = arm_of(drawn, tmp_path), Random(10)
    refusals = []
    for elbow in list(Elbow) * 5:
        q = drawn.some_joints(source)
        try:
            found = arm.select(pose_of(drawn, q), arm.model.poses["ready"], Configuration.of(elbow=elbow))
        except (JointOutOfRange, LocationOutOfRange) as error:
            refusals.append((elbow, arm.configuration(q).elbow, error.hint))
        else:
            assert arm.configuration(found).elbow is elbow
    assert refusals
    assert all(asked is not taught for asked, taught, _ in refusals)
    assert all(taught is not None and f"say {taught.name}" in hint for _, taught, hint in refusals)
    with pytest.raises(LocationOutOfRange, match="all links in one line"):
        arm.select(translation(0.0, 2.5, 0.0), arm.model.poses["ready"])


def test_a_line_goes_on_where_words_change(tmp_path: Path) -> None:
    """Joint 5 of a GoFa passes 0 without a singularity, as axes 4 and 6 do not meet."""
    model = OFFSET_ARMS["gofa"].model(tmp_path)
    engine = Engine(model, start=model.units.read((-52.7, 73.9, -9.7, -90.0, -4.6, -157.6)))
    before = engine.arm.configuration(engine.position().joints)
    goal = engine.arm.forward(model.units.read((-51.0, 75.6, -8.0, -88.3, 4.6, -156.0)))
    engine.perform(Move(PoseTarget(goal), straight=True))
    assert {s.path.configuration for s in engine.timeline if isinstance(s.path, CartesianPath)} == {NONE}
    after = engine.position(engine.end).joints
    assert engine.arm.configuration(after) == before.other_wrist
    steps = [engine.position(t).joints for t in np.linspace(0.0, engine.end, 400).tolist()]
    assert max(abs(y - x) for a, b in pairwise(steps) for x, y in zip(a, b, strict=True)) < 0.02
    assert engine.arm.forward(after) == pytest.approx(goal, abs=1e-9)


def test_what_was_said_holds_for_the_next_motions(tmp_path: Path) -> None:
    model = OFFSET_ARMS["xarm"].model(tmp_path)
    engine = Engine(model, start=model.units.read((10.0, -20.0, -60.0, 30.0, 60.0, 0.0)))
    have = engine.arm.configuration(engine.position().joints)
    assert have.wrist is not None
    engine.perform(SetConfiguration(have.other_wrist.wrist))
    pose = compose(engine.arm.forward(engine.position().joints), translation(0.0, 0.01, 0.0))
    engine.perform(Move(PoseTarget(pose), straight=False))
    after = engine.position(engine.end).joints
    assert engine.arm.configuration(after).wrist is have.other_wrist.wrist
    assert nearest_turn(after[0], 0.0) == pytest.approx(after[0])
