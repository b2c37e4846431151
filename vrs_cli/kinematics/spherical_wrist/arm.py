"""Solve arms with six joints whose last three axes meet in one point, such as the PUMA 560.

The formulas are explained in `spherical_wrist.inverse`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property
from math import cos, hypot, sin, sqrt
from typing import TYPE_CHECKING

from vrs_cli.errors import LocationOutOfRange, StraightLineSingular
from vrs_cli.kinematics import clearance as bounds
from vrs_cli.kinematics.formula import FormulaArm, every_branch, over_arrays
from vrs_cli.kinematics.joints import ALL, AT_REST, WRIST_SINGULAR, Configuration, Demands, Joints, Singularity, Twist
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.spherical_wrist import inverse
from vrs_cli.kinematics.spherical_wrist.inverse import outward
from vrs_cli.kinematics.transform import IDENTITY, Transform, cross

if TYPE_CHECKING:
    from vrs_cli.kinematics.serial_batch import SerialBatch

_new = tuple.__new__


class SphericalWristArm(FormulaArm):
    """An arm with six joints and a spherical wrist. The methods are those of `arm.RobotArm`."""

    ways = ALL
    method = "closed form, spherical wrist"
    step_names = inverse.STEPS

    def __init__(self, model: RobotModel, geometry: inverse.Geometry) -> None:
        super().__init__(model)
        self.geometry = geometry
        self.forward = make_forward(geometry)
        self.formula = self.branch_joints = inverse.make_branch(geometry)  # type: ignore[method-assign, assignment]
        self._within = inverse.make_within(model.lower, model.upper)
        lower, upper = zip(*self._nearly_limits, strict=True)
        self.limits_ok = inverse.make_within(lower, upper)
        self.reach = bounds.TwoBars(geometry.a2, geometry.forearm, abs(geometry.side))
        self.boundary = self.reach.boundary()
        self.fold = 2, geometry.beta
        self.hand = bounds.Hand(IDENTITY, (0.0, 0.0, -geometry.d6), (0.0, 0.0, 1.0))

    @property
    def constants(self) -> Mapping[str, float]:
        return self.geometry._asdict()

    @cached_property
    def branches(self) -> Callable[[Transform], tuple[Joints | None, ...]]:
        rest = (0.0, 0.0, 0.0, min(max(0.0, self.model.lower[3]), self.model.upper[3]), 0.0, 0.0)
        return every_branch(self.formula, self.middle, rest, inverse.flipped_wrist)

    def configuration(self, q: Joints) -> Configuration:
        return inverse.configuration_of(self.geometry, q)

    def twins(self, q: Joints) -> tuple[Configuration, ...]:
        return () if abs(q[4]) >= WRIST_SINGULAR else (self.configuration(q).other_wrist,)

    def _outside(self, q: Joints) -> tuple[int, ...]:
        return () if self.limits_ok(q) else super()._outside(q)

    def _inside(self, q: Joints, near: Joints) -> Joints | None:
        return q if self._within(q) else super()._inside(q, near)

    def _out_of_reach(self, T: Transform, configuration: Configuration, hint: str) -> LocationOutOfRange:
        return self.reach.refusal(self.clearance(T, configuration), "the wrist", hint)

    # --- clearances --------------------------------------------------------------------------------------

    def clearance(self, T: Transform, configuration: Configuration) -> bounds.Clearance:
        d1, a1, _, _, _, d6, side, _, _ = self.geometry
        x, y, down = T[3] - d6 * T[2], T[7] - d6 * T[6], d1 + d6 * T[10] - T[11]
        shoulder = x * x + y * y - side * side
        outward = -configuration.signs[0] * sqrt(max(shoulder, 0.0)) - a1
        square = (shoulder if a1 == 0.0 else outward * outward) + down * down
        q = self.branch_joints(T, configuration, self.middle)
        outer, inner = self.reach.outer - square, square - self.reach.inner
        if q is None:
            return bounds.Clearance(shoulder, outer, inner)
        s23 = sin(q[1] + q[2])
        forearm = cos(q[0]) * s23, sin(q[0]) * s23, cos(q[1] + q[2])  # direction of the forearm
        return bounds.Clearance(shoulder, outer, inner, abs(sin(q[4])), cross(forearm, (T[2], T[6], T[10])))

    def least_clearance(
        self, a: bounds.Clearance, b: bounds.Clearance, pace: bounds.HandPace, h: float, *, beside_axis: bool = False
    ) -> bounds.Clearance:
        bars = self.reach
        shoulder, turns = bounds.turning_bounds(bars, a.shoulder, b.shoulder, pace, h, beside_axis=beside_axis)
        if turns is not None:
            speed, bend = hypot(turns.outward, pace.speed), hypot(turns.outward_bend, pace.bend)
        if beside_axis or self.geometry.a1 == 0.0:
            outer, inner = bounds.from_shoulder(bars, a, b, pace.speed, pace.bend, h, bars.side * bars.side)
        elif turns is not None:
            outer, inner = bounds.from_shoulder(bars, a, b, speed, bend, h)
        else:
            outer = inner = bounds.UNKNOWN
        if turns is None or outer <= 0.0 or inner <= 0.0:
            return bounds.Clearance(shoulder, outer, inner, bounds.UNKNOWN)
        # joints 2 and 3 turn the upper arm a2 and the forearm: bounds of the wrist centre's velocity and acceleration
        # give bounds of the bars' turning rates and accelerations
        fold = bars.fold(outer, inner)
        upper, fore = speed / (bars.upper * fold), speed / (bars.fore * fold)  # maximum turning rates of both bars
        fore_bend = (bend + bars.upper * upper * upper + bars.fore * fore * fore) / (bars.fore * fold)
        spin = hypot(turns.rate, fore)  # maximum turning rate of the forearm, about two perpendicular axes
        swing = turns.bend + fore_bend + turns.rate * fore + spin * spin
        wrist = bounds.shortest(
            a.across, b.across, spin + pace.tilt, swing + 2.0 * spin * pace.tilt + pace.tilt_bend, h
        )
        return bounds.Clearance(shoulder, outer, inner, wrist)

    def outward(self, q: Joints) -> float:
        return outward(self.geometry, q)

    # --- velocities --------------------------------------------------------------------------------------

    def joint_velocity(
        self,
        q: Joints,
        twist: Twist,
        T_flange_tool: Transform = IDENTITY,
        demands: Demands = (),  # noqa: ARG002 (no redundant joints)
    ) -> Joints:
        """Return the joint rates [rad/s] that give the tool the twist `twist`.

        In a singular pose the tool cannot move in one direction (the lost direction). A twist without a component in
        this direction is solved with joint 1, 3 or 4 at rest; any other twist raises StraightLineSingular with the name
        of the singularity. Near a singular pose the rates are large, so callers must compare them with the limits.

        Joints 1 to 3 move the wrist centre, and joints 4 to 6 turn the hand about it. So the 6x6 Jacobian splits into
        three small systems (Hollerbach and Sahar 1983), each with its own singularity:

            shoulder    wrist centre in the plane through the axis of joint 1        u = 0
            elbow       arm stretched or folded flat                                 sin psi = 0
            wrist       axes of joints 4 and 6 in one line                           sin q5 = 0
        """
        _, a1, a2, a3, d4, d6, side, forearm, _ = self.geometry
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
        if u > bounds.SINGULAR or u < -bounds.SINGULAR:
            qd1 = across / u
        elif -AT_REST < across < AT_REST:
            qd1 = 0.0
        else:
            raise _singular("shoulder", "the wrist is above or below the axis of joint 1")
        out += side * qd1
        stretch = uu * fv - uv * fu  # equals a2 forearm sin psi; 0 if the arm is stretched or folded
        if abs(stretch) > bounds.SINGULAR * a2 * forearm:
            qd2 = (out * fu + down * fv) / stretch
            qd23 = -(out * uu + down * uv) / stretch
        else:
            h, v = uu + fu, uv + fv
            reach = hypot(h, v)
            if reach < bounds.SINGULAR or abs(out * h + down * v) > AT_REST * reach:
                raise _singular("elbow", "the arm is stretched or folded flat")
            qd2 = qd23 = (down * h - out * v) / (reach * reach)
        # subtract the angular velocity contributed by joints 1 to 3; the wrist must provide the rest
        x += s23 * qd1
        y -= qd23
        z -= c23 * qd1
        lost = c4 * x + s4 * y
        qd5 = c4 * y - s4 * x
        if s5 > bounds.ON_BOUNDARY or s5 < -bounds.ON_BOUNDARY:
            qd6 = lost / s5
            return qd1, qd2, qd23 - qd2, z - c5 * qd6, qd5, qd6
        # at a singular wrist joint 4 stays at rest; an angular velocity in the lost direction is refused, because
        # joints 4 and 6 would have to jump
        if -bounds.SINGULAR <= s5 <= bounds.SINGULAR and not -AT_REST < lost < AT_REST:
            raise _singular("wrist", "the axes of joints 4 and 6 are in one line")
        return qd1, qd2, qd23 - qd2, 0.0, qd5, z / c5

    def singularity(self, q: Joints) -> Singularity:
        _, a1, a2, a3, d4, _, _, forearm, _ = self.geometry
        _, q2, q3, _, q5, _ = q
        c23, s23 = cos(q2 + q3), sin(q2 + q3)
        uu, uv = a2 * cos(q2), a2 * sin(q2)
        fu, fv = a3 * c23 + d4 * s23, a3 * s23 - d4 * c23
        stretch = (uu * fv - uv * fu) / (a2 * forearm)
        return Singularity(abs(a1 + uu + fu) / (a1 + a2 + forearm), abs(stretch), abs(sin(q5)))

    # --- arrays ------------------------------------------------------------------------------------------

    @cached_property
    def batch(self) -> SerialBatch:
        from vrs_cli.kinematics.serial_batch import WristBatch  # imported here because it loads numpy

        return WristBatch(self.model, ALL, self.unchanging, over_arrays(self.formula))


def make_forward(geometry: inverse.Geometry) -> Callable[[Joints], Transform]:
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


def _singular(which: str, why: str) -> StraightLineSingular:
    return StraightLineSingular(f"{which}: {why}", "take another path, or go there by MOVE")
