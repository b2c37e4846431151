"""A segment (t_s, t_f, a): an interval of the timeline on which the path is polynomial in t - t_s.

In joint space each joint is a polynomial. In Cartesian space the position of the tool tip is three polynomials and
its orientation is a base rotation times rotations about fixed axes by polynomial angles:
R(t) = R_0 Rot(k_1, phi_1(t)) Rot(k_2, phi_2(t)) ...; both are given in the robot's own frame, as T_robot_tool [m, rad].
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterable, Iterator, Sequence
from enum import Enum
from itertools import chain, pairwise
from typing import Any, NamedTuple

from msgspec import Struct, structs

from vrs_cli.kinematics.joints import LIMIT_TOLERANCE, Configuration, Demands, Joints, Twist
from vrs_cli.kinematics.transform import (
    IDENTITY,
    Transform,
    Vector,
    compose,
    cross,
    rotate,
    rotation_about,
    scaled_vector,
    turned_about,
    vector_sum,
)
from vrs_cli.trajectory.polynomial import (
    Polynomial,
    derivative,
    derivative_at,
    extremes,
    second_derivative,
    third_derivative,
    turning_points,
    value,
    value_and_rate,
)
from vrs_cli.values.commands import Frames, Motion, MotionKind

STILL: Vector = (0.0, 0.0, 0.0)

_new = tuple.__new__


class Phase(Enum):
    """The kind of motion of the robot in a segment."""

    REST = "rest"
    ACCELERATE = "accelerate"
    BLEND = "blend"
    CRUISE = "cruise"
    DECELERATE = "decelerate"

    __hash__ = object.__hash__  # faster than the hash of Enum, which is a function in Python


class JointPath(Struct, eq=False, gc=False):
    """One polynomial for each joint [rad, m], all of the same degree; `s` below is t - t_s [s].

    Paths are compared by value. `pack` stores a path as contiguous doubles, which take a fifth of the memory but are
    slower to read. `packed_length`: the number of coefficients of a polynomial if the path is packed, else 0.
    """

    _rows: tuple[Polynomial, ...] | bytes
    packed_length: int = 0

    @classmethod
    def make_packed(cls, rows: Sequence[Sequence[float]]) -> JointPath:
        """Make a path whose coefficients are stored as contiguous doubles. Raises ValueError if the polynomials differ
        in their number of coefficients.
        """
        length = len(rows[0])
        if len(rows) == 6:  # six joints are by far the most frequent case
            a, b, c, d, e, f = rows
            if len(b) == length and len(c) == length and len(d) == length and len(e) == length and len(f) == length:
                return cls(_DOUBLES[6 * length].pack(*a, *b, *c, *d, *e, *f), length)
        numbers: list[float] = []
        for row in rows:
            if len(row) != length:
                raise ValueError(
                    f"polynomials of {min(map(len, rows))} and of {max(map(len, rows))} coefficients in one segment"
                )
            numbers += row
        return cls(_DOUBLES[len(numbers)].pack(*numbers), length)

    @property
    def coefficients(self) -> tuple[Polynomial, ...]:
        rows = self._rows
        return tuple(_DOUBLES[self.packed_length].iter_unpack(rows)) if isinstance(rows, bytes) else rows

    def pack(self) -> None:
        """Replace the polynomials by their contiguous doubles."""
        if not isinstance(self._rows, bytes):
            self.packed_length, self._rows = self.degree + 1, self.doubles()

    def doubles(self) -> bytes:
        """Return the coefficients of all joints as contiguous doubles, joint by joint."""
        rows = self._rows
        if isinstance(rows, bytes):
            return rows
        return _DOUBLES[len(rows[0]) * len(rows)].pack(*chain.from_iterable(rows))

    def __eq__(self, other: object) -> bool:
        return isinstance(other, JointPath) and (
            (self._rows, self.packed_length) == (other._rows, other.packed_length)
            or self.coefficients == other.coefficients
        )

    def __ne__(self, other: object) -> bool:  # without it, the __ne__ of Struct would compare identities
        return not self == other

    def __hash__(self) -> int:
        return hash(self.coefficients)

    def __repr__(self) -> str:
        return f"JointPath({self.coefficients})"

    def joints(self, s: float) -> Joints:
        """Return the joints [rad, m] at t_s + s."""
        rows = self._rows
        if isinstance(rows, bytes):
            if len(rows) == _SIX and self.packed_length == 3:  # the most frequent query: six joints on parabolas
                p1, v1, h1, p2, v2, h2, p3, v3, h3, p4, v4, h4, p5, v5, h5, p6, v6, h6 = _six_parabolas(rows)
                return (
                    p1 + s * (v1 + s * h1),
                    p2 + s * (v2 + s * h2),
                    p3 + s * (v3 + s * h3),
                    p4 + s * (v4 + s * h4),
                    p5 + s * (v5 + s * h5),
                    p6 + s * (v6 + s * h6),
                )
            degree, polynomials = self.packed_length - 1, _DOUBLES[self.packed_length].iter_unpack(rows)
        else:
            degree, polynomials = len(rows[0]) - 1, iter(rows)
        if degree == 2:  # the two most frequent degrees are written out, because this is faster
            return tuple([a + s * (b + s * c) for a, b, c in polynomials])
        if degree == 1:
            return tuple([a + s * b for a, b in polynomials])
        return tuple([value(a, s) for a in polynomials])

    @property
    def joint_count(self) -> int:
        rows = self._rows
        return len(rows) // (DOUBLE_BYTES * self.packed_length) if isinstance(rows, bytes) else len(rows)

    @property
    def degree(self) -> int:
        rows = self._rows
        return (self.packed_length if isinstance(rows, bytes) else len(rows[0])) - 1

    def velocity(self, s: float) -> Joints:
        """Return the joint velocities [rad/s, m/s] at t_s + s."""
        rows = self.coefficients
        if len(rows[0]) == 3:  # parabolas are by far the most frequent case
            return tuple([v + s * (0.0 + 2.0 * half) for _, v, half in rows])
        return tuple([value(derivative(a), s) for a in rows])

    def acceleration(self, s: float) -> Joints:
        """Return the joint accelerations [rad/s2, m/s2] at t_s + s."""
        return tuple([second_derivative(a, s) for a in self.coefficients])

    def extremes(self, duration: float, order: int = 0) -> list[tuple[float, float]]:
        """Return the minimum and the maximum of every joint over `duration` [s], or of its derivative of the given
        order.
        """
        rows = self.coefficients
        for _ in range(order):
            rows = tuple(derivative(a) for a in rows)
        return [extremes(a, duration) for a in rows]

    def stays_inside(self, lower: Joints, upper: Joints, duration: float) -> bool:
        """Return whether every joint is inside its range at the end and at all of its turning points. Positions may
        exceed the range by LIMIT_TOLERANCE.
        """
        for a, least, most in zip(self.coefficients, lower, upper, strict=True):
            low, high = least - LIMIT_TOLERANCE, most + LIMIT_TOLERANCE
            if len(a) == 4:
                p, v, half, sixth = a
                way = duration * (abs(v) + duration * (abs(half) + duration * abs(sixth)))
                if low + way <= p <= high - way:  # a cubic with these coefficients moves no farther than `way`
                    continue
            if not low <= value(a, duration) <= high:
                return False
            if len(a) == 3:  # parabolas are by far the most frequent case
                p, v, half = a
                if v * (v + 2.0 * half * duration) < 0.0 and not low <= p - 0.25 * v * v / half <= high:
                    return False
            elif len(a) > 3 and not all(low <= value(a, s) <= high for s in turning_points(a, duration)):
                return False
        return True


class _Layouts(dict[int, struct.Struct]):  # a dictionary, because calling a cached function takes twice as long
    def __missing__(self, count: int) -> struct.Struct:
        return self.setdefault(count, struct.Struct(f"{count}d"))


_DOUBLES = _Layouts()  # the layout of contiguous doubles, by their number
DOUBLE_BYTES = 8
_SIX = 6 * 3 * DOUBLE_BYTES  # size of the packed parabolas of six joints [bytes]
_six_parabolas = _DOUBLES[6 * 3].unpack


class Turn(NamedTuple):
    """A rotation about a fixed unit axis (in the frame that the earlier turns have rotated) by a polynomial angle
    [rad].
    """

    axis: tuple[float, float, float]
    angle: Polynomial


class Guide(Struct, frozen=True):
    """A condition on redundant joints along a path: the weighted sum of all joints is `value` [rad], a polynomial in
    time.

    If one weight is 1 and the others are zero, `value` is the position of one joint.
    """

    weights: Joints
    value: Polynomial


class CartesianPath(Struct, frozen=True):
    """A path on which the tool tip follows polynomials, and inverse kinematics in one constant configuration gives the
    joints.

    There is one guide for each redundant joint. `seeds` are the joints at t_s, t_s + seed_interval, ...: they select
    the revolution of joints that can turn more than once, and joint 4 at a wrist singularity, so that g is continuous
    and needs no history.
    """

    position: tuple[Polynomial, Polynomial, Polynomial]
    orientation: Transform  # R_0; its position is not used
    turns: tuple[Turn, ...]
    configuration: Configuration
    seeds: tuple[Joints, ...]
    seed_interval: float
    guides: tuple[Guide, ...] = ()

    @property
    def joint_count(self) -> int:
        return len(self.seeds[0])

    def demands(self, s: float, order: int = 0) -> Demands:
        """Return (weights, required sum) of each guide at t_s + s, or (`order` > 0) with the derivative of the sum."""
        return tuple([(guide.weights, derivative_at(guide.value, s, order)) for guide in self.guides])

    def seed(self, s: float) -> Joints:
        """Return the stored seed joints whose time is nearest to t_s + s."""
        if len(self.seeds) == 1:
            return self.seeds[0]
        return self.seeds[min(max(round(s / self.seed_interval), 0), len(self.seeds) - 1)]

    def pose(self, s: float) -> Transform:
        """Return T_robot_tool at t_s + s."""
        return self.states()(s)[0]

    def twist(self, s: float) -> Twist:
        """Return the velocity of the tool tip and the angular velocity, in the robot's frame [m/s, rad/s]."""
        return self.states()(s)[1]

    def states(self) -> Callable[[float], tuple[Transform, Twist]]:
        """Return a function that maps s to (`pose`, `twist`); it is faster if many times of one path are needed."""
        (x, y, z), turns = self.position, self.turns
        if len(x) < 4 and len(y) < 4 and len(z) < 4 and (not turns or (len(turns) == 1 and len(turns[0][1]) < 4)):
            return _parabolic_states(self.position, self.orientation, turns)
        place, turned = _places(*self.position), _orientations(self.orientation, self.turns)

        def state(s: float) -> tuple[Transform, Twist]:
            x, vx, y, vy, z, vz = place(s)
            (nx, sx, ax, _, ny, sy, ay, _, nz, sz, az, _), (wx, wy, wz) = turned(s)
            return _new(Transform, (nx, sx, ax, x, ny, sy, ay, y, nz, sz, az, z)), (vx, vy, vz, wx, wy, wz)

        return state

    def twist_rate(self, s: float) -> Twist:
        """Return the acceleration of the tool tip and the angular acceleration [m/s2, rad/s2]."""
        alpha, (x, y, z) = STILL, self.position
        if len(self.turns) > 1:
            alpha = self._spin_rates(s)[0]
        elif self.turns:  # most paths have one turn; the acceleration is then along its axis
            ((axis, angle),) = self.turns
            second, (kx, ky, kz) = second_derivative(angle, s), rotate(self.orientation, axis)
            alpha = 0.0 + kx * second, 0.0 + ky * second, 0.0 + kz * second
        return (second_derivative(x, s), second_derivative(y, s), second_derivative(z, s), *alpha)

    def twist_rates(self, s: float) -> tuple[Twist, Twist]:
        """Return `twist_rate` and its time derivative, which consists of the linear jerk of the tool tip and the
        angular jerk [m/s3, rad/s3].
        """
        x, y, z = self.position
        alpha, beta = self._spin_rates(s) if self.turns else (STILL, STILL)
        return (
            (second_derivative(x, s), second_derivative(y, s), second_derivative(z, s), *alpha),
            (third_derivative(x, s), third_derivative(y, s), third_derivative(z, s), *beta),
        )

    def _spin_rates(self, s: float) -> tuple[Vector, Vector]:
        """Return angular acceleration and angular jerk. Each turn adds its own acceleration and jerk to the sums of
        the earlier turns, which also rotate the axis of this turn.
        """
        w = alpha = beta = STILL
        R = self.orientation
        before: Turn | None = None
        for axis, angle in self.turns:
            if before is not None:
                R = compose(R, rotation_about(before.axis, value(before.angle, s)))
            k, rate, second = rotate(R, axis), value_and_rate(angle, s)[1], second_derivative(angle, s)
            carried = cross(w, k)
            again = vector_sum(cross(alpha, k), cross(w, carried))
            beta = vector_sum(
                vector_sum(beta, scaled_vector(k, third_derivative(angle, s))), scaled_vector(carried, 2.0 * second)
            )
            beta = vector_sum(beta, scaled_vector(again, rate))
            alpha = vector_sum(vector_sum(alpha, scaled_vector(k, second)), scaled_vector(carried, rate))
            w = vector_sum(w, scaled_vector(k, rate))
            before = Turn(axis, angle)
        return alpha, beta


