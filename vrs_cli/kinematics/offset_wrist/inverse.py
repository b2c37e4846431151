"""Six joints without a common point of the wrist: the arm of Universal Robots and its like, in closed form.

    i   theta   d     a    alpha
    1   q1      d1    0    +90 deg
    2   q2      d2    a2     0
    3   q3      d3    a3     0
    4   q4      d4    0    +90
    5   q5      d5    0    -90
    6   q6      d6    0      0

The axes of joints 2, 3 and 4 are parallel; joint 6 does not turn its own axis, and the axis of joint 5 leaves the plane
of the arm at w = d2 + d3 + d4 from the axis of joint 1. With p the origin of frame 5 and y = (s1, -c1, 0) the axes of
joints 2 to 4:  p . y = w  gives joint 1,  a . y = cos q5  joint 5,  (n . y, s . y) = sin q5 (c6, -s6)  joint 6, and two
bars a2 and a3 in the plane the rest. Source: Hawkins, "Analytic inverse kinematics for the Universal Robots" (2013).

The configurations, in V+'s words as they suit this arm:

    RIGHTY / LEFTY    the arm to the right / left of the axis of joint 1, seen along the arm
    ABOVE / BELOW     the elbow above / below the line from shoulder to wrist
    NOFLIP / FLIP     joint 5 positive (or zero) / negative, as on a PUMA

With the other wrist the plane of joints 2 to 4 has turned by half a turn about its normal: `lift` and `level`, the sine
and cosine of q2 + q3 + q4, change their signs.
"""

from __future__ import annotations

from collections.abc import Callable
from math import acos, atan2, cos, dist, pi, sin, sqrt
from typing import NamedTuple

from vrs_cli.kinematics.arm import Branch
from vrs_cli.kinematics.clearance import BOUNDARY, ON_BOUNDARY, SINGULAR
from vrs_cli.kinematics.joints import TURN, Configuration, Joints, Steps, six_turned_near
from vrs_cli.kinematics.model import EXACT, RobotModel
from vrs_cli.kinematics.transform import Transform

ALPHAS = (pi / 2, 0.0, 0.0, pi / 2, -pi / 2)


class Offsets(NamedTuple):
    """Lengths [m]; `right` is the side of the arm: +1.0 where w is positive, else -1.0."""

    d1: float
    a2: float
    a3: float
    side: float
    d5: float
    d6: float
    right: float


def offsets_of(model: RobotModel) -> Offsets | None:
    """The lengths of a model whose links have these alphas; None where it is not of this kind."""
    l1, l2, l3, l4, l5, l6 = model.links
    if max(abs(l1.a), abs(l4.a), abs(l5.a)) > EXACT or min(l2.a, l3.a) <= EXACT:
        return None
    side = l2.d + l3.d + l4.d
    return Offsets(l1.d, l2.a, l3.a, side, l5.d, l6.d, -1.0 if side < 0.0 else 1.0)


NOWHERE = (None, None, None, None)
ON_AXIS = SINGULAR * SINGULAR  # [m2]

Branches = Callable[[Transform], tuple[Joints | None, ...]]


def make_branches(offsets: Offsets, middle: Joints) -> Branches:
    """All eight joint vectors, in the order of `configuration.ALL`; None where the arm does not reach.

    Each joint is on the turn nearest to the middle of its range.
    """
    d1, a2, a3, side, d5, d6, right = offsets
    bars, twice = a2 * a2 + a3 * a3, 1.0 / (2.0 * a2 * a3)
    mid1, mid2, mid3, mid4, mid5, mid6 = middle
    low1, low2, low3, low4, low5, low6 = (angle - pi for angle in middle)
    high1, high2, high3, high4, high5, high6 = (angle + pi for angle in middle)

    def branches(T: Transform) -> tuple[Joints | None, ...]:
        nx, sx, ax, px, ny, sy, ay, py, nz, sz, az, pz = T
        x, y, z = px - d6 * ax, py - d6 * ay, pz - d6 * az - d1
        reach2 = x * x + y * y
        outward2 = reach2 - side * side
        if outward2 < -BOUNDARY:
            return NOWHERE + NOWHERE
        root = sqrt(outward2) if outward2 > 0.0 else 0.0
        found: tuple[Joints | None, ...] = ()
        for forward in (right, -right):
            if reach2 > ON_AXIS:
                c1 = (forward * root * x - side * y) / reach2
                s1 = (forward * root * y + side * x) / reach2
                q1 = atan2(s1, c1)
                if not low1 <= q1 <= high1:
                    q1 -= TURN * round((q1 - mid1) / TURN)
            else:  # joint 1 may stand anywhere
                q1, c1, s1 = mid1, cos(mid1), sin(mid1)
            n, s, c5 = nx * s1 - ny * c1, sx * s1 - sy * c1, ax * s1 - ay * c1  # along the axes of joints 2 to 4
            s5 = sqrt(n * n + s * s)
            q5, q6, other6, back = atan2(s5, c5), mid6, mid6, 1.0
            if s5 > ON_BOUNDARY:
                c6, s6, q6, back = n / s5, -s / s5, atan2(-s, n), -1.0
                other6 = q6 - pi if q6 > 0.0 else q6 + pi
                if not low6 <= q6 <= high6:
                    q6 -= TURN * round((q6 - mid6) / TURN)
                if not low6 <= other6 <= high6:
                    other6 -= TURN * round((other6 - mid6) / TURN)
            else:  # joint 6 may stand anywhere
                c6, s6 = cos(mid6), sin(mid6)
            u, v = c5 * c6, -c5 * s6  # x axis of frame 4 seen from the flange: (u, v, -s5)
            level = c1 * (nx * u + sx * v - ax * s5) + s1 * (ny * u + sy * v - ay * s5)
            lift = nz * u + sz * v - az * s5
            out = c1 * x + s1 * y
            solved: tuple[Joints | None, ...] = ()
            for _ in (1, 2):  # NOFLIP, then FLIP
                h, v = out - d5 * lift, z + d5 * level  # joint 4 in the arm's plane, outward and up
                k = (h * h + v * v - bars) * twice
                if not -1.0 < k < 1.0:
                    if -1.0 - BOUNDARY < k < 1.0 + BOUNDARY:
                        k = 1.0 if k > 0.0 else -1.0
                    else:
                        solved += (None, None)
                        lift, level, q5, q6 = back * lift, back * level, -q5, other6
                        continue
                bearing, pitch = atan2(v, h), atan2(lift, level)
                beside, bend = forward * atan2(a3 * sqrt((1.0 - k) * (1.0 + k)), a2 + a3 * k), forward * acos(k)
                turned5 = q5 if low5 <= q5 <= high5 else q5 - TURN * round((q5 - mid5) / TURN)
                for _ in (1, 2):  # ABOVE, then BELOW
                    q2, q3 = bearing + beside, -bend
                    q4 = pitch - q2 - q3
                    if not low2 <= q2 <= high2:
                        q2 -= TURN * round((q2 - mid2) / TURN)
                    if not low3 <= q3 <= high3:
                        q3 -= TURN * round((q3 - mid3) / TURN)
                    if not low4 <= q4 <= high4:
                        q4 -= TURN * round((q4 - mid4) / TURN)
                    solved += ((q1, q2, q3, q4, turned5, q6),)
                    beside, bend = -beside, -bend
                lift, level, q5, q6 = back * lift, back * level, -q5, other6
            above, below, other_above, other_below = solved
            found += (above, other_above, below, other_below)
        return found

    return branches


