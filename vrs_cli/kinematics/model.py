"""Describe a robot as data: axes, links, limits, nominal speeds, named poses, and the part of a pose that counts.

The whole pose counts for six joints, a part of it for an arm that cannot reach every pose. A file that names no task
gets the task that fits (`model_data.fitting_task`). The whole pose may also count for four or five joints: such an arm
accepts the poses that it can reach and refuses all other poses.

Two arms with the same arrangement of axes differ only in directions, zeros and frames. So a closed form is written once
for an arrangement, and solves any robot with this arrangement (`chain_of`).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from enum import Enum
from functools import cached_property
from itertools import accumulate, combinations
from math import atan2, cos, dist, hypot, sin, sqrt
from typing import TYPE_CHECKING, NamedTuple

from msgspec import Struct

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


PARALLEL = 1e-8  # [rad] angle between axes that count as parallel
EXACT = 1e-9  # [rad, m] tolerance for angles and lengths of a closed form


class AxisLine(NamedTuple):
    """A point on an axis [m], and the direction of the axis, of length one."""

    point: Vector
    direction: Vector


class Link(NamedTuple):
    """A link by standard Denavit-Hartenberg parameters: Rz(theta) Tz(d) Tx(a) Rx(alpha) [m, rad].

    The joint's value is added to theta if it turns, to d if it slides.
    """

    a: float
    d: float
    alpha: float
    theta: float = 0.0
    kind: JointKind = JointKind.REVOLUTE


class Chain(Struct, frozen=True):
    """T_base_flange(q) = base . links(signs * q) . flange, with one sign, +1.0 or -1.0, for each joint."""

    base: Transform
    links: tuple[Link, ...]
    flange: Transform
    signs: Joints

    def of(self, q: Joints) -> Joints:
        """Return the link variables for joints of the robot: theta of a link that turns, d of one that slides."""
        return tuple(
            s * x + (link.d if link.kind is JointKind.PRISMATIC else link.theta)
            for s, x, link in zip(self.signs, q, self.links, strict=True)
        )


def link_transform(link: Link, q: float) -> Transform:
    """Return T_previous_link of one joint at q."""
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
    """Return the z axis of a frame."""
    return AxisLine(position(T), (T.ax, T.ay, T.az))


def frame(x: Vector, z: Vector, origin: Vector) -> Transform:
    y = cross(z, x)
    return Transform(x[0], y[0], z[0], origin[0], x[1], y[1], z[1], origin[1], x[2], y[2], z[2], origin[2])


class _Step(Struct, frozen=True):
    """Frame i and the step to it from frame i - 1: the origin slides along the axis of frame i - 1 to `foot` first."""

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
    """Return links that have these axes, and T_base_flange, while all joints are 0.

    `alphas`: the alphas of all joints but the last; None for any angle. If they are given, axes may be reversed and
    normals are chosen so that the links have these alphas, and `a` is never below zero between parallel axes. None if
    that is impossible.
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
    """Return the step from the axis z through `origin` to the next axis; None if it is not at the angle `alpha`."""
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
    between = vector_difference(axis.point, origin)  # the foot of the common normal on each axis, by Cramer's rule
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
FEWEST = 4  # minimum number of joints of an arm whose whole pose may count, though it cannot reach every pose