def _parabolic_states(
    rows: Sequence[Polynomial], R: Transform, turns: tuple[Turn, ...]
) -> Callable[[float], tuple[Transform, Twist]]:
    """Return the function of `CartesianPath.states` for parabolas with at most one turn, by far the most
    frequent case.
    """
    (x0, x1, x2), (y0, y1, y2), (z0, z1, z2) = [a if len(a) == 3 else (*a, 0.0, 0.0)[:3] for a in rows]
    if not turns:
        nx, sx, ax, _, ny, sy, ay, _, nz, sz, az, _ = R

        def shifted(s: float) -> tuple[Transform, Twist]:
            x, y, z = x0 + s * (x1 + s * x2), y0 + s * (y1 + s * y2), z0 + s * (z1 + s * z2)
            return (
                _new(Transform, (nx, sx, ax, x, ny, sy, ay, y, nz, sz, az, z)),
                (x1 + 2.0 * x2 * s, y1 + 2.0 * y2 * s, z1 + 2.0 * z2 * s, 0.0, 0.0, 0.0),
            )

        return shifted
    ((axis, angle),) = turns
    (kx, ky, kz), turned, (a0, a1, a2) = rotate(R, axis), turned_about(R, axis), (*angle, 0.0, 0.0)[:3]

    def turning(s: float) -> tuple[Transform, Twist]:
        rate = a1 + 2.0 * a2 * s
        return (
            turned(a0 + s * (a1 + s * a2), x0 + s * (x1 + s * x2), y0 + s * (y1 + s * y2), z0 + s * (z1 + s * z2)),
            (x1 + 2.0 * x2 * s, y1 + 2.0 * y2 * s, z1 + 2.0 * z2 * s, kx * rate, ky * rate, kz * rate),
        )

    return turning


