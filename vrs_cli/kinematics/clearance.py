"""Bound how close a path comes to the limits of an arm's reach and to the singular poses of its closed form.

A closed form takes the square root of a number that is 0 where the arm is stretched, folded, or as near to axis 1 as it
can be, and negative out of reach. It also takes the angle of a vector that is 0 where two axes of the wrist coincide.
Along a path of the hand, the number and the vector are smooth functions of the path parameter. Bounds of their
derivatives follow from bounds of the derivatives of the hand's motion. If |f''| <= m on an interval of length h between
a and b, then

    f >= min(f(a), f(b)) - m h^2 / 8,

and the length of a vector is at least the minimum length on the chord minus the same term. If this bound is above 0,
the whole interval is certain to be free of such poses, not only the samples. Source: Moore, Kearfott and Cloud,
"Introduction to Interval Analysis" (2009), chapter 6; the error of linear interpolation is in any textbook of numerical
analysis.
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


CONSTANT = 1e-9  # [m, sine] coordinates and directions that change less than this count as unchanging


class Forbidden(Struct, frozen=True):
    """The reason why an arm cannot reach a pose, as a message for users (`what`), and the nearest pose of the flange
    that the arm can reach (`right`).
    """

    what: str
    right: Transform


class Unchanging(Struct, frozen=True):
    """The coordinates and the direction of the flange that no joint of an arm can change. `places`: directions, and the
    constant coordinate of the flange along each [m]. `approach`: the constant direction of the flange's Z axis, None if
    it can change.
    """

    places: tuple[tuple[Vector, float], ...] = ()
    approach: Vector | None = None

    def allows(self, T: Transform) -> bool:
        """Return whether a pose of the flange agrees with the coordinates and the direction that this arm cannot
        change.
        """
        at = transform.position(T)
        return (
            not self.places or all(abs(transform.dot(at, way) - value) <= LEVEL for way, value in self.places)
        ) and (self.approach is None or _angle(self.approach, axis_of(T).direction) <= STRAIGHT)

    def forbids(self, T: Transform) -> Forbidden | None:
        """Return why no joints reach a pose of the flange, if it differs from what this arm cannot change; None if it
        agrees.
        """
        approach, at = self.approach, transform.position(T)
        if approach is not None and (tilt := _angle(approach, axis_of(T).direction)) > STRAIGHT:
            upright = "vertical, pointing " + ("down" if approach[2] < 0.0 else "up")
            points = upright if abs(approach[2]) > 1.0 - CONSTANT else "in one direction"
            what = f"keeps its tool {points}; the location tilts it by {degrees(tilt):.2f} deg"
            z = axis_of(T).direction  # turn this direction to the constant approach axis by the smallest angle
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


def find_unchanging(model: RobotModel, forward: Callable[[Joints], Transform]) -> Unchanging:
    """Return what no joint can change in the flange's pose, found by comparing sample poses. An arm with six degrees of
    freedom can change everything.
    """
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
    """Return a string with the angles O, A, T of the pose `instead` [deg]. If the pose `asked` has the same angles,
    return the coordinates of `instead` that differ [mm].
    """
    rows = list(zip("OAT", map(degrees, transform.to_oat(instead)), strict=True))
    if transform.angle_between(asked, instead) <= STRAIGHT:
        places = zip("XYZ", transform.position(asked), transform.position(instead), strict=True)
        rows = [(name, 1000.0 * b) for name, a, b in places if abs(a - b) > 0.5 * LEVEL]
    return ", ".join(f"{name} {round(x, 3) + 0.0:.10g}" for name, x in rows)


def _is_kept(way: Vector, poses: Sequence[Transform]) -> bool:
    """Return whether the positions of all these poses have the same coordinate along a direction."""
    first, *others = (transform.dot(transform.position(T), way) for T in poses)
    return all(abs(other - first) < CONSTANT for other in others)


def _angle(a: Vector, b: Vector) -> float:
    """Return the angle between two directions [rad]."""
    sine = dist(transform.cross(a, b), STILL)
    return sine if transform.dot(a, b) > 0.0 and sine < STRAIGHT else acos(min(max(transform.dot(a, b), -1.0), 1.0))


# [m, sine] the direction of a shorter vector is rounding noise, so a joint angle cannot be computed from it
SINGULAR = 1e-10
# excess over the reach that is accepted as rounding: of the elbow's cosine over 1, or in [m2] at axis 1
BOUNDARY = 1e-11
# [m, rad] a pose closer than this to the boundary of the reach counts as on the boundary; two wrist axes at a smaller
# angle count as coincident
ON_BOUNDARY = 1e-9
# stands for a clearance without a known lower bound, because another clearance that it depends on may be 0
UNKNOWN = -inf


class Hand(Struct, frozen=True):
    """The point and the direction fixed to the flange (wrist centre and last axis) from which a closed form computes
    clearances. `T_axis_base`: the base seen from a frame with z along axis 1.
    """

    T_axis_base: Transform
    centre: Vector  # centre of the wrist, in the flange's frame [m]
    approach: Vector  # direction of the last axis, in the flange's frame


class HandPace(Struct, frozen=True):
    """Upper bounds of the first and second derivatives of the hand's motion on a path, by the path parameter. Names
    with `bend` are second derivatives.

    `speed`: the speed of the wrist centre. `across`: the component of this speed perpendicular to axis 1. `tilt`: the
    rate at which the direction of the last axis turns.
    """

    across: float
    across_bend: float
    speed: float
    bend: float
    tilt: float
    tilt_bend: float


class Clearance(Struct, frozen=True):
    """The clearances of a pose (how far it is from poses that are out of reach or singular), or the minimum clearances
    on a path. A clearance is infinite if the arm has no such limit.

    `shoulder` [m2]: the squared distance of the wrist from axis 1, minus the squared distance of the arm's plane from
    axis 1. `outer`, `inner` [m2]: how far the wrist's squared distance from the shoulder is below its maximum (arm
    stretched) and above its minimum (arm folded). `wrist`: the sine of the angle between two wrist axes; `across` is
    their cross product.
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


