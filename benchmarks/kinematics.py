"""Kinematics beside the tools that a user would pick instead: `python -m benchmarks kinematics`.

Every figure is the least of repeats in this one run, of the processor; compare ratios, not microseconds.
"""

from __future__ import annotations

import random
from typing import Any

import numpy as np

from benchmarks.peers import Peers, beside
from benchmarks.peers.timing import at_once, each
from benchmarks.report import Figure, show
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import Transform, compose

POSES = 200  # scalar work goes round different poses, so that no branch is learnt by heart
MANY = 100_000  # poses at once
ROUNDS = 10


def main() -> None:
    peers = Peers()
    model = load_robot("puma560")
    source = random.Random(560)
    q = [tuple(map(source.uniform, model.lower, model.upper)) for _ in range(POSES)]
    show("Kinematics", [*one_pose(model, q, peers), *many_poses(model, q, peers)], peers.missing)


def one_pose(model: RobotModel, q: list[Joints], peers: Peers) -> list[Figure]:
    arm = arm_for(model)
    T = [arm.forward(row) for row in q]
    own = [arm.configuration(row) for row in q]
    twists = [arm.twist(row, row) for row in q]
    theirs = [peers.figures(name, work_of(model, q, T)) for name in ("eaik_peer", "toolbox_peer", "pinocchio_peer")]
    inverse, one = beside("inverse", *theirs), beside("inverse one", *theirs)
    return [
        Figure("forward, one pose", each(arm.forward, q, rounds=ROUNDS), "", beside("forward", *theirs)),
        Figure("inverse, 8 branches", each(arm.branches, T, rounds=ROUNDS), "2 x EAIK", inverse),
        Figure("- with limits told", each(arm.inverse_all, T, rounds=ROUNDS), "", inverse),
        Figure("inverse, 1 branch", each(arm.branch_joints, T, own, q, rounds=ROUNDS), "1.5", one),
        Figure("- inside the limits", each(arm.inverse_branch, T, own, q, rounds=ROUNDS)),
        Figure("configuration", each(arm.configuration, q, rounds=ROUNDS)),
        Figure("Jacobian", each(arm.jacobian, q, rounds=ROUNDS), "", beside("jacobian", *theirs)),
        Figure("joint velocity", each(arm.joint_velocity, q, twists, rounds=ROUNDS)),
        Figure("compose two poses", each(compose, T, T, rounds=ROUNDS)),
    ]


def many_poses(model: RobotModel, q: list[Joints], peers: Peers) -> list[Figure]:
    arm = arm_for(model)
    joints = np.random.default_rng(560).uniform(model.lower, model.upper, (MANY, model.joint_count))
    T = arm.batch.forward(joints)
    own = arm.configuration(tuple(joints[0].tolist()))
    work = work_of(model, q, [arm.forward(row) for row in q])
    theirs = [peers.figures(name, work) for name in ("eaik_peer", "toolbox_peer", "pinocchio_peer")]
    forward, inverse = beside("forward many", *theirs), beside("inverse many", *theirs)
    return [
        Figure("100,000 poses, per pose: forward", at_once(lambda: arm.batch.forward(joints), MANY), "", forward),
        Figure("- inverse, 8 branches", at_once(lambda: arm.batch.inverse(T), MANY), "EAIK / 3", inverse),
        Figure("- inverse, 1 branch", at_once(lambda: arm.batch.inverse_branch(T, own, joints), MANY)),
        Figure("- Jacobian", at_once(lambda: arm.batch.jacobian(joints), MANY)),
    ]


def work_of(model: RobotModel, q: list[Joints], T: list[Transform]) -> dict[str, Any]:
    """What peers need to do the same."""
    links = {key: [getattr(link, key) for link in model.links] for key in ("alpha", "a", "d")}
    poses = [[t[0:4], t[4:8], t[8:12], (0.0, 0.0, 0.0, 1.0)] for t in T]
    return {**links, "joints": q, "poses": poses}


if __name__ == "__main__":
    main()
