"""Velocities of an arm with a spherical wrist, both ways, in closed form; plain floats, one pose at a time.

The tool is T_flange_tool; only its position matters to a velocity.

Seen from the wrist centre the arm moves it and the wrist turns about it, so the 6x6 of the Jacobian falls into three
small ones (Hollerbach and Sahar 1983), each with its own singularity:

    shoulder    wrist centre in the plane through the axis of joint 1        u = 0
    elbow       arm stretched or folded flat                                 sin psi = 0
    wrist       axes of joints 4 and 6 in one line                           sin q5 = 0
"""

from __future__ import annotations

from math import cos, hypot, sin

from vrs_cli.errors import StraightLineSingular
from vrs_cli.kinematics.clearance import ON_BOUNDARY, SINGULAR
from vrs_cli.kinematics.jacobian import AT_REST, Singularity, Twist
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.spherical_wrist.geometry import Geometry
from vrs_cli.kinematics.transform import IDENTITY, Transform


def singularity(geometry: Geometry, q: Joints) -> Singularity:
    """The measures of a pose."""
    _, a1, a2, a3, d4, _, _, forearm, _ = geometry
    _, q2, q3, _, q5, _ = q
    c23, s23 = cos(q2 + q3), sin(q2 + q3)
    uu, uv = a2 * cos(q2), a2 * sin(q2)
    fu, fv = a3 * c23 + d4 * s23, a3 * s23 - d4 * c23
    stretch = (uu * fv - uv * fu) / (a2 * forearm)
    return Singularity(abs(a1 + uu + fu) / (a1 + a2 + forearm), abs(stretch), abs(sin(q5)))


def joint_velocity(geometry: Geometry, q: Joints, twist: Twist, T_flange_tool: Transform = IDENTITY) -> Joints:
    """Joint rates [rad/s] that give the tool this twist.

    In a singularity a twist that asks nothing of the lost direction is solved (joint 1, 3 or 4 standing
    still); any other raises StraightLineSingular, which says which singularity it is. Near one the rates are
    large: compare them with the limits.
    """
    _, a1, a2, a3, d4, d6, side, forearm, _ = geometry
    q1, q2, q3, q4, q5, q6 = q
    c1, s1 = cos(q1), sin(q1)
    c23, s23 = cos(q2 + q3), sin(q2 + q3)
    c4, s4 = cos(q4), sin(q4)
    c5, s5 = cos(q5), sin(q5)
    uu, uv = a2 * cos(q2), a2 * sin(q2)  # upper arm, outward and down
    fu, fv = a3 * c23 + d4 * s23, a3 * s23 - d4 * c23  # forearm
    u = a1 + uu + fu  # wrist centre from the axis of joint 1
    x, y = c4 * s5, s4 * s5
    e = c23 * x + s23 * c5
    tx, ty, tz = T_flange_tool[3], T_flange_tool[7], d6 + T_flange_tool[11]
    rx, ry, rz = tz * (c1 * e - s1 * y), tz * (s1 * e + c1 * y), tz * (c23 * c5 - s23 * x)  # wrist centre to tool
    if tx or ty:  # off the axis of joint 6
        c6, s6 = cos(q6), sin(q6)
        along, across = c6 * tx - s6 * ty, s6 * tx + c6 * ty
        x = c4 * c5 * along - s4 * across
        y = s4 * c5 * along + c4 * across
        z = -s5 * along
        e = c23 * x + s23 * z
        rx += c1 * e - s1 * y
        ry += s1 * e + c1 * y
        rz += c23 * z - s23 * x
    vx, vy, vz, wx, wy, wz = twist
    x = vx - wy * rz + wz * ry  # of the wrist centre
    y = vy - wz * rx + wx * rz
    out, across, down = c1 * x + s1 * y, c1 * y - s1 * x, wx * ry - wy * rx - vz
    turn = c1 * wx + s1 * wy
    x, y, z = c23 * turn - s23 * wz, c1 * wy - s1 * wx, s23 * turn + c23 * wz  # of the hand, about the axes of frame 3
    if u > SINGULAR or u < -SINGULAR:
        qd1 = across / u
    elif -AT_REST < across < AT_REST:
        qd1 = 0.0
    else:
        raise _singular("shoulder", "the wrist is above or below the axis of joint 1")
    out += side * qd1
    stretch = uu * fv - uv * fu  # a2 forearm sin psi
    if abs(stretch) > SINGULAR * a2 * forearm:
        qd2 = (out * fu + down * fv) / stretch
        qd23 = -(out * uu + down * uv) / stretch
    else:
        h, v = uu + fu, uv + fv
        reach = hypot(h, v)
        if reach < SINGULAR or abs(out * h + down * v) > AT_REST * reach:
            raise _singular("elbow", "the arm is stretched or folded flat")
        qd2 = qd23 = (down * h - out * v) / (reach * reach)
    # what is left for the wrist to turn
    x += s23 * qd1
    y -= qd23
    z -= c23 * qd1
    lost = c4 * x + s4 * y
    qd5 = c4 * y - s4 * x
    if s5 > ON_BOUNDARY or s5 < -ON_BOUNDARY:
        qd6 = lost / s5
        return qd1, qd2, qd23 - qd2, z - c5 * qd6, qd5, qd6
    # a vector so short has no direction: joint 4 is held. Where it would have to turn, joints jump to the next sample,
    # which no velocity explains
    if -SINGULAR <= s5 <= SINGULAR and not -AT_REST < lost < AT_REST:
        raise _singular("wrist", "the axes of joints 4 and 6 are in one line")
    return qd1, qd2, qd23 - qd2, 0.0, qd5, z / c5


def _singular(which: str, why: str) -> StraightLineSingular:
    return StraightLineSingular(f"{which}: {why}", "take another path, or go there by MOVE")
