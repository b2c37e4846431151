"""The robot model theta: link parameters, limits, nominal speeds and named poses, and which part of a pose counts.

Data, never code. All of a pose counts for six joints, less for an arm that cannot do all. An arm whose file names no
task has the one that fits it (`model_data.fitting_task`). One of four or five joints may have the whole pose count too:
it takes the poses that it can, and refuses the others.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from functools import cached_property
from itertools import accumulate, combinations
from math import atan2, cos, dist, hypot, sin, sqrt
from random import Random
from typing import TYPE_CHECKING, NamedTuple

from vrs_cli.errors import JointOutOfRange
from vrs_cli.kinematics.joints import JointKind, Joints, JointUnits, Profile
from vrs_cli.kinematics.transform import (
    IDENTITY,
    Transform,
    Vector,
    along,
    any_normal,
    compose,
    cross,
    dot,
    inverse,
    position,
    unit,
    vector_difference,
)

if TYPE_CHECKING:
    from vrs_cli.kinematics.link_data import LinkMasses, LinkShape


PARALLEL = 1e-8  # [rad] two axes that are
EXACT = 1e-9  # [rad, m] how near an angle or a length must be to the one that a closed form needs


class AxisLine(NamedTuple):
    """An axis: a point on it [m] and its direction, of length one."""

    point: Vector
    direction: Vector


class Link(NamedTuple):
    """Standard Denavit-Hartenberg: Rz(theta) Tz(d) Tx(a) Rx(alpha). a, d [m], alpha, theta [rad].

    The joint's value is added to theta where it turns, to d where it slides.
    """

    a: float
    d: float
    alpha: float
    theta: float = 0.0
    kind: JointKind = JointKind.REVOLUTE


class Chain(NamedTuple):
    """T_base_flange(q) = base . links(signs * q) . flange: signs are +1.0 or -1.0, one a joint."""

    base: Transform
    links: tuple[Link, ...]
    flange: Transform
    signs: Joints

    def of(self, q: Joints) -> Joints:
        """The variables of the links, from those of the robot: theta of a link that turns, d of one that slides."""
        return tuple(
            s * x + (link.d if link.kind is JointKind.PRISMATIC else link.theta)
            for s, x, link in zip(self.signs, q, self.links, strict=True)
        )


def link_transform(link: Link, q: float) -> Transform:
    """T_previous_link of one joint."""
    turns = link.kind is JointKind.REVOLUTE
    theta, d = (link.theta + q, link.d) if turns else (link.theta, link.d + q)
    c, s = cos(theta), sin(theta)
    ca, sa = cos(link.alpha), sin(link.alpha)
    return Transform(
        c, -s * ca, s * sa, link.a * c,
        s, c * ca, -c * sa, link.a * s,
        0.0, sa, ca, d,
    )  # fmt: skip


def axis_of(T: Transform) -> AxisLine:
    """The z axis of a frame."""
    return AxisLine(position(T), (T.ax, T.ay, T.az))


def frame(x: Vector, z: Vector, origin: Vector) -> Transform:
    y = cross(z, x)
    return Transform(x[0], y[0], z[0], origin[0], x[1], y[1], z[1], origin[1], x[2], y[2], z[2], origin[2])


class _Step(NamedTuple):
    """Frame i, and the way to it from frame i - 1, whose origin may be slid along its axis to `foot`."""

    x: Vector
    z: Vector
    origin: Vector
    foot: Vector
    alpha: float
    a: float


def chain_of(
    axes: Sequence[AxisLine],
    kinds: Sequence[JointKind],
    T_base_flange: Transform,
    alphas: Sequence[float | None] | None = None,
) -> Chain | None:
    """Links that have these axes, and T_base_flange, when all joints are 0.

    With `alphas` (of all joints but the last; None for any) axes are reversed and normals chosen so that the links have
    them, with no `a` below zero between parallel axes; None where that cannot be.
    """
    z, origin = axes[0].direction, axes[0].point
    steps: list[_Step] = []
    for i, axis in enumerate(axes[1:]):
        step = _next(z, origin, steps[-1].x if steps else None, axis, None if alphas is None else alphas[i])
        if step is None:
            return None
        steps.append(step)
        z, origin = step.z, step.origin
    x = steps[0].x if steps else any_normal(z)
    origin = steps[0].foot if steps else origin
    base, z = frame(x, axes[0].direction, origin), axes[0].direction
    links, signs = [], [1.0]
    for step, axis, kind in zip(steps, axes[1:], kinds, strict=False):
        theta = atan2(dot(cross(x, step.x), z), dot(x, step.x))
        links.append(Link(step.a, dot(vector_difference(step.foot, origin), z), step.alpha, theta, kind))
        signs.append(1.0 if dot(step.z, axis.direction) > 0.0 else -1.0)
        x, z, origin = step.x, step.z, step.origin
    links.append(Link(0.0, 0.0, 0.0, 0.0, kinds[-1]))
    flange = compose(inverse(frame(x, z, origin)), T_base_flange)
    return Chain(base, tuple(links), flange, tuple(signs))


def _next(z: Vector, origin: Vector, x: Vector | None, axis: AxisLine, alpha: float | None) -> _Step | None:
    """From the axis z through `origin` to the next one. None where it does not lie at the angle `alpha`."""
    turn = cross(z, axis.direction)
    sine, cosine = sqrt(dot(turn, turn)), dot(z, axis.direction)
    if sine < PARALLEL:
        return _parallel(z, origin, x, axis, alpha)
    normal = (turn[0] / sine, turn[1] / sine, turn[2] / sine)
    if alpha is not None and sin(alpha) < 0.0:
        normal, sine = (-normal[0], -normal[1], -normal[2]), -sine
    found = atan2(sine, cosine)
    if alpha is not None and abs(found - alpha) > EXACT:
        return None
    between = vector_difference(axis.point, origin)  # feet of the common normal, by Cramer's rule
    p, q = dot(between, z), dot(between, axis.direction)
    foot = along(origin, z, (p - cosine * q) / (sine * sine))
    onto = along(axis.point, axis.direction, (cosine * p - q) / (sine * sine))
    return _Step(
        normal,
        axis.direction,
        onto,
        foot,
        found if alpha is None else alpha,
        dot(vector_difference(onto, foot), normal),
    )


def _parallel(z: Vector, origin: Vector, x: Vector | None, axis: AxisLine, alpha: float | None) -> _Step | None:
    if alpha is not None and abs(sin(alpha)) > EXACT:
        return None
    direction = axis.direction
    same = dot(z, direction) > 0.0
    if alpha is not None and same != (cos(alpha) > 0.0):
        direction, same = (-direction[0], -direction[1], -direction[2]), not same
    between = vector_difference(axis.point, origin)
    across = along(between, z, -dot(between, z))
    a = hypot(*across)
    normal = (x or any_normal(z)) if a < EXACT else (across[0] / a, across[1] / a, across[2] / a)
    if a < EXACT:
        a = 0.0
    alpha = atan2(0.0, 1.0 if same else -1.0) if alpha is None else alpha
    return _Step(normal, direction, along(origin, normal, a), origin, alpha, a)


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
SEED = 560
MEASURED = 16  # poses over which freedoms are measured
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

    def joint_text(self, joint: int, x: float, decimals: int = 2) -> str:
        """A value of a joint, counted from 1, for a message."""
        return f"{self.units.one_shown(joint, x):z.{decimals}f} {self.units.unit(joint)}"

    def range_of(self, joint: int, decimals: int = 2) -> str:
        """The range of a joint, counted from 1, for a message."""
        low = self.units.one_shown(joint, self.lower[joint - 1])
        return f"{low:z.{decimals}f} to {self.joint_text(joint, self.upper[joint - 1], decimals)}"

    def refuse_joint(self, joint: int, x: float, hint: str = "") -> JointOutOfRange:
        """The refusal of a joint, counted from 1, that would stand at x [rad or m]."""
        detail = f"would be {self.joint_text(joint, x)}, its range is {self.range_of(joint)}"
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


def some_joints(model: RobotModel) -> Iterator[Joints]:
    """Yield joints in their ranges without end, the same for the same model."""
    random, limits = Random(SEED), list(zip(model.lower, model.upper, strict=True))
    while True:
        yield tuple(random.uniform(low, high) for low, high in limits)


def levers(model: RobotModel) -> tuple[Vector, tuple[float, ...]]:
    """A point on the axis of joint 1, and for each axis a distance from it that the flange never exceeds [m].

    The foot of the flange on the last axis, the foot of that on the one before, ...: each keeps its distance
    from the next, but for what a joint slides.
    """
    at, far, found = position(link_frames(model, (0.0,) * model.joint_count)[-1]), 0.0, list[float]()
    rows = zip(joint_axes(model), model.links, model.lower, model.upper, strict=True)
    for axis, link, low, high in reversed(list(rows)):
        foot = along(axis.point, axis.direction, dot(vector_difference(at, axis.point), axis.direction))
        far += dist(foot, at) + (max(abs(low), abs(high)) if link.kind is JointKind.PRISMATIC else 0.0)
        found.append(far)
        at = foot
    return at, tuple(reversed(found))
