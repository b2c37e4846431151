"""How far the tool tip gets: the outermost points of the reach, with all joints inside their ranges."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from functools import lru_cache
from math import atan2, ceil, cos, pi, sin

from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.transform import TURN, Vector, dot, moved_point

SCATTERED = 500  # poses to begin from
DIRECTIONS = 32  # a plane: the outline between two of them is at most 0.5 % of the reach too small
SWEEPS = 20  # over all joints, for one direction
LEAST = 1e-4  # [m] that a sweep has to gain for another one


Far = Callable[[Joints], float]  # how far joints bring the tip in one direction [m]


@lru_cache(maxsize=8)
def outermost(model: RobotModel, p_flange_tip: Vector) -> tuple[Vector, ...]:
    """Points of the reach of a tool tip, p_robot [m], that lie farthest out as seen from above and from the side (along
    Z and along Y): their convex outlines are those of the reach.
    """
    arm = arm_for(model)
    found = {moved_point(arm.forward(q), p_flange_tip): q for q in _scattered(model)}  # joints by their tip
    for u in _directions():
        best, latest = found[_best(found, u)], next(reversed(found.values()))  # that of the direction beside it
        for begin in (best, latest):
            q = _farthest(arm, _far(arm, p_flange_tip, u), begin)
            found[moved_point(arm.forward(q), p_flange_tip)] = q
    return tuple(dict.fromkeys(_best(found, u) for u in _directions()))


def _best(points: Iterable[Vector], direction: Vector) -> Vector:
    return max(points, key=lambda p: dot(direction, p))


def _directions() -> Iterator[Vector]:
    for k in range(DIRECTIONS):
        c, s = cos(TURN * k / DIRECTIONS), sin(TURN * k / DIRECTIONS)
        yield from ((c, s, 0.0), (c, 0.0, s))


def _scattered(model: RobotModel) -> Iterator[Joints]:
    """Poses all over the ranges of the joints: multiples of the roots of x^(n+1) = x + 1 fill a cube of n dimensions
    evenly (Roberts, The unreasonable effectiveness of quasirandom sequences, 2018).
    """
    n = model.joint_count
    root = 1.5
    for _ in range(30):
        root = (1.0 + root) ** (1.0 / (n + 1))
    for k in range(SCATTERED):
        parts = ((k + 1) * root ** -(i + 1) % 1.0 for i in range(n))
        yield tuple(low + part * (high - low) for low, high, part in zip(model.lower, model.upper, parts, strict=True))


def _far(arm: RobotArm, p_flange_tip: Vector, direction: Vector) -> Far:
    return lambda q: dot(direction, moved_point(arm.forward(q), p_flange_tip))


def _farthest(arm: RobotArm, far: Far, q: Joints) -> Joints:
    """Joints that bring the tip far that way: one joint after the other turned or slid to its best."""
    for _ in range(SWEEPS):
        before = far(q)
        for i in range(arm.model.joint_count):
            q = max((_with(q, i, x) for x in (q[i], *_candidates(arm, far, q, i))), key=far)
        if far(q) - before < LEAST:
            break
    return q


def _with(q: Joints, i: int, x: float) -> Joints:
    return (*q[:i], x, *q[i + 1 :])


def _candidates(arm: RobotArm, far: Far, q: Joints, i: int) -> Iterator[float]:
    """Where a joint brings the tip farthest: an end of its range or, where it turns, the crest of a cosine."""
    low, high = arm.model.lower[i], arm.model.upper[i]
    yield from (low, high)
    if arm.turning[i]:
        at_0, at_90, at_180 = (far(_with(q, i, x)) for x in (0.0, pi / 2, pi))
        crest = atan2(at_90 - (at_0 + at_180) / 2, (at_0 - at_180) / 2)
        turns = ceil((low - crest) / TURN)
        if crest + turns * TURN <= high:
            yield crest + turns * TURN
