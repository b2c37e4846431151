"""Joint rates of an arm without a common point of the wrist, in closed form; the links are those of `offsets`.

The point where axes 5 and 6 meet is moved by joints 1 to 4 alone: across the plane of the arm by joint 1. What joint 1
leaves of the turn is along the normal of the plane, which joints 2 to 4 turn about together, along axis 5, and along
the third direction X of frame 4, where joint 6 alone turns. So joint 4 moves as a planar arm of two bars brings it.
"""

from __future__ import annotations

from math import cos, sin

from vrs_cli.kinematics.jacobian import Twist
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.offset_wrist.offsets import Offsets
from vrs_cli.kinematics.transform import Transform

CLEAR = 1e-3  # of the measures of singularities, from which on the rates are these


def joint_velocity(offsets: Offsets, q: Joints, twist: Twist, T_flange_tool: Transform) -> Joints | None:
    """[rad/s] for a twist of the tool; None next to a singular pose."""
    _, a2, a3, side, d5, d6, _ = offsets
    q1, q2, q3, q4, q5, q6 = q
    c1, s1, c5, s5, s3 = cos(q1), sin(q1), cos(q5), sin(q5), sin(q3)
    c23, s23 = cos(q2 + q3), sin(q2 + q3)
    c, s = cos(q2 + q3 + q4), sin(q2 + q3 + q4)
    h, v = a2 * cos(q2) + a3 * c23, a2 * sin(q2) + a3 * s23  # joint 4 from joint 2, outward and up
    outward = h + d5 * s
    if -CLEAR < s3 < CLEAR or -CLEAR < s5 < CLEAR or abs(outward) < CLEAR * (a2 + a3 + abs(d5)):
        return None
    vx, vy, vz, wx, wy, wz = twist
    out, across = c1 * wx + s1 * wy, s1 * wx - c1 * wy  # of the turn
    tx, ty, tz = T_flange_tool[3], T_flange_tool[7], d6 + T_flange_tool[11]
    x, y, z = -s5 * tz, c5 * tz, 0.0  # from where axes 5 and 6 meet to the tip, in frame 4
    if tx or ty:
        c6, s6 = cos(q6), sin(q6)
        along = c6 * tx - s6 * ty
        x, y, z = x + c5 * along, y + s5 * along, -s6 * tx - c6 * ty
    ro, ru = c * x + s * z, s * x - c * z
    vo = c1 * vx + s1 * vy - (wz * y - across * ru)  # out x across = -up, across x up = -out, up x out = -across
    va = s1 * vx - c1 * vy - (out * ru - wz * ro)
    vu = vz - (across * ro - out * y)
    qd1 = -va / outward
    up = wz - qd1
    qd6 = -(c * out + s * up) / s5
    turn = across - c5 * qd6
    vo, vu = vo - side * qd1 - turn * d5 * c, vu - turn * d5 * s
    qd2 = (vo * c23 + vu * s23) / (a2 * s3)
    qd3 = -(h * vo + v * vu) / (a2 * a3 * s3)
    return qd1, qd2, qd3, turn - qd2 - qd3, s * out - c * up, qd6
