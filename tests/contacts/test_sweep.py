"""How far bodies can come: no point of a body moves farther than its way says."""

from __future__ import annotations

from itertools import pairwise
from random import Random

import numpy as np
import pytest

pytest.importorskip("mujoco")

from tests.contacts.cases import cases
from vrs_cli.contacts.physics import Ball, Bounds
from vrs_cli.contacts.sweep import Sweep, frames_over, levers, sums_of
from vrs_cli.engine.position import joints_over
from vrs_cli.kinematics.model import link_frames
from vrs_cli.kinematics.robot_file import load_robot

CLOSE = 1e-9


@pytest.mark.parametrize("robot", ["puma560", "cobra600", "ur5e"])
def test_frames_are_those_of_the_kinematics(robot: str) -> None:
    model, rng = load_robot(robot), np.random.default_rng(2)
    q = rng.uniform(model.lower, model.upper, (5, model.joint_count))
    turns, places = frames_over(model, q)
    for row, joints in enumerate(q.tolist()):
        for i, T in enumerate(link_frames(model, tuple(joints))):
            rows = np.array(T).reshape(3, 4)
            assert abs(turns[i, row] - rows[:, :3]).max() < CLOSE
            assert abs(places[i, row] - rows[:, 3]).max() < CLOSE


@pytest.mark.parametrize("robot", ["puma560", "cobra600"])
def test_no_point_moves_farther_than_its_way(robot: str) -> None:
    rng = Random(4)
    for case in cases(rng, 4, robot):
        arm, stage = case.checker.arm, case.stage
        sweep = Sweep(arm, case.timeline, stage.begin, stage.end)
        last = arm.model.joint_count
        point = np.array([0.03, 0.02, 0.1])
        body = Bounds(last, Ball((0.0, 0.0, 0.05), float(np.linalg.norm(point - (0.0, 0.0, 0.05)))))
        times = np.linspace(stage.begin, stage.end, 2000)
        turns, places = frames_over(arm.model, joints_over(arm, case.timeline, times))
        absolute = turns[last] @ point + places[last]
        first = np.einsum("nji,nj->ni", turns[1], absolute - places[1])  # as link 1 sees it
        ways = sweep.ways([body])[0], sweep.way_between(np.array(levers(arm.model, body, 1)))
        for moving, way in zip((absolute, first), ways, strict=True):
            done = np.interp(times, sweep.times, sums_of(way))
            for a, b in pairwise(range(0, 2000, 7)):
                assert np.linalg.norm(moving[b] - moving[a]) <= done[b] - done[a] + CLOSE


def test_a_way_is_done_no_earlier_than_it_can_be() -> None:
    (case,) = cases(Random(6), 1)
    sweep = Sweep(case.checker.arm, case.timeline, case.stage.begin, case.stage.end)
    sums = sums_of(np.full(len(sweep.times) - 1, 0.01))
    t = sweep.reaches(sums, case.stage.begin, 0.005)
    assert sweep.times[0] < t < sweep.times[1]
    assert sweep.reaches(sums, case.stage.begin, 100.0) == sweep.times[-1]
