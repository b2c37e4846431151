"""Bound how close a path comes to the limits of an arm's reach and to the singular poses of its closed form.

A closed form takes a square root that is 0 where the arm is stretched, folded, or as near to axis 1 as it can be, and
negative beyond the reach. It also takes the angle of a vector that is 0 where two axes of the wrist coincide. Along a
path of the hand these are smooth functions, and bounds of their derivatives follow from bounds of the hand's. With
|f''| <= m on a stretch of length h between a and b

    f >= min(f(a), f(b)) - m h2 / 8,

and the length of a vector is at least that of the chord less the same term. If a function stays above 0 by this bound,
the stretch is clear for certain, not only at samples. Source: Moore, Kearfott and Cloud, "Introduction to Interval
Analysis" (2009), chapter 6; the error of linear interpolation is in any book of numerical analysis.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import acos, degrees, dist, hypot, inf, sqrt

from msgspec import Struct

from vrs_cli.errors import LocationOutOfRange, LocationTooClose, LocationTooFar
from vrs_cli.kinematics import transform
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.model import ALL_PARTS, LEVEL, SAMPLES, STILL, STRAIGHT, RobotModel, axis_of, plane_normal
from vrs_cli.kinematics.transform import Transform, Vector

AXES: tuple[Vector, ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


CONSTANT = 1e-9  # [m, sine] smaller changes count as 0


class Forbidden(Struct, frozen=True):
    """The part of a pose that an arm cannot reach, in words, and the nearest pose that it can reach."""

    what: str
    right: Transform


class Unchanging(Struct, frozen=True):
    """The parts of a pose that no joint changes: positions of the flange along some directions [m], and the direction
    of its axis.
    """

    places: tuple[tuple[Vector, float], ...] = ()
    approach: Vector | None = None

    def allows(self, T: Transform) -> bool:
        """Return whether a pose has the values of these parts, so that no joint would have to change them."""
        at = transform.position(T)
        return (
            not self.places or all(abs(transform.dot(at, way) - value) <= LEVEL for way, value in self.places)
        ) and (self.approach is None or _angle(self.approach, axis_of(T).direction) <= STRAIGHT)

    def forbids(self, T: Transform) -> Forbidden | None:
        """Return the part of a pose of the flange that no joint can reach; None if there is none."""
        approach, at = self.approach, transform.position(T)
        if approach is not None and (tilt := _angle(approach, axis_of(T).direction)) > STRAIGHT:
            upright = "vertical, pointing " + ("down" if approach[2] < 0.0 else "up")
            points = upright if abs(approach[2]) > 1.0 - CONSTANT else "in one direction"
            what = f"keeps its tool {points}; the location tilts it by {degrees(tilt):.2f} deg"
            z = axis_of(T).direction  # to be turned to the approach axis by the smallest angle
            axis = (
                transform.any_normal(z)
                if dist(transform.cross(z, approach), STILL) < CONSTANT
                else transform.cross(z, approach)
            )
            return Forbidden(
                what,
                transform.at_position(transform.compose(transform.rotation_about(transform.unit(axis), tilt), T), *at),
            )
        for way, value in self.places:
            beside = transform.dot(at, way) - value
            if abs(beside) > LEVEL:
                what = f"moves in one plane, its flange would be {1000.0 * abs(beside):.1f} mm beside that"
                if way in AXES:
                    name, plane, flange = "XYZ"[AXES.index(way)], 1000.0 * value, 1000.0 * (value + beside)
                    what = f"moves in the plane {name} = {plane:.1f} mm of its own frame, "
                    what += f"its flange would be at {name} = {flange:.1f} mm"
                return Forbidden(what, transform.at_position(T, *transform.along(at, way, -beside)))
        return None


def unchanging(model: RobotModel, forward: Callable[[Joints], Transform]) -> Unchanging:
    """Return the parts of a pose that no joint changes, measured on sample poses. An arm with six freedoms has no such
    parts."""
    if model.joint_count >= ALL_PARTS and all(model.counts):
        return Unchanging()
    limits = list(zip(model.lower, model.upper, strict=True))
    poses = [forward(tuple(low + part * (high - low) for low, high in limits)) for part in SAMPLES]
    first, approach, normal = transform.position(poses[0]), axis_of(poses[0]).direction, plane_normal(model)
    kept = [way for way in AXES if _is_kept(way, poses)]
    if not kept and normal is not None and _is_kept(normal, poses):
        kept = [normal]
    steady = all(dist(axis_of(T).direction, approach) < CONSTANT for T in poses)
    return Unchanging(tuple((way, transform.dot(first, way)) for way in kept), approach if steady else None)


def difference(asked: Transform, instead: Transform) -> str:
    """Return as text the angles of the pose `instead`; if `asked` has the same angles, the coordinates that differ."""
    rows = list(zip("OAT", map(degrees, transform.to_oat(instead)), strict=True))
    if transform.angle_between(asked, instead) <= STRAIGHT:
        places = zip("XYZ", transform.position(asked), transform.position(instead), strict=True)
        rows = [(name, 1000.0 * b) for name, a, b in places if abs(a - b) > 0.5 * LEVEL]
    return ", ".join(f"{name} {round(x, 3) + 0.0:.10g}" for name, x in rows)


def _is_kept(way: Vector, poses: Sequence[Transform]) -> bool:
    """Return whether all these poses have the same coordinate along a direction."""
    first, *others = (transform.dot(transform.position(T), way) for T in poses)
    return all(abs(other - first) < CONSTANT for other in others)


def _angle(a: Vector, b: Vector) -> float:
    """Return the angle between two directions [rad]."""
    sine = dist(transform.cross(a, b), STILL)
    return sine if transform.dot(a, b) > 0.0 and sine < STRAIGHT else acos(min(max(transform.dot(a, b), -1.0), 1.0))


SINGULAR = 1e-10  # sine or [m] below which a joint's angle is noise
BOUNDARY = 1e-11  # allowed excess over the reach by rounding: cosine of the elbow, or [m2] at axis 1
ON_BOUNDARY = 1e-9  # [m, rad] distance at which a pose counts as on the boundary, or two wrist axes as coincident
UNKNOWN = -inf  # clearance without a known bound, because another clearance that it depends on may be 0


class Hand(Struct, frozen=True):
    """The point and the direction of the flange that a closed form follows, seen from a frame with z along axis 1."""

    T_axis_base: Transform
    centre: Vector  # centre of the wrist, in the flange's frame [m]
    approach: Vector  # direction of the last axis, in the flange's frame


class HandPace(Struct, frozen=True):
    """The maximum first and second derivatives of the motion of the hand on a path, by the parameter of the path.

    `across`: the part of the wrist centre's speed that is perpendicular to axis 1. `tilt`: the rate at which the last
    axis turns.
    """

    across: float
    across_bend: float
    speed: float
    bend: float
    tilt: float
    tilt_bend: float


class Clearance(Struct, frozen=True):
    """The clearances of a pose, or the minimum clearances on a path; infinite for edges that an arm does not have.

    `shoulder` [m2]: the squared distance of the wrist from axis 1, less the squared distance of the arm's plane from
    axis 1. `outer`, `inner` [m2]: how far the squared distance from the shoulder is below its maximum and above its
    minimum. `wrist`: the sine of the angle between two wrist axes; `across` is their cross product.
    """

    shoulder: float = inf
    outer: float = inf
    inner: float = inf
    wrist: float = inf
    across: Vector = (inf, 0.0, 0.0)

    @property
    def sizes(self) -> tuple[float, float, float, float]:
        """Return all clearances except the vector `across`."""
        return self.shoulder, self.outer, self.inner, self.wrist


SHOULDER, WRIST = 0, 3  # indexes in `sizes`


class TwoBars(Struct, frozen=True):
    """Two hinged bars that limit the reach, in a plane at the distance `side` from axis 1 [m]."""

    upper: float
    fore: float
    side: float

    @property
    def outer(self) -> float:
        return (self.upper + self.fore) ** 2

    @property
    def inner(self) -> float:
        return (self.upper - self.fore) ** 2

    def boundary(self) -> Clearance:
        """Return the clearances of a pose that is `ON_BOUNDARY` away from each boundary."""
        ends = self.side, self.upper + self.fore, self.upper - self.fore
        shoulder, outer, inner = (ON_BOUNDARY * (2.0 * abs(r) + ON_BOUNDARY) for r in ends)
        return Clearance(shoulder, outer, inner, ON_BOUNDARY)

    def fold(self, outer: float, inner: float) -> float:
        """Return the sine of the angle between the bars."""
        return sqrt(outer * inner) / (2.0 * self.upper * self.fore)

    def refusal(self, clearance: Clearance, end: str, hint: str) -> LocationOutOfRange:
        """Return the error for a pose with this clearance. `end`: the part of the arm at the end of the bars."""
        across = sqrt(max(clearance.shoulder + self.side * self.side, 0.0))
        if across < self.side:
            return LocationTooClose(
                f"the wrist would be {1000 * across:.1f} mm from the axis of joint 1, "
                f"it cannot come nearer than {1000 * self.side:.1f} mm",
                hint or f"move the location {1000 * (self.side - across):.1f} mm away from the axis",
                value=across,
                lower=self.side,
            )
        far, most, least = sqrt(max(self.outer - clearance.outer, 0.0)), self.upper + self.fore, sqrt(self.inner)
        where = f"{end} would be {1000 * far:.1f} mm from the shoulder, "
        if far > most:
            what = where + f"the arm reaches {1000 * most:.1f} mm"
            right = f"move the location {1000 * (far - most):.1f} mm nearer"
            return LocationTooFar(what, hint or right, value=far, upper=most)
        what = where + f"the folded arm comes no nearer than {1000 * least:.1f} mm"
        right = f"move the location {1000 * (least - far):.1f} mm away"
        return LocationTooClose(what, hint or right, value=far, lower=least)


class Turning(Struct, frozen=True):
    """Bounds of the motion of joint 1 and of the wrist centre, which is at least u from axis 1 in the arm's plane.

    With unit vectors r outward and t across, the wrist centre c seen from above, w = side and u = r . c: u q1' = t . c'
    and u' = r . c' + q1' w; the second derivatives follow from these equations.
    """

    rate: float  # maximum |q1'|: the angular velocity of joint 1
    bend: float
    outward: float  # maximum |u'|: how fast the wrist centre moves away from axis 1
    outward_bend: float


def turning(
    bars: TwoBars, a: float, b: float, pace: HandPace, h: float, *, beside_axis: bool
) -> tuple[float, Turning | None]:
    """Return the minimum of `shoulder` between two poses, and the bounds of the motion, or None if u may be 0.

    `beside_axis`: u is 0 on the whole path. Then joint 1 follows the wrist centre, or is at rest if the wrist centre is
    on the axis.
    """
    across, side = pace.across, bars.side
    far = sqrt(max(a, b, 0.0) + side * side) + 0.5 * across * h  # maximum distance of the wrist centre from axis 1
    shoulder = min(a, b) - 0.25 * h * h * (across * across + far * pace.across_bend)
    if beside_axis and side <= ON_BOUNDARY:
        return shoulder, Turning(0.0, 0.0, 0.0, 0.0)
    if beside_axis:
        return shoulder, Turning(across / side, pace.across_bend / side, 0.0, 0.0)
    if shoulder <= 0.0:
        return shoulder, None
    u = sqrt(shoulder)
    rate = across / u
    outward = across + rate * side
    bend = (pace.across_bend + rate * (across + outward)) / u
    outward_bend = pace.across_bend + 2.0 * rate * across + bend * side + rate * rate * far
    return shoulder, Turning(rate, bend, outward, outward_bend)


def from_shoulder(
    bars: TwoBars, a: Clearance, b: Clearance, speed: float, bend: float, h: float, beside: float = 0.0
) -> tuple[float, float]:
    """Return the minimum of `outer` and `inner` between two poses, for a point with these bounds of speed and second
    derivative.

    `beside`: the part of the point's squared distance from the shoulder that does not count for the reach [m2].
    """
    far = sqrt(max(bars.outer - min(a.outer, b.outer) + beside, 0.0)) + 0.5 * speed * h
    quarter = 0.25 * h * h
    outer = min(a.outer, b.outer) - quarter * far * bend  # a straight path is nearer to the shoulder than its ends
    return outer, min(a.inner, b.inner) - quarter * (speed * speed + far * bend)


def shortest(a: Vector, b: Vector, rate: float, bend: float, h: float) -> float:
    """Return a lower bound of the length of a vector between two values, from bounds of its first and second
    derivatives."""
    ax, ay, az = a
    dx, dy, dz = b[0] - ax, b[1] - ay, b[2] - az
    square = dx * dx + dy * dy + dz * dz
    part = min(max(-(ax * dx + ay * dy + az * dz) / square, 0.0), 1.0) if square else 0.0
    chord = hypot(ax + part * dx, ay + part * dy, az + part * dz)  # minimum distance from the origin
    return max(chord - 0.125 * bend * h * h, 0.5 * (hypot(*a) + hypot(*b) - rate * h))
