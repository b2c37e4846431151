"""How the joints that are too many go along a straight line: they follow guides, which are planned.

An arm with more joints than its task has parts can follow a line in endless ways. What it does here is a function of
the instant alone, exact, without integration: for each joint too many the sum of all joints, each by a weight, goes
from what it is to an end by the law of the line (`segment.Guide`). This is the augmented task of Sciavicco and
Siciliano ("A solution algorithm to the inverse kinematic problem for redundant manipulators", IEEE J. Robotics and
Automation 4(4), 1988) with a constant linear task.

Weights and ends come from a walk along the line with the pseudo-inverse, the shortest way of the joints, and a part of
the gradient towards the middle of their ranges in its null space (Liegeois, "Automatic supervisory control of the
configuration and behavior of multibody mechanisms", IEEE Trans. Systems, Man and Cybernetics 7(12), 1977). The weights
are the mean direction of the null space on the walk, in which the joints are free at its best; the ends are the sums
where the walk ends. Walks with other parts of the gradient are tried where the first one leads out of a range.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from math import sqrt
from operator import mul
from typing import NamedTuple

from vrs_cli.kinematics.elimination import damped
from vrs_cli.kinematics.joints import Asked, Joints, Walk
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.numeric.newton import NO_TWIST, Newton
from vrs_cli.kinematics.transform import Transform

PARTS = (0.0, 0.5, 1.0, 2.0, 4.0)  # of the gradient, over the whole walk
ENOUGH = 0.03  # of a range: a walk that keeps so far from the ends is taken at once
ROUNDING = 1e-9  # of a range
LEAST = 1e-6  # of a direction that counts
BEYOND = 0.02  # of a range: a walk, which is coarse, may leave it by so much where the line does not
THERE = 0.01  # [m, rad] a walk that misses its end by more has no way to it
DAMPING = 1e-9  # [m2, rad2] of the pseudo-inverse

Rows = Sequence[Sequence[float]]


class Follower(NamedTuple):
    """What an arm follows poses with: `missing` gives the rows of the Jacobian that count, and what is missing; `held`
    are the joints, by index, that the others miss least, as many as there are too many.
    """

    model: RobotModel
    held: tuple[int, ...]
    missing: Callable[[Joints, Transform], tuple[Rows, Sequence[float]]]
    newton: Newton


def walks(arm: Follower, begin: Joints, poses: Sequence[Transform], asked: Asked) -> Iterator[Walk]:
    """The walks from the joints `begin` through poses of the flange, theirs first, that arrive inside the ranges; the
    walk to try first first.

    Those that keep far from the ends of ranges, or as far as the walk begins, in the order of `PARTS`; then the others,
    the farther the sooner.
    """
    found, enough = list[Walk](), min(ENOUGH, _margin(arm.model, begin) - ROUNDING)
    free = len(begin) > arm.model.task.size + len(asked)
    for part in PARTS if free else PARTS[:1]:
        this = walk(arm, begin, poses, asked, part)
        if this.arrives and this.margin >= enough:
            yield this
        else:
            found.append(this)
    inside = [one for one in found if one.arrives and one.margin >= -BEYOND]
    yield from sorted(inside, key=lambda one: -one.margin)


def walk(arm: Follower, begin: Joints, poses: Sequence[Transform], asked: Asked, part: float) -> Walk:
    """With such a part of the gradient."""
    q, margin, total, steps = begin, 1.0, list[Joints](), len(poses) - 1
    axes = [_axis(joint, len(q)) for joint, _ in asked]
    others = [i for i in arm.held if i not in dict(asked)]
    basis = [_axis(joint, len(q)) for joint in others[: len(arm.held) - len(asked)]]
    for k, pose in enumerate(poses):
        held = [(axis, begin[i] + k / steps * (end - begin[i])) for axis, (i, end) in zip(axes, asked, strict=True)]
        step, basis = _step(arm, q, pose, held, basis, _inward(arm.model, q, part / len(poses)) if part else ())
        total = [_plus(a, 1.0, b) for a, b in zip(total, basis, strict=True)] if total else basis
        q = _plus(q, 1.0, step)
        margin = min(margin, _margin(arm.model, q))
    arrives = max(map(abs, arm.missing(q, poses[-1])[1])) < THERE
    return Walk(q, (*axes, *_orthonormal(total)), margin, arrives)


def _inward(model: RobotModel, q: Joints, part: float) -> Joints:
    """Against the gradient of the sum of the squares of where in its range each joint is, of a range of 1 rad about."""
    ranges = [high - low for low, high in zip(model.lower, model.upper, strict=True)]
    mean = sum(ranges) / len(ranges)
    rows = zip(q, model.lower, ranges, strict=True)
    return tuple([part * (low + 0.5 * size - x) * (mean / size) ** 2 for x, low, size in rows])


def _margin(model: RobotModel, q: Joints) -> float:
    """How far all joints are from the ends of their ranges, as a part of these; less than 0 beyond."""
    rows = zip(q, model.lower, model.upper, strict=True)
    return min([(x - low if x - low < high - x else high - x) / (high - low) for x, low, high in rows])


# --- the null space ----------------------------------------------------------------------------------------------


def _step(
    arm: Follower, q: Joints, pose: Transform, held: list[tuple[Joints, float]], near: list[Joints], inward: Joints
) -> tuple[Joints, list[Joints]]:
    """The shortest step to a pose and to sums that are held, with what leads `inward`, if anything, in the null space;
    and an orthonormal basis of that, each direction next to one of some others.
    """
    demands = (*held, *((unit, _dot(unit, q)) for unit in near))
    step, directions = Joints(), list[Joints]()
    for k in range(len(held), max(len(demands), len(held) + 1)):
        found = arm.newton(q, pose, demands, NO_TWIST, _axis(k, len(demands)))
        if found is None:
            return _damped_step(arm, q, pose, held), near
        step = found[0]
        directions.append(found[1])
    basis = _orthonormal(directions[: len(near)])
    for unit in basis:
        step = _plus(step, (_dot(unit, inward) if inward else 0.0) - _dot(unit, step), unit)
    return step, basis


def _damped_step(arm: Follower, q: Joints, pose: Transform, held: list[tuple[Joints, float]]) -> Joints:
    rows, error = arm.missing(q, pose)
    rest = [value - _dot(axis, q) for axis, value in held]
    return damped([*rows, *(axis for axis, _ in held)], [*error, *rest], DAMPING)


def _orthonormal(directions: Iterable[Joints]) -> list[Joints]:
    """By Gram and Schmidt, in their order."""
    basis = list[Joints]()
    for direction in directions:
        rest = direction
        for unit in basis:
            rest = _plus(rest, -_dot(rest, unit), unit)
        size = max(sqrt(_dot(rest, rest)), LEAST)
        basis.append(tuple([x / size for x in rest]))
    return basis


def _axis(joint: int, count: int) -> Joints:
    """The sum that is one joint alone."""
    return tuple([float(i == joint) for i in range(count)])


def _dot(a: Sequence[float], b: Sequence[float]) -> float:
    return float(sum(map(mul, a, b)))


def _plus(a: Joints, factor: float, b: Joints) -> Joints:
    return tuple([x + factor * y for x, y in zip(a, b, strict=True)])
