"""The arm of six joints without a common point of the wrist; its formulas stand in `offset_wrist.inverse`."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from math import cos, sin, sqrt
from typing import TYPE_CHECKING

from vrs_cli.errors import LocationOutOfRange
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.clearance import (
    BOUNDARY,
    SINGULAR,
    UNKNOWN,
    Clearance,
    Hand,
    HandPace,
    TwoBars,
    from_axis,
    from_shoulder,
    shortest,
    turning,
    turning_beside_axis,
)
from vrs_cli.kinematics.joints import ALL, WRIST_SINGULAR, Configuration, Demands, Joints, Singularity, Twist
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.offset_wrist.inverse import Offsets, make_branch, make_branches
from vrs_cli.kinematics.transform import IDENTITY, Transform, cross, length

if TYPE_CHECKING:
    from vrs_cli.kinematics.serial_batch import SerialBatch

CLEAR = 1e-3  # of the measures of singularities, from which on the rates are these


class OffsetWristArm(RobotArm):
    """Documented in `arm.RobotArm`; the links are those of `inverse`."""

    ways = ALL
    method = "closed form, joints 2 to 4 parallel"

    def __init__(self, model: RobotModel, offsets: Offsets) -> None:
        super().__init__(model)
        self.offsets = offsets
        self.branches = make_branches(offsets, self.middle)  # type: ignore[method-assign, assignment] # as on a PUMA
        self.branch_joints = make_branch(offsets)  # type: ignore[method-assign]
        self.reach = TwoBars(offsets.a2, offsets.a3, abs(offsets.side))
        self.boundary = self.reach.boundary()
        self.fold = 2, 0.0
        self.hand = Hand(IDENTITY, (0.0, 0.0, -offsets.d6), (0.0, 0.0, 1.0))

    @property
    def constants(self) -> Mapping[str, float]:
        return self.offsets._asdict()

    def configuration(self, q: Joints) -> Configuration:
        g = self.offsets
        outward = self._outward(q)
        lefty = outward * g.right < -SINGULAR
        forward = -1.0 if outward < -SINGULAR or (abs(outward) <= SINGULAR and g.right < 0.0) else 1.0
        below = sin(q[2]) * forward > SINGULAR
        return ALL[4 * lefty + 2 * below + (sin(q[4]) < -SINGULAR)]

    def outward(self, q: Joints) -> float:
        return -self.offsets.right * self._outward(q)

    def _outward(self, q: Joints) -> float:
        """Of the origin of frame 5 in the arm's plane, from the axis of joint 1 [m]."""
        _, q2, q3, q4, _, _ = q
        g = self.offsets
        return g.a2 * cos(q2) + g.a3 * cos(q2 + q3) + g.d5 * sin(q2 + q3 + q4)

    def twins(self, q: Joints) -> tuple[Configuration, ...]:
        return () if abs(sin(q[4])) >= WRIST_SINGULAR else (self.configuration(q).other_wrist,)

    def joint_velocity(
        self, q: Joints, twist: Twist, T_flange_tool: Transform = IDENTITY, demands: Demands = ()
    ) -> Joints:
        """In closed form, but for poses next to a singular one.

        Joints 1 to 4 alone move the point where axes 5 and 6 meet; joint 1 alone moves it across the plane of the arm.
        The rest of the turn has three parts: about the normal of the plane, which joints 2 to 4 make together; about
        axis 5; and about the third direction, X of frame 4, which joint 6 alone makes. So joint 4 moves as a planar arm
        of two bars brings it.
        """
        _, a2, a3, side, d5, d6, _ = self.offsets
        q1, q2, q3, q4, q5, q6 = q
        c1, s1, c5, s5, s3 = cos(q1), sin(q1), cos(q5), sin(q5), sin(q3)
        c23, s23 = cos(q2 + q3), sin(q2 + q3)
        c, s = cos(q2 + q3 + q4), sin(q2 + q3 + q4)
        h, v = a2 * cos(q2) + a3 * c23, a2 * sin(q2) + a3 * s23  # joint 4 from joint 2, outward and up
        outward = h + d5 * s
        if -CLEAR < s3 < CLEAR or -CLEAR < s5 < CLEAR or abs(outward) < CLEAR * (a2 + a3 + abs(d5)):
            return super().joint_velocity(q, twist, T_flange_tool, demands)
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

    def clearance(self, T: Transform, configuration: Configuration) -> Clearance:
        """Joint 4 is at o - d5 z, with o the wrist's centre and z along y x a, which is as long as sin q5."""
        d1, _, _, side, d5, d6, right = self.offsets
        arm, _, wrist = configuration.signs
        x, y = T[3] - d6 * T[2], T[7] - d6 * T[6]
        reach2 = x * x + y * y
        shoulder = reach2 - side * side
        if shoulder < -BOUNDARY:
            return Clearance(shoulder)
        outward, c1, s1 = arm * right * sqrt(max(shoulder, 0.0)), 1.0, 0.0
        if reach2 > SINGULAR * SINGULAR:
            c1, s1 = (outward * x - side * y) / reach2, (outward * y + side * x) / reach2
        across = cross((s1, -c1, 0.0), (T[2], T[6], T[10]))
        s5 = length(across)
        away = d5 * wrist / s5 if s5 > SINGULAR else 0.0
        h = c1 * x + s1 * y - away * (c1 * across[0] + s1 * across[1])
        v = T[11] - d6 * T[10] - d1 - away * across[2]
        square = h * h + v * v
        return Clearance(shoulder, self.reach.outer - square, square - self.reach.inner, s5, across)

    def least_clearance(
        self, a: Clearance, b: Clearance, pace: HandPace, h: float, *, beside_axis: bool = False
    ) -> Clearance:
        shoulder, far = from_axis(self.reach, a.shoulder, b.shoulder, pace, h)
        if beside_axis:
            turns = turning_beside_axis(self.reach.side, pace)
        elif shoulder > 0.0:
            turns = turning(sqrt(shoulder), far, self.reach.side, pace)
        else:
            return Clearance(shoulder, UNKNOWN, UNKNOWN, UNKNOWN)
        rate = pace.tilt + turns.rate
        change = turns.bend + turns.rate * (turns.rate + 2.0 * pace.tilt) + pace.tilt_bend
        wrist = shortest(a.across, b.across, rate, change, h)
        if wrist <= 0.0:
            return Clearance(shoulder, UNKNOWN, UNKNOWN, wrist)
        swing, swing_bend = (
            rate / wrist,
            change / wrist + 3.0 * (rate / wrist) ** 2,
        )  # of z, a vector made of length one
        d5, beside = abs(self.offsets.d5), self.reach.side * self.reach.side
        speed, bend = pace.speed + d5 * swing, pace.bend + d5 * swing_bend
        return Clearance(shoulder, *from_shoulder(self.reach, a, b, speed, bend, h, beside), wrist)

    def _out_of_reach(self, T: Transform, configuration: Configuration, hint: str) -> LocationOutOfRange:
        return self.reach.refusal(self.clearance(T, configuration), "joint 4", hint)

    @cached_property
    def batch(self) -> SerialBatch:
        from vrs_cli.kinematics.offset_wrist.batch import OffsetWristBatch  # here: it brings numpy

        return OffsetWristBatch(self.model, self.offsets)

    def singularity(self, q: Joints) -> Singularity:
        g = self.offsets
        return Singularity(abs(self._outward(q)) / (g.a2 + g.a3 + abs(g.d5)), abs(sin(q[2])), abs(sin(q[4])))
