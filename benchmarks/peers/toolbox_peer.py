"""The Robotics Toolbox for Python. The frames of its PUMA differ from VAL's; the work is the same."""

from __future__ import annotations

from typing import Any

import numpy as np
import roboticstoolbox

from benchmarks.peers.timing import at_once, each, serve


def measure(work: dict[str, Any]) -> dict[str, float]:
    """`joints` for kinematics, or `from_rest`: [q, v, goal] each, for planning."""
    return _planning(work) if "from_rest" in work else _kinematics(work)


def _kinematics(work: dict[str, Any]) -> dict[str, float]:
    robot = roboticstoolbox.models.DH.Puma560()
    ets = robot.ets()
    q = np.array(work["joints"])
    rows = list(q)
    poses = [robot.fkine(row) for row in rows[:20]]
    many = np.tile(q, (20, 1))
    return {
        "forward": each(ets.eval, rows, rounds=5),
        "inverse": each(robot.ikine_a, poses),  # one branch only
        "jacobian": each(ets.jacob0, rows, rounds=5),
        "forward many": at_once(lambda: ets.fkine(many), len(many)),
    }


def _planning(work: dict[str, Any]) -> dict[str, float]:
    tasks = [(np.array(q), np.array(goal)) for q, _, goal in work["from_rest"]]
    starts, goals = zip(*tasks, strict=True)
    via, fastest = np.array([*starts[:1], *goals[:1]]), np.array(work["velocity"])
    return {
        "f from_rest": each(lambda q, goal: roboticstoolbox.jtraj(q, goal, 100), starts, goals),
        "f mstraj": each(lambda points: roboticstoolbox.mstraj(points, 0.01, 0.3, qdmax=fastest), [via]),
    }


if __name__ == "__main__":
    serve(measure)
