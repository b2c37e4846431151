"""Pinocchio: forward kinematics and Jacobian of a chain with the same links, in C++."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio

from benchmarks.peers.timing import at_once, each, serve


def measure(work: dict[str, Any]) -> dict[str, float]:
    """`alpha`, `a`, `d` of the links; `joints`."""
    model = _chain(work["alpha"], work["a"], work["d"])
    data = model.createData()
    rows = list(np.array(work["joints"]))
    last = model.nq
    many = rows * 20

    def forward_many() -> None:
        for q in many:
            pinocchio.forwardKinematics(model, data, q)

    return {
        "forward": each(lambda q: pinocchio.forwardKinematics(model, data, q), rows, rounds=5),
        "forward many": at_once(forward_many, len(many)),
        "jacobian": each(lambda q: pinocchio.computeJointJacobian(model, data, q, last), rows, rounds=5),
    }


def _chain(alpha: list[float], a: list[float], d: list[float]) -> pinocchio.Model:
    """A revolute joint about z, then the rest of its link, for each link."""
    model, placement, parent = pinocchio.Model(), pinocchio.SE3.Identity(), 0
    for i, (twist, length, offset) in enumerate(zip(alpha, a, d, strict=True)):
        parent = model.addJoint(parent, pinocchio.JointModelRZ(), placement, f"joint{i + 1}")
        turned = pinocchio.SE3(pinocchio.utils.rotate("x", twist), np.zeros(3))
        placement = pinocchio.SE3(np.eye(3), np.array([length, 0.0, offset])) * turned
    return model


if __name__ == "__main__":
    serve(measure)