def make_branch(offsets: Offsets) -> Branch:
    """One branch: each joint on the turn nearest to `near`, whatever the limits; None where out of reach.

    Where joint 1 or joint 6 may stand anywhere it stays.
    """
    d1, a2, a3, side, d5, d6, right = offsets
    bars, twice = a2 * a2 + a3 * a3, 1.0 / (2.0 * a2 * a3)

    def branch(T: Transform, configuration: Configuration, near: Joints, steps: Steps | None = None) -> Joints | None:
        nx, sx, ax, px, ny, sy, ay, py, nz, sz, az, pz = T
        arm, elbow, wrist = configuration.signs
        forward = arm * right
        x, y = px - d6 * ax, py - d6 * ay
        reach2 = x * x + y * y
        outward2 = reach2 - side * side
        if steps is not None:
            steps.update(arm=arm, elbow=elbow, wrist=wrist, x=x, y=y, z=pz - d6 * az - d1, u2=outward2)
        if outward2 < -BOUNDARY:
            return None
        if reach2 > ON_AXIS:
            outward = forward * sqrt(outward2) if outward2 > 0.0 else 0.0
            c1, s1 = (outward * x - side * y) / reach2, (outward * y + side * x) / reach2
            q1 = atan2(s1, c1)
        else:
            q1, c1, s1 = near[0], cos(near[0]), sin(near[0])
        n, s, c5 = nx * s1 - ny * c1, sx * s1 - sy * c1, ax * s1 - ay * c1
        s5 = sqrt(n * n + s * s)
        if s5 > ON_BOUNDARY:
            c6, s6 = wrist * n / s5, -wrist * s / s5
            q6 = atan2(s6, c6)
        else:
            q6, c6, s6 = near[5], cos(near[5]), sin(near[5])
        s5 *= wrist
        u, v = c5 * c6, -c5 * s6
        level = c1 * (nx * u + sx * v - ax * s5) + s1 * (ny * u + sy * v - ay * s5)
        lift = nz * u + sz * v - az * s5
        h, v = c1 * x + s1 * y - d5 * lift, pz - d6 * az - d1 + d5 * level
        k = (h * h + v * v - bars) * twice
        if steps is not None:
            q5 = atan2(s5, c5)
            steps.update(u=c1 * x + s1 * y, q1=q1, c5=c5, s5=s5, q5=q5, q6=q6, lift=lift, level=level, h=h, v=v, k=k)
        if not -1.0 < k < 1.0:
            if not -1.0 - BOUNDARY < k < 1.0 + BOUNDARY:
                return None
            k = 1.0 if k > 0.0 else -1.0
        fold = -elbow * forward
        q2 = atan2(v, h) - fold * atan2(a3 * sqrt((1.0 - k) * (1.0 + k)), a2 + a3 * k)
        q3 = fold * acos(k)
        q4 = atan2(lift, level) - q2 - q3
        q5 = atan2(s5, c5)
        if steps is not None:
            steps.update(q3=q3, q2=q2, phi=q2 + q3 + q4, q4=q4)
        found = q1, q2, q3, q4, q5, q6
        return found if dist(found, near) < pi else six_turned_near(found, near)  # no joint is half a turn away

    return branch
