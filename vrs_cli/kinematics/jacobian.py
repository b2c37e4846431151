"""The velocities of any serial arm.

A twist is (vx, vy, vz, wx, wy, wz): velocity of the tool's point [m/s] and angular velocity [rad/s], both in
the base frame.
"""

from __future__ import annotations

from typing import NamedTuple

from vrs_cli.kinematics.joints import Joints

Twist = tuple[float, float, float, float, float, float]
Jacobian = tuple[Joints, Joints, Joints, Joints, Joints, Joints]  # six rows of n
Demands = tuple[tuple[Joints, float], ...]  # of joints that are too many: a sum of all of them by weights, what it is

AT_REST = 1e-9  # [m/s, rad/s] a demand on a lost direction that is rounding and no motion


class Singularity(NamedTuple):
    """How far from each singularity a pose is, 0 (in it) to 1 (as far as can be).

    `shoulder` is |u| over the arm's length, `elbow` |sin psi|, `wrist` |sin q5|.
    """

    shoulder: float
    elbow: float
    wrist: float

    @property
    def nearest(self) -> str:
        return min(zip(self, self._fields, strict=True))[1]


def beyond(rate: Twist, bias: Twist) -> Twist:
    """What the joints' next derivative has to make of a rate of the tool: all but the bias."""
    vx, vy, vz, wx, wy, wz = rate
    ax, ay, az, bx, by, bz = bias
    return vx - ax, vy - ay, vz - az, wx - bx, wy - by, wz - bz
