"""The geometry and the kinematics of an articulated arm with a spherical wrist, for plain floats.

    i   theta   d     a    alpha
    1   q1      d1    a1   -90 deg
    2   q2      d2    a2     0
    3   q3      d3    a3   +90
    4   q4      d4    0    -90
    5   q5      0     0    +90
    6   q6      d6    0      0

The closed form is derived in the vertical plane of the arm, which contains the x and y axes of frame 1. The wrist
centre is at (h, v) from joint 2, h outward and v DOWN, and w = d2 + d3 to the side. In the base frame it is at

    (c1 u - s1 w,  s1 u + c1 w,  d1 - v),      u = a1 + h.

The upper arm is a bar of length a2. The forearm (a3, d4) is a bar of length `forearm`, at the angle psi = q3 - beta to
the upper arm. So

    (h, v) = Rot(q2) (a2 + forearm cos psi,  forearm sin psi),      beta = atan2(d4, a3).

Source: Lee and Ziegler (1984); Fu, Gonzalez and Lee, "Robotics" (1987), sections 2.2 and 2.3; the wrist as in Paul
(1981). Signs of the configurations: ARM = -sign(u), ELBOW = -ARM sign(sin psi), WRIST = sign(sin q5). This is valid for
w > 0 and an upright arm; for other arms some words are swapped with the other word of their pair (`swapped_words`).

The inverse needs no sine or cosine of a joint: it computes the ratio of both from the location, and each angle from
this ratio by one atan2. Joint 6 is computed from joint 4, not from the third row of the rotation as in textbooks. Near
a singular wrist this row is rounding noise; computed from joint 4, joint 6 corrects its error exactly.
"""

from __future__ import annotations

from collections.abc import Callable
from math import acos, atan2, copysign, cos, dist, hypot, pi, sin, sqrt
from typing import NamedTuple

from vrs_cli.errors import StraightLineSingular
from vrs_cli.kinematics.arm import Branch
from vrs_cli.kinematics.clearance import BOUNDARY, ON_BOUNDARY, SINGULAR
from vrs_cli.kinematics.joints import (
    ALL,
    ARM,
    AT_REST,
    ELBOW,
    WRIST,
    Configuration,
    Demands,
    JointKind,
    Joints,
    Twist,
    six_turned_near,
)
from vrs_cli.kinematics.model import EXACT, RobotModel
from vrs_cli.kinematics.transform import IDENTITY, Transform

_new = tuple.__new__

ALPHAS = (-pi / 2, 0.0, pi / 2, -pi / 2, pi / 2, 0.0)


class Geometry(NamedTuple):
    """The constants of the closed form: lengths [m], and the angle beta [rad]."""

    d1: float
    a1: float
    a2: float
    a3: float
    d4: float
    d6: float
    side: float  # w, the distance of the plane of the arm from the axis of joint 1
    forearm: float
    beta: float


def geometry_of(model: RobotModel) -> Geometry | None:
    """Return the constants of a model whose links fit the table above; None for other models."""
    turns = all(link.kind is JointKind.REVOLUTE and link.theta == 0.0 for link in model.links)
    if model.joint_count != 6 or not turns or (model.base, model.flange) != (IDENTITY, IDENTITY):
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


def swapped_words(geometry: Geometry, *, down: bool, folded: bool) -> int:
    """Return the word pairs (of arm, elbow and wrist, such as LEFTY and RIGHTY) for which the sign formulas above give
    the wrong word, as bits of `Configuration.index`.

    `down`: whether axis 1 points down. `folded`: whether the hand points back to the elbow while joint 5 of the
    formulas is 0.
    """
    if abs(geometry.side) > EXACT:
        left = (geometry.side < 0.0) != down
    elif abs(geometry.a1) > EXACT:
        left = geometry.a1 > 0.0
    else:
        left = down
    return ARM * left + ELBOW * down + WRIST * folded


def configuration_of(geometry: Geometry, q: Joints) -> Configuration:
    """Return the configuration to which joints belong. If they are on a border within rounding, return the
    configuration with the first word of the pair.
    """
    _, _, _, a3, d4, _, _, forearm, _ = geometry
    _, _, q3, _, q5, _ = q
    lefty = outward(geometry, q) > SINGULAR
    sin_psi = (a3 * sin(q3) - d4 * cos(q3)) / forearm
    below = (-sin_psi if lefty else sin_psi) > SINGULAR
    flip = sin(q5) < -SINGULAR
    return ALL[4 * lefty + 2 * below + flip]


