"""Describe a robot as data: axes, links, limits, nominal speeds, named poses, and the part of a pose that counts.

For six joints the whole pose counts; for an arm that cannot reach every pose only a part of it, which is the arm's task
(`ArmTask`). If a file names no task, the task that fits the arm is chosen (`model_data.fitting_task`). The whole pose
may also count for an arm of four or five joints: it then accepts the poses that it can reach and refuses all others.

Robots whose axes have the same arrangement differ only in the positive directions and zeros of their joints, and in
their base and flange frames. So a closed form is written once for each arrangement, and `chain_of` converts any robot
with this arrangement to it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from enum import Enum
from functools import cached_property
from itertools import accumulate, combinations
from math import atan2, cos, dist, hypot, sin, sqrt
from typing import TYPE_CHECKING, NamedTuple

from msgspec import Struct, structs

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


PARALLEL = 1e-8  # [rad] axes at a smaller angle to each other count as parallel
EXACT = 1e-9  # [rad, m] maximum difference of angles and lengths from those that a closed form requires


class AxisLine(NamedTuple):
    """The line of a joint axis: a point on it [m], and its direction as a unit vector."""

    point: Vector
    direction: Vector


class Link(Struct, frozen=True):
    """A link, described by standard Denavit-Hartenberg parameters: Rz(theta) Tz(d) Tx(a) Rx(alpha) [m, rad].

    The value of the joint is added to theta if it is revolute, to d if it is prismatic.
    """

    a: float
    d: float
    alpha: float
    theta: float = 0.0
    kind: JointKind = JointKind.REVOLUTE


class Chain(Struct, frozen=True):
    """The kinematics of a robot as a product of transforms: T_base_flange(q) = base . links(signs * q) . flange, with a
    sign, +1.0 or -1.0, for each joint.
    """

    base: Transform
    links: tuple[Link, ...]
    flange: Transform
    signs: Joints

    def of(self, q: Joints) -> Joints:
        """Convert joint values of the robot to link variables: theta for a revolute joint, d for a prismatic joint."""
        return tuple(
            s * x + (link.d if link.kind is JointKind.PRISMATIC else link.theta)
            for s, x, link in zip(self.signs, q, self.links, strict=True)
        )


def link_transform(link: Link, q: float) -> Transform:
    """Return T_previous_link, the pose of a link's frame in the previous frame, at the joint value q [rad, m]."""
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
    """Return the line along the z axis of a frame."""
    return AxisLine(position(T), (T.ax, T.ay, T.az))


def frame(x: Vector, z: Vector, origin: Vector) -> Transform:
    y = cross(z, x)
    return Transform(x[0], y[0], z[0], origin[0], x[1], y[1], z[1], origin[1], x[2], y[2], z[2], origin[2])


