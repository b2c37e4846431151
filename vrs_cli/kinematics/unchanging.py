"""What no joint of an arm changes, as the tool of a SCARA, and what is said of a pose that asks for it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import acos, degrees, dist
from typing import NamedTuple

from vrs_cli.kinematics.axes import axis_of
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.model import ALL_PARTS, SAMPLES, RobotModel, plane_normal
from vrs_cli.kinematics.transform import (
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
    to_oat,
    unit,
)

LEVEL, STRAIGHT = 1e-5, 2e-4  # [m, rad] what a location may be beside the arm's plane or tilted: three decimals do it
AXES: tuple[Vector, ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
CONSTANT = 1e-9  # [m, sine] an arm that changes it by less does not


class Forbidden(NamedTuple):
    """What an arm cannot do about a pose of its flange, in words, and the nearest pose of which that is not so."""

    what: str
    right: Transform


class Unchanging(NamedTuple):
    """Positions of the flange along some directions [m], and the direction in which it points."""

    places: tuple[tuple[Vector, float], ...] = ()
    approach: Vector | None = None

    def allows(self, T: Transform) -> bool:
        """Whether `forbids` finds nothing."""
        return all(abs(dot(position(T), way) - value) <= LEVEL for way, value in self.places) and (
            self.approach is None or _angle(self.approach, axis_of(T).direction) <= STRAIGHT
        )

    def forbids(self, T: Transform) -> Forbidden | None:
        """What a pose of the flange asks for that no joint changes."""
        approach, at = self.approach, position(T)
        if approach is not None and (tilt := _angle(approach, axis_of(T).direction)) > STRAIGHT:
            what = f"keeps its tool {_direction(approach)}; the location tilts it by {degrees(tilt):.2f} deg"
            return Forbidden(what, _turned_along(T, approach))
        for way, value in self.places:
            beside = dot(at, way) - value
            if abs(beside) > LEVEL:
                return Forbidden(_plane(way, value, beside), at_position(T, *along(at, way, -beside)))
        return None


def unchanging(model: RobotModel, forward: Callable[[Joints], Transform]) -> Unchanging:
    """What no joint of a model changes, seen on a few poses; nothing for an arm that has all six freedoms."""
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
    """What to give instead of a location: the angles or the coordinates that differ, as the user writes them."""
    rows = list(zip("OAT", map(degrees, to_oat(instead)), strict=True))
    if angle_between(asked, instead) <= STRAIGHT:
        places = zip("XYZ", position(asked), position(instead), strict=True)
        rows = [(name, 1000.0 * b) for name, a, b in places if abs(a - b) > 0.5 * LEVEL]
    return ", ".join(f"{name} {round(x, 3) + 0.0:.10g}" for name, x in rows)


def _is_kept(way: Vector, poses: Sequence[Transform]) -> bool:
    """Whether all these poses are equally far along a direction."""
    first, *others = (dot(position(T), way) for T in poses)
    return all(abs(other - first) < CONSTANT for other in others)


def _plane(way: Vector, value: float, beside: float) -> str:
    """The message for a flange that would lie beside its plane."""
    if way not in AXES:
        return f"moves in one plane, its flange would be {1000.0 * abs(beside):.1f} mm beside that"
    axis, plane, flange = "XYZ"[AXES.index(way)], f"{1000.0 * value:.1f} mm", f"{1000.0 * (value + beside):.1f} mm"
    return f"moves in the plane {axis} = {plane} of its own frame, its flange would be at {axis} = {flange}"


def _angle(a: Vector, b: Vector) -> float:
    """Between two directions [rad]."""
    sine = dist(cross(a, b), (0.0, 0.0, 0.0))
    return sine if dot(a, b) > 0.0 and sine < STRAIGHT else acos(min(max(dot(a, b), -1.0), 1.0))


def _direction(approach: Vector) -> str:
    """Where a tool points that always points there, in words."""
    if abs(approach[2]) <= 1.0 - CONSTANT:
        return "in one direction"
    return "vertical, pointing down" if approach[2] < 0.0 else "vertical, pointing up"


def _turned_along(T: Transform, approach: Vector) -> Transform:
    """The pose at the same place, turned the shortest way until its Z lies along a direction."""
    z = axis_of(T).direction
    axis, angle = cross(z, approach), _angle(z, approach)
    if dist(axis, (0.0, 0.0, 0.0)) < CONSTANT:
        axis = any_normal(z)
    return at_position(compose(rotation_about(unit(axis), angle), T), *position(T))