def outward(geometry: Geometry, q: Joints) -> float:
    """Return u, the signed distance of the wrist centre from axis 1 in the plane of the arm [m]."""
    _, a1, a2, a3, d4, _, _, _, _ = geometry
    _, q2, q3, *_ = q
    return a1 + a2 * cos(q2) + a3 * cos(q2 + q3) + d4 * sin(q2 + q3)


ON_AXIS = SINGULAR * SINGULAR  # [m2] a point with a smaller squared distance from an axis counts as on the axis


def flipped_wrist(q4: float, q5: float, q6: float, bends: bool) -> tuple[float, float, float]:
    """Convert joints 4 to 6 of NOFLIP to those of FLIP. `bends`: whether joint 5 is not straight; at a straight
    (singular) wrist both are the same.
    """
    if bends:
        q4 = q4 - pi if q4 > 0.0 else q4 + pi
        q5 = -q5
        q6 = q6 - pi if q6 > 0.0 else q6 + pi
    return q4, q5, q6


STEPS = (  # variables of the formula in `make_branch` that `render/symbols.py` shows to users
    *("arm", "elbow", "wrist", "x", "y", "v", "u2", "u", "h", "k"),
    *("q1", "psi", "q3", "m", "t", "q2", "X", "Y", "Z", "s5", "q4", "q5", "q6"),
)


def make_branch(geometry: Geometry) -> Branch:
    """Return the formula of inverse kinematics: a function of a pose, a configuration and `near` that ignores the
    limits, and adds whole turns to bring each joint nearest to `near`.

    The function returns None if the pose is out of reach. If the wrist is singular, joint 4 keeps the value it has
    in `near`, and joint 6 is set accordingly.
    """
    d1, a1, a2, a3, d4, d6, side, forearm, beta = geometry
    side2 = side * side
    bars, twice = a2 * a2 + forearm * forearm, 1.0 / (2.0 * a2 * forearm)
    f3, f4 = a3 / (forearm * forearm), d4 / (forearm * forearm)
    most = 1.0 + BOUNDARY

    def branch(T: Transform, configuration: Configuration, near: Joints) -> Joints | None:
        arm, elbow, wrist = configuration.signs
        nx, sx, ax, px, ny, sy, ay, py, nz, sz, az, pz = T
        x, y = px - d6 * ax, py - d6 * ay
        v = d1 + d6 * az - pz
        across = x * x + y * y
        u2 = across - side2
        if u2 < -BOUNDARY:
            return None
        root = sqrt(u2 if u2 >= ON_AXIS else 0.0)
        u = -arm * root
        h = u - a1
        rho = h * h + v * v
        k = (rho - bars) * twice
        if k >= most or k <= -most or rho == 0.0:
            return None
        cosine = k if -1.0 < k < 1.0 else copysign(1.0, k)
        beside = across > ON_AXIS  # if the wrist centre is on axis 1 (False), joint 1 keeps its value
        c1 = (u * x + side * y) / across if beside else cos(near[0])
        s1 = (u * y - side * x) / across if beside else sin(near[0])
        m, rise, angle = a2 + forearm * cosine, forearm * sqrt((1.0 - cosine) * (1.0 + cosine)), acos(cosine)
        fold = -arm * elbow
        t, psi = rise * fold, angle * fold
        c2, s2 = (h * m + v * t) / rho, (v * m - h * t) / rho
        q1, q2 = atan2(s1, c1), atan2(s2, c2)
        q3 = beta + psi
        fh, fv = h - a2 * c2, v - a2 * s2
        c23, s23 = f3 * fh - f4 * fv, f4 * fh + f3 * fv
        # components of the hand's axes a, n and s: outward in the plane of the arm, and perpendicular to this plane
        aH, aY = c1 * ax + s1 * ay, c1 * ay - s1 * ax
        nH, nY, sH, sY = c1 * nx + s1 * ny, c1 * ny - s1 * nx, c1 * sx + s1 * sy, c1 * sy - s1 * sx
        aX, nX, sX = c23 * aH - s23 * az, c23 * nH - s23 * nz, c23 * sH - s23 * sz
        s5 = sqrt(aX * aX + aY * aY)
        X, Y, Z = wrist * aX, wrist * aY, s23 * aH + c23 * az
        bends = s5 > ON_BOUNDARY  # if the wrist is singular (False), joint 4 keeps its value
        c4 = X if bends else cos(near[3])
        s4 = Y if bends else sin(near[3])
        q4 = atan2(Y, X) if bends else near[3]
        q5 = atan2(wrist * (s5 if bends else c4 * X + s4 * Y), Z)
        q6 = atan2(c4 * nY - s4 * nX, c4 * sY - s4 * sX)
        found = q1, q2, q3, q4, q5, q6
        # if the distance is below pi, every joint is within half a turn
        return found if dist(found, near) < pi else six_turned_near(found, near)

    return branch


