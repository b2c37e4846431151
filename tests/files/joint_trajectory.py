"""A JointTrajectoryController, as far as it interpolates: its polynomials, from the conditions at two points.

After ros2_controllers, joint_trajectory_controller/src/trajectory.cpp: linear between points with positions alone,
cubic where both have velocities, quintic where both have accelerations too.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from vrs_cli.kinematics.arrays import Floats

Point = dict[str, Any]


def time_of(point: Point) -> float:
    stamp = point["time_from_start"]
    return float(stamp["sec"] + stamp["nanosec"] * 1e-9)


def sampled(points: list[Point], times: Floats) -> Floats:
    """The joints (N, n) at times (N,) [s] from the start, sorted."""
    starts = np.array([time_of(point) for point in points])
    assert (np.diff(starts) > 0.0).all(), "times must increase strictly"
    found = np.empty((len(times), len(points[0]["positions"])))
    which = np.searchsorted(starts, times, side="right") - 1
    for i in np.unique(which):
        rows = which == i
        if i + 1 == len(points):
            found[rows] = points[i]["positions"]
        else:
            found[rows] = _polynomial(points[i], points[i + 1], times[rows] - starts[i])
    return found


def _polynomial(a: Point, b: Point, s: Floats) -> Floats:
    """Coefficients c with sum c_k s^k and its derivatives as given at s = 0 and s = T."""
    T = time_of(b) - time_of(a)
    given = [key for key in ("positions", "velocities", "accelerations") if a[key] and b[key]]
    assert given in (["positions"], ["positions", "velocities"], ["positions", "velocities", "accelerations"])
    size, rows, wanted = 2 * len(given), [], []
    for order, key in enumerate(given):
        for point, x in ((a, 0.0), (b, 1.0)):  # with s = T x
            rows.append([_factor(k, order) * x ** (k - order) if k >= order else 0.0 for k in range(size)])
            wanted.append(np.array(point[key]) * T**order)
    coefficients = np.linalg.solve(np.array(rows), np.array(wanted))
    return np.vander(s / T, size, increasing=True) @ coefficients


def _factor(k: int, order: int) -> float:
    return float(np.prod([k - i for i in range(order)]))
