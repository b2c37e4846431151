"""Forward kinematics: from joints to the flange, one pose, plain floats."""

from __future__ import annotations

from collections.abc import Callable
from math import cos, sin

from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.spherical_wrist.geometry import Geometry
from vrs_cli.kinematics.transform import Transform

_new = tuple.__new__


def make_forward(geometry: Geometry) -> Callable[[Joints], Transform]:
    """T_base_flange(q) in closed form, for an arm with a spherical wrist."""
    d1, a1, a2, a3, d4, d6, side, _, _ = geometry

    def forward(q: Joints) -> Transform:
        q1, q2, q3, q4, q5, q6 = q
        q23 = q2 + q3
        c1, s1 = cos(q1), sin(q1)
        c23, s23 = cos(q23), sin(q23)
        c4, s4 = cos(q4), sin(q4)
        c5, s5 = cos(q5), sin(q5)
        c6, s6 = cos(q6), sin(q6)
        # approach a and x axis n in frame 3, then turned by q23 in the arm's plane, then by q1 about the
        # waist
        x = c4 * s5
        y = s4 * s5
        e = c23 * x + s23 * c5
        ax = c1 * e - s1 * y
        ay = s1 * e + c1 * y
        az = c23 * c5 - s23 * x
        t = c5 * c6
        x = c4 * t - s4 * s6
        y = s4 * t + c4 * s6
        t = s5 * c6
        e = c23 * x - s23 * t
        nx = c1 * e - s1 * y
        ny = s1 * e + c1 * y
        nz = -c23 * t - s23 * x
        u = a1 + a2 * cos(q2) + a3 * c23 + d4 * s23
        return _new(
            Transform,
            (
                nx,
                ay * nz - az * ny,
                ax,
                c1 * u - s1 * side + d6 * ax,
                ny,
                az * nx - ax * nz,
                ay,
                s1 * u + c1 * side + d6 * ay,
                nz,
                ax * ny - ay * nx,
                az,
                d1 - a2 * sin(q2) - a3 * s23 + d4 * c23 + d6 * az,
            ),
        )

    return forward
