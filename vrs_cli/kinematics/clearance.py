"""How far a pose is from the edges of what a closed form solves, and how near to them a way between two poses can come.

A closed form takes a square root of what is 0 where the arm is stretched, folded, or as near to the axis of joint 1 as
it comes, and less beyond the reach; and it takes the angle of a vector that is 0 where two axes of the wrist fall
together. Along a way of the hand these are smooth functions, as long as the ones before them are not 0, and bounds of
their derivatives follow from bounds of the hand's. With |f''| <= m on a stretch of length h between a and b

    f >= min(f(a), f(b)) - m h2 / 8,

and likewise for the length of a vector, which is at least that of the chord less as much. A stretch where one of these
is above 0 is clear, for certain, and not for all that was looked at. Source: Moore, Kearfott and Cloud, "Introduction
to Interval Analysis" (2009), chapter 6, and the error of linear interpolation in any book of numerical analysis.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import acos, degrees, dist, hypot, inf, sqrt
from typing import NamedTuple

from vrs_cli.errors import LocationOutOfRange, LocationTooClose, LocationTooFar
from vrs_cli.kinematics import transform
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.model import ALL_PARTS, LEVEL, SAMPLES, STILL, STRAIGHT, RobotModel, axis_of, plane_normal
from vrs_cli.kinematics.transform import Transform, Vector

AXES: tuple[Vector, ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


CONSTANT = 1e-9  # [m, sine] an arm that changes it by less does not


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
        return all(abs(transform.dot(transform.position(T), way) - value) <= LEVEL for way, value in self.places) and (
            self.approach is None or _angle(self.approach, axis_of(T).direction) <= STRAIGHT
        )

    def forbids(self, T: Transform) -> Forbidden | None:
        """Return what a pose of the flange asks for that no joint changes."""
        approach, at = self.approach, transform.position(T)
        if approach is not None and (tilt := _angle(approach, axis_of(T).direction)) > STRAIGHT:
            upright = "vertical, pointing " + ("down" if approach[2] < 0.0 else "up")
            points = upright if abs(approach[2]) > 1.0 - CONSTANT else "in one direction"
            what = f"keeps its tool {points}; the location tilts it by {degrees(tilt):.2f} deg"
            z = axis_of(T).direction  # turned the shortest way until it lies along the approach
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
    """The parts of a pose that no joint changes, seen on a few poses; none for an arm that has all six freedoms."""
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
    """The angles or coordinates to give in place of those of a location, as the user writes them."""
    rows = list(zip("OAT", map(degrees, transform.to_oat(instead)), strict=True))
    if transform.angle_between(asked, instead) <= STRAIGHT:
        places = zip("XYZ", transform.position(asked), transform.position(instead), strict=True)
        rows = [(name, 1000.0 * b) for name, a, b in places if abs(a - b) > 0.5 * LEVEL]
    return ", ".join(f"{name} {round(x, 3) + 0.0:.10g}" for name, x in rows)


def _is_kept(way: Vector, poses: Sequence[Transform]) -> bool:
    """Return whether all these poses are equally far along a direction."""
    first, *others = (transform.dot(transform.position(T), way) for T in poses)
    return all(abs(other - first) < CONSTANT for other in others)


def _angle(a: Vector, b: Vector) -> float:
    """Between two directions [rad]."""
    sine = dist(transform.cross(a, b), STILL)
    return sine if transform.dot(a, b) > 0.0 and sine < STRAIGHT else acos(min(max(transform.dot(a, b), -1.0), 1.0))


SINGULAR = 1e-10  # sine, or [m]: below it a joint's angle is noise
BOUNDARY = 1e-11  # cosine of the elbow, or [m2] at the axis of joint 1: rounding beyond the reach that is forgiven
ON_BOUNDARY = 1e-9  # [m, rad] within which a pose is on the boundary of the reach, or two axes of a wrist are one
UNKNOWN = -inf  # the least clearance where a clearance that it depends on may be 0


class Hand(NamedTuple):
    """What a closed form follows: a point and a direction of the flange, seen from a frame with z along axis 1."""

    T_axis_base: Transform
    centre: Vector  # of the wrist, in the flange's frame [m]
    approach: Vector  # along the last axis, in the flange's frame


class HandPace(NamedTuple):
    """The greatest first and second derivatives on a way of the hand, by whatever it is measured in.

    `across` is that part of the speed of the wrist's centre that is square to axis 1, `tilt` the rate of the last axis.
    """

    across: float
    across_bend: float
    speed: float
    bend: float
    tilt: float
    tilt_bend: float


class Clearance(NamedTuple):
    """Of a pose, or the least on a way; infinite what an arm does not have.

    `shoulder` [m2]: the square of the wrist's distance from axis 1, less that of the arm's plane. `outer` and `inner`
    [m2]: how much the square of the distance from the shoulder is below and above the ends of the reach. `wrist`: the
    sine between its axes, as long as which `across` is, their cross product.
    """

    shoulder: float = inf
    outer: float = inf
    inner: float = inf
    wrist: float = inf
    across: Vector = (inf, 0.0, 0.0)

    @property
    def sizes(self) -> tuple[float, float, float, float]:
        """Without `across`."""
        return self.shoulder, self.outer, self.inner, self.wrist


SHOULDER, WRIST = 0, 3  # among the sizes


class TwoBars(NamedTuple):
    """The lengths that bound a reach: two bars that fold, `side` of their plane from axis 1 [m]."""

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
        """The clearances at `ON_BOUNDARY` from each boundary."""
        ends = self.side, self.upper + self.fore, self.upper - self.fore
        shoulder, outer, inner = (ON_BOUNDARY * (2.0 * abs(r) + ON_BOUNDARY) for r in ends)
        return Clearance(shoulder, outer, inner, ON_BOUNDARY)

    def fold(self, outer: float, inner: float) -> float:
        """The sine of the angle between the bars."""
        return sqrt(outer * inner) / (2.0 * self.upper * self.fore)

    def refusal(self, clearance: Clearance, end: str, hint: str) -> LocationOutOfRange:
        """Why a pose of that clearance is out of reach; `end`: what is at the end of the bars."""
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


class Turning(NamedTuple):
    """Bounds of joint 1 and of the wrist's centre in the arm's plane, from the distance u of that from axis 1.

    With the unit vectors r outward and t across, c the wrist's centre seen from above, w = side and u = r . c:
    u q1' = t . c';  u' = r . c' + q1' w;  the second derivatives are those of these equations.
    """

    rate: float  # of joint 1
    bend: float
    outward: float  # of u
    outward_bend: float


def turning(u: float, far: float, side: float, pace: HandPace) -> Turning:
    """Where u is at least so much, and the wrist's centre at most `far` from axis 1."""
    rate = pace.across / u
    outward = pace.across + rate * side
    bend = (pace.across_bend + rate * (pace.across + outward)) / u
    return Turning(rate, bend, outward, pace.across_bend + 2.0 * rate * pace.across + bend * side + rate * rate * far)


