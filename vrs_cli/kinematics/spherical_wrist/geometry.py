"""The geometry of an articulated arm with a spherical wrist, as constants for the closed forms.

    i   theta   d     a    alpha
    1   q1      d1    a1   -90 deg
    2   q2      d2    a2     0
    3   q3      d3    a3   +90
    4   q4      d4    0    -90
    5   q5      0     0    +90
    6   q6      d6    0      0

The closed forms think in the vertical plane of the arm. Frame 1 lies in it: with the wrist centre at (h, v)
from joint 2, h outward and v DOWN, and at w = d2 + d3 to the side, the base sees it at

    (c1 u - s1 w,  s1 u + c1 w,  d1 - v),      u = a1 + h.

Upper arm a2 and forearm (a3, d4), one bar of length `forearm` at the angle psi = q3 - beta to the upper arm,
give

    (h, v) = Rot(q2) (a2 + forearm cos psi,  forearm sin psi),      beta = atan2(d4, a3).

Source: Lee and Ziegler (1984); Fu, Gonzalez and Lee, "Robotics" (1987), sections 2.2 and 2.3; the wrist as in
Paul (1981). Signs of the configurations: ARM = -sign(u), ELBOW = -ARM sign(sin psi), WRIST = sign(sin q5): what the
words mean for w > 0 and up as here; `swapped` tells what else they may be.
"""

from __future__ import annotations

from math import atan2, cos, hypot, pi, sin
from typing import NamedTuple

from vrs_cli.kinematics.axes import EXACT
from vrs_cli.kinematics.clearance import SINGULAR
from vrs_cli.kinematics.configuration import ALL, ARM, ELBOW, WRIST, Configuration
from vrs_cli.kinematics.joints import JointKind, Joints
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.transform import IDENTITY

ALPHAS = (-pi / 2, 0.0, pi / 2, -pi / 2, pi / 2, 0.0)


class Geometry(NamedTuple):
    """Lengths in metres, beta in radians."""

    d1: float
    a1: float
    a2: float
    a3: float
    d4: float
    d6: float
    side: float  # w, of the arm's plane from the axis of joint 1
    forearm: float
    beta: float


def plain(model: RobotModel) -> bool:
    """Whether all joints turn, with their zeros where the links have them, and nothing stands at the ends."""
    turns = all(link.kind is JointKind.REVOLUTE and link.theta == 0.0 for link in model.links)
    return turns and model.base == IDENTITY and model.flange == IDENTITY


def geometry_of(model: RobotModel) -> Geometry | None:
    """The constants of a model of this kind; None for every other robot."""
    if model.joint_count != 6 or not plain(model):
        return None
    l1, l2, l3, l4, l5, l6 = model.links
    zeros = (
        l4.a,
        l5.a,
        l6.a,
        l5.d,
        *(link.alpha - alpha for link, alpha in zip(model.links, ALPHAS, strict=True)),
    )
    if any(abs(zero) > EXACT for zero in zeros) or l2.a <= EXACT or hypot(l3.a, l4.d) <= EXACT:
        return None
    return Geometry(
        d1=l1.d,
        a1=l1.a,
        a2=l2.a,
        a3=l3.a,
        d4=l4.d,
        d6=l6.d,
        side=l2.d + l3.d,
        forearm=hypot(l3.a, l4.d),
        beta=atan2(l4.d, l3.a),
    )


def swapped(geometry: Geometry, *, down: bool, folded: bool) -> int:
    """The words that are the other of their pair by geometry, as bits of `Configuration.index`. `down`: up is down;
    `folded`: where joint 5 of the formulas is 0, the hand points back to the elbow.
    """
    if abs(geometry.side) > EXACT:
        left = (geometry.side < 0.0) != down
    elif abs(geometry.a1) > EXACT:
        left = geometry.a1 > 0.0
    else:
        left = down
    return ARM * left + ELBOW * down + WRIST * folded


def configuration_of(geometry: Geometry, q: Joints) -> Configuration:
    """Which of the eight the joints are in; on a border, rounding aside, the first word of the pair."""
    _, _, _, a3, d4, _, _, forearm, _ = geometry
    _, _, q3, _, q5, _ = q
    lefty = outward(geometry, q) > SINGULAR
    sin_psi = (a3 * sin(q3) - d4 * cos(q3)) / forearm
    below = (-sin_psi if lefty else sin_psi) > SINGULAR
    flip = sin(q5) < -SINGULAR
    return ALL[4 * lefty + 2 * below + flip]


def outward(geometry: Geometry, q: Joints) -> float:
    """u, of the wrist's centre in the arm's plane, from the axis of joint 1 [m]."""
    _, a1, a2, a3, d4, _, _, _, _ = geometry
    _, q2, q3, *_ = q
    return a1 + a2 * cos(q2) + a3 * cos(q2 + q3) + d4 * sin(q2 + q3)
