"""The robot model theta: link parameters, limits, nominal speeds and named poses, and which part of a pose counts.

Data, never code. All of a pose counts for six joints, less for an arm that cannot do all. An arm whose file names no
task has the one that fits it (`model_data.fitting_task`). One of four or five joints may have the whole pose count too:
it takes the poses that it can, and refuses the others.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from functools import cached_property
from itertools import accumulate, combinations
from math import acos, degrees, dist
from typing import TYPE_CHECKING, NamedTuple

from vrs_cli.errors import JointOutOfRange
from vrs_cli.kinematics.axes import EXACT, AxisLine, Link, axis_of, link_transform
from vrs_cli.kinematics.joints import JointKind, Joints, JointUnits
from vrs_cli.kinematics.profile import Profile
from vrs_cli.kinematics.transform import (
    IDENTITY,
    Transform,
    Vector,
    along,
    angle_between,
    any_normal,
    at_position,
    compose,
    cross,
    dot,
    position,
    rotation_about,
    subtracted,
    to_oat,
    unit,
)

if TYPE_CHECKING:
    from vrs_cli.kinematics.masses import LinkMasses
    from vrs_cli.kinematics.shapes import LinkShape

ALL_PARTS = 6
FEWEST = 4  # joints of an arm that may have the whole pose count, though it cannot take every one


class ArmTask(Enum):
    """`value` is the word in a robot file; `counts`: X, Y, Z of the robot's frame and the turns about X, Y, Z of the
    flange. What does not count is not asked for: it may be what the arm makes of it. `counts` of POINT and PLANE is
    for an arm that moves in the plane X Y; `RobotModel.counts` knows the plane of each.
    """

    POSE = "pose"
    POINTING = "pointing"  # the place and where the flange points, not its turn about itself
    UPRIGHT = "upright"  # the place and the turn about the flange's axis, which keeps its direction (a SCARA)
    STEADY = "steady"  # the place, and the tool turned as nearly as the arm can
    POSITION = "position"  # the place alone
    PLANE = "plane"  # the place in the plane of the arm and the turn in it
    POINT = "point"  # the place in the plane of the arm alone

    @property
    def counts(self) -> tuple[bool, ...]:
        return _COUNTS[self]

    @property
    def turns(self) -> bool:
        """Return whether any turn counts."""
        return any(self.counts[3:])

    @property
    def size(self) -> int:
        """Return how many joints it takes to do it everywhere."""
        return FEWEST if self is ArmTask.STEADY else sum(self.counts)

    def suits(self, joints: int) -> bool:
        """Return whether an arm of so many joints may have it."""
        if self is ArmTask.STEADY and joints >= ALL_PARTS:
            return False
        return self.size <= joints or (self is ArmTask.POSE and joints >= FEWEST)


_PARTS = {
    ArmTask.POSE: "111111",
    ArmTask.POINTING: "111110",
    ArmTask.STEADY: "111111",  # the turns as far as they can be had
    ArmTask.UPRIGHT: "111001",
    ArmTask.POSITION: "111000",
    ArmTask.PLANE: "110001",
    ArmTask.POINT: "110000",
}
_COUNTS = {task: tuple(letter == "1" for letter in letters) for task, letters in _PARTS.items()}


PROFILES = tuple(Profile.__members__)  # the first is that of a robot that names none
STILL = (0.0, 0.0, 0.0)
LEVEL, STRAIGHT = 1e-5, 2e-4  # [m, rad] what a location may be beside the arm's plane or tilted: three decimals do it
AXES: tuple[Vector, ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
CONSTANT = 1e-9  # [m, sine] an arm that changes it by less does not
SAMPLES = (0.05, 0.3, 0.45, 0.7, 0.9)  # of a joint's range: poses that show what an arm cannot change


class Origin(NamedTuple):
    """Where a model comes from, for people: the links of its file that it is an arm between, the names of its joints
    with their types, those of the joints of its hand, and what was decided though the file does not say it."""

    base: str
    tip: str
    joints: tuple[str, ...]
    types: tuple[str, ...]
    fingers: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class RobotModel:
    """One robot. Joint by joint: limits [rad, m], velocity [rad/s, m/s], acceleration and jerk likewise.

    T_base_flange = base . links . flange; `task` is the part of a pose that counts. The tool's linear [m/s, m/s2,
    m/s3] and angular [rad/s, rad/s2, rad/s3] figures are those of a straight line at SPEED 100. `profile`: what
    PARAMETER PROFILE is at the start. `shapes`: how it looks, where its file says so (`bodies.shapes_of` knows it
    of any robot); `collision`: what stands for it when contacts are looked for, where that is not how it looks.
    `hand_width`: how wide its hand opens [m], 0 where nobody says it. `masses`: one of each link, where its file says
    them (`twin.inertia` knows those of the built-in robots). `origin`: of one out of a file with names; `names_task`:
    whether the file names the task. None of these three tells robots apart.
    """

    name: str
    title: str
    links: tuple[Link, ...]
    lower: Joints
    upper: Joints
    max_velocity: Joints
    max_acceleration: Joints
    max_jerk: Joints
    linear_speed: float
    linear_acceleration: float
    linear_jerk: float
    angular_speed: float
    angular_acceleration: float
    angular_jerk: float
    poses: Mapping[str, Joints] = field(hash=False)  # a dictionary has no hash; the rest tells models apart
    base: Transform = IDENTITY
    flange: Transform = IDENTITY
    task: ArmTask = ArmTask.POSE
    profile: str = PROFILES[0]
    shapes: tuple[LinkShape, ...] = ()
    collision: tuple[LinkShape, ...] = ()
    hand_width: float = 0.0
    masses: tuple[LinkMasses, ...] = field(default=(), compare=False)
    origin: Origin | None = field(default=None, compare=False)
    names_task: bool = field(default=True, compare=False)

    @property
    def joint_count(self) -> int:
        return len(self.links)

    @cached_property
    def counts(self) -> tuple[bool, ...]:
        """`Task.counts`. Of `Task.POINT` and `PLANE` it is the plane in which the arm moves that counts: the two
        coordinates that tell a place in it, and the turn about the axis of the flange that is nearest its normal.
        """
        counts, normal = self.task.counts, plane_normal(self)
        if self.task not in (ArmTask.POINT, ArmTask.PLANE) or normal is None:
            return counts
        flange = link_frames(self, (0.0,) * self.joint_count)[-1]
        across = max(range(3), key=lambda i: abs(normal[i]))
        about = max(range(3), key=lambda i: abs(dot((flange[i], flange[4 + i], flange[8 + i]), normal)))
        return (*(i != across for i in range(3)), *(self.task.turns and i == about for i in range(3)))

    @cached_property
    def units(self) -> JointUnits:
        """How people see the joints: degrees and millimetres."""
        return JointUnits(tuple(link.kind for link in self.links))

    def said(self, joint: int, x: float, decimals: int = 2) -> str:
        """A value of a joint, counted from 1, for a message."""
        return f"{self.units.one_shown(joint, x):z.{decimals}f} {self.units.unit(joint)}"

    def range_of(self, joint: int, decimals: int = 2) -> str:
        """The range of a joint, counted from 1, for a message."""
        low = self.units.one_shown(joint, self.lower[joint - 1])
        return f"{low:z.{decimals}f} to {self.said(joint, self.upper[joint - 1], decimals)}"

    def refuse_joint(self, joint: int, x: float, hint: str = "") -> JointOutOfRange:
        """The refusal of a joint, counted from 1, that would stand at x [rad or m]."""
        detail = f"would be {self.said(joint, x)}, its range is {self.range_of(joint)}"
        lower, upper = self.lower[joint - 1], self.upper[joint - 1]
        return JointOutOfRange(detail, hint, joint=joint, value=x, lower=lower, upper=upper)


def joint_axes(model: RobotModel) -> tuple[AxisLine, ...]:
    """The axes of the joints while all of them are 0, in the base frame."""
    return tuple(map(axis_of, link_frames(model, (0.0,) * model.joint_count)[:-1]))


def axes_parallel(model: RobotModel) -> bool:
    """Whether all axes are, as those of a SCARA are."""
    first, *others = joint_axes(model)
    return all(max(map(abs, cross(first.direction, other.direction))) < EXACT for other in others)


def plane_normal(model: RobotModel) -> Vector | None:
    """The normal of the plane in which an arm moves, whose joints turn about it or slide across it; None for others."""
    axes = list(zip(joint_axes(model), model.units.kinds, strict=True))
    turning = [axis.direction for axis, kind in axes if kind is JointKind.REVOLUTE]
    sliding = [axis.direction for axis, kind in axes if kind is JointKind.PRISMATIC]
    normals = [*turning, *(cross(a, b) for a, b in combinations(sliding, 2) if dist(cross(a, b), STILL) > EXACT)]
    if not normals:
        return None
    normal = unit(normals[0])
    leans = [dist(cross(normal, other), STILL) for other in turning] + [abs(dot(normal, way)) for way in sliding]
    return normal if max(leans) < EXACT else None


def flange_steady(model: RobotModel) -> bool:
    """Whether the flange keeps its direction, as that of a SCARA and of a gantry does."""
    ranges = list(zip(model.lower, model.upper, strict=True))
    poses = (tuple(low + part * (high - low) for low, high in ranges) for part in SAMPLES)
    first, *others = (axis_of(link_frames(model, q)[-1]).direction for q in poses)
    return all(dist(first, other) < EXACT for other in others)


def link_frames(model: RobotModel, q: Joints) -> tuple[Transform, ...]:
    """T_base_0, T_base_1, ... T_base_flange: one frame more than joints; joint i turns about z of frame i - 1."""
    steps = (link_pose(model, i, x) for i, x in enumerate(q, 1))
    return tuple(accumulate(steps, compose, initial=model.base))


def link_pose(model: RobotModel, i: int, x: float) -> Transform:
    """T_i-1_i of joint i, counted from 1, at x [rad, m]; behind the last one is the flange."""
    T = link_transform(model.links[i - 1], x)
    return compose(T, model.flange) if i == model.joint_count else T


def levers(model: RobotModel) -> tuple[Vector, tuple[float, ...]]:
    """A point on the axis of joint 1, and for each axis a distance from it that the flange never exceeds [m].

    The foot of the flange on the last axis, the foot of that on the one before, ...: each keeps its distance
    from the next, but for what a joint slides.
    """
    at, far, found = position(link_frames(model, (0.0,) * model.joint_count)[-1]), 0.0, list[float]()
    rows = zip(joint_axes(model), model.links, model.lower, model.upper, strict=True)
    for axis, link, low, high in reversed(list(rows)):
        foot = along(axis.point, axis.direction, dot(subtracted(at, axis.point), axis.direction))
        far += dist(foot, at) + (max(abs(low), abs(high)) if link.kind is JointKind.PRISMATIC else 0.0)
        found.append(far)
        at = foot
    return at, tuple(reversed(found))


# --- what no joint of an arm changes -------------------------------------------------------------------------------


class Forbidden(NamedTuple):
    """The part of a pose of the flange that an arm cannot do, in words, and the nearest pose that it can."""

    what: str
    right: Transform


class Unchanging(NamedTuple):
    """Positions of the flange along some directions [m], and the direction in which it points."""

    places: tuple[tuple[Vector, float], ...] = ()
    approach: Vector | None = None

    def allows(self, T: Transform) -> bool:
        """Return whether `forbids` finds nothing."""
        return all(abs(dot(position(T), way) - value) <= LEVEL for way, value in self.places) and (
            self.approach is None or _angle(self.approach, axis_of(T).direction) <= STRAIGHT
        )

    def forbids(self, T: Transform) -> Forbidden | None:
        """Return what a pose of the flange asks for that no joint changes."""
        approach, at = self.approach, position(T)
        if approach is not None and (tilt := _angle(approach, axis_of(T).direction)) > STRAIGHT:
            upright = "vertical, pointing " + ("down" if approach[2] < 0.0 else "up")
            points = upright if abs(approach[2]) > 1.0 - CONSTANT else "in one direction"
            what = f"keeps its tool {points}; the location tilts it by {degrees(tilt):.2f} deg"
            z = axis_of(T).direction  # turned the shortest way until it lies along the approach
            axis = any_normal(z) if dist(cross(z, approach), STILL) < CONSTANT else cross(z, approach)
            return Forbidden(what, at_position(compose(rotation_about(unit(axis), tilt), T), *at))
        for way, value in self.places:
            beside = dot(at, way) - value
            if abs(beside) > LEVEL:
                what = f"moves in one plane, its flange would be {1000.0 * abs(beside):.1f} mm beside that"
                if way in AXES:
                    name, plane, flange = "XYZ"[AXES.index(way)], 1000.0 * value, 1000.0 * (value + beside)
                    what = f"moves in the plane {name} = {plane:.1f} mm of its own frame, "
                    what += f"its flange would be at {name} = {flange:.1f} mm"
                return Forbidden(what, at_position(T, *along(at, way, -beside)))
        return None


def unchanging(model: RobotModel, forward: Callable[[Joints], Transform]) -> Unchanging:
    """The parts of a pose that no joint changes, seen on a few poses; none for an arm that has all six freedoms."""
    if model.joint_count >= ALL_PARTS and all(model.counts):
        return Unchanging()
    limits = list(zip(model.lower, model.upper, strict=True))
    poses = [forward(tuple(low + part * (high - low) for low, high in limits)) for part in SAMPLES]
    first, approach, normal = position(poses[0]), axis_of(poses[0]).direction, plane_normal(model)
    kept = [way for way in AXES if _is_kept(way, poses)]
    if not kept and normal is not None and _is_kept(normal, poses):
        kept = [normal]
    steady = all(dist(axis_of(T).direction, approach) < CONSTANT for T in poses)
    return Unchanging(tuple((way, dot(first, way)) for way in kept), approach if steady else None)


def difference(asked: Transform, instead: Transform) -> str:
    """The angles or coordinates to give in place of those of a location, as the user writes them."""
    rows = list(zip("OAT", map(degrees, to_oat(instead)), strict=True))
    if angle_between(asked, instead) <= STRAIGHT:
        places = zip("XYZ", position(asked), position(instead), strict=True)
        rows = [(name, 1000.0 * b) for name, a, b in places if abs(a - b) > 0.5 * LEVEL]
    return ", ".join(f"{name} {round(x, 3) + 0.0:.10g}" for name, x in rows)


def _is_kept(way: Vector, poses: Sequence[Transform]) -> bool:
    """Return whether all these poses are equally far along a direction."""
    first, *others = (dot(position(T), way) for T in poses)
    return all(abs(other - first) < CONSTANT for other in others)


def _angle(a: Vector, b: Vector) -> float:
    """Between two directions [rad]."""
    sine = dist(cross(a, b), STILL)
    return sine if dot(a, b) > 0.0 and sine < STRAIGHT else acos(min(max(dot(a, b), -1.0), 1.0))
