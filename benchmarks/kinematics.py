"""Kinematics beside the tools that a user would pick instead: `python -m benchmarks.kinematics`.

Every figure is the median of repeats in this one run, on this machine; compare ratios, not microseconds. A peer that
is not installed is named and left out (`pip install eaik roboticstoolbox-python`).
"""

from __future__ import annotations

import random
import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from vrs_cli.kinematics.arm import RobotArm, arm_for
from vrs_cli.kinematics.model import load_robot
from vrs_cli.kinematics.transform import compose

REPEATS = 15
POSES = 200  # scalar work goes round different poses, so that no branch is learnt by heart
BATCH = 100_000


@dataclass(frozen=True)
class Figure:
    work: str
    ours: float  # [us]
    peers: dict[str, float]  # [us]
    bar: str = ""


def median_us(run: Callable[[], object], operations: int) -> float:
    """Microseconds for one operation of a run that does many."""
    run()
    return statistics.median(_timed(run) for _ in range(REPEATS)) / operations * 1e6


def _timed(run: Callable[[], object]) -> float:
    start = time.perf_counter()
    run()
    return time.perf_counter() - start


def each(call: Callable[..., object], *arguments: list[Any], rounds: int = 10) -> float:
    """Microseconds for one call, over rows of arguments; the loop itself is taken off."""
    rows = list(zip(*arguments, strict=True)) * rounds

    def work() -> None:
        for row in rows:
            call(*row)

    def loop() -> None:
        for row in rows:
            _nothing(*row)

    return median_us(work, len(rows)) - median_us(loop, len(rows))


def _nothing(*_: object) -> None:
    """What the loop costs without its work, a call into Python included: taken off from all sides alike."""


def eaik_robot() -> Any:
    """The PUMA as EAIK's C++ solver, or None."""
    try:
        from eaik.IK_DH import DhRobot
    except ImportError:
        return None
    links = load_robot("puma560").links
    alpha, a, d = (np.array([getattr(link, key) for link in links]) for key in ("alpha", "a", "d"))
    return DhRobot(alpha, a, d)


def toolbox_robot() -> Any:
    """The PUMA of the Robotics Toolbox, or None. Its frames differ from VAL's, the work is the same."""
    try:
        import roboticstoolbox
    except ImportError:
        return None
    return roboticstoolbox.models.DH.Puma560()


def figures() -> list[Figure]:
    model = load_robot("puma560")
    arm = arm_for(model)
    rng = random.Random(560)
    q = [tuple(rng.uniform(lo, hi) for lo, hi in zip(model.lower, model.upper, strict=True)) for _ in range(POSES)]
    return [*scalar_figures(arm, q), *batch_figures(arm)]


def scalar_figures(arm: RobotArm, q: list[Any]) -> list[Figure]:
    eaik, toolbox = eaik_robot(), toolbox_robot()
    T = [arm.forward(row) for row in q]
    own = [arm.configuration(row) for row in q]
    twists = [arm.twist(row, row) for row in q]
    arrays, matrices = [np.array(row) for row in q], [np.vstack((np.reshape(t, (3, 4)), (0, 0, 0, 1))) for t in T]
    forward: dict[str, float] = {}
    inverse: dict[str, float] = {}
    jacobian: dict[str, float] = {}
    if eaik:
        forward["EAIK"] = each(eaik.fwdKin, arrays)
        inverse["EAIK"] = each(lambda m: eaik.IK(m).Q, matrices)
    if toolbox:
        ets = toolbox.ets()
        poses = [toolbox.fkine(row) for row in arrays[:20]]
        forward["Robotics Toolbox"] = each(ets.eval, arrays)
        inverse["Robotics Toolbox"] = each(toolbox.ikine_a, poses, rounds=1)  # one branch only
        jacobian["Robotics Toolbox"] = each(ets.jacob0, arrays)
    return [
        Figure("forward, one pose", each(arm.forward, q), forward),
        Figure("inverse, 8 branches", each(arm.branches, T), inverse, "2 x EAIK"),
        Figure("- with limits told", each(arm.inverse_all, T), inverse),
        Figure("inverse, 1 branch", each(arm.branch_joints, T, own, q), {}, "1.5 us"),
        Figure("- inside the limits", each(arm.inverse_branch, T, own, q), {}),
        Figure("configuration", each(arm.configuration, q), {}),
        Figure("Jacobian", each(arm.jacobian, q), jacobian),
        Figure("joint velocity", each(arm.joint_velocity, q, twists), {}),
        Figure("compose two poses", each(compose, T, T), {}),
    ]


def batch_figures(arm: RobotArm) -> list[Figure]:
    q = np.random.default_rng(560).uniform(arm.model.lower, arm.model.upper, (BATCH, 6))
    T = arm.forward_batch(q)
    own = arm.configuration(tuple(q[0].tolist()))
    eaik = eaik_robot()
    peers: dict[str, float] = {}
    if eaik:
        matrices = list(np.concatenate((T, np.broadcast_to((0, 0, 0, 1), (BATCH, 1, 4))), axis=1)[:10_000])
        peers["EAIK"] = median_us(lambda: eaik.IK_batched(matrices, 1), len(matrices))
    return [
        Figure("100,000 poses, per pose: forward", median_us(lambda: arm.forward_batch(q), BATCH), {}),
        Figure("- inverse, 8 branches", median_us(lambda: arm.inverse_batch(T), BATCH), peers, "EAIK / 3"),
        Figure("- inverse, 1 branch", median_us(lambda: arm.inverse_branch_batch(T, own, q), BATCH), {}),
        Figure("- Jacobian", median_us(lambda: arm.jacobian_batch(q), BATCH), {}),
        Figure("- joint velocity", median_us(lambda: arm.joint_velocity_batch(q, q), BATCH), {}),
    ]


def main() -> None:
    console = Console(width=110)
    names = ("EAIK", "Robotics Toolbox")
    installed = {"EAIK": eaik_robot(), "Robotics Toolbox": toolbox_robot()}
    table = Table("work", "ours, us", *(f"{name}, us (ours / theirs)" for name in names), "bar", title="Kinematics")
    for figure in figures():
        beside = (f"{p:.2f} ({figure.ours / p:.2f})" if (p := figure.peers.get(name)) else "" for name in names)
        table.add_row(figure.work, f"{figure.ours:.2f}", *beside, figure.bar)
    console.print(table)
    for name, robot in installed.items():
        if robot is None:
            console.print(f"{name} is not installed here, so its column is empty.")


if __name__ == "__main__":
    main()
