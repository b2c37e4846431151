"""Joint accelerations and jerks of an arm with a spherical wrist, in closed form; plain floats, one pose at a time.

`rates.rates` solves for every derivative, once what the lower ones make of it is taken away. That is seen along the
axes of frame 3, which joints 1 to 3 turn; a hand that joints 4 to 6 turn against it is resolved along the axes of
frame 3 turned by joint 4: `n`, `m` (the axis of joint 5) and z.
"""

from __future__ import annotations

from typing import NamedTuple

from vrs_cli.kinematics.axes import cross
from vrs_cli.kinematics.jacobian import Twist
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.spherical_wrist.geometry import Geometry
from vrs_cli.kinematics.spherical_wrist.rates import Terms, rates, terms_of
from vrs_cli.kinematics.transform import IDENTITY, Transform, Vector

CONSTANT = (0.0,) * 6  # rates that do not change

_new = tuple.__new__


class _Turns(NamedTuple):
    """Angular velocities of frame 3 (`link`) and the hand, the rates of these components, the acceleration."""

    link: Vector
    hand: Vector
    link_rate: Vector
    hand_rate: Vector
    acceleration: Vector


def joint_acceleration(
    geometry: Geometry, q: Joints, qd: Joints, rate: Twist, T_flange_tool: Transform = IDENTITY
) -> Joints:
    """Joint accelerations [rad/s2] that give the tool this acceleration [m/s2, rad/s2], at joint rates qd.

    Raises StraightLineSingular, as `joint_velocity` does.
    """
    terms = terms_of(geometry, q, T_flange_tool)
    _, _, c23, s23, _, _, _, _, uu, uv, fu, fv, u, _, _, _, _, _, _ = terms
    d1, d2, d3, _, _, _ = qd
    d23 = d2 + d3
    turns = _turns(terms, qd, CONSTANT)
    spin, tool, turning = turns.hand, _in_frame_3(terms, terms[16:]), _in_frame_3(terms, rate[3:])
    x, y, z = _in_frame_3(terms, rate[:3])
    kx, ky, kz = cross(turning, tool)
    lx, ly, lz = cross(spin, cross(spin, tool))
    x, y, z = x - kx - lx, y - ky - ly, z - kz - lz  # of the wrist centre
    ax, ay, az = turning
    bx, by, bz = turns.acceleration
    return rates(
        geometry,
        terms,
        c23 * x + s23 * z + d1 * d1 * u + d2 * d2 * uu + d23 * d23 * fu,
        y + 2.0 * d1 * (uv * d2 + fv * d23) + d1 * d1 * geometry.side,
        s23 * x - c23 * z + d2 * d2 * uv + d23 * d23 * fv,
        ax - bx,
        ay - by,
        az - bz,
    )


def joint_jerk(
    geometry: Geometry, q: Joints, qd: Joints, qdd: Joints, rate: Twist, T_flange_tool: Transform = IDENTITY
) -> Joints:
    """Joint jerks [rad/s3] that give the tool this jerk [m/s3, rad/s3], at joint rates qd and accelerations qdd.

    Raises StraightLineSingular, as `joint_velocity` does.
    """
    terms = terms_of(geometry, q, T_flange_tool)
    _, _, c23, s23, _, _, _, _, uu, uv, fu, fv, u, _, _, _, _, _, _ = terms
    d1, d2, d3, _, _, _ = qd
    e1, e2, e3, _, _, _ = qdd
    d23, e23, side = d2 + d3, e2 + e3, geometry.side
    turns, turning = _turns(terms, qd, qdd), _in_frame_3(terms, rate[3:])
    kx, ky, kz = _tool_jerk(turns, turning, _in_frame_3(terms, terms[16:]))
    x, y, z = _in_frame_3(terms, rate[:3])
    x, y, z = x - kx, y - ky, z - kz  # of the wrist centre
    ax, ay, az = turning
    bx, by, bz = _turning_bias(terms, turns, qd, qdd)
    speed = -uv * d2 - fv * d23  # of the wrist centre, outward
    rise = -uv * e2 - fv * e23 - uu * d2 * d2 - fu * d23 * d23
    cubed, mixed = d1 * d1 * d1, 3.0 * d1 * e1
    cubed2, mixed2, cubed23, mixed23 = d2 * d2 * d2, 3.0 * d2 * e2, d23 * d23 * d23, 3.0 * d23 * e23
    return rates(
        geometry,
        terms,
        c23 * x + s23 * z + 3.0 * d1 * d1 * speed + mixed * u - cubed * side
        + mixed2 * uu - cubed2 * uv + mixed23 * fu - cubed23 * fv,
        y - 3.0 * (d1 * rise + e1 * speed) + cubed * u + mixed * side,
        s23 * x - c23 * z + mixed2 * uv + cubed2 * uu + mixed23 * fv + cubed23 * fu,
        ax - bx,
        ay - by,
        az - bz,
    )  # fmt: skip


