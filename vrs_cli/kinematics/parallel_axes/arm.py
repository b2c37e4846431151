"""The arm whose axes are all parallel; its formulas stand in `parallel_axes.bars`."""

from __future__ import annotations

from cmath import phase, rect
from collections.abc import Callable, Mapping
from functools import cached_property
from math import acos, atan2, cos, sin
from operator import itemgetter
from typing import TYPE_CHECKING

from vrs_cli.errors import LocationOutOfRange, LocationTooClose, LocationTooFar
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.clearance import BOUNDARY, SINGULAR, Clearance, Hand, HandPace, TwoBars, from_shoulder
from vrs_cli.kinematics.joints import SIDES, Configuration, Demands, Joints, Singularity, Steps, Twist, nearest_turn
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.parallel_axes.bars import Bars
from vrs_cli.kinematics.transform import IDENTITY, Transform, at_position, compose, inverse, rotate

if TYPE_CHECKING:
    from vrs_cli.kinematics.serial_batch import SerialBatch

CLEAR = 1e-3  # of the measure of the singularity, from which on the rates are in closed form


class ParallelAxesArm(RobotArm):
    """Documented in `arm.RobotArm`."""

    ways = SIDES
    method = "closed form, all axes parallel"

    def __init__(self, model: RobotModel, bars: Bars) -> None:
        super().__init__(model)
        self.bars = bars
        self._closed_rates = make_rates(bars)
        self.reach = TwoBars(*bars.lengths, 0.0)
        self.boundary = self.reach.boundary()
        centre = rotate(inverse(bars.flange), (-bars.hand.real, -bars.hand.imag, 0.0))
        joint = bars.turns[1]
        self.fold = joint, bars.signs[joint] * (bars.bearings[0] - bars.bearings[1])
        self.hand = Hand(bars.T_plane_base, centre, (0.0, 0.0, 1.0))

    @property
    def constants(self) -> Mapping[str, float]:
        return dict(zip(("l1", "l2"), self.bars.lengths, strict=True))

    def elbow(self, q: Joints) -> float:
        """psi, the angle of the second bar against the first [rad]."""
        joint = self.bars.turns[1]
        return self.bars.signs[joint] * q[joint] + self.bars.bearings[1] - self.bars.bearings[0]

    def configuration(self, q: Joints) -> Configuration:
        return SIDES[sin(self.elbow(q)) * self.bars.up < -SINGULAR]

    def wrist(self, T: Transform) -> tuple[complex, float, float]:
        """Where the second bar ends, the turn of the flange since all joints were 0 [rad], and its rise [m]."""
        bars = self.bars
        seen, zero = compose(bars.T_plane_base, T), bars.flange
        turn = 0.0
        if len(bars.turns) > 2:  # a rotation about z: R = Rz(turn) R_zero
            turn = atan2(
                seen.ny * zero.nx + seen.sy * zero.sx + seen.ay * zero.ax
                - (seen.nx * zero.ny + seen.sx * zero.sy + seen.ax * zero.ay),
                seen.nx * zero.nx + seen.sx * zero.sx + seen.ax * zero.ax
                + (seen.ny * zero.ny + seen.sy * zero.sy + seen.ay * zero.ay),
            )  # fmt: skip
        return complex(seen.px, seen.py) - bars.hand * rect(1.0, turn), turn, seen.pz - zero.pz

    def branch_joints(
        self, T: Transform, configuration: Configuration, near: Joints, steps: Steps | None = None
    ) -> Joints | None:
        if not self.unchanging.allows(T):
            return None
        bars, (l1, l2) = self.bars, self.bars.lengths
        wrist, turn, rise = self.wrist(T)
        k = (abs(wrist) ** 2 - l1 * l1 - l2 * l2) / (2.0 * l1 * l2)
        if steps is not None:
            steps.update(arm=configuration.signs[0] * bars.up, x=wrist.real, y=wrist.imag, turn=turn, rise=rise, k=k)
        if not -1.0 < k < 1.0:
            if not -1.0 - BOUNDARY < k < 1.0 + BOUNDARY:
                return None
            k = 1.0 if k > 0.0 else -1.0
        psi = acos(k) * configuration.signs[0] * bars.up
        i1, i2, *i3 = bars.turns
        q = list(near)
        if abs(wrist) > SINGULAR:  # else joint 1 may stand anywhere: it stays
            q[i1] = bars.signs[i1] * (phase(wrist) - phase(l1 + l2 * rect(1.0, psi)) - self.bars.bearings[0])
        q[i2] = bars.signs[i2] * (psi - self.bars.bearings[1] + self.bars.bearings[0])
        for i in i3:
            q[i] = bars.signs[i] * (turn - bars.signs[i1] * q[i1] - bars.signs[i2] * q[i2])
        for i in bars.slides:
            q[i] = bars.signs[i] * rise
        for i in bars.turns:
            q[i] = nearest_turn(q[i], near[i])
        if steps is not None:
            first = phase(wrist) - phase(l1 + l2 * rect(1.0, psi)) if abs(wrist) > SINGULAR else 0.0
            steps.update(psi=psi, m=l1 + l2 * k, t=l2 * sin(psi), first=first)
        return tuple(q)

    def joint_velocity(
        self, q: Joints, twist: Twist, T_flange_tool: Transform = IDENTITY, demands: Demands = ()
    ) -> Joints:
        found = self._closed_rates(q, twist, T_flange_tool)
        return super().joint_velocity(q, twist, T_flange_tool, demands) if found is None else found

    def _out_of_reach(self, T: Transform, configuration: Configuration, hint: str) -> LocationOutOfRange:  # noqa: ARG002
        far, (l1, l2) = abs(self.wrist(T)[0]), self.bars.lengths
        where = f"the arm would have to reach {1000 * far:.1f} mm, "
        if far > l1 + l2:
            right = f"move the location {1000 * (far - l1 - l2):.1f} mm nearer"
            return LocationTooFar(where + f"it reaches {1000 * (l1 + l2):.1f} mm", right, value=far, upper=l1 + l2)
        least = abs(l1 - l2)
        right = f"move the location {1000 * (least - far):.1f} mm away"
        what = where + f"folded it comes no nearer than {1000 * least:.1f} mm"
        return LocationTooClose(what, right, value=far, lower=least)

    def clearance(self, T: Transform, configuration: Configuration) -> Clearance:  # noqa: ARG002 (the same in both)
        square = abs(self.wrist(T)[0]) ** 2
        return Clearance(outer=self.reach.outer - square, inner=square - self.reach.inner)

    def least_clearance(
        self,
        a: Clearance,
        b: Clearance,
        pace: HandPace,
        h: float,
        *,
        beside_axis: bool = False,  # noqa: ARG002 (on axis 1)
    ) -> Clearance:
        outer, inner = from_shoulder(self.reach, a, b, pace.across, pace.across_bend, h)
        return Clearance(outer=outer, inner=inner)

    def singularity(self, q: Joints) -> Singularity:
        return Singularity(1.0, abs(sin(self.elbow(q))), 1.0)

    @cached_property
    def batch(self) -> SerialBatch:
        from vrs_cli.kinematics.parallel_axes.batch import ParallelAxesBatch  # here: it brings numpy

        return ParallelAxesBatch(self.model, self.unchanging, self.bars)