def _places(
    x: Polynomial, y: Polynomial, z: Polynomial
) -> Callable[[float], tuple[float, float, float, float, float, float]]:
    """Return a function that maps s to the position and velocity along each axis: x, x', y, y', z, z'."""
    if len(x) == len(y) == len(z) == 4:
        return _cubic_places((*x, *y, *z))
    if max(len(x), len(y), len(z)) > 3:
        return lambda s: (*value_and_rate(x, s), *value_and_rate(y, s), *value_and_rate(z, s))
    (x0, x1, x2), (y0, y1, y2), (z0, z1, z2) = [
        (*a, 0.0, 0.0)[:3] for a in (x, y, z)
    ]  # parabolas are by far the most frequent case

    def place(s: float) -> tuple[float, float, float, float, float, float]:
        return (
            x0 + s * (x1 + s * x2),
            x1 + 2.0 * x2 * s,
            y0 + s * (y1 + s * y2),
            y1 + 2.0 * y2 * s,
            z0 + s * (z1 + s * z2),
            z1 + 2.0 * z2 * s,
        )

    return place


def _cubic_places(
    coefficients: Polynomial,
) -> Callable[[float], tuple[float, float, float, float, float, float]]:
    """Return the function of `_places` for three cubics, with the same arithmetic as `value_and_rate`."""
    x0, x1, x2, x3, y0, y1, y2, y3, z0, z1, z2, z3 = coefficients

    def place(s: float) -> tuple[float, float, float, float, float, float]:
        xx, yy, zz = x2 + s * x3, y2 + s * y3, z2 + s * z3
        x, y, z = x1 + s * xx, y1 + s * yy, z1 + s * zz
        return x0 + s * x, x + s * (xx + s * x3), y0 + s * y, y + s * (yy + s * y3), z0 + s * z, z + s * (zz + s * z3)

    return place


