"""The arm with six joints of which the last three meet in one point, as the PUMA 560.

Formulas: `spherical_wrist.geometry`, `forward`, `inverse`, `rates`, `accelerations`.
"""

from __future__ import annotations

from functools import cached_property
from math import cos, hypot, sin, sqrt
from typing import TYPE_CHECKING, NamedTuple

from vrs_cli.errors import LocationOutOfRange, LocationTooClose, LocationTooFar
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.axes import cross
from vrs_cli.kinematics.clearance import (
    UNKNOWN,
    Clearance,
    Hand,
    Pace,
    Turning,
    TwoBars,
    beside_axis,
    from_shoulder,
    shortest,
    turning,
)
from vrs_cli.kinematics.configuration import ALL, WRIST_SINGULAR, Configuration
from vrs_cli.kinematics.jacobian import Jacobian, Singularity, Twist
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.spherical_wrist import accelerations, rates
from vrs_cli.kinematics.spherical_wrist.forward import make_forward
from vrs_cli.kinematics.spherical_wrist.geometry import Geometry, configuration_of, wrist_centre
from vrs_cli.kinematics.spherical_wrist.inverse import make_branch, make_branches, make_outside, make_within
from vrs_cli.kinematics.transform import IDENTITY, Transform

if TYPE_CHECKING:
    from vrs_cli.kinematics.serial_batch import SerialBatch


