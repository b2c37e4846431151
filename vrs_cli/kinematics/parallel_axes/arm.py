"""Solve arms whose axes are all parallel (SCARA and planar arms) in closed form.

Two bars of lengths l1 and l2, at the angles b1 and b2, move in the plane perpendicular to the axes. Points of this
plane are complex numbers, and the first axis is at 0:

    wrist = l1 exp(i b1) + l2 exp(i b2),     psi = b2 - b1,     cos psi = (|wrist|^2 - l1^2 - l2^2) / (2 l1 l2).

The wrist is the third turning axis, or the flange if there is no such axis. The third turning joint sets the angle of
the flange, and a sliding joint its height; their order in the chain does not matter.

The arm is RIGHTY if its elbow is to the right of the line from shoulder to wrist (psi >= 0), like that of a person's
right arm. The view is from above, or against the direction of a horizontal first axis.
"""

from __future__ import annotations

from cmath import phase
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from math import acos, atan2, copysign, cos, sin
from operator import itemgetter

from vrs_cli.errors import LocationOutOfRange
from vrs_cli.kinematics.arm import Branch, FormulaArm
from vrs_cli.kinematics.clearance import BOUNDARY, SINGULAR, Clearance, Hand, HandPace, TwoBars, from_shoulder
from vrs_cli.kinematics.joints import SIDES, Configuration, Demands, JointKind, Joints, Singularity, Twist, nearest_turn
from vrs_cli.kinematics.model import EXACT, ArmTask, RobotModel, frame, joint_axes, link_frames
from vrs_cli.kinematics.transform import IDENTITY, Transform, any_normal, at_position, compose, dot, inverse, rotate

TASKS = {
    (2, 0): ArmTask.POINT,
    (3, 0): ArmTask.PLANE,
    (3, 1): ArmTask.UPRIGHT,
    (2, 1): ArmTask.POSITION,
}  # key: number of turning joints, number of sliding joints


