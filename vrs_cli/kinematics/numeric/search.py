"""Any serial arm, without a closed form: damped least squares, within the limits of the joints.

Levenberg and Marquardt with the damping of Sugihara (2011), a part of the squared error: far from the goal a step
follows the gradient, near it it is Newton's. A search within the limits holds the joints at a limit that would leave
it, and may be caught there; one without limits passes, and three in four of what it finds are within the limits on
another turn. So both are made. Starts: the joints that are near, then a fixed sequence of others in the joints' ranges,
so that the same question always has the same answer: some first, and more where these find nothing.

An arm with fewer joints than six reaches a pose or does not; what misses by less than three decimals tell is reached.

An arm with more joints than the task has parts can be at one place in many ways. A MOVE takes what the search finds
from where the arm is. On a straight line the joints follow guides (`numeric.arm`), which makes it definite: they
are then a function of the pose and the instant alone.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice
from math import atan2, hypot
from random import Random

from vrs_cli.kinematics.joints import Joints, Twist
from vrs_cli.kinematics.model import ArmTask, RobotModel
from vrs_cli.kinematics.transform import Transform, Vector, cross, dot

CONVERGED = 1e-10  # [m, rad] an error that is none
STEPS = 60  # of one search
FREE_STEPS = 30  # in which one without limits is there, if it ever is
LARGEST_STEP = 0.5  # [rad, m] of a joint
DAMPING, LEAST_DAMPING = 0.1, 1e-13  # of the squared error; and beside that
HOPELESS = 1e-3  # a step, as a part of the error, from which steps that do not grow lead nowhere
NEWTON = 1e-3  # [m2, rad2] with less damping the step is Newton's, which costs half
SHORT, FEW = 0.35, 6  # [rad, m], of steps of Newton's method alone, which converges from there
LAST = 1e-6  # [rad, m] of a step after which the error is none
RATES = 1e-5  # of the rates of joints: so much of them may be wrong where they are planned
ROUNDS = (40, 160, 640)  # starts, of which later ones are tried where earlier ones found nothing
FEW_JOINTS = 2  # rounds of an arm that reaches few poses, and those by the first starts: most of its searches find none
SEED = 560
MEASURED = 16  # poses of a range over which freedoms are measured


def rounds(model: RobotModel, near: Joints) -> Iterator[list[Joints]]:
    """Where searches begin: `near`, the middle of the ranges and some of a fixed sequence; then more of it."""
    others = some_joints(model)
    middle = tuple((low + high) / 2 for low, high in zip(model.lower, model.upper, strict=True))
    first, *later = ROUNDS[:FEW_JOINTS] if model.joint_count < model.task.size else ROUNDS
    yield [near, middle, *islice(others, first)]
    yield from (list(islice(others, count)) for count in later)


def some_joints(model: RobotModel) -> Iterator[Joints]:
    """A fixed sequence of joints in their ranges, without an end."""
    random, limits = Random(SEED), list(zip(model.lower, model.upper, strict=True))
    while True:
        yield tuple(random.uniform(low, high) for low, high in limits)


def missing(task: ArmTask, have: Transform, want: Transform) -> Twist:
    """From one pose to another [m, rad]: the way, and the turn about axes of the base."""
    if task is ArmTask.POINTING:
        turn = turn_between((have.ax, have.ay, have.az), (want.ax, want.ay, want.az))
    else:
        turn = rotation_vector(have, want)
    return want.px - have.px, want.py - have.py, want.pz - have.pz, *turn


def turn_between(a: Vector, b: Vector) -> Vector:
    """The shortest rotation vector that brings direction a to b."""
    return as_long_as_angle(cross(a, b), dot(a, b))


def rotation_vector(have: Transform, want: Transform) -> Vector:
    """The rotation vector of R_want R_have^T, about axes of the base [rad]."""
    h, w = have, want
    x = 0.5 * (h.ny * w.nz - h.nz * w.ny + h.sy * w.sz - h.sz * w.sy + h.ay * w.az - h.az * w.ay)
    y = 0.5 * (h.nz * w.nx - h.nx * w.nz + h.sz * w.sx - h.sx * w.sz + h.az * w.ax - h.ax * w.az)
    z = 0.5 * (h.nx * w.ny - h.ny * w.nx + h.sx * w.sy - h.sy * w.sx + h.ax * w.ay - h.ay * w.ax)
    trace = (
        h.nx * w.nx + h.ny * w.ny + h.nz * w.nz
        + h.sx * w.sx + h.sy * w.sy + h.sz * w.sz
        + h.ax * w.ax + h.ay * w.ay + h.az * w.az
    )  # fmt: skip
    return as_long_as_angle((x, y, z), 0.5 * (trace - 1.0))


def as_long_as_angle(v: Vector, cosine: float) -> Vector:
    """A rotation vector that is as long as the sine of its angle, made as long as the angle."""
    sine = hypot(*v)
    if sine < 1e-12:  # no turn, or half a turn: about any axis, the next step sees which
        return v if cosine > 0.0 else (1e-3, 0.0, 0.0)
    factor = atan2(sine, cosine) / sine
    return v[0] * factor, v[1] * factor, v[2] * factor