def make_rates(bars: Bars) -> Callable[[Joints, Twist, Transform], Joints | None]:
    """Joint rates [rad/s, m/s] for a twist of a tool.

    None next to a singular pose, and for a tip that the arm turns as it goes.
    The wrist goes as both bars turn, each at its rate: v = i (w1 bar1 + w2 bar2), as complex numbers in their plane.
    """
    (l1, l2), (b1, b2), plane, flange = bars.lengths, bars.bearings, bars.T_plane_base, bars.flange
    level = at_position(plane, 0.0, 0.0, 0.0) == IDENTITY
    i1, i2, *i3 = bars.turns
    third, signs = (*i3, i2)[0], bars.signs
    s1, s2, s3, s4 = signs[i1], signs[i2], signs[third], signs[(*bars.slides, i1)[0]]
    places = dict(zip(bars.turns, range(3), strict=False)) | dict.fromkeys(bars.slides, 3)
    in_order = itemgetter(*(places[i] for i in range(len(places))))
    near = CLEAR * l1 * l2

    def rates(q: Joints, twist: Twist, T_flange_tool: Transform) -> Joints | None:
        px, py, pz = T_flange_tool[3], T_flange_tool[7], T_flange_tool[11]
        tx = bars.hand.real + (flange[0] * px + flange[1] * py + flange[2] * pz)
        ty = bars.hand.imag + (flange[4] * px + flange[5] * py + flange[6] * pz)
        a1 = s1 * q[i1]
        a2 = a1 + s2 * q[i2]
        x1, y1, x2, y2 = l1 * cos(a1 + b1), l1 * sin(a1 + b1), l2 * cos(a2 + b2), l2 * sin(a2 + b2)
        across = x1 * y2 - y1 * x2
        if -near < across < near or ((tx or ty) and not i3):
            return None
        x, y, rise, _, _, turn = twist if level else (*rotate(plane, twist[:3]), *rotate(plane, twist[3:]))
        if i3:
            a3 = a2 + s3 * q[third]
            c, s = cos(a3), sin(a3)
            x, y = x + turn * (c * ty + s * tx), y - turn * (c * tx - s * ty)
        w1 = (x * x2 + y * y2) / across
        w2 = -(x * x1 + y * y1) / across
        found: Joints = in_order((s1 * w1, s2 * (w2 - w1), s3 * (turn - w2), s4 * rise))
        return found

    return rates