def turning_beside_axis(side: float, pace: HandPace) -> Turning:
    """Where u is 0 all along, the wrist's centre `side` from axis 1: joint 1 turns with it, and stands still where it
    is on the axis.
    """
    if side <= ON_BOUNDARY:
        return Turning(0.0, 0.0, 0.0, 0.0)
    return Turning(pace.across / side, pace.across_bend / side, 0.0, 0.0)


def from_axis(bars: TwoBars, a: float, b: float, pace: HandPace, h: float) -> tuple[float, float]:
    """The least `shoulder` between two, and how far the wrist's centre is from axis 1 at most [m]."""
    far = sqrt(max(a, b, 0.0) + bars.side * bars.side) + 0.5 * pace.across * h
    return min(a, b) - 0.25 * h * h * (pace.across * pace.across + far * pace.across_bend), far


def from_shoulder(
    bars: TwoBars, a: Clearance, b: Clearance, speed: float, bend: float, h: float, beside: float = 0.0
) -> tuple[float, float]:
    """The least `outer` and `inner` between two, for a point of that speed and bend; `beside`: what the square of its
    distance from the shoulder has more than what is compared with the reach [m2].
    """
    far = sqrt(max(bars.outer - min(a.outer, b.outer) + beside, 0.0)) + 0.5 * speed * h
    quarter = 0.25 * h * h
    outer = min(a.outer, b.outer) - quarter * far * bend  # a straight way bulges inward only
    return outer, min(a.inner, b.inner) - quarter * (speed * speed + far * bend)


def shortest(a: Vector, b: Vector, rate: float, bend: float, h: float) -> float:
    """The least length of a vector between two values, from its greatest first and second derivative."""
    ax, ay, az = a
    dx, dy, dz = b[0] - ax, b[1] - ay, b[2] - az
    square = dx * dx + dy * dy + dz * dz
    part = min(max(-(ax * dx + ay * dy + az * dz) / square, 0.0), 1.0) if square else 0.0
    chord = hypot(ax + part * dx, ay + part * dy, az + part * dz)  # where it is nearest to the origin
    return max(chord - 0.125 * bend * h * h, 0.5 * (hypot(*a) + hypot(*b) - rate * h))