@dataclass(frozen=True)
class Bars:
    """The dimensions of the arm while all joints are 0, in a frame whose z axis is the first axis (`T_plane_base`).

    `turns`, `slides`: the indexes of the joints that turn and of those that slide. `signs`: -1.0 if a joint's positive
    direction is opposite to the first axis, else 1.0. `first`, `second`: the two bars as complex numbers; `hand`: the
    vector from the wrist to the flange [m]. `up`: -1.0 if the first axis points down, else 1.0.
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

    @cached_property
    def lengths(self) -> tuple[float, float]:
        return abs(self.first), abs(self.second)

    @cached_property
    def bearings(self) -> tuple[float, float]:
        return phase(self.first), phase(self.second)


def bars_of(model: RobotModel) -> Bars | None:
    """Return the dimensions of a model whose axes are all parallel; None for other models."""
    kinds = model.units.kinds
    turns = tuple(i for i, kind in enumerate(kinds) if kind is JointKind.REVOLUTE)
    slides = tuple(i for i, kind in enumerate(kinds) if kind is JointKind.PRISMATIC)
    if TASKS.get((len(turns), len(slides))) is not model.task:
        return None
    axes = joint_axes(model)
    start = axes[turns[0]]
    z = start.direction
    T_plane_base = inverse(frame(any_normal(z), z, start.point))
    if any(max(map(abs, rotate(T_plane_base, axis.direction)[:2])) >= EXACT for axis in axes):
        return None  # not all axes are parallel
    flange = compose(T_plane_base, link_frames(model, (0.0,) * model.joint_count)[-1])
    turning = (axes[i] for i in turns)
    across = [compose(T_plane_base, frame(any_normal(a.direction), a.direction, a.point)) for a in turning]
    points = [complex(T.px, T.py) for T in (*across, flange)]
    bars = Bars(
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
    return None if min(bars.lengths) < EXACT else bars


STEPS = (
    "arm",
    "x",
    "y",
    "turn",
    "rise",
    "k",
    "psi",
    "m",
    "t",
    "first",
)  # variables of the formula in `make_branch` that `render/symbols.py` shows to users


class ParallelAxesArm(FormulaArm):
    """An arm whose axes are all parallel. The methods are those of `arm.RobotArm`."""

    ways = SIDES
    method = "closed form, all axes parallel"
    step_names = STEPS

    def __init__(self, model: RobotModel, bars: Bars) -> None:
        super().__init__(model)
        self.bars = bars
        self.wrist, self._closed_rates = make_wrist(bars), make_rates(bars)
        self.formula = make_branch(bars, self.wrist)
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
        """Return psi, the angle from the first bar to the second [rad]."""
        joint = self.bars.turns[1]
        return self.bars.signs[joint] * q[joint] + self.bars.bearings[1] - self.bars.bearings[0]

    def configuration(self, q: Joints) -> Configuration:
        return SIDES[sin(self.elbow(q)) * self.bars.up < -SINGULAR]

    def branch_joints(self, T: Transform, configuration: Configuration, near: Joints) -> Joints | None:
        return self.formula(T, configuration, near) if self.unchanging.allows(T) else None

    def joint_velocity(
        self, q: Joints, twist: Twist, T_flange_tool: Transform = IDENTITY, demands: Demands = ()
    ) -> Joints:
        found = self._closed_rates(q, twist, T_flange_tool)
        return super().joint_velocity(q, twist, T_flange_tool, demands) if found is None else found

    def _out_of_reach(self, T: Transform, configuration: Configuration, hint: str) -> LocationOutOfRange:
        return self.reach.refusal(self.clearance(T, configuration), "the wrist", hint)

    def clearance(self, T: Transform, configuration: Configuration) -> Clearance:  # noqa: ARG002 (same in both)
        square = abs(complex(*self.wrist(T)[:2])) ** 2
        return Clearance(outer=self.reach.outer - square, inner=square - self.reach.inner)

    def least_clearance(
        self,
        a: Clearance,
        b: Clearance,
        pace: HandPace,
        h: float,
        *,
        beside_axis: bool = False,  # noqa: ARG002 (the shoulder is on axis 1)
    ) -> Clearance:
        outer, inner = from_shoulder(self.reach, a, b, pace.across, pace.across_bend, h)
        return Clearance(outer=outer, inner=inner)

    def singularity(self, q: Joints) -> Singularity:
        return Singularity(1.0, abs(sin(self.elbow(q))), 1.0)


def make_wrist(bars: Bars) -> Callable[[Transform], tuple[float, float, float, float]]:
    """Return a function of T_base_flange. It returns the end of the second bar in the plane of the arm (x, y) [m], and
    the angle [rad] and height [m] of the flange, measured from its pose while all joints are 0.
    """
    plane, zero, turns = bars.T_plane_base, bars.flange, len(bars.turns) > 2
    hx, hy = bars.hand.real, bars.hand.imag

    def wrist(T: Transform) -> tuple[float, float, float, float]:
        nx, sx, ax, px, ny, sy, ay, py, _, _, _, pz = compose(plane, T)
        across = ny * zero.nx + sy * zero.sx + ay * zero.ax - (nx * zero.ny + sx * zero.sy + ax * zero.ay)
        ahead = nx * zero.nx + sx * zero.sx + ax * zero.ax + (ny * zero.ny + sy * zero.sy + ay * zero.ay)
        turn = atan2(across, ahead) if turns else 0.0 * px  # the flange only rotates about z: R = Rz(turn) R_zero
        c, s = cos(turn), sin(turn)
        return px - (hx * c - hy * s), py - (hx * s + hy * c), turn, pz - zero.pz

    return wrist


def make_branch(bars: Bars, wrist: Callable[[Transform], tuple[float, float, float, float]]) -> Branch:
    """Return the formula of inverse kinematics: a function of a pose, a configuration and `near` that ignores the
    limits, and adds whole turns to bring each turning joint nearest to `near`. `wrist`: the function that `make_wrist`
    returns.
    """
    (l1, l2), (b1, b2), up, most = bars.lengths, bars.bearings, bars.up, 1.0 + BOUNDARY
    i1, i2, i3 = (*bars.turns, bars.turns[1])[:3]
    s1, s2, s3, s4 = (bars.signs[i] for i in (i1, i2, i3, (*bars.slides, i1)[0]))
    in_order = joints_in_order(bars)

    def branch(T: Transform, configuration: Configuration, near: Joints) -> Joints | None:
        x, y, turn, rise = wrist(T)
        arm = configuration.signs[0] * up
        far = abs(complex(x, y))
        k = (far**2 - l1 * l1 - l2 * l2) / (2.0 * l1 * l2)
        if k >= most or k <= -most:
            return None
        psi = acos(k if -1.0 < k < 1.0 else copysign(1.0, k)) * arm
        m, t = l1 + l2 * cos(psi), l2 * sin(psi)
        first = atan2(y, x) - atan2(t, m)
        # if the wrist is on axis 1, joint 1 may have any value, so it keeps its value in `near`
        q1 = s1 * (first - b1) if far > SINGULAR else near[i1]
        q2 = s2 * (psi - b2 + b1)
        q3 = nearest_turn(s3 * (turn - s1 * q1 - s2 * q2), near[i3])
        joints: Joints = in_order((nearest_turn(q1, near[i1]), nearest_turn(q2, near[i2]), q3, s4 * rise))
        return joints

    return branch


def joints_in_order(bars: Bars) -> Callable[[tuple[float, ...]], Joints]:
    """Return a function that takes the values of three turning joints and of the sliding joint, and returns the
    values of the joints that the arm has, in the order of its joints.
    """
    places = dict(zip(bars.turns, range(3), strict=False)) | dict.fromkeys(bars.slides, 3)
    return itemgetter(*(places[i] for i in range(len(places))))


def make_rates(bars: Bars) -> Callable[[Joints, Twist, Transform], Joints | None]:
    """Return a function of joints, twist and T_flange_tool that returns the joint rates [rad/s, m/s], or None.

    It returns None near a singular pose. It also returns None if the tip of the tool is beside the wrist and the arm
    has no third turning joint. The angular velocities w1 and w2 of the bars give the wrist the velocity v = i (w1 bar1
    + w2 bar2), with complex numbers for vectors in the plane.
    """
    (l1, l2), (b1, b2), plane, flange = bars.lengths, bars.bearings, bars.T_plane_base, bars.flange
    level = at_position(plane, 0.0, 0.0, 0.0) == IDENTITY
    i1, i2, *i3 = bars.turns
    third, signs = (*i3, i2)[0], bars.signs
    s1, s2, s3, s4 = signs[i1], signs[i2], signs[third], signs[(*bars.slides, i1)[0]]
    in_order = joints_in_order(bars)
    # [m2] if |bar1 x bar2| is smaller, the arm is too near to its singularity for the closed form
    near = 1e-3 * l1 * l2

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
