"""Arms whose axes are all parallel: the SCARA and the planar arms of a class, in closed form.

Two bars in the plane square to the axes carry the rest: as complex numbers in that plane, with the first axis at 0,

    wrist = l1 exp(i b1) + l2 exp(i b2),     psi = b2 - b1,     cos psi = (|wrist|^2 - l1^2 - l2^2) / (2 l1 l2).

The wrist is the third axis that turns, or the flange itself where there is none. A third turn makes the angle of the
flange, a joint that slides its height; where along the chain they stand does not matter.

RIGHTY is the arm whose elbow lies to the right of the line from shoulder to wrist, as a right arm's does (psi >= 0);
seen from above, or against the first axis where that is level.
"""

from __future__ import annotations

from cmath import phase
from dataclasses import dataclass
from functools import cached_property

from vrs_cli.kinematics.joints import JointKind
from vrs_cli.kinematics.model import EXACT, ArmTask, RobotModel, axes_parallel, frame, joint_axes, link_frames
from vrs_cli.kinematics.transform import Transform, any_normal, compose, dot, inverse

TASKS = {
    (2, 0): ArmTask.POINT,
    (3, 0): ArmTask.PLANE,
    (3, 1): ArmTask.UPRIGHT,
    (2, 1): ArmTask.POSITION,
}  # turning, sliding joints


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

    @cached_property
    def lengths(self) -> tuple[float, float]:
        return abs(self.first), abs(self.second)

    @cached_property
    def bearings(self) -> tuple[float, float]:
        return phase(self.first), phase(self.second)


def bars_of(model: RobotModel) -> Bars | None:
    """The bars of a model of this kind; None for every other robot."""
    kinds = model.units.kinds
    turns = tuple(i for i, kind in enumerate(kinds) if kind is JointKind.REVOLUTE)
    slides = tuple(i for i, kind in enumerate(kinds) if kind is JointKind.PRISMATIC)
    if TASKS.get((len(turns), len(slides))) is not model.task or not axes_parallel(model):
        return None
    axes = joint_axes(model)
    start = axes[turns[0]]
    z = start.direction
    T_plane_base = inverse(frame(any_normal(z), z, start.point))
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