class _Step(Struct, frozen=True):
    """Link frame i, and the way to it from frame i - 1. `x`, `z`, `origin`: the axes and the origin of frame i. `foot`:
    the point of axis i - 1 that is nearest to axis i. `alpha`, `a`: the angle and the distance between both axes.
    """

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
    """Find Denavit-Hartenberg links whose axes are `axes`, and whose flange is at `T_base_flange`, while all joints are
    0.

    `alphas`: the required alphas of all links but the last; None in place of an alpha accepts any angle. If alphas are
    given, axes are reversed and normals chosen so that the links have these alphas, and `a` is never negative between
    parallel axes. Return None if no choice gives these alphas.
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
    """Return the step from the axis with direction z through `origin` to the next axis; None if the axes are not at the
    angle `alpha`. `x`: the previous normal, used if the axes coincide.
    """
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
    between = vector_difference(axis.point, origin)  # Cramer's rule gives the foot of the common normal on each axis
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
FEWEST = 4  # an arm with fewer joints cannot have the task POSE; arms of 4 or 5 joints can, but do not reach every pose


class ArmTask(Enum):
    """The part of a pose that an arm must reach (the part that "counts"). `value` is the word in a robot file.

    `counts`: six values, which say whether the coordinates X, Y, Z in the robot's frame and the rotations about X, Y, Z
    of the flange count. The arm chooses the parts that do not count. For POINT and PLANE the values are those of an arm
    that moves in the plane X Y; `RobotModel.counts` has the values for the plane of a given robot.
    """

    POSE = "pose"
    POINTING = "pointing"  # the position and the direction of the flange's Z axis, but not the rotation about it
    # the position and the rotation about the flange's Z axis, which has a constant direction (a SCARA)
    UPRIGHT = "upright"
    STEADY = "steady"  # the position exactly, and the orientation as closely as the arm can reach it
    POSITION = "position"  # the position only
    PLANE = "plane"  # the position in the plane of the arm and the rotation in this plane
    POINT = "point"  # the position in the plane of the arm only

    @property
    def counts(self) -> tuple[bool, ...]:
        return tuple(letter == "1" for letter in _PARTS[self])

    @property
    def turns(self) -> bool:
        """Return whether any rotation counts."""
        return any(self.counts[3:])

    @property
    def size(self) -> int:
        """Return the number of joints that an arm needs for the task."""
        return FEWEST if self is ArmTask.STEADY else sum(self.counts)

    def suits(self, joints: int) -> bool:
        """Return whether an arm with this number of joints may have the task."""
        if self is ArmTask.STEADY and joints >= ALL_PARTS:
            return False
        return self.size <= joints or (self is ArmTask.POSE and joints >= FEWEST)


_PARTS = {
    ArmTask.POSE: "111111",
    ArmTask.POINTING: "111110",
    ArmTask.STEADY: "111111",  # the rotations count, but need to be reached only as closely as possible
    ArmTask.UPRIGHT: "111001",
    ArmTask.POSITION: "111000",
    ArmTask.PLANE: "110001",
    ArmTask.POINT: "110000",
}


PROFILES = tuple(Profile.__members__)  # the default profile is first
STILL = (0.0, 0.0, 0.0)
# [m, rad] allowed distance from the arm's plane, and allowed tilt: poses typed with three decimals are not exact
LEVEL, STRAIGHT = 1e-5, 2e-4
SEED = 560
MEASURED = 16  # number of sample poses over which `freedom` and similar measures are averaged
SAMPLES = (
    0.05,
    0.3,
    0.45,
    0.7,
    0.9,
)  # fractions of the joint ranges: parts of a pose that are equal at all these joints count as unchangeable


class Origin(Struct, frozen=True):
    """The source of a model that was read from a URDF file, as shown to users.

    `base`, `tip`: the links at both ends of the arm in the file. `joints`, `types`: the names and types of the joints.
    `fingers`: the joints of the hand. `notes`: messages about choices that vrs made because the file does not determine
    them.
    """

    base: str
    tip: str
    joints: tuple[str, ...]
    types: tuple[str, ...]
    fingers: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()


NOT_COMPARED = 3  # number of fields at the end of a model that `==` ignores


class RobotModel(Struct, frozen=True, dict=True, eq=False):
    """The data of a robot, and values computed from them. `lower` to `max_jerk` have a value for each joint: limits
    [rad, m], maximum velocity [rad/s, m/s], acceleration and jerk.

    T_base_flange = base . links . flange; `task` is the part of a pose that counts. The linear [m/s, m/s2, m/s3] and
    angular [rad/s, rad/s2, rad/s3] values are the limits of the tool on a straight line at SPEED 100. `profile`: the
    initial value of PARAMETER PROFILE. `shapes`: the visible shapes, if the file has them (`bodies.shapes_of` returns
    shapes for any robot). `collision`: the shapes for contact detection, if they differ from `shapes`. `hand_width`:
    the width of the open hand [m], 0 if unknown. `masses`: the masses of each link, if the file has them
    (`twin.inertia` has the masses of built-in robots). `origin`: the source, for a URDF file. `names_task`: whether the
    file names the task. Models that differ only in the last three fields are equal.
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
    poses: Mapping[str, Joints]
    base: Transform = IDENTITY
    flange: Transform = IDENTITY
    task: ArmTask = ArmTask.POSE
    profile: str = PROFILES[0]
    shapes: tuple[LinkShape, ...] = ()
    collision: tuple[LinkShape, ...] = ()
    hand_width: float = 0.0
    masses: tuple[LinkMasses, ...] = ()
    origin: Origin | None = None
    names_task: bool = True

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, RobotModel):
            return False
        return structs.astuple(self)[:-NOT_COMPARED] == structs.astuple(other)[:-NOT_COMPARED]

    def __ne__(self, other: object) -> bool:
        return not self == other

    def __hash__(self) -> int:
        return hash((self.name, self.links, self.lower, self.upper, self.base, self.flange))

    @property
    def joint_count(self) -> int:
        return len(self.links)

    @cached_property
    def counts(self) -> tuple[bool, ...]:
        """Return which parts of a pose count for this robot: `ArmTask.counts`, adapted to the plane in which the arm
        moves.

        For POINT and PLANE, two coordinates that determine the position in this plane count; for PLANE also the
        rotation about the axis of the flange that is nearest to the normal of the plane.
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
        """Return an object that converts joint values to degrees and millimetres."""
        return JointUnits(tuple(link.kind for link in self.links))

    def joint_text(self, joint: int, x: float, decimals: int = 2) -> str:
        """Return the value x [rad, m] of a joint (counted from 1) as a string with its unit."""
        return f"{self.units.one_shown(joint, x):z.{decimals}f} {self.units.unit(joint)}"

    def range_of(self, joint: int, decimals: int = 2) -> str:
        """Return the range of a joint (counted from 1) as a string with its unit."""
        low = self.units.one_shown(joint, self.lower[joint - 1])
        return f"{low:z.{decimals}f} to {self.joint_text(joint, self.upper[joint - 1], decimals)}"

    def refuse_joint(self, joint: int, x: float, hint: str = "") -> JointOutOfRange:
        """Return the error for a joint (counted from 1) whose value x would be out of range [rad, m]."""
        detail = f"would be {self.joint_text(joint, x)}, its range is {self.range_of(joint)}"
        lower, upper = self.lower[joint - 1], self.upper[joint - 1]
        return JointOutOfRange(detail, hint, joint=joint, value=x, lower=lower, upper=upper)


def joint_axes(model: RobotModel) -> tuple[AxisLine, ...]:
    """Return the axis of each joint in the base frame while all joints are 0."""
    return tuple(map(axis_of, link_frames(model, (0.0,) * model.joint_count)[:-1]))


def plane_normal(model: RobotModel) -> Vector | None:
    """Return the normal of the plane in which an arm moves; None if the arm does not move in one plane.

    An arm moves in one plane if each joint turns about its normal or slides perpendicular to it.
    """
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
    """Return whether the Z axis of the flange has the same direction in all poses, as on a SCARA or a gantry."""
    ranges = list(zip(model.lower, model.upper, strict=True))
    poses = (tuple(low + part * (high - low) for low, high in ranges) for part in SAMPLES)
    first, *others = (axis_of(link_frames(model, q)[-1]).direction for q in poses)
    return all(dist(first, other) < EXACT for other in others)


def link_frames(model: RobotModel, q: Joints) -> tuple[Transform, ...]:
    """Return the n + 1 frames T_base_0, T_base_1, ... T_base_flange at joints q. The axis of joint i is z of frame i -
    1.
    """
    steps = (link_pose(model, i, x) for i, x in enumerate(q, 1))
    return tuple(accumulate(steps, compose, initial=model.base))


def link_pose(model: RobotModel, i: int, x: float) -> Transform:
    """Return T_i-1_i, the pose of link i in the previous frame, if joint i (counted from 1) is at x [rad, m]; for the
    last joint return T_i-1_flange.
    """
    T = link_transform(model.links[i - 1], x)
    return compose(T, model.flange) if i == model.joint_count else T


def some_joints(model: RobotModel) -> Iterator[Joints]:
    """Yield an infinite pseudo-random sequence of joint vectors within the ranges; it is always the same for the same
    model.
    """
    from random import Random  # imported here because few robots need sample poses

    random, limits = Random(SEED), list(zip(model.lower, model.upper, strict=True))
    while True:
        yield tuple(random.uniform(low, high) for low, high in limits)


def levers(model: RobotModel) -> tuple[Vector, tuple[float, ...]]:
    """Return a point on the axis of joint 1, and for each axis an upper bound of the flange's distance from it (its
    lever) [m].

    A lever is the length of a path: from the flange to the nearest point of the last axis, from there to the nearest
    point of the previous axis, and so on. The parts of this path change their lengths only if a joint slides.
    """
    at, far, found = position(link_frames(model, (0.0,) * model.joint_count)[-1]), 0.0, list[float]()
    rows = zip(joint_axes(model), model.links, model.lower, model.upper, strict=True)
    for axis, link, low, high in reversed(list(rows)):
        foot = along(axis.point, axis.direction, dot(vector_difference(at, axis.point), axis.direction))
        far += dist(foot, at) + (max(abs(low), abs(high)) if link.kind is JointKind.PRISMATIC else 0.0)
        found.append(far)
        at = foot
    return at, tuple(reversed(found))
