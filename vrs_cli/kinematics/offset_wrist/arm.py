"""Solve arms with six joints and an offset wrist, such as those of Universal Robots, in closed form.

    i   theta   d     a    alpha
    1   q1      d1    0    +90 deg
    2   q2      d2    a2     0
    3   q3      d3    a3     0
    4   q4      d4    0    +90
    5   q5      d5    0    -90
    6   q6      d6    0      0

The axes of joints 2, 3 and 4 are parallel. The plane of the arm (of its bars a2 and a3) is at the distance w = d2 + d3
+ d4 from the axis of joint 1. Let p be the origin of frame 5, n, s and a the axes of the flange, and y = (s1, -c1, 0)
the direction of the axes of joints 2 to 4. Then p . y = w gives joint 1, a . y = cos q5 gives joint 5, (n . y, s . y) =
sin q5 (c6, -s6) gives joint 6, and the triangle of the bars gives joints 2 to 4. Source: Hawkins, "Analytic inverse
kinematics for the Universal Robots" (2013).

The configurations have the words of V+, adapted to this arm:

    RIGHTY / LEFTY    the arm to the right / left of the axis of joint 1, seen along the arm
    ABOVE / BELOW     the elbow above / below the line from shoulder to wrist
    NOFLIP / FLIP     joint 5 positive (or zero) / negative, as on a PUMA

If the wrist word changes, q2 + q3 + q4 changes by half a turn: its sine and cosine, `lift` and `level`, change their
signs.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property
from math import acos, atan2, copysign, cos, dist, pi, sin, sqrt
from typing import NamedTuple

from vrs_cli.errors import LocationOutOfRange
from vrs_cli.kinematics import clearance as bounds
from vrs_cli.kinematics.arm import Branch, FormulaArm
from vrs_cli.kinematics.clearance import ON_BOUNDARY
from vrs_cli.kinematics.formula import every_branch
from vrs_cli.kinematics.joints import (
    ALL,
    WRIST_SINGULAR,
    Configuration,
    Demands,
    Joints,
    Singularity,
    Twist,
    six_turned_near,
)
from vrs_cli.kinematics.model import EXACT, RobotModel
from vrs_cli.kinematics.transform import IDENTITY, Transform, cross, length

ALPHAS = (pi / 2, 0.0, 0.0, pi / 2, -pi / 2)


class Offsets(NamedTuple):
    """The lengths of the arm [m]. `side`: w, the distance of the arm's plane from axis 1; `right`: its sign, +1.0 or
    -1.0.
    """

    d1: float
    a2: float
    a3: float
    side: float
    d5: float
    d6: float
    right: float


def offsets_of(model: RobotModel) -> Offsets | None:
    """Return the lengths of a model whose links have the alphas of the table above; None if other link parameters do
    not fit the table.
    """
    l1, l2, l3, l4, l5, l6 = model.links
    if max(abs(l1.a), abs(l4.a), abs(l5.a)) > EXACT or min(l2.a, l3.a) <= EXACT:
        return None
    side = l2.d + l3.d + l4.d
    return Offsets(l1.d, l2.a, l3.a, side, l5.d, l6.d, -1.0 if side < 0.0 else 1.0)


# [m2] a point with a smaller squared distance from an axis counts as on the axis
ON_AXIS = bounds.SINGULAR * bounds.SINGULAR

STEPS = (  # variables of the formula in `make_branch` that `render/symbols.py` shows to users
    *("arm", "elbow", "wrist", "x", "y", "z", "u2", "u", "q1", "c5", "s5", "q5", "q6"),
    *("lift", "level", "h", "v", "k", "q3", "q2", "phi", "q4"),
)


def make_branch(offsets: Offsets) -> Branch:
    """Return the formula of inverse kinematics: a function of a pose, a configuration and `near` that ignores the
    limits, and adds whole turns to bring each joint nearest to `near`.

    The function returns None if the pose is out of reach. Joint 1 or joint 6 keeps its value in `near` if it may have
    any value.
    """
    d1, a2, a3, side, d5, d6, right = offsets
    bars, twice = a2 * a2 + a3 * a3, 1.0 / (2.0 * a2 * a3)
    most = 1.0 + bounds.BOUNDARY

    def branch(T: Transform, configuration: Configuration, near: Joints) -> Joints | None:
        arm, elbow, wrist = configuration.signs
        nx, sx, ax, px, ny, sy, ay, py, nz, sz, az, pz = T
        forward = arm * right
        x, y, z = px - d6 * ax, py - d6 * ay, pz - d6 * az - d1
        reach2 = x * x + y * y
        u2 = reach2 - side * side
        if u2 < -bounds.BOUNDARY:
            return None
        outward = forward * sqrt(u2 if u2 > 0.0 else 0.0)
        c1, s1 = (
            ((outward * x - side * y) / reach2, (outward * y + side * x) / reach2)
            if reach2 > ON_AXIS
            else (cos(near[0]), sin(near[0]))
        )
        q1 = atan2(s1, c1) if reach2 > ON_AXIS else near[0]
        n, s, c5 = nx * s1 - ny * c1, sx * s1 - sy * c1, ax * s1 - ay * c1
        size = sqrt(n * n + s * s)
        c6, s6 = (wrist * n / size, -wrist * s / size) if size > ON_BOUNDARY else (cos(near[5]), sin(near[5]))
        q6 = atan2(s6, c6) if size > ON_BOUNDARY else near[5]
        s5 = size * wrist
        q5 = atan2(s5, c5)
        along, beside = c5 * c6, -c5 * s6
        level = c1 * (nx * along + sx * beside - ax * s5) + s1 * (ny * along + sy * beside - ay * s5)
        lift = nz * along + sz * beside - az * s5
        u = c1 * x + s1 * y
        h, v = u - d5 * lift, z + d5 * level
        k = (h * h + v * v - bars) * twice
        if k >= most or k <= -most:
            return None
        cosine = k if -1.0 < k < 1.0 else copysign(1.0, k)
        fold = -elbow * forward
        bearing, angle2 = atan2(v, h), atan2(a3 * sqrt((1.0 - cosine) * (1.0 + cosine)), a2 + a3 * cosine)
        angle3, phi = acos(cosine), atan2(lift, level)
        q2, q3 = bearing - fold * angle2, fold * angle3
        q4 = phi - q2 - q3
        found = q1, q2, q3, q4, q5, q6
        # if the distance is below pi, every joint is within half a turn
        return found if dist(found, near) < pi else six_turned_near(found, near)

    return branch


# nearer to a singularity (values of `singularity` below this), rates are computed by the Jacobian, not in closed form
CLEAR = 1e-3


class OffsetWristArm(FormulaArm):
    """An arm with six joints and an offset wrist. The methods are those of `arm.RobotArm`."""

    ways = ALL
    method = "closed form, joints 2 to 4 parallel"
    step_names = STEPS

    def __init__(self, model: RobotModel, offsets: Offsets) -> None:
        super().__init__(model)
        self.offsets = offsets
        self.formula = self.branch_joints = make_branch(offsets)  # type: ignore[method-assign, assignment]
        self.reach = bounds.TwoBars(offsets.a2, offsets.a3, abs(offsets.side))
        self.boundary = self.reach.boundary()
        self.fold = 2, 0.0
        self.hand = bounds.Hand(IDENTITY, (0.0, 0.0, -offsets.d6), (0.0, 0.0, 1.0))

    @property
    def constants(self) -> Mapping[str, float]:
        return self.offsets._asdict()

    @cached_property
    def branches(self) -> Callable[[Transform], tuple[Joints | None, ...]]:
        return every_branch(self.formula, self.middle, self.middle)

    def configuration(self, q: Joints) -> Configuration:
        g = self.offsets
        outward = self._outward(q)
        lefty = outward * g.right < -bounds.SINGULAR
        forward = -1.0 if outward < -bounds.SINGULAR or (abs(outward) <= bounds.SINGULAR and g.right < 0.0) else 1.0
        below = sin(q[2]) * forward > bounds.SINGULAR
        return ALL[4 * lefty + 2 * below + (sin(q[4]) < -bounds.SINGULAR)]

    def outward(self, q: Joints) -> float:
        return -self.offsets.right * self._outward(q)

    def _outward(self, q: Joints) -> float:
        """Return the signed distance of the origin of frame 5 from axis 1, in the plane of the arm [m]."""
        _, q2, q3, q4, _, _ = q
        g = self.offsets
        return g.a2 * cos(q2) + g.a3 * cos(q2 + q3) + g.d5 * sin(q2 + q3 + q4)

    def twins(self, q: Joints) -> tuple[Configuration, ...]:
        return () if abs(sin(q[4])) >= WRIST_SINGULAR else (self.configuration(q).other_wrist,)

    def joint_velocity(
        self, q: Joints, twist: Twist, T_flange_tool: Transform = IDENTITY, demands: Demands = ()
    ) -> Joints:
        """Return the joint rates in closed form; near a singular pose compute them by the Jacobian.

        Only joints 1 to 4 move the point where axes 5 and 6 meet, and only joint 1 moves it perpendicular to the plane
        of the arm. Subtracting the effect of joint 1 leaves an angular velocity with three components. Joints 2 to 4
        together make the component along the normal of the plane, joint 5 makes the component along axis 5, and joint 6
        the component along the third direction, X of frame 4. Then the axis of joint 4 moves like the end of a planar
        arm of two bars, which gives joints 2 and 3.
        """
        _, a2, a3, side, d5, d6, _ = self.offsets
        q1, q2, q3, q4, q5, q6 = q
        c1, s1, c5, s5, s3 = cos(q1), sin(q1), cos(q5), sin(q5), sin(q3)
        c23, s23 = cos(q2 + q3), sin(q2 + q3)
        c, s = cos(q2 + q3 + q4), sin(q2 + q3 + q4)
        h, v = a2 * cos(q2) + a3 * c23, a2 * sin(q2) + a3 * s23  # position of joint 4 from joint 2, outward and up
        outward = h + d5 * s
        if -CLEAR < s3 < CLEAR or -CLEAR < s5 < CLEAR or abs(outward) < CLEAR * (a2 + a3 + abs(d5)):
            return super().joint_velocity(q, twist, T_flange_tool, demands)
        vx, vy, vz, wx, wy, wz = twist
        # components of the angular velocity: outward in the plane of the arm, and perpendicular to this plane
        out, across = c1 * wx + s1 * wy, s1 * wx - c1 * wy
        tx, ty, tz = T_flange_tool[3], T_flange_tool[7], d6 + T_flange_tool[11]
        x, y, z = -s5 * tz, c5 * tz, 0.0  # vector from the point where axes 5 and 6 meet to the tip, in frame 4
        if tx or ty:
            c6, s6 = cos(q6), sin(q6)
            along = c6 * tx - s6 * ty
            x, y, z = x + c5 * along, y + s5 * along, -s6 * tx - c6 * ty
        ro, ru = c * x + s * z, s * x - c * z
        # the signs follow from the cross products of the axes: out x across = -up, across x up = -out, up x out =
        # -across
        vo = c1 * vx + s1 * vy - (wz * y - across * ru)
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

    def clearance(self, T: Transform, configuration: Configuration) -> bounds.Clearance:
        """Return the clearances of a pose: how far it is from poses that are out of reach or singular.

        The bars end on the axis of joint 4, at the point o - d5 z. Here o is the wrist centre and z = y x a / sin q5,
        with y and a as in the module's docstring.
        """
        d1, _, _, side, d5, d6, right = self.offsets
        arm, _, wrist = configuration.signs
        x, y = T[3] - d6 * T[2], T[7] - d6 * T[6]
        reach2 = x * x + y * y
        shoulder = reach2 - side * side
        if shoulder < -bounds.BOUNDARY:
            return bounds.Clearance(shoulder)
        outward, c1, s1 = arm * right * sqrt(max(shoulder, 0.0)), 1.0, 0.0
        if reach2 > bounds.SINGULAR * bounds.SINGULAR:
            c1, s1 = (outward * x - side * y) / reach2, (outward * y + side * x) / reach2
        across = cross((s1, -c1, 0.0), (T[2], T[6], T[10]))
        s5 = length(across)
        away = d5 * wrist / s5 if s5 > bounds.SINGULAR else 0.0
        h = c1 * x + s1 * y - away * (c1 * across[0] + s1 * across[1])
        v = T[11] - d6 * T[10] - d1 - away * across[2]
        square = h * h + v * v
        return bounds.Clearance(shoulder, self.reach.outer - square, square - self.reach.inner, s5, across)

    def least_clearance(
        self, a: bounds.Clearance, b: bounds.Clearance, pace: bounds.HandPace, h: float, *, beside_axis: bool = False
    ) -> bounds.Clearance:
        shoulder, turns = bounds.turning_bounds(self.reach, a.shoulder, b.shoulder, pace, h, beside_axis=beside_axis)
        if turns is None:
            return bounds.Clearance(shoulder, bounds.UNKNOWN, bounds.UNKNOWN, bounds.UNKNOWN)
        rate = pace.tilt + turns.rate
        change = turns.bend + turns.rate * (turns.rate + 2.0 * pace.tilt) + pace.tilt_bend
        wrist = bounds.shortest(a.across, b.across, rate, change, h)
        if wrist <= 0.0:
            return bounds.Clearance(shoulder, bounds.UNKNOWN, bounds.UNKNOWN, wrist)
        swing, swing_bend = (
            rate / wrist,
            change / wrist + 3.0 * (rate / wrist) ** 2,
        )  # bounds of the derivatives of z, which is a normalised vector
        d5, beside = abs(self.offsets.d5), self.reach.side * self.reach.side
        speed, bend = pace.speed + d5 * swing, pace.bend + d5 * swing_bend
        return bounds.Clearance(shoulder, *bounds.from_shoulder(self.reach, a, b, speed, bend, h, beside), wrist)

    def _out_of_reach(self, T: Transform, configuration: Configuration, hint: str) -> LocationOutOfRange:
        return self.reach.refusal(self.clearance(T, configuration), "joint 4", hint)

    def singularity(self, q: Joints) -> Singularity:
        g = self.offsets
        return Singularity(abs(self._outward(q)) / (g.a2 + g.a3 + abs(g.d5)), abs(sin(q[2])), abs(sin(q[4])))
