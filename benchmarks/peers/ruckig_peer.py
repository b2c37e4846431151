"""Ruckig (C++) plans the same joint motions, jerk limited as it always is, and reads one motion at a time."""

from __future__ import annotations

from typing import Any

from ruckig import InputParameter, Result, Ruckig, Trajectory

from benchmarks.peers.timing import each, serve


def measure(work: dict[str, Any]) -> dict[str, float]:
    """`from_rest`, `from_motion`: [q, v, goal] each; `from_acceleration`: [q, v, goal, a]; `velocity`, `acceleration`,
    `jerk` limits. `duration` of the motions [us] too.
    """
    dofs = len(work["velocity"])
    planner, trajectory = Ruckig(dofs), Trajectory(dofs)
    figures = {}
    for name in ("from_rest", "from_motion", "from_acceleration"):
        tasks = [_input(work, dofs, *task) for task in work[name]]
        assert all(planner.calculate(task, trajectory) == Result.Working for task in tasks)
        figures[f"f {name}"] = each(lambda task: planner.calculate(task, trajectory), tasks, rounds=5)
        durations = []
        for task in tasks:
            planner.calculate(task, trajectory)
            durations.append(trajectory.duration)
        figures[f"duration {name}"] = 1e6 * sum(durations) / len(durations)
    times = [trajectory.duration * k / 1000 for k in range(1000)]
    figures["g one"] = each(trajectory.at_time, times)
    return figures


def _input(
    work: dict[str, Any], dofs: int, q: list[float], v: list[float], goal: list[float], a: tuple[float, ...] = ()
) -> InputParameter:
    task = InputParameter(dofs)
    task.current_position, task.current_velocity, task.target_position = q, v, goal
    if a:
        task.current_acceleration = a
    task.max_velocity, task.max_acceleration, task.max_jerk = work["velocity"], work["acceleration"], work["jerk"]
    return task


if __name__ == "__main__":
    serve(measure)