def _in_frame_3(terms: Terms, vector: Vector) -> Vector:
    """A vector of the base along the axes of frame 3."""
    c1, s1, c23, s23 = terms[:4]
    x, y, z = vector
    out = c1 * x + s1 * y
    return c23 * out - s23 * z, c1 * y - s1 * x, s23 * out + c23 * z


def _turns(terms: Terms, qd: Joints, qdd: Joints) -> _Turns:
    """What the joints turn; with `qdd` zero the acceleration is J' qd."""
    _, _, c23, s23, c4, s4, c5, s5, _, _, _, _, _, _, _, _, _, _, _ = terms
    d1, d2, d3, d4, d5, d6 = qd
    e1, e2, e3, e4, e5, e6 = qdd
    d23 = d2 + d3
    px, py, pz = link = -s23 * d1, d23, c23 * d1
    n, z = s5 * d6, d4 + c5 * d6
    wx, wy, wz = hand = px + c4 * n - s4 * d5, py + s4 * n + c4 * d5, pz + z
    link_rate = ux, uy, uz = -s23 * e1 - c23 * d23 * d1, e2 + e3, c23 * e1 - s23 * d23 * d1
    n_rate, m_rate = s5 * e6 + c5 * d5 * d6 - d4 * d5, e5 + d4 * n
    vx, vy, vz = hand_rate = (
        ux + c4 * n_rate - s4 * m_rate,
        uy + s4 * n_rate + c4 * m_rate,
        uz + e4 + c5 * e6 - s5 * d5 * d6,
    )
    acceleration = vx + py * wz - pz * wy, vy + pz * wx - px * wz, vz + px * wy - py * wx
    return _new(_Turns, (link, hand, link_rate, hand_rate, acceleration))


def _tool_jerk(turns: _Turns, turning: Vector, tool: Vector) -> Vector:
    """The jerk of the tool about the wrist centre, while the hand's angular jerk is `turning`."""
    w, a = turns.hand, turns.acceleration
    way = cross(w, tool)
    x, y, z = cross(a, tool)
    lx, ly, lz = cross(w, way)
    ax, ay, az = cross(turning, tool)
    bx, by, bz = cross(a, way)
    cx, cy, cz = cross(w, (x + lx, y + ly, z + lz))
    return ax + 2.0 * bx + cx, ay + 2.0 * by + cy, az + 2.0 * bz + cz


def _turning_bias(terms: Terms, turns: _Turns, qd: Joints, qdd: Joints) -> Vector:
    """The angular part of J'' qd + 2 J' qdd."""
    _, _, c23, s23, c4, s4, c5, s5, _, _, _, _, _, _, _, _, _, _, _ = terms
    d1, d2, d3, d4, d5, d6 = qd
    e1, e2, e3, e4, e5, e6 = qdd
    d23, e23 = d2 + d3, e2 + e3
    link, hand, link_rate, (hx, hy, hz), (ax, ay, az) = turns
    mixed, squared = 2.0 * d23 * e1 + e23 * d1, d23 * d23 * d1
    wrist, bent = 2.0 * d5 * e6 + e5 * d6, d5 * d5 * d6
    n = c5 * wrist - s5 * bent - e4 * d5 - 2.0 * d4 * e5 - d4 * d4 * s5 * d6
    m = e4 * s5 * d6 + 2.0 * d4 * (s5 * e6 + c5 * d5 * d6) - d4 * d4 * d5
    x, y, z = cross(link_rate, hand)
    kx, ky, kz = cross(link, (hx + ax, hy + ay, hz + az))
    return (
        x + kx - c23 * mixed + s23 * squared + c4 * n - s4 * m,
        y + ky + s4 * n + c4 * m,
        z + kz - s23 * mixed - c23 * squared - s5 * wrist - c5 * bent,
    )
