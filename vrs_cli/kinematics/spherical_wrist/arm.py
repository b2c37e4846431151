"""Solve arms with six joints whose last three axes meet in one point, such as the PUMA 560.

The formulas are explained in `spherical_wrist.inverse`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property
from math import cos, hypot, sin, sqrt
from typing import TYPE_CHECKING

from vrs_cli.errors import LocationOutOfRange
from vrs_cli.kinematics import clearance as bounds
from vrs_cli.kinematics.arm import Branch, FormulaArm
from vrs_cli.kinematics.joints import ALL, WRIST_SINGULAR, Configuration, Joints, Singularity
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.spherical_wrist import inverse
from vrs_cli.kinematics.spherical_wrist.inverse import outward
from vrs_cli.kinematics.transform import IDENTITY, Transform, cross

if TYPE_CHECKING:
    from vrs_cli.kinematics.serial_batch import SerialBatch


class SphericalWristArm(FormulaArm):
    """An arm with six joints and a spherical wrist. The methods are those of `arm.RobotArm`."""

    ways = ALL
    method = "closed form, spherical wrist"
    step_names = inverse.STEPS

    def __init__(self, model: RobotModel, geometry: inverse.Geometry) -> None:
        super().__init__(model)
        self.geometry = geometry
        self.forward = inverse.make_forward(geometry)
        self.joint_velocity = inverse.make_joint_velocity(geometry)  # type: ignore[method-assign]
        self.branch_joints = inverse.make_branch(geometry)  # type: ignore[method-assign, assignment]
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
    def formula(self) -> Branch:  # type: ignore[override]
        from vrs_cli.kinematics.formula import interpreted  # imported here because motions of joints do not need it

        formula: Branch = interpreted(inverse.make_branch)(self.geometry)
        return formula

    @cached_property
    def branches(self) -> Callable[[Transform], tuple[Joints | None, ...]]:
        from vrs_cli.kinematics.formula import every_branch, interpreted

        rest = (0.0, 0.0, 0.0, min(max(0.0, self.model.lower[3]), self.model.upper[3]), 0.0, 0.0)
        return every_branch(self.formula, self.middle, rest, interpreted(inverse.flipped_wrist))

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
        from vrs_cli.kinematics.formula import over_arrays
        from vrs_cli.kinematics.serial_batch import WristBatch  # imported here because it loads numpy

        return WristBatch(self.model, ALL, self.unchanging, over_arrays(self.formula))