def _orientations(R: Transform, turns: tuple[Turn, ...]) -> Callable[[float], tuple[Transform, Vector]]:
    """Return a function that maps s to the orientation (ignore the position of this Transform) and the angular
    velocity.
    """
    if not turns:
        return lambda _: (R, STILL)
    (axis, angle), *others = turns
    (kx, ky, kz), turned = rotate(R, axis), turned_about(R, axis)
    later = [(another, turned_about(IDENTITY, another), polynomial) for another, polynomial in others]

    def orientation(s: float) -> tuple[Transform, Vector]:
        phi, rate = value_and_rate(angle, s)
        now, w = turned(phi), (kx * rate, ky * rate, kz * rate)
        for another, rotation, polynomial in later:
            phi, rate = value_and_rate(polynomial, s)
            w = vector_sum(w, scaled_vector(rotate(now, another), rate))
            now = compose(now, rotation(phi))
        return now, w

    return orientation


Path = JointPath | CartesianPath


class PackedMotion(Struct, frozen=True, gc=False):
    """A motion with a goal in joint space, stored in a third of the usual memory: only `number`, `goal` and `text` are
    its own; it takes all other fields from the motion `like`.
    """

    number: int
    goal: bytes
    text: str
    like: Motion

    @classmethod
    def of(cls, motion: Motion, before: PackedMotion | None) -> PackedMotion:
        """Pack a motion. `before`: the previously packed motion, which often has the same values in other fields."""
        goal, like = motion.goal or (), before.like if before else motion
        fields = zip(structs.astuple(motion), _fields(like, motion.number, motion.goal, motion.text), strict=True)
        # equal floats have the same bits, except 0.0 and -0.0
        known = all(a is b or (type(a) is type(b) is float and a == b != 0.0) for a, b in fields)
        return cls(motion.number, _DOUBLES[len(goal)].pack(*goal), motion.text, like if known else motion)

    @property
    def kind(self) -> MotionKind:
        return self.like.kind

    @property
    def frames(self) -> Frames:
        return self.like.frames

    def unpack(self) -> Motion:
        goal = _DOUBLES[len(self.goal) // DOUBLE_BYTES].unpack(self.goal)
        return Motion(*_fields(self.like, self.number, goal, self.text))


_NUMBER, _GOAL, _TEXT = map(Motion.__struct_fields__.index, ("number", "goal", "text"))


def _fields(like: Motion, number: int, goal: Joints | None, text: str) -> list[Any]:
    """Return the fields of a motion that differs from the motion `like` only in number, goal and text."""
    fields = list(structs.astuple(like))
    fields[_NUMBER], fields[_GOAL], fields[_TEXT] = number, goal, text
    return fields


class Segment(Struct, frozen=True, gc=False):
    """An interval of the timeline: `start` is t_s and `finish` t_f [s]; `motion` is the motion that contains the
    segment.

    A truncated segment keeps its path and finishes earlier; a shifted segment keeps its path exactly.
    """

    start: float
    finish: float
    path: Path
    phase: Phase
    motion: Motion

    @property
    def duration(self) -> float:
        return self.finish - self.start

    def moves(self, s: float) -> bool:
        """Return whether the robot moves at t_s + s: the segment is not a rest, and has not ended."""
        return self.phase is not Phase.REST and s < self.finish - self.start

    def shift_by(self, shift: float) -> Segment:
        if not shift:
            return self
        return Segment(self.start + shift, self.finish + shift, self.path, self.phase, self.motion)

    def truncate(self, finish: float) -> Segment:
        return Segment(self.start, finish, self.path, self.phase, self.motion)


def stay_inside(segments: Iterable[Segment], lower: Joints, upper: Joints) -> bool:
    """Return whether every joint stays in its range in all segments in joint space."""
    return all(
        segment.path.stays_inside(lower, upper, segment.duration)
        for segment in segments
        if isinstance(segment.path, JointPath)
    )


def rest(joints: Joints, duration: float, start: float, motion: Motion) -> Segment:
    """Make a segment in which the robot is at rest; its duration may be 0 if only the hand or the tool changes."""
    return Segment(start, start + duration, JointPath(tuple((q,) for q in joints)), Phase.REST, motion)


def stops_on_the_way(segments: Iterable[Segment]) -> Iterator[Segment]:
    """Yield each segment at whose end a straight-line motion stops before it continues."""
    for a, b in pairwise(segments):
        if a.motion.number == b.motion.number and (a.phase, b.phase) == (Phase.DECELERATE, Phase.ACCELERATE):
            yield a


# --- stretches -----------------------------------------------------------------------------------------------


class ToolStretch(Struct, frozen=True):
    """A piece of a straight-line motion before its joints are computed: the same polynomials as in `CartesianPath`,
    their duration [s], and the phase. `guides`: the `value` of each guide.
    """

    duration: float
    phase: Phase
    position: tuple[Polynomial, Polynomial, Polynomial]
    orientation: Transform
    turns: tuple[tuple[Vector, Polynomial], ...]
    guides: tuple[Polynomial, ...] = ()


def segments_of(start: float, motion: Motion, stretches: Iterator[tuple[float, Phase, Path]]) -> tuple[Segment, ...]:
    """Make consecutive segments of a motion from (duration, phase, path) triples, beginning at `start` [s]; leave out
    triples without duration.
    """
    segments = []
    for duration, phase, path in stretches:
        if duration > 0.0:
            segments.append(Segment(start, start + duration, path, phase, motion))
            start += duration
    return tuple(segments)