class ArmTask(Enum):
    """The part of a pose that counts for an arm. `value` is the word in a robot file.

    `counts`: whether X, Y, Z of the robot's frame and the turns about X, Y, Z of the flange count. The arm chooses the
    parts that do not count. POINT and PLANE have the plane X Y here; `RobotModel.counts` has the plane of a robot.
    """

    POSE = "pose"
    POINTING = "pointing"  # the position and the direction of the flange, not its turn about its axis
    UPRIGHT = "upright"  # the position and the turn about the flange's axis, which keeps its direction (a SCARA)
    STEADY = "steady"  # the position, and the orientation as nearly as the arm can reach it
    POSITION = "position"  # the position only
    PLANE = "plane"  # the position in the plane of the arm and the turn in this plane
    POINT = "point"  # the position in the plane of the arm only

    @property
    def counts(self) -> tuple[bool, ...]:
        return tuple(letter == "1" for letter in _PARTS[self])

    @property
    def turns(self) -> bool:
        """Return whether any turn counts."""
        return any(self.counts[3:])

    @property
    def size(self) -> int:
        """Return the number of joints that can do the task everywhere."""
        return FEWEST if self is ArmTask.STEADY else sum(self.counts)

    def suits(self, joints: int) -> bool:
        """Return whether an arm with this number of joints may have the task."""
        if self is ArmTask.STEADY and joints >= ALL_PARTS:
            return False
        return self.size <= joints or (self is ArmTask.POSE and joints >= FEWEST)


_PARTS = {
    ArmTask.POSE: "111111",
    ArmTask.POINTING: "111110",
    ArmTask.STEADY: "111111",  # the turns count, but may be reached only approximately
    ArmTask.UPRIGHT: "111001",
    ArmTask.POSITION: "111000",
    ArmTask.PLANE: "110001",
    ArmTask.POINT: "110000",
}


PROFILES = tuple(Profile.__members__)  # the default profile is first
STILL = (0.0, 0.0, 0.0)
LEVEL, STRAIGHT = 1e-5, 2e-4  # [m, rad] allowed distance from the arm's plane and tilt, for three decimals
SEED = 560
MEASURED = 16  # number of sample poses for measuring freedoms
SAMPLES = (
    0.05,
    0.3,
    0.45,
    0.7,
    0.9,
)  # fractions of joint ranges, for poses that show what an arm cannot change


class Origin(Struct, frozen=True):
    """The source of a model, as shown to users.

    `base`, `tip`: the links at both ends of the arm in the file. `joints`, `types`: the names and types of the joints.
    `fingers`: the joints of the hand. `notes`: choices that the file does not determine.
    """

    base: str
    tip: str
    joints: tuple[str, ...]
    types: tuple[str, ...]
    fingers: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()


NOT_COMPARED = 3  # number of fields at the end of a model that do not count when models are compared


class _ModelData(NamedTuple):
    """One robot. For each joint: limits [rad, m], velocity [rad/s, m/s], acceleration and jerk.

    T_base_flange = base . links . flange; `task` is the part of a pose that counts. The linear [m/s, m/s2, m/s3] and
    angular [rad/s, rad/s2, rad/s3] figures of the tool are those of a straight line at SPEED 100. `profile`: the
    initial PARAMETER PROFILE. `shapes`: the looks, if the file gives them (`bodies.shapes_of` returns shapes for any
    robot). `collision`: shapes for contacts, if they differ. `hand_width`: the width of the open hand [m], 0 if
    unknown. `masses`: one row for each link, if the file gives them (`twin.inertia` has those of built-in robots).
    `origin`: the source, for a file that names its links and joints. `names_task`: whether the file names the task.
    Models that differ only in the last three are equal.
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


class RobotModel(_ModelData):
    """One robot, with figures that follow from its data."""

    def __eq__(self, other: object) -> bool:
        return isinstance(other, RobotModel) and self[:-NOT_COMPARED] == other[:-NOT_COMPARED]

    def __ne__(self, other: object) -> bool:
        return not self == other

    def __hash__(self) -> int:
        return hash((self.name, self.links, self.lower, self.upper, self.base, self.flange))

    @property
    def joint_count(self) -> int:
        return len(self.links)

    @cached_property
    def counts(self) -> tuple[bool, ...]:
        """Return which parts of a pose count: `ArmTask.counts` in the plane of the arm.

        For POINT and PLANE these are the two coordinates that determine a position in this plane, and the turn about
        the axis of the flange that is nearest to the normal of the plane.
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
        """Return the converter of joint values to degrees and millimetres."""
        return JointUnits(tuple(link.kind for link in self.links))

    def joint_text(self, joint: int, x: float, decimals: int = 2) -> str:
        """Return the value of a joint (counted from 1) for a message."""
        return f"{self.units.one_shown(joint, x):z.{decimals}f} {self.units.unit(joint)}"

    def range_of(self, joint: int, decimals: int = 2) -> str:
        """Return the range of a joint (counted from 1) for a message."""
        low = self.units.one_shown(joint, self.lower[joint - 1])
        return f"{low:z.{decimals}f} to {self.joint_text(joint, self.upper[joint - 1], decimals)}"

    def refuse_joint(self, joint: int, x: float, hint: str = "") -> JointOutOfRange:
        """Return the error for a joint (counted from 1) that would be at x [rad or m]."""
        detail = f"would be {self.joint_text(joint, x)}, its range is {self.range_of(joint)}"
        lower, upper = self.lower[joint - 1], self.upper[joint - 1]
        return JointOutOfRange(detail, hint, joint=joint, value=x, lower=lower, upper=upper)