def make_forward(geometry: Geometry) -> Callable[[Joints], Transform]:
    """Return a function that computes T_base_flange from joints, for an arm with a spherical wrist; it is faster than
    the generated code.
    """
    d1, a1, a2, a3, d4, d6, side, _, _ = geometry

    def forward(q: Joints) -> Transform:
        q1, q2, q3, q4, q5, q6 = q
        q23 = q2 + q3
        c1, s1 = cos(q1), sin(q1)
        c23, s23 = cos(q23), sin(q23)
        c4, s4 = cos(q4), sin(q4)
        c5, s5 = cos(q5), sin(q5)
        c6, s6 = cos(q6), sin(q6)
        # compute the axes a and n in frame 3, then rotate them by q23 in the plane of the arm, and by q1 about the
        # vertical
        x, y = c4 * s5, s4 * s5
        e = c23 * x + s23 * c5
        ax, ay = c1 * e - s1 * y, s1 * e + c1 * y
        az = c23 * c5 - s23 * x
        t = c5 * c6
        x, y = c4 * t - s4 * s6, s4 * t + c4 * s6
        t = s5 * c6
        e = c23 * x - s23 * t
        nx, ny = c1 * e - s1 * y, s1 * e + c1 * y
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


def make_joint_velocity(geometry: Geometry) -> Callable[..., Joints]:
    """Return the function `joint_velocity` of an arm (`arm.RobotArm`).

    In a singular pose the tool cannot move in one direction (the lost direction). A twist without a component in this
    direction is solved with joint 1, 3 or 4 at rest; any other twist raises StraightLineSingular with the name of the
    singularity. Near a singular pose the rates are large, so callers must compare them with the limits.

    Joints 1 to 3 move the wrist centre, and joints 4 to 6 turn the hand about it. So the 6x6 Jacobian splits into three
    small systems (Hollerbach and Sahar 1983), each with its own singularity:

        shoulder    wrist centre in the plane through the axis of joint 1        u = 0
        elbow       arm stretched or folded flat                                 sin psi = 0
        wrist       axes of joints 4 and 6 in one line                           sin q5 = 0
    """
    (_, a1, a2, a3, d4, d6, side, _, _), flat = geometry, SINGULAR * geometry.a2 * geometry.forearm

    def joint_velocity(
        q: Joints,
        twist: Twist,
        T_flange_tool: Transform = IDENTITY,
        demands: Demands = (),  # noqa: ARG001 (no redundant joints)
    ) -> Joints:
        q1, q2, q3, q4, q5, q6 = q
        c1, s1 = cos(q1), sin(q1)
        c23, s23 = cos(q2 + q3), sin(q2 + q3)
        c4, s4 = cos(q4), sin(q4)
        c5, s5 = cos(q5), sin(q5)
        uu, uv = a2 * cos(q2), a2 * sin(q2)  # upper arm, outward and down
        fu, fv = a3 * c23 + d4 * s23, a3 * s23 - d4 * c23  # forearm, outward and down
        u = a1 + uu + fu  # distance of the wrist centre from the axis of joint 1
        x, y = c4 * s5, s4 * s5
        e = c23 * x + s23 * c5
        tx, ty, tz = T_flange_tool[3], T_flange_tool[7], d6 + T_flange_tool[11]
        # vector from the wrist centre to the tip of the tool
        rx, ry, rz = tz * (c1 * e - s1 * y), tz * (s1 * e + c1 * y), tz * (c23 * c5 - s23 * x)
        if tx or ty:  # the tip is not on the axis of joint 6
            c6, s6 = cos(q6), sin(q6)
            along, across = c6 * tx - s6 * ty, s6 * tx + c6 * ty
            x, y = c4 * c5 * along - s4 * across, s4 * c5 * along + c4 * across
            z = -s5 * along
            e = c23 * x + s23 * z
            rx += c1 * e - s1 * y
            ry += s1 * e + c1 * y
            rz += c23 * z - s23 * x
        vx, vy, vz, wx, wy, wz = twist
        x = vx - wy * rz + wz * ry  # velocity of the wrist centre
        y = vy - wz * rx + wx * rz
        out, across, down = c1 * x + s1 * y, c1 * y - s1 * x, wx * ry - wy * rx - vz
        turn = c1 * wx + s1 * wy
        # angular velocity of the hand, in the axes of frame 3
        x, y, z = c23 * turn - s23 * wz, c1 * wy - s1 * wx, s23 * turn + c23 * wz
        if u > SINGULAR or u < -SINGULAR:
            qd1 = across / u
        elif -AT_REST < across < AT_REST:
            qd1 = 0.0
        else:
            raise _singular("shoulder", "the wrist is above or below the axis of joint 1")
        out += side * qd1
        stretch = uu * fv - uv * fu  # equals a2 forearm sin psi; 0 if the arm is stretched or folded
        if stretch > flat or stretch < -flat:
            qd2 = (out * fu + down * fv) / stretch
            qd23 = -(out * uu + down * uv) / stretch
        else:
            h, v = uu + fu, uv + fv
            reach = hypot(h, v)
            if reach < SINGULAR or abs(out * h + down * v) > AT_REST * reach:
                raise _singular("elbow", "the arm is stretched or folded flat")
            qd2 = qd23 = (down * h - out * v) / (reach * reach)
        # subtract the angular velocity contributed by joints 1 to 3; the wrist must provide the rest
        x += s23 * qd1
        y -= qd23
        z -= c23 * qd1
        lost = c4 * x + s4 * y
        qd5 = c4 * y - s4 * x
        if s5 > ON_BOUNDARY or s5 < -ON_BOUNDARY:
            qd6 = lost / s5
            return qd1, qd2, qd23 - qd2, z - c5 * qd6, qd5, qd6
        # at a singular wrist joint 4 stays at rest; an angular velocity in the lost direction is refused, because
        # joints 4 and 6 would have to jump
        if -SINGULAR <= s5 <= SINGULAR and not -AT_REST < lost < AT_REST:
            raise _singular("wrist", "the axes of joints 4 and 6 are in one line")
        return qd1, qd2, qd23 - qd2, 0.0, qd5, z / c5

    return joint_velocity