class Reach(NamedTuple):
    """Where the wrist centre can be, limits of joints left aside [m].

    Between `inner` and `outer` from the axis of joint 2, and no nearer than `axis` to the axis of joint 1.
    """

    outer: float
    inner: float
    axis: float


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
        a2, forearm, side = geometry.a2, geometry.forearm, abs(geometry.side)
        self.bars = TwoBars(a2, forearm, side)
        self.boundary = self.bars.boundary()
        self.hand = Hand(IDENTITY, (0.0, 0.0, -geometry.d6), (0.0, 0.0, 1.0))
        self.reach = Reach(outer=a2 + forearm, inner=abs(a2 - forearm), axis=side)

    def configuration(self, q: Joints) -> Configuration:
        return configuration_of(self.geometry, q)

    def twins(self, q: Joints) -> tuple[Configuration, ...]:
        return () if abs(q[4]) >= WRIST_SINGULAR else (self.configuration(q).flipped,)

    def _inside(self, q: Joints, near: Joints) -> Joints | None:
        return q if self._within(q) else super()._inside(q, near)

    def _out_of_reach(self, T: Transform, configuration: Configuration, hint: str) -> LocationOutOfRange:
        """Too far or too close, in millimetres, for the arm of this configuration."""
        outward, down, across = wrist_centre(self.geometry, T, configuration)
        if across < self.reach.axis:
            return LocationTooClose(
                f"the wrist would be {1000 * across:.1f} mm from the axis of joint 1, "
                f"it cannot come nearer than {1000 * self.reach.axis:.1f} mm",
                hint or f"move the location {1000 * (self.reach.axis - across):.1f} mm away from the axis",
                value=across,
                lower=self.reach.axis,
            )
        far = hypot(outward, down)
        where = f"the wrist would be {1000 * far:.1f} mm from the shoulder, "
        if far > self.reach.outer:
            return LocationTooFar(
                where + f"the arm reaches {1000 * self.reach.outer:.1f} mm",
                hint or f"move the location {1000 * (far - self.reach.outer):.1f} mm nearer",
                value=far,
                upper=self.reach.outer,
            )
        return LocationTooClose(
            where + f"the folded arm comes no nearer than {1000 * self.reach.inner:.1f} mm",
            hint or f"move the location {1000 * (self.reach.inner - far):.1f} mm away",
            value=far,
            lower=self.reach.inner,
        )

    # --- clearances --------------------------------------------------------------------------------------

    def clearance(self, T: Transform, configuration: Configuration) -> Clearance:
        d1, a1, _, _, _, d6, side, _, _ = self.geometry
        x, y, down = T[3] - d6 * T[2], T[7] - d6 * T[6], d1 + d6 * T[10] - T[11]
        shoulder = x * x + y * y - side * side
        outward = -configuration.signs[0] * sqrt(max(shoulder, 0.0)) - a1
        square = (shoulder if a1 == 0.0 else outward * outward) + down * down
        q = self.branch_joints(T, configuration, self._middle)
        outer, inner = self.bars.outer - square, square - self.bars.inner
        if q is None:
            return Clearance(shoulder, outer, inner)
        s23 = sin(q[1] + q[2])
        forearm = cos(q[0]) * s23, sin(q[0]) * s23, cos(q[1] + q[2])  # along the axis of joint 4
        return Clearance(shoulder, outer, inner, abs(sin(q[4])), cross(forearm, (T[2], T[6], T[10])))

    def least_clearance(self, a: Clearance, b: Clearance, pace: Pace, h: float) -> Clearance:
        bars = self.bars
        shoulder, far = beside_axis(bars, a.shoulder, b.shoulder, pace, h)
        turns = turning(sqrt(shoulder), far, bars.side, pace) if shoulder > 0.0 else None
        if self.geometry.a1 == 0.0:
            outer, inner = from_shoulder(bars, a, b, pace.speed, pace.bend, h, bars.side * bars.side)
        elif turns is not None:
            speed, bend = hypot(turns.outward, pace.speed), hypot(turns.outward_bend, pace.bend)
            outer, inner = from_shoulder(bars, a, b, speed, bend, h)
        else:
            outer = inner = UNKNOWN
        if turns is None or outer <= 0.0 or inner <= 0.0:
            return Clearance(shoulder, outer, inner, UNKNOWN)
        return Clearance(shoulder, outer, inner, self._straightest(a, b, turns, bars.fold(outer, inner), pace, h))

    def _straightest(self, a: Clearance, b: Clearance, turns: Turning, fold: float, pace: Pace, h: float) -> float:
        """The least `wrist` between two. Joints 2 and 3 turn the bars as a2 and forearm, square to them, make the
        velocity of the wrist's centre, and their derivatives its acceleration.
        """
        bars = self.bars
        speed, bend = hypot(turns.outward, pace.speed), hypot(turns.outward_bend, pace.bend)
        upper, fore = speed / (bars.upper * fold), speed / (bars.fore * fold)  # greatest rates of both bars
        fore_bend = (bend + bars.upper * upper * upper + bars.fore * fore * fore) / (bars.fore * fold)
        spin = hypot(turns.rate, fore)  # of the forearm, whose axes of turning are square to each other
        swing = turns.bend + fore_bend + turns.rate * fore + spin * spin
        return shortest(a.across, b.across, spin + pace.tilt, swing + 2.0 * spin * pace.tilt + pace.tilt_bend, h)

    # --- velocities --------------------------------------------------------------------------------------

    def jacobian(self, q: Joints, T_flange_tool: Transform = IDENTITY) -> Jacobian:
        return rates.jacobian(self.geometry, q, T_flange_tool)

    def twist(self, q: Joints, qd: Joints, T_flange_tool: Transform = IDENTITY) -> Twist:
        return rates.twist(self.geometry, q, qd, T_flange_tool)

    def joint_velocity(self, q: Joints, twist: Twist, T_flange_tool: Transform = IDENTITY) -> Joints:
        return rates.joint_velocity(self.geometry, q, twist, T_flange_tool)

    def joint_acceleration(self, q: Joints, qd: Joints, rate: Twist, T_flange_tool: Transform = IDENTITY) -> Joints:
        return accelerations.joint_acceleration(self.geometry, q, qd, rate, T_flange_tool)

    def joint_jerk(
        self, q: Joints, qd: Joints, qdd: Joints, rate: Twist, T_flange_tool: Transform = IDENTITY
    ) -> Joints:
        return accelerations.joint_jerk(self.geometry, q, qd, qdd, rate, T_flange_tool)

    def singularity(self, q: Joints) -> Singularity:
        return rates.singularity(self.geometry, q)

    # --- arrays ------------------------------------------------------------------------------------------

    @cached_property
    def _batch(self) -> SerialBatch:
        from vrs_cli.kinematics.spherical_wrist.batch import SphericalWristBatch  # here: it brings numpy

        return SphericalWristBatch(self.model, self.geometry)