def joint_axes(model: RobotModel) -> tuple[AxisLine, ...]:
    """Return the axes of the joints in the base frame, while all joints are 0."""
    return tuple(map(axis_of, link_frames(model, (0.0,) * model.joint_count)[:-1]))


def plane_normal(model: RobotModel) -> Vector | None:
    """Return the normal of the plane in which an arm moves; None for other arms.

    Its joints turn about the normal or slide perpendicular to it.
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
    """Return whether the flange keeps its direction, as on a SCARA or a gantry."""
    ranges = list(zip(model.lower, model.upper, strict=True))
    poses = (tuple(low + part * (high - low) for low, high in ranges) for part in SAMPLES)
    first, *others = (axis_of(link_frames(model, q)[-1]).direction for q in poses)
    return all(dist(first, other) < EXACT for other in others)


def link_frames(model: RobotModel, q: Joints) -> tuple[Transform, ...]:
    """Return T_base_0, T_base_1, ... T_base_flange, n + 1 frames; joint i turns about z of frame i - 1."""
    steps = (link_pose(model, i, x) for i, x in enumerate(q, 1))
    return tuple(accumulate(steps, compose, initial=model.base))


def link_pose(model: RobotModel, i: int, x: float) -> Transform:
    """Return T_i-1_i of joint i (counted from 1) at x [rad, m]; for the last joint T_i-1_flange."""
    T = link_transform(model.links[i - 1], x)
    return compose(T, model.flange) if i == model.joint_count else T


def some_joints(model: RobotModel) -> Iterator[Joints]:
    """Yield an infinite sequence of joints in their ranges, always the same for the same model."""
    from random import Random  # here because few robots are measured

    random, limits = Random(SEED), list(zip(model.lower, model.upper, strict=True))
    while True:
        yield tuple(random.uniform(low, high) for low, high in limits)


def levers(model: RobotModel) -> tuple[Vector, tuple[float, ...]]:
    """Return a point on the axis of joint 1, and for each axis the greatest distance of the flange from it [m].

    The walk goes from the flange to its foot on the last axis, from there to the foot on the axis before, and so on.
    The distance between two feet changes only if a joint slides.
    """
    at, far, found = position(link_frames(model, (0.0,) * model.joint_count)[-1]), 0.0, list[float]()
    rows = zip(joint_axes(model), model.links, model.lower, model.upper, strict=True)
    for axis, link, low, high in reversed(list(rows)):
        foot = along(axis.point, axis.direction, dot(vector_difference(at, axis.point), axis.direction))
        far += dist(foot, at) + (max(abs(low), abs(high)) if link.kind is JointKind.PRISMATIC else 0.0)
        found.append(far)
        at = foot
    return at, tuple(reversed(found))
