"""Kinematics of every kind of robot beside its peers: `python -m benchmarks robots`.

A robot stands for each way of solving: spherical wrist by way of other zeros, offset wrist, parallel axes, and
damped least squares. EAIK solves six joints only, in all branches. The Robotics Toolbox solves all of them numerically,
one solution from one start: it stands beside what finds one solution, from the same starts; searches from the middle of
the ranges count for each solution found.
"""

from __future__ import annotations

import random
from contextlib import suppress
from math import copysign
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

from benchmarks.peers import Peers, beside
from benchmarks.peers.timing import at_once, each
from benchmarks.report import Figure, show
from vrs_cli.engine.problem import Here, Problem
from vrs_cli.engine.straight import straight_segments
from vrs_cli.errors import MotionError
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.joints import JointKind, Joints, Profile
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.spherical_shoulder.arm import SphericalShoulderArm
from vrs_cli.trajectory.state import JointState
from vrs_cli.values.commands import Motion, MotionKind, Start

SEVEN = Path(__file__).parents[1] / "tests" / "kinematics" / "urdf" / "seven.urdf"
ROBOTS = ("puma560", "irb120", "ur5e", "cobra600", "planar2", "panda", SEVEN)
POSES = 100
MANY = 20_000  # poses at once
FEW = 2_000  # for a search
WAY = 0.2  # [m] of a line, along X
NEAR = 0.05  # [rad, m] where a search for one branch begins
ROUNDS = 5


def main() -> None:
    peers = Peers()
    for robot in ROBOTS:
        show(load_robot(robot).title, figures(load_robot(robot), peers), dict.fromkeys(peers.missing))


def figures(model: RobotModel, peers: Peers) -> list[Figure]:
    arm, q, work = arm_for(model), places(model), work_of(model)
    near = work["near"]
    T, own = [arm.forward(row) for row in q], [arm.configuration(row) for row in q]
    theirs = [peers.figures("toolbox_peer", work)]
    if model.joint_count == 6:
        theirs.append(peers.figures("eaik_peer", links_of(model, work)))
    searched = len(arm.ways) == 1
    many = np.random.default_rng(7).uniform(model.lower, model.upper, (FEW if searched else MANY, model.joint_count))
    poses = arm.batch.forward(many)
    ways = "a search" if searched else f"{len(arm.ways)} branches"
    all_of_them = beside("inverse", *theirs[0 if searched else 1 :])
    return [
        Figure("forward, one pose", each(arm.forward, q, rounds=ROUNDS), "", beside("forward", *theirs)),
        Figure(f"inverse, {ways}", search_time(model) if searched else each(arm.branches, T), "", all_of_them),
        Figure("inverse, 1 branch", each(arm.branch_joints, T, own, near), "", beside("inverse one", *theirs)),
        Figure("Jacobian", each(arm.jacobian, q, rounds=ROUNDS), "", beside("jacobian", *theirs)),
        Figure("joint velocity", each(arm.joint_velocity, q, [arm.twist(row, row) for row in q], rounds=1)),
        Figure("f, MOVES 200 mm along X, median", line(arm, q)),
        Figure("many poses, per pose: forward", at_once(lambda: arm.batch.forward(many), len(many))),
        Figure(
            f"- inverse, {ways}",
            at_once(lambda: arm.batch.inverse(poses), len(many)),
            "",
            beside("inverse many", *theirs),
        ),
    ]


def places(model: RobotModel) -> list[Joints]:
    source = random.Random(7)
    return [tuple(map(source.uniform, model.lower, model.upper)) for _ in range(POSES)]


def search_time(model: RobotModel) -> float:
    """Return the time of a search from the middle of the ranges, for each solution found in the limits [us]."""
    arm = arm_for(model)
    T = list(map(arm.forward, places(model)))
    solved = sum(q is not None and arm.limits_ok(q) for (q,) in map(arm.branches, T))
    return each(arm.branches, T) * len(T) / max(solved, 1)


def branch_time(model: RobotModel) -> float:
    """Return the time of all solutions for a value of joint 7, for each of them [us]."""
    arm = arm_for(model)
    assert isinstance(arm, SphericalShoulderArm)
    q = places(model)
    T, sevenths = list(map(arm.forward, q)), [row[6] for row in q]
    return each(arm.branches_at, T, sevenths) * len(T) / sum(map(len, map(arm.branches_at, T, sevenths)))


def work_of(model: RobotModel) -> dict[str, Any]:
    """What the toolbox needs to do the same."""
    arm, q, source = arm_for(model), places(model), random.Random(8)
    return {
        "robot": [[link.a, link.d, link.alpha, link.theta, link.kind is JointKind.PRISMATIC] for link in model.links],
        "limits": [model.lower, model.upper],
        "joints": q,
        "near": [tuple(x + source.uniform(-NEAR, NEAR) for x in row) for row in q],
        "poses": [[t[0:4], t[4:8], t[8:12], (0.0, 0.0, 0.0, 1.0)] for t in map(arm.forward, q)],
        "counts": [float(part) for part in model.task.counts],
    }


def line(arm: RobotArm, begin: list[Joints]) -> float:
    """The median of what lines along X cost [us]."""
    return median(each(straight_segments, [one]) for one in _lines(arm, begin))


def _lines(arm: RobotArm, begin: list[Joints]) -> list[Problem]:
    """Those lines along X that the arm can do."""
    found = []
    for q in begin:
        pose = arm.forward(q)
        motion = Motion(
            1,
            MotionKind.STRAIGHT,
            Start.AT,
            pose=pose._replace(px=pose.px - copysign(WAY, pose.px)),
            profile=Profile.LSPB,
        )
        problem = Problem(arm, Here(JointState(q, (0.0,) * len(q))), motion, 0.0)
        with suppress(MotionError):
            straight_segments(problem)
            found.append(problem)
    return found


def links_of(model: RobotModel, work: dict[str, Any]) -> dict[str, Any]:
    links = {key: [getattr(link, key) for link in model.links] for key in ("alpha", "a", "d")}
    return {**links, "joints": work["joints"], "poses": work["poses"]}


if __name__ == "__main__":
    main()
