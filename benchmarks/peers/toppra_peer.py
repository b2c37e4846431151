"""TOPP-RA plans a joint motion along its own path, at rest at both ends."""

from __future__ import annotations

import logging
from typing import Any

import numpy as np
import toppra
import toppra.algorithm
import toppra.constraint

from benchmarks.peers.timing import each, serve


def measure(work: dict[str, Any]) -> dict[str, float]:
    """`from_rest`: [q, v, goal] each; `velocity` and `acceleration` limits."""
    logging.disable(logging.CRITICAL)
    toppra.setup_logging("ERROR")
    limits = [np.array(work[name]) for name in ("velocity", "acceleration")]
    velocity, acceleration = (np.stack((-most, most), axis=1) for most in limits)
    constraints = [
        toppra.constraint.JointVelocityConstraint(velocity),
        toppra.constraint.JointAccelerationConstraint(acceleration),
    ]

    def plan(q: list[float], goal: list[float]) -> object:
        path = toppra.SplineInterpolator([0.0, 1.0], np.array([q, goal]))
        algorithm = toppra.algorithm.TOPPRA(constraints, path, parametrizer="ParametrizeConstAccel")
        trajectory = algorithm.compute_trajectory()
        assert trajectory is not None
        return trajectory

    tasks = work["from_rest"][:4]
    return {"f from_rest": each(plan, [task[0] for task in tasks], [task[2] for task in tasks])}


if __name__ == "__main__":
    serve(measure)
