"""The axes of an arm as lines in space, and the Denavit-Hartenberg links that any axes have.

Where two arms have axes that lie alike, they are one arm: only the names of directions, zeros and frames differ. So a
closed form is written once, for one arrangement of links, and any robot whose axes lie so is solved by it.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import atan2, cos, hypot, sin, sqrt
from typing import NamedTuple

from vrs_cli.kinematics.joints import JointKind, Joints
from vrs_cli.kinematics.transform import (
    Transform,
    Vector,
    along,
    any_normal,
    compose,
    cross,
    dot,
    inverse,
    position,
    subtracted,
)

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


# --- links from axes ---------------------------------------------------------------------------------------------


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
        links.append(Link(step.a, dot(subtracted(step.foot, origin), z), step.alpha, theta, kind))
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
    between = subtracted(axis.point, origin)  # feet of the common normal, by Cramer's rule
    p, q = dot(between, z), dot(between, axis.direction)
    foot = along(origin, z, (p - cosine * q) / (sine * sine))
    onto = along(axis.point, axis.direction, (cosine * p - q) / (sine * sine))
    return _Step(
        normal, axis.direction, onto, foot, found if alpha is None else alpha, dot(subtracted(onto, foot), normal)
    )


def _parallel(z: Vector, origin: Vector, x: Vector | None, axis: AxisLine, alpha: float | None) -> _Step | None:
    if alpha is not None and abs(sin(alpha)) > EXACT:
        return None
    direction = axis.direction
    same = dot(z, direction) > 0.0
    if alpha is not None and same != (cos(alpha) > 0.0):
        direction, same = (-direction[0], -direction[1], -direction[2]), not same
    between = subtracted(axis.point, origin)
    across = along(between, z, -dot(between, z))
    a = hypot(*across)
    normal = (x or any_normal(z)) if a < EXACT else (across[0] / a, across[1] / a, across[2] / a)
    if a < EXACT:
        a = 0.0
    alpha = atan2(0.0, 1.0 if same else -1.0) if alpha is None else alpha
    return _Step(normal, direction, along(origin, normal, a), origin, alpha, a)
