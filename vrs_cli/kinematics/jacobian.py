"""The velocities of any serial arm: its Jacobian, and what of the derivatives the joint rates make themselves.

A twist is (vx, vy, vz, wx, wy, wz): velocity of the tool's point [m/s] and angular velocity [rad/s], both in
the base frame.
"""

from __future__ import annotations

from typing import NamedTuple

from vrs_cli.kinematics.joints import Joints

Twist = tuple[float, float, float, float, float, float]
Jacobian = tuple[Joints, Joints, Joints, Joints, Joints, Joints]  # six rows of n

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


def bias_of(J: Jacobian, qd: Joints) -> Twist:
    """J' qd of any serial arm, from its Jacobian: the tool's acceleration [m/s2, rad/s2] while the joint rates stay.

    Source: the outward half of the Newton-Euler recursion (Luh, Walker and Paul 1980).
    """
    wx = wy = wz = 0.0
    lx = ly = lz = bx = by = bz = 0.0
    # Column i is z_i x r_i. The joints before i carry it round with their w; its own joint and those after it
    # move the tool away from the axis with the velocity `tail`: column' = w x column + z_i x tail.
    tails = _tails(J, qd)
    for i in range(len(qd)):
        zx, zy, zz = J[3][i], J[4][i], J[5][i]
        d = qd[i]
        cx, cy, cz = J[0][i], J[1][i], J[2][i]
        tx, ty, tz = tails[i]
        lx += d * (wy * cz - wz * cy + zy * tz - zz * ty)
        ly += d * (wz * cx - wx * cz + zz * tx - zx * tz)
        lz += d * (wx * cy - wy * cx + zx * ty - zy * tx)
        bx += d * (wy * zz - wz * zy)
        by += d * (wz * zx - wx * zz)
        bz += d * (wx * zy - wy * zx)
        wx, wy, wz = wx + d * zx, wy + d * zy, wz + d * zz
    return lx, ly, lz, bx, by, bz


def _tails(J: Jacobian, qd: Joints) -> list[tuple[float, float, float]]:
    """For each joint the part of the tool's velocity that it and the joints after it make."""
    x = y = z = 0.0
    tails = []
    for a, b, c, d in zip(reversed(J[0]), reversed(J[1]), reversed(J[2]), reversed(qd), strict=True):
        x, y, z = x + a * d, y + b * d, z + c * d
        tails.append((x, y, z))
    return tails[::-1]


def beyond(rate: Twist, bias: Twist) -> Twist:
    """What the joints' next derivative has to make of a rate of the tool: all but the bias."""
    vx, vy, vz, wx, wy, wz = (a - b for a, b in zip(rate, bias, strict=True))
    return vx, vy, vz, wx, wy, wz


def jerk_bias_of(J: Jacobian, qd: Joints, qdd: Joints) -> Twist:
    """J'' qd + 2 J' qdd of any serial arm, from its Jacobian: the tool's jerk [m/s3, rad/s3] at constant qdd.

    One derivative more of what `bias_of` does: the joints before i turn with w and its rate `a`, and the derivative of
    the tail is `pull`.
    """
    wx = wy = wz = ax = ay = az = 0.0
    lx = ly = lz = bx = by = bz = px = py = pz = 0.0
    changes = []
    for cx, cy, cz, zx, zy, zz, (tx, ty, tz), d, dd in zip(*J, _tails(J, qd), qd, qdd, strict=True):
        ux, uy, uz = wy * zz - wz * zy, wz * zx - wx * zz, wx * zy - wy * zx  # w x z
        ex = wy * cz - wz * cy + zy * tz - zz * ty  # the change of the column
        ey = wz * cx - wx * cz + zz * tx - zx * tz
        ez = wx * cy - wy * cx + zx * ty - zy * tx
        bx += d * (ay * zz - az * zy + wy * uz - wz * uy) + 2.0 * dd * ux
        by += d * (az * zx - ax * zz + wz * ux - wx * uz) + 2.0 * dd * uy
        bz += d * (ax * zy - ay * zx + wx * uy - wy * ux) + 2.0 * dd * uz
        # the change of that, but what z x pull makes of it
        gx = ay * cz - az * cy + wy * ez - wz * ey + uy * tz - uz * ty
        gy = az * cx - ax * cz + wz * ex - wx * ez + uz * tx - ux * tz
        gz = ax * cy - ay * cx + wx * ey - wy * ex + ux * ty - uy * tx
        lx += d * gx + 2.0 * dd * ex
        ly += d * gy + 2.0 * dd * ey
        lz += d * gz + 2.0 * dd * ez
        changes.append((d, zx, zy, zz, d * ex + dd * cx, d * ey + dd * cy, d * ez + dd * cz))
        ax, ay, az = ax + dd * zx + d * ux, ay + dd * zy + d * uy, az + dd * zz + d * uz
        wx, wy, wz = wx + d * zx, wy + d * zy, wz + d * zz
    for d, zx, zy, zz, x, y, z in reversed(changes):
        px, py, pz = px + x, py + y, pz + z
        lx += d * (zy * pz - zz * py)
        ly += d * (zz * px - zx * pz)
        lz += d * (zx * py - zy * px)
    return lx, ly, lz, bx, by, bz
