"""The arm of six joints without a common point of the wrist; its formulas stand in `offset_wrist.offsets`."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from math import acos, atan2, cos, hypot, sin, sqrt
from typing import TYPE_CHECKING

from vrs_cli.errors import LocationOutOfRange
from vrs_cli.kinematics.arm import RobotArm, turned_near
from vrs_cli.kinematics.clearance import (
    BOUNDARY,
    SINGULAR,
    UNKNOWN,
    Clearance,
    Hand,
    Pace,
    TwoBars,
    beside_axis,
    from_shoulder,
    shortest,
    turning,
)
from vrs_cli.kinematics.configuration import ALL, WRIST_SINGULAR, Configuration
from vrs_cli.kinematics.jacobian import Demands, Singularity, Twist
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.offset_wrist.offsets import Offsets
from vrs_cli.kinematics.offset_wrist.rates import joint_velocity
from vrs_cli.kinematics.transform import IDENTITY, Transform, cross

if TYPE_CHECKING:
    from vrs_cli.kinematics.serial_batch import SerialBatch

# where joint 4 is seen from joint 2, the angle between that and the first bar, joint 3, the sum of joints 2 to 4 [rad]
Bars = tuple[float, float, float, float]


class OffsetWristArm(RobotArm):
    """Documented in `arm.RobotArm`; the links are those of `offsets`."""

    ways = ALL
    method = "closed form, joints 2 to 4 parallel"

    def __init__(self, model: RobotModel, offsets: Offsets) -> None:
        super().__init__(model)
        self.offsets = offsets
        self.reach = TwoBars(offsets.a2, offsets.a3, abs(offsets.side))
        self.boundary = self.reach.boundary()
        self.fold = 2, 0.0
        self.hand = Hand(IDENTITY, (0.0, 0.0, -offsets.d6), (0.0, 0.0, 1.0))

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
        return () if abs(sin(q[4])) >= WRIST_SINGULAR else (self.configuration(q).flipped,)

    def branch_joints(self, T: Transform, configuration: Configuration, near: Joints) -> Joints | None:
        arm, elbow, wrist = configuration.signs
        forward = arm * self.offsets.right
        shoulder = self._shoulder(T, forward, near[0])
        if shoulder is None:
            return None
        q1, c1, s1 = shoulder
        q5, q6, *plane = self._wrist(T, c1, s1, wrist, near[5])
        bars = self._bars(plane)
        return None if bars is None else turned_near((q1, *folded(bars, -elbow * forward), q5, q6), near)

    def branches(self, T: Transform) -> tuple[Joints | None, ...]:
        near, found = self._middle, list[Joints | None]()
        for arm in (1.0, -1.0):
            forward = arm * self.offsets.right
            shoulder = self._shoulder(T, forward, near[0])
            if shoulder is None:
                found += (None,) * 4
                continue
            q1, c1, s1 = shoulder
            wrists = [self._wrist(T, c1, s1, wrist, near[5]) for wrist in (1.0, -1.0)]
            solved = [(q5, q6, self._bars(plane)) for q5, q6, *plane in wrists]
            for elbow in (1.0, -1.0):
                for q5, q6, bars in solved:
                    q = None if bars is None else (q1, *folded(bars, -elbow * forward), q5, q6)
                    found.append(None if q is None else turned_near(q, near))
        return tuple(found)

    def _shoulder(self, T: Transform, forward: float, rest: float) -> tuple[float, float, float] | None:
        """Joint 1, its cosine and its sine; `rest` where it may stand anywhere."""
        _, _, _, side, _, d6, _ = self.offsets
        x, y = T[3] - d6 * T[2], T[7] - d6 * T[6]
        reach2 = x * x + y * y
        outward2 = reach2 - side * side
        if outward2 < -BOUNDARY:
            return None
        outward = forward * sqrt(max(outward2, 0.0))
        if reach2 <= SINGULAR * SINGULAR:
            return rest, cos(rest), sin(rest)
        c1, s1 = (outward * x - side * y) / reach2, (outward * y + side * x) / reach2
        return atan2(s1, c1), c1, s1

    def _wrist(
        self, T: Transform, c1: float, s1: float, wrist: float, rest: float
    ) -> tuple[float, float, float, float, float, float]:
        """Joints 5 and 6; sine and cosine of q2 + q3 + q4; where joint 4 is in the arm's plane, outward and up."""
        nx, sx, ax, px, ny, sy, ay, py, nz, sz, az, pz = T
        d1, _, _, _, d5, d6, _ = self.offsets
        n, s = nx * s1 - ny * c1, sx * s1 - sy * c1  # n . y, s . y
        s5 = hypot(n, s)
        c5 = ax * s1 - ay * c1
        q6 = atan2(-s * wrist, n * wrist) if s5 > SINGULAR else rest
        s5 *= wrist
        c6, s6 = cos(q6), sin(q6)
        u, v = c5 * c6, -c5 * s6  # x axis of frame 4 seen from the flange: (u, v, -s5)
        level = c1 * (nx * u + sx * v - ax * s5) + s1 * (ny * u + sy * v - ay * s5)
        lift = nz * u + sz * v - az * s5
        outward = c1 * (px - d6 * ax) + s1 * (py - d6 * ay) - d5 * lift
        return atan2(s5, c5), q6, lift, level, outward, pz - d6 * az - d1 + d5 * level

    def _bars(self, plane: Sequence[float]) -> Bars | None:
        """From what `_wrist` says of the plane; None where joint 4 is out of reach."""
        lift, level, h, v = plane
        _, a2, a3, _, _, _, _ = self.offsets
        k = (h * h + v * v - a2 * a2 - a3 * a3) / (2.0 * a2 * a3)
        if not -1.0 < k < 1.0:
            if not -1.0 - BOUNDARY < k < 1.0 + BOUNDARY:
                return None
            k = 1.0 if k > 0.0 else -1.0
        return atan2(v, h), atan2(a3 * sqrt((1.0 - k) * (1.0 + k)), a2 + a3 * k), acos(k), atan2(lift, level)

    def joint_velocity(
        self, q: Joints, twist: Twist, T_flange_tool: Transform = IDENTITY, demands: Demands = ()
    ) -> Joints:
        found = joint_velocity(self.offsets, q, twist, T_flange_tool)
        return found or super().joint_velocity(q, twist, T_flange_tool, demands)

    def clearance(self, T: Transform, configuration: Configuration) -> Clearance:
        arm, _, wrist = configuration.signs
        side, d6 = self.offsets.side, self.offsets.d6
        x, y = T[3] - d6 * T[2], T[7] - d6 * T[6]
        shoulder, turned = x * x + y * y - side * side, self._shoulder(T, arm * self.offsets.right, 0.0)
        if turned is None:
            return Clearance(shoulder)
        _, c1, s1 = turned
        q5, _, _, _, h, v = self._wrist(T, c1, s1, wrist, 0.0)
        square, across = h * h + v * v, cross((s1, -c1, 0.0), (T[2], T[6], T[10]))
        return Clearance(shoulder, self.reach.outer - square, square - self.reach.inner, abs(sin(q5)), across)

    def least_clearance(self, a: Clearance, b: Clearance, pace: Pace, h: float) -> Clearance:
        """Joint 4 is at o - d5 z, with o the wrist's centre and z along y x a, which is as long as sin q5."""
        shoulder, far = beside_axis(self.reach, a.shoulder, b.shoulder, pace, h)
        if shoulder <= 0.0:
            return Clearance(shoulder, UNKNOWN, UNKNOWN, UNKNOWN)
        turns = turning(sqrt(shoulder), far, self.reach.side, pace)
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
    def _batch(self) -> SerialBatch:
        from vrs_cli.kinematics.offset_wrist.batch import OffsetWristBatch  # here: it brings numpy

        return OffsetWristBatch(self.model, self.offsets)

    def singularity(self, q: Joints) -> Singularity:
        g = self.offsets
        return Singularity(abs(self._outward(q)) / (g.a2 + g.a3 + abs(g.d5)), abs(sin(q[2])), abs(sin(q[4])))


def folded(bars: Bars, fold: float) -> tuple[float, float, float]:
    """Joints 2, 3 and 4 with the bars folded to one side or the other."""
    bearing, beside, bend, pitch = bars
    q2, q3 = bearing - fold * beside, fold * bend
    return q2, q3, pitch - q2 - q3