def _singular(which: str, why: str) -> StraightLineSingular:
    return StraightLineSingular(f"{which}: {why}", "take another path, or go there by MOVE")


def make_within(lower: Joints, upper: Joints) -> Callable[[Joints], bool]:
    """Return a function that checks whether six joints are all between `lower` and `upper`, without a tolerance."""
    low1, low2, low3, low4, low5, low6 = lower
    high1, high2, high3, high4, high5, high6 = upper

    def within(q: Joints) -> bool:
        q1, q2, q3, q4, q5, q6 = q
        return (
            low1 <= q1 <= high1
            and low2 <= q2 <= high2
            and low3 <= q3 <= high3
            and low4 <= q4 <= high4
            and low5 <= q5 <= high5
            and low6 <= q6 <= high6
        )

    return within


CIRCLE_ALPHAS = (-pi / 2, 0.0, pi / 2, None, None)
SKEW = 0.1  # minimum sine of the angle between neighbouring wrist axes for the search of `wrist_circle`


class Circle(NamedTuple):
    """The constants of an arm whose wrist (the point where axes 4 and 5 meet) moves on a circle as joint 6 turns while
    the flange stays; lengths [m], angles [rad].

    `arm`: the geometry of joints 1 to 3, with this point as the wrist centre.
    """

    arm: Geometry
    alpha4: float
    d5: float
    a5: float
    alpha5: float

    @property
    def straight(self) -> float:
        """Return a positive number if z3 and z5 point in similar directions at q5 = 0, a negative number if they point
        in opposite directions.
        """
        return -sin(self.alpha4) * sin(self.alpha5)


def circle_of(model: RobotModel) -> Circle | None:
    """Return the constants of a model whose first alphas are CIRCLE_ALPHAS; None if other link parameters
    do not fit.
    """
    l1, l2, l3, l4, l5, _ = model.links
    forearm = hypot(l3.a, l4.d)
    if abs(l4.a) > EXACT or min(l2.a, forearm) <= EXACT or min(abs(sin(l4.alpha)), abs(sin(l5.alpha))) < SKEW:
        return None
    arm = Geometry(l1.d, l1.a, l2.a, l3.a, l4.d, 0.0, l2.d + l3.d, forearm, atan2(l4.d, l3.a))
    return Circle(arm, l4.alpha, l5.d, l5.a, l5.alpha)
