"""Six joints whose wrist is not one point: axes 4 and 5 meet, and axis 6 passes beside that point (or not square).

    i   theta   d     a    alpha
    1   q1      d1    a1   -90 deg
    2   q2      d2    a2     0
    3   q3      d3    a3   +90
    4   q4      d4    0    alpha4
    5   q5      d5    a5   alpha5
    6   q6      0     0      0

The Fanuc CRX (d5), the ABB GoFa and the xArm 6 (a5), the Jaco (d5, alpha4 and alpha5 of 55 or 60 deg). There is no
closed form, but one unknown is all that is left to search: as joint 6 turns, the point where axes 4 and 5 meet goes
round a circle, and wherever it is, joints 1 to 3 follow as those of a spherical wrist do, in up to four ways. The
axis z3 of the forearm and the axis z4 must then be alpha4 apart:

    f(q6) = z3 . z4 - cos alpha4 = 0,

a function for each of the four ways, which meet in pairs where the arm is stretched, or its shoulder turns over. There
are up to 16 solutions. Each is found as a change of sign, or as a place where f comes near 0 and turns back, on a grid
of joint 6; Newton's method over all joints makes it exact.

The point where axes 4 and 5 meet is the wrist of which the words speak; the hand points along the forearm where axis 6
is nearest to the direction of axis 4. Two solutions may have the same words. On a straight line words may change, as
what divides them is not singular.
"""

from __future__ import annotations

from math import atan2, hypot, pi, sin
from typing import NamedTuple

from vrs_cli.kinematics.model import EXACT, RobotModel
from vrs_cli.kinematics.spherical_wrist.inverse import Geometry

ALPHAS = (-pi / 2, 0.0, pi / 2, None, None)
SKEW = 0.1  # the sine of an angle between axes of the wrist, at least


class Circle(NamedTuple):
    """`arm`: joints 1 to 3, with the wrist where axes 4 and 5 meet; lengths [m], angles [rad]."""

    arm: Geometry
    alpha4: float
    d5: float
    a5: float
    alpha5: float

    @property
    def straight(self) -> float:
        """Positive where z3 and z5 are nearer to one direction at q5 = 0 than half a turn on, else negative."""
        return -sin(self.alpha4) * sin(self.alpha5)


def circle_of(model: RobotModel) -> Circle | None:
    """The constants of a model whose first axes lie as ALPHAS say; None where it is not of this kind."""
    l1, l2, l3, l4, l5, _ = model.links
    forearm = hypot(l3.a, l4.d)
    if abs(l4.a) > EXACT or min(l2.a, forearm) <= EXACT or min(abs(sin(l4.alpha)), abs(sin(l5.alpha))) < SKEW:
        return None
    arm = Geometry(l1.d, l1.a, l2.a, l3.a, l4.d, 0.0, l2.d + l3.d, forearm, atan2(l4.d, l3.a))
    return Circle(arm, l4.alpha, l5.d, l5.a, l5.alpha)