SHOULDER, WRIST = 0, 3  # indexes of these clearances in `sizes`


class TwoBars(Struct, frozen=True):
    """The upper arm and forearm of lengths `upper` and `fore`, hinged at the elbow; they move in a plane at the
    distance `side` from axis 1 [m] and limit the reach.
    """

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
        """Return the clearances of a pose that is `ON_BOUNDARY` away from each limit of the reach; poses with smaller
        clearances count as on the limit.
        """
        ends = self.side, self.upper + self.fore, self.upper - self.fore
        shoulder, outer, inner = (ON_BOUNDARY * (2.0 * abs(r) + ON_BOUNDARY) for r in ends)
        return Clearance(shoulder, outer, inner, ON_BOUNDARY)

    def fold(self, outer: float, inner: float) -> float:
        """Return the sine of the angle between the bars from the clearances `outer` and `inner` [m2]."""
        return sqrt(outer * inner) / (2.0 * self.upper * self.fore)

    def refusal(self, clearance: Clearance, end: str, hint: str) -> LocationOutOfRange:
        """Return the error for a pose that is out of reach and has this clearance. `end`: the name, for the message, of
        the point where the two bars end, such as "the wrist". `hint`: replaces the usual hint if not empty.
        """
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
    """Upper bounds of the first and second derivatives of joint 1 (`rate`, `bend`) and of u (`outward`,
    `outward_bend`), the distance of the wrist centre from axis 1 in the plane of the arm.

    Let c be the wrist centre seen from above, r and t the unit vectors outward and across in the arm's frame, and w =
    side; then u = r . c. The bounds follow from u q1' = t . c' and u' = r . c' + q1' w, and from the derivatives of
    these equations.
    """

    rate: float  # maximum |q1'|: the angular velocity of joint 1
    bend: float
    outward: float  # maximum |u'|: how fast the wrist centre moves away from axis 1
    outward_bend: float


def turning_bounds(
    bars: TwoBars, a: float, b: float, pace: HandPace, h: float, *, beside_axis: bool
) -> tuple[float, Turning | None]:
    """Return a lower bound of the clearance `shoulder` between two poses where it is a and b, and the bounds of the
    motion, or None if u (see `Turning`) may be 0.

    `beside_axis`: u is 0 on the whole path. Joint 1 then follows the wrist centre, or is at rest if the wrist centre is
    on axis 1.
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
    """Return lower bounds of the clearances `outer` and `inner` on a path between two poses. `speed`, `bend`: bounds of
    the first and second derivative of the wrist's position. `h`: the length of the parameter interval.

    `beside`: the part of the wrist's squared distance from the shoulder that does not count for the reach [m2].
    """
    far = sqrt(max(bars.outer - min(a.outer, b.outer) + beside, 0.0)) + 0.5 * speed * h
    quarter = 0.25 * h * h
    # no term for the speed: a straight path is nowhere farther from the shoulder than at its farther end
    outer = min(a.outer, b.outer) - quarter * far * bend
    return outer, min(a.inner, b.inner) - quarter * (speed * speed + far * bend)


def shortest(a: Vector, b: Vector, rate: float, bend: float, h: float) -> float:
    """Return a lower bound of the length of a vector that changes from a to b over a parameter interval of length h.
    `rate`, `bend`: bounds of its first and second derivatives.
    """
    ax, ay, az = a
    dx, dy, dz = b[0] - ax, b[1] - ay, b[2] - az
    square = dx * dx + dy * dy + dz * dz
    part = min(max(-(ax * dx + ay * dy + az * dz) / square, 0.0), 1.0) if square else 0.0
    chord = hypot(ax + part * dx, ay + part * dy, az + part * dz)  # minimum distance of the chord from the origin
    return max(chord - 0.125 * bend * h * h, 0.5 * (hypot(*a) + hypot(*b) - rate * h))
