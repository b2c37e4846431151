"""The Robotics Toolbox for Python. The frames of its PUMA differ from VAL's; the work is the same."""

from __future__ import annotations

from typing import Any

import numpy as np
import roboticstoolbox

from benchmarks.peers.timing import at_once, each, serve

SQUARED_ERROR = 1e-16  # [m2, rad2] half of it at most: ours are as near, or nearer


def measure(work: dict[str, Any]) -> dict[str, float]:
    """`robot` (links) for one of any kind, `joints` for a PUMA, or `from_rest`: [q, v, goal] each, for planning."""
    if "robot" in work:
        return _any_robot(work)
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
        "inverse one": each(robot.ikine_a, poses),
        "jacobian": each(ets.jacob0, rows, rounds=5),
        "forward many": at_once(lambda: ets.fkine(many), len(many)),
    }


def _any_robot(work: dict[str, Any]) -> dict[str, float]:
    """`robot`: a, d, alpha, theta and whether it slides, joint by joint; `counts`: the parts of a pose that do; `near`:
    where the search for the pose of each row of `joints` begins. A search finds one solution, in the limits, or none;
    its time counts for each solution that is found.
    """
    robot = roboticstoolbox.DHRobot([_link(*row, *ends) for row, ends in zip(work["robot"], _ends(work), strict=True)])
    rows, ets = list(np.array(work["joints"])), robot.ets()
    counts, near = np.array(work["counts"]), list(np.array(work["near"]))
    poses = [robot.fkine(row).A for row in rows]
    middle = np.mean(work["limits"], axis=0)

    def solve(pose: Any, start: Any) -> Any:
        return ets.ik_LM(pose, q0=start, tol=SQUARED_ERROR, mask=counts)

    def solution_time(starts: list[Any]) -> float:
        solved = sum(solve(*row).success for row in zip(poses, starts, strict=True))
        return each(solve, poses, starts) * len(poses) / max(solved, 1)

    return {
        "forward": each(ets.eval, rows, rounds=5),
        "inverse": solution_time([middle] * len(poses)),
        "inverse one": solution_time(near),
        "jacobian": each(ets.jacob0, rows, rounds=5),
    }


def _ends(work: dict[str, Any]) -> list[list[float]]:
    return [list(pair) for pair in zip(*work["limits"], strict=True)]


def _link(a: float, d: float, alpha: float, theta: float, slides: bool, lower: float, upper: float) -> Any:
    if slides:
        return roboticstoolbox.PrismaticDH(theta=theta, a=a, alpha=alpha, offset=d, qlim=[lower, upper])
    return roboticstoolbox.RevoluteDH(d=d, a=a, alpha=alpha, offset=theta, qlim=[lower, upper])


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
