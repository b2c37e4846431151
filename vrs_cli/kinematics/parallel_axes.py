"""Arms whose axes are all parallel: the SCARA and the planar arms of a class, in closed form.

Two bars in the plane square to the axes carry the rest: as complex numbers in that plane, with the first axis at 0,

    wrist = l1 exp(i b1) + l2 exp(i b2),     psi = b2 - b1,     cos psi = (|wrist|^2 - l1^2 - l2^2) / (2 l1 l2).

The wrist is the third axis that turns, or the flange itself where there is none. A third turn makes the angle of the
flange, a joint that slides its height; where along the chain they stand does not matter.

RIGHTY is the arm whose elbow lies to the right of the line from shoulder to wrist, as a right arm's does (psi >= 0);
seen from above, or against the first axis where that is level.
"""

from __future__ import annotations

from cmath import phase, rect
from dataclasses import dataclass
from functools import cached_property
from math import acos, atan2, sin
from typing import TYPE_CHECKING

from vrs_cli.errors import LocationOutOfRange, LocationTooClose, LocationTooFar
from vrs_cli.kinematics.axes import EXACT, Line, any_normal, dot, frame
from vrs_cli.kinematics.clearance import Clearance, Hand, Pace, TwoBars, from_shoulder
from vrs_cli.kinematics.configuration import SIDES, Configuration
from vrs_cli.kinematics.jacobian import Singularity
from vrs_cli.kinematics.joints import JointKind, Joints, nearest_turn
from vrs_cli.kinematics.model import RobotModel, axes_parallel, joint_axes, link_frames
from vrs_cli.kinematics.serial_arm import SerialArm
from vrs_cli.kinematics.spherical_wrist import BOUNDARY, SINGULAR
from vrs_cli.kinematics.task import Task
from vrs_cli.kinematics.transform import Transform, compose, inverse, rotate

if TYPE_CHECKING:
    from vrs_cli.kinematics.serial_batch import ParallelAxesBatch

TASKS = {(2, 0): Task.POINT, (3, 0): Task.PLANE, (3, 1): Task.UPRIGHT, (2, 1): Task.POSITION}  # turning, sliding joints


@dataclass(frozen=True)
class Bars:
    """The arm while all joints are 0, in the plane of the first axis (z up along it).

    `turns` and `slides`: joints by index, `signs` the sense of each; `first` and `second` bar, `hand` from the wrist to
    the flange [m]; `height` of the flange [m].
    """

    T_plane_base: Transform
    turns: tuple[int, ...]
    slides: tuple[int, ...]
    signs: tuple[float, ...]
    first: complex
    second: complex
    hand: complex
    flange: Transform
    up: float


def parallel_axes_arm(model: RobotModel) -> ParallelAxesArm | None:
    """The arm of a model of this kind; None for every other robot."""
    kinds = model.units.kinds
    turns = tuple(i for i, kind in enumerate(kinds) if kind is JointKind.REVOLUTE)
    slides = tuple(i for i, kind in enumerate(kinds) if kind is JointKind.PRISMATIC)
    if TASKS.get((len(turns), len(slides))) is not model.task or not axes_parallel(model):
        return None
    bars = _bars(model, turns, slides)
    return None if min(abs(bars.first), abs(bars.second)) < EXACT else ParallelAxesArm(model, bars)


def _bars(model: RobotModel, turns: tuple[int, ...], slides: tuple[int, ...]) -> Bars:
    axes = joint_axes(model)
    start = axes[turns[0]]
    z = start.direction
    T_plane_base = inverse(frame(any_normal(z), z, start.point))
    flange = compose(T_plane_base, link_frames(model, (0.0,) * model.joint_count)[-1])
    points = [*(_in_plane(T_plane_base, axes[i]) for i in turns), complex(flange.px, flange.py)]
    return Bars(
        T_plane_base=T_plane_base,
        turns=turns,
        slides=slides,
        signs=tuple(1.0 if dot(axis.direction, z) > 0.0 else -1.0 for axis in axes),
        first=points[1] - points[0],
        second=points[2] - points[1],
        hand=points[-1] - points[2],
        flange=flange,
        up=-1.0 if z[2] < -EXACT else 1.0,
    )


def _in_plane(T_plane_base: Transform, axis: Line) -> complex:
    T = compose(T_plane_base, frame(any_normal(axis.direction), axis.direction, axis.point))
    return complex(T.px, T.py)


class ParallelAxesArm(SerialArm):
    """Documented in `arm.RobotArm`."""

    ways = SIDES
    method = "closed form, all axes parallel"

    def __init__(self, model: RobotModel, bars: Bars) -> None:
        super().__init__(model)
        self.bars = bars
        self.lengths = abs(bars.first), abs(bars.second)
        self.bearings = phase(bars.first), phase(bars.second)
        self.reach = TwoBars(*self.lengths, 0.0)
        self.boundary = self.reach.boundary()
        centre = rotate(inverse(bars.flange), (-bars.hand.real, -bars.hand.imag, 0.0))
        self.hand = Hand(bars.T_plane_base, centre, (0.0, 0.0, 1.0))

    def elbow(self, q: Joints) -> float:
        """psi, the angle of the second bar against the first [rad]."""
        joint = self.bars.turns[1]
        return self.bars.signs[joint] * q[joint] + self.bearings[1] - self.bearings[0]

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

    def branch_joints(self, T: Transform, configuration: Configuration, near: Joints) -> Joints | None:
        if not self.in_task(T):
            return None
        bars, (l1, l2) = self.bars, self.lengths
        wrist, turn, rise = self.wrist(T)
        k = (abs(wrist) ** 2 - l1 * l1 - l2 * l2) / (2.0 * l1 * l2)
        if not -1.0 < k < 1.0:
            if not -1.0 - BOUNDARY < k < 1.0 + BOUNDARY:
                return None
            k = 1.0 if k > 0.0 else -1.0
        psi = acos(k) * configuration.signs[0] * bars.up
        i1, i2, *i3 = bars.turns
        q = list(near)
        if abs(wrist) > SINGULAR:  # else joint 1 may stand anywhere: it stays
            q[i1] = bars.signs[i1] * (phase(wrist) - phase(l1 + l2 * rect(1.0, psi)) - self.bearings[0])
        q[i2] = bars.signs[i2] * (psi - self.bearings[1] + self.bearings[0])
        for i in i3:
            q[i] = bars.signs[i] * (turn - bars.signs[i1] * q[i1] - bars.signs[i2] * q[i2])
        for i in bars.slides:
            q[i] = bars.signs[i] * rise
        for i in bars.turns:
            q[i] = nearest_turn(q[i], near[i])
        return tuple(q)

    def _out_of_reach(self, T: Transform, configuration: Configuration, hint: str) -> LocationOutOfRange:  # noqa: ARG002
        far, (l1, l2) = abs(self.wrist(T)[0]), self.lengths
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

    def least_clearance(self, a: Clearance, b: Clearance, pace: Pace, h: float) -> Clearance:
        outer, inner = from_shoulder(self.reach, a, b, pace.across, pace.across_bend, h)
        return Clearance(outer=outer, inner=inner)

    def singularity(self, q: Joints) -> Singularity:
        return Singularity(1.0, abs(sin(self.elbow(q))), 1.0)

    @cached_property
    def _batch(self) -> ParallelAxesBatch:
        from vrs_cli.kinematics.serial_batch import ParallelAxesBatch

        return ParallelAxesBatch(self)
