"""The arm with six joints of which the last three meet in one point, as the PUMA 560.

Formulas: `spherical_wrist.geometry`, `forward`, `inverse`, `rates`.
"""

from __future__ import annotations

from functools import cached_property
from math import cos, hypot, sin, sqrt
from typing import TYPE_CHECKING

from vrs_cli.errors import LocationOutOfRange
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.clearance import (
    UNKNOWN,
    Clearance,
    Hand,
    HandPace,
    Turning,
    TwoBars,
    from_axis,
    from_shoulder,
    shortest,
    turning,
    turning_beside_axis,
)
from vrs_cli.kinematics.configuration import ALL, WRIST_SINGULAR, Configuration
from vrs_cli.kinematics.jacobian import Demands, Singularity, Twist
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.spherical_wrist import rates
from vrs_cli.kinematics.spherical_wrist.forward import make_forward
from vrs_cli.kinematics.spherical_wrist.geometry import Geometry, configuration_of, outward
from vrs_cli.kinematics.spherical_wrist.inverse import make_branch, make_branches, make_outside, make_within
from vrs_cli.kinematics.transform import IDENTITY, Transform, cross

if TYPE_CHECKING:
    from vrs_cli.kinematics.serial_batch import SerialBatch


class SphericalWristArm(RobotArm):
    """Documented in `arm.RobotArm`."""

    ways = ALL
    method = "closed form, spherical wrist"

    def __init__(self, model: RobotModel, geometry: Geometry) -> None:
        super().__init__(model)
        self.geometry = geometry
        self.forward = make_forward(geometry)
        self.branches = make_branches(geometry, model)  # type: ignore[method-assign, assignment] # written out, for speed
        self.branch_joints = make_branch(geometry)  # type: ignore[method-assign, assignment]
        self._outside = make_outside(model)  # type: ignore[method-assign, assignment]
        self._within = make_within(model)
        self.reach = TwoBars(geometry.a2, geometry.forearm, abs(geometry.side))
        self.boundary = self.reach.boundary()
        self.fold = 2, geometry.beta
        self.hand = Hand(IDENTITY, (0.0, 0.0, -geometry.d6), (0.0, 0.0, 1.0))

    def configuration(self, q: Joints) -> Configuration:
        return configuration_of(self.geometry, q)

    def twins(self, q: Joints) -> tuple[Configuration, ...]:
        return () if abs(q[4]) >= WRIST_SINGULAR else (self.configuration(q).flipped,)

    def _inside(self, q: Joints, near: Joints) -> Joints | None:
        return q if self._within(q) else super()._inside(q, near)

    def _out_of_reach(self, T: Transform, configuration: Configuration, hint: str) -> LocationOutOfRange:
        return self.reach.refusal(self.clearance(T, configuration), "the wrist", hint)

    # --- clearances --------------------------------------------------------------------------------------

    def clearance(self, T: Transform, configuration: Configuration) -> Clearance:
        d1, a1, _, _, _, d6, side, _, _ = self.geometry
        x, y, down = T[3] - d6 * T[2], T[7] - d6 * T[6], d1 + d6 * T[10] - T[11]
        shoulder = x * x + y * y - side * side
        outward = -configuration.signs[0] * sqrt(max(shoulder, 0.0)) - a1
        square = (shoulder if a1 == 0.0 else outward * outward) + down * down
        q = self.branch_joints(T, configuration, self._middle)
        outer, inner = self.reach.outer - square, square - self.reach.inner
        if q is None:
            return Clearance(shoulder, outer, inner)
        s23 = sin(q[1] + q[2])
        forearm = cos(q[0]) * s23, sin(q[0]) * s23, cos(q[1] + q[2])  # along the axis of joint 4
        return Clearance(shoulder, outer, inner, abs(sin(q[4])), cross(forearm, (T[2], T[6], T[10])))

    def least_clearance(
        self, a: Clearance, b: Clearance, pace: HandPace, h: float, *, beside_axis: bool = False
    ) -> Clearance:
        bars = self.reach
        shoulder, far = from_axis(bars, a.shoulder, b.shoulder, pace, h)
        turns = turning(sqrt(shoulder), far, bars.side, pace) if shoulder > 0.0 else None
        if beside_axis:
            turns = turning_beside_axis(bars.side, pace)
        if beside_axis or self.geometry.a1 == 0.0:
            outer, inner = from_shoulder(bars, a, b, pace.speed, pace.bend, h, bars.side * bars.side)
        elif turns is not None:
            speed, bend = hypot(turns.outward, pace.speed), hypot(turns.outward_bend, pace.bend)
            outer, inner = from_shoulder(bars, a, b, speed, bend, h)
        else:
            outer = inner = UNKNOWN
        if turns is None or outer <= 0.0 or inner <= 0.0:
            return Clearance(shoulder, outer, inner, UNKNOWN)
        return Clearance(shoulder, outer, inner, self._straightest(a, b, turns, bars.fold(outer, inner), pace, h))

    def _straightest(self, a: Clearance, b: Clearance, turns: Turning, fold: float, pace: HandPace, h: float) -> float:
        """The least `wrist` between two. Joints 2 and 3 turn the bars as a2 and forearm, square to them, make the
        velocity of the wrist's centre, and their derivatives its acceleration.
        """
        bars = self.reach
        speed, bend = hypot(turns.outward, pace.speed), hypot(turns.outward_bend, pace.bend)
        upper, fore = speed / (bars.upper * fold), speed / (bars.fore * fold)  # greatest rates of both bars
        fore_bend = (bend + bars.upper * upper * upper + bars.fore * fore * fore) / (bars.fore * fold)
        spin = hypot(turns.rate, fore)  # of the forearm, whose axes of turning are square to each other
        swing = turns.bend + fore_bend + turns.rate * fore + spin * spin
        return shortest(a.across, b.across, spin + pace.tilt, swing + 2.0 * spin * pace.tilt + pace.tilt_bend, h)

    def outward(self, q: Joints) -> float:
        return outward(self.geometry, q)

    # --- velocities --------------------------------------------------------------------------------------

    def joint_velocity(
        self,
        q: Joints,
        twist: Twist,
        T_flange_tool: Transform = IDENTITY,
        demands: Demands = (),  # noqa: ARG002 (no joint is too many)
    ) -> Joints:
        return rates.joint_velocity(self.geometry, q, twist, T_flange_tool)

    def singularity(self, q: Joints) -> Singularity:
        return rates.singularity(self.geometry, q)

    # --- arrays ------------------------------------------------------------------------------------------

    @cached_property
    def batch(self) -> SerialBatch:
        from vrs_cli.kinematics.spherical_wrist.batch import SphericalWristBatch  # here: it brings numpy

        return SphericalWristBatch(self.model, self.geometry)
