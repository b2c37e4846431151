"""Six joints without a common point of the wrist: the arm of Universal Robots and its like, in closed form.

    i   theta   d     a    alpha
    1   q1      d1    0    +90 deg
    2   q2      d2    a2     0
    3   q3      d3    a3     0
    4   q4      d4    0    +90
    5   q5      d5    0    -90
    6   q6      d6    0      0

The axes of joints 2, 3 and 4 are parallel; joint 6 does not turn its own axis, and the axis of joint 5 leaves the plane
of the arm at w = d2 + d3 + d4 from the axis of joint 1. With p the origin of frame 5 and y = (s1, -c1, 0) the axes of
joints 2 to 4:  p . y = w  gives joint 1,  a . y = cos q5  joint 5,  (n . y, s . y) = sin q5 (c6, -s6)  joint 6, and two
bars a2 and a3 in the plane the rest. Source: Hawkins, "Analytic inverse kinematics for the Universal Robots" (2013).

The configurations, in V+'s words as they suit this arm:

    RIGHTY / LEFTY    the arm to the right / left of the axis of joint 1, seen along the arm
    ABOVE / BELOW     the elbow above / below the line from shoulder to wrist
    NOFLIP / FLIP     joint 5 positive (or zero) / negative, as on a PUMA
"""

from __future__ import annotations

from math import pi
from typing import NamedTuple

from vrs_cli.kinematics.axes import EXACT
from vrs_cli.kinematics.model import RobotModel

ALPHAS = (pi / 2, 0.0, 0.0, pi / 2, -pi / 2)


class Offsets(NamedTuple):
    """Lengths [m]; `right` is the side of the arm: +1.0 where w is positive, else -1.0."""

    d1: float
    a2: float
    a3: float
    side: float
    d5: float
    d6: float
    right: float


def offsets_of(model: RobotModel) -> Offsets | None:
    """The lengths of a model whose links have these alphas; None where it is not of this kind."""
    l1, l2, l3, l4, l5, l6 = model.links
    if max(abs(l1.a), abs(l4.a), abs(l5.a)) > EXACT or min(l2.a, l3.a) <= EXACT:
        return None
    side = l2.d + l3.d + l4.d
    return Offsets(l1.d, l2.a, l3.a, side, l5.d, l6.d, -1.0 if side < 0.0 else 1.0)
