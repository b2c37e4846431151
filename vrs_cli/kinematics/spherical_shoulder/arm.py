"""Solve arms with seven joints and a spherical shoulder in closed form, for a chosen value of joint 7.

    i   theta   d     a    alpha
    1   q1      d1    0    -90 deg
    2   q2      0     0    +90
    3   q3      d3    a3   +90
    4   q4      0     a4   -90
    5   q5      d5    0    +90
    6   q6      0     a6   +90
    7   q7      d7    0      0

Axes 1 to 3 meet in the shoulder, axes 5 and 6 in the wrist. Such arms are those of Franka (a3 = -a4, a6), the xArm 7,
and arms with a spherical wrist, such as the iiwa (a3 = a4 = a6 = 0). Source: He and Liu, "Analytical Inverse Kinematics
for Franka Emika Panda" (2021), with joint 7 as the redundant angle.

The pose and joint 7 determine the axes x6, z6 and z7 and the wrist. Let r be the vector from the shoulder to the wrist.
Its length gives two values of joint 4. Then r = m x4 + length z5, with z5 the axis of the forearm. As z5 is
perpendicular to z6, the equation r . z5 = length gives two values of joint 6, one for each sign of r . x5 = m cos q5.
Joints 1 and 2 bring z3 to the direction of the upper arm, with two solutions.

A pose is solved for values of joint 7 on a grid around its current value, and then on a finer grid around the best
value. For a pose close to the current pose the numerical search is tried first; it moves joint 7 no farther than
needed. It also solves singular poses (arm stretched, or joint 2 at 0), for which the closed form has no solution.

On a straight line the guide of `numeric.arm` prescribes a weighted sum of all joints. Newton's method varies joint 7
until the joints of the closed form have this sum. It needs the null-space motion: the rates of the joints while joint 7
turns and the flange rests. These rates, and those for a moving flange, have a closed form too. Let x, y, z be the
components of r along x6, z6 and z7, x', y', z' their rates, and e = r . x5:

    r . r' = -upper lower sin(q4 - kappa) q4'
    q5' = (y' - m' sin q5) / e,   q6' = (length' - x' sin q6 + z' cos q6) / e

Joints 1 to 3 make the remaining angular velocity of the forearm. On two in five random lines of 200 mm two of the eight
solutions come so close to each other that no smooth motion of joint 7 follows the line. Near such places all joints are
searched together, by the method of `numeric.arm`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from math import acos, atan2, ceil, copysign, cos, hypot, inf, pi, sin, sqrt
from typing import TYPE_CHECKING

from vrs_cli.kinematics.joints import Demands, Joints, Twist, six_turned_near, turn_within
from vrs_cli.kinematics.model import EXACT, Link, RobotModel
from vrs_cli.kinematics.numeric.arm import NumericArm
from vrs_cli.kinematics.numeric.search import CONVERGED, FEW, LAST, SHORT
from vrs_cli.kinematics.transform import Transform

if TYPE_CHECKING:
    from vrs_cli.kinematics.numeric.batch import NumericBatch

ALPHAS = (-0.5 * pi, 0.5 * pi, 0.5 * pi, -0.5 * pi, 0.5 * pi, 0.5 * pi)
VERTICAL = 1e-4  # if |sin q2| is smaller, axes 1 and 3 count as coincident, and the closed form gives no solution
# [rad] coarse and fine step of the grid of joint 7; the fine grid is tried if the coarse one gives no solution
STEPS = (0.5, 0.02)
CLOSE = 0.3  # [m, rad] for a pose closer than this to the current pose, the numerical search is tried first
# solutions coincide where the cosine of an angle between two bars is 1 or -1, or where the sine of joint 2 is 0: the
# closed form is used only if the cosine is smaller, and the sine larger, than this
CLEAR, BESIDE = 0.99998, 0.005
RATE_ERROR = 1e-6  # relative error of the joint rates that ends Newton's method on straight lines
HALVINGS = 5  # number of times the grid step is halved to refine the best value of joint 7


def has_spherical_shoulder(links: Sequence[Link]) -> bool:
    """Return whether axes 1 to 3 meet at one point and axes 5 and 6 also intersect. The link twists (alpha) must be
    those in the table above.
    """
    l1, l2, l3, l4, l5, l6, _ = links
    offsets = l1.a, l2.a, l5.a, l2.d, l4.d, l6.d
    return max(map(abs, offsets)) <= EXACT < min(hypot(l3.d, l3.a), hypot(l5.d, l4.a))


def make_branches(links: Sequence[Link]) -> Callable[[Transform, float], list[Joints]]:
    """Return a function of a pose and the value of joint 7 that returns up to eight solutions, without whole turns
    added.

    It leaves out solutions in which axes 1 and 3 coincide. `links`: the links of the table above, where theta is the
    offset of a joint's zero.
    """
    z1, z2, z3, z4, z5, z6, z7 = [link.theta for link in links]
    d1, _, d3, _, d5, _, d7 = [link.d for link in links]
    _, _, a3, a4, _, a6, _ = [link.a for link in links]
    kappa = atan2(d3 * a4 - a3 * d5, d3 * d5 + a3 * a4)  # theta of joint 4 at which the arm is stretched
    upper, lower = hypot(d3, a3), hypot(d5, a4)  # distances of axis 4 from the shoulder and from the wrist
    bars, twice = upper * upper + lower * lower, 2.0 * upper * lower

    def branches(T: Transform, q7: float) -> list[Joints]:
        nx, sx, ax, px, ny, sy, ay, py, nz, sz, az, pz = T
        found = list[Joints]()
        c7, s7 = cos(q7 + z7), sin(q7 + z7)
        xx, xy, xz = c7 * nx - s7 * sx, c7 * ny - s7 * sy, c7 * nz - s7 * sz  # axis x6
        yx, yy, yz = s7 * nx + c7 * sx, s7 * ny + c7 * sy, s7 * nz + c7 * sz  # axis z6
        rx, ry, rz = px - d7 * ax - a6 * xx, py - d7 * ay - a6 * xy, pz - d7 * az - a6 * xz - d1
        k = (rx * rx + ry * ry + rz * rz - bars) / twice
        if not -1.0 < k < 1.0:
            return found
        along, beside, ahead = rx * xx + ry * xy + rz * xz, rx * yx + ry * yy + rz * yz, rx * ax + ry * ay + rz * az
        across2, bend = along * along + ahead * ahead, acos(k)
        for t4 in (kappa + bend, kappa - bend):
            c4, s4 = cos(t4), sin(t4)
            m, length = a4 + a3 * c4 + d3 * s4, d5 - a3 * s4 + d3 * c4
            rest = across2 - length * length
            if rest <= 0.0:
                continue
            root, size = sqrt(rest), copysign(sqrt(rest + beside * beside), m)
            for e in (root, -root):  # both signs of r . x5
                s6, c6 = (length * along + e * ahead) / across2, (e * along - length * ahead) / across2
                c5, s5 = e / size, beside / size
                fx, fy, fz = s6 * xx - c6 * ax, s6 * xy - c6 * ay, s6 * xz - c6 * az  # axis z5
                x, y, z = c6 * xx + s6 * ax, c6 * xy + s6 * ay, c6 * xz + s6 * az  # axis x5
                tx, ty, tz = c5 * x + s5 * yx, c5 * y + s5 * yy, c5 * z + s5 * yz  # axis x4
                ux, uy, uz = s4 * tx + c4 * fx, s4 * ty + c4 * fy, s4 * tz + c4 * fz  # axis z3
                s2 = sqrt(ux * ux + uy * uy)
                if s2 < VERTICAL:
                    continue
                q1, q2, q3 = atan2(uy, ux) - z1, atan2(s2, uz), atan2(s5 * z - c5 * yz, s4 * fz - c4 * tz) - z3
                others = t4 - z4, atan2(s5, c5) - z5, atan2(s6, c6) - z6, q7
                found += [(q1, q2 - z2, q3, *others), (q1 + pi, -q2 - z2, q3 + pi, *others)]
        return found

    return branches


def make_state(links: Sequence[Link]) -> Callable[..., tuple[Joints, Joints] | None]:
    """Return a function that finds the joints at which a weighted sum of them has a prescribed value, and their rates.

    The function takes the pose T of the flange, joints `near` the solution, the twist of the flange, and the weights,
    the value and the rate of the sum. Elbow, wrist and shoulder stay bent to the same side as in `near`. Newton's
    method varies joint 7 until the sum has its value. The result is None if the method does not converge, or if the
    arm comes near a pose where two solutions with the same joint 7 meet.
    """
    z1, z2, z3, z4, z5, z6, z7 = [link.theta for link in links]
    d1, _, d3, _, d5, _, d7 = [link.d for link in links]
    _, _, a3, a4, _, a6, _ = [link.a for link in links]
    kappa = atan2(d3 * a4 - a3 * d5, d3 * d5 + a3 * a4)  # theta of joint 4 at which the arm is stretched
    upper2, lower2 = d3 * d3 + a3 * a3, d5 * d5 + a4 * a4
    bars, product = upper2 + lower2, sqrt(upper2 * lower2)

    def state(
        T: Transform, near: Joints, twist: Twist, weights: Joints, value: float, rate: float
    ) -> tuple[Joints, Joints] | None:
        nx, sx, ax, px, ny, sy, ay, py, nz, sz, az, pz = T
        six, q7 = near[:6], near[6]
        w1, w2, w3, w4, w5, w6, w7 = weights
        bent, turned, above = sin(near[3] + z4 - kappa), cos(near[4] + z5), copysign(1.0, sin(near[1] + z2))
        before, pz = LAST, pz - d1
        for _ in range(FEW):
            c7, s7 = cos(q7 + z7), sin(q7 + z7)
            xx, xy, xz = c7 * nx - s7 * sx, c7 * ny - s7 * sy, c7 * nz - s7 * sz  # axis x6
            yx, yy, yz = s7 * nx + c7 * sx, s7 * ny + c7 * sy, s7 * nz + c7 * sz  # axis z6
            rx, ry, rz = px - d7 * ax - a6 * xx, py - d7 * ay - a6 * xy, pz - d7 * az - a6 * xz
            k = 0.5 * (rx * rx + ry * ry + rz * rz - bars) / product
            if not -CLEAR < k < CLEAR:
                return None
            t4 = kappa + copysign(acos(k), bent)
            c4, s4 = cos(t4), sin(t4)
            along, beside, ahead = rx * xx + ry * xy + rz * xz, rx * yx + ry * yy + rz * yz, rx * ax + ry * ay + rz * az
            across2, m, length = along * along + ahead * ahead, a4 + a3 * c4 + d3 * s4, d5 - a3 * s4 + d3 * c4
            if length * length > CLEAR * across2:
                return None
            e = copysign(sqrt(across2 - length * length), m * turned)
            s6, c6 = (length * along + e * ahead) / across2, (e * along - length * ahead) / across2
            c5, s5 = e / m, beside / m
            fx, fy, fz = s6 * xx - c6 * ax, s6 * xy - c6 * ay, s6 * xz - c6 * az  # axis z5
            x, y, z = c6 * xx + s6 * ax, c6 * xy + s6 * ay, c6 * xz + s6 * az  # axis x5
            ox, oy, oz = c5 * yx - s5 * x, c5 * yy - s5 * y, c5 * yz - s5 * z  # axis z4
            tx, ty, tz = c5 * x + s5 * yx, c5 * y + s5 * yy, c5 * z + s5 * yz  # axis x4
            ux, uy, uz = s4 * tx + c4 * fx, s4 * ty + c4 * fy, s4 * tz + c4 * fz  # axis z3
            s2 = above * sqrt(ux * ux + uy * uy)
            if -BESIDE < s2 < BESIDE:
                return None
            c1, s1 = ux / s2, uy / s2
            q1, q2, q3 = atan2(s1, c1) - z1, atan2(s2, uz) - z2, atan2(-above * oz, above * (s4 * fz - c4 * tz)) - z3
            found = q1, q2, q3, t4 - z4, atan2(s5, c5) - z5, atan2(s6, c6) - z6
            q1, q2, q3, q4, q5, q6 = six_turned_near(found, six)
            # n1 to n6: the rates of joints 1 to 6 for 1 rad/s of joint 7 and a flange at rest
            lever = copysign(product * sqrt(1.0 - k * k), -bent)
            n4 = a6 * beside / lever
            n5, n6 = (along + a6 - (length - d5) * n4 * s5) / e, ((a4 - m) * n4 + beside * s6) / e
            wx, wy = -ax - n4 * ox - n5 * fx - n6 * yx, -ay - n4 * oy - n5 * fy - n6 * yy
            n3 = (c1 * wx + s1 * wy) / s2
            n1, n2 = -az - n4 * oz - n5 * fz - n6 * yz - uz * n3, c1 * wy - s1 * wx
            slope = w1 * n1 + w2 * n2 + w3 * n3 + w4 * n4 + w5 * n5 + w6 * n6 + w7
            missing = value - (w1 * q1 + w2 * q2 + w3 * q3 + w4 * q4 + w5 * q5 + w6 * q6 + w7 * q7)
            size = abs(missing) * hypot(n1, n2, n3, n4, n5, n6, 1.0)  # distance to the solution, times the slope
            if not size < SHORT * abs(slope):
                return None
            step, size = missing / slope, size / abs(slope)
            shrunk = (size / before) ** 2
            if shrunk < RATE_ERROR and shrunk * size < CONVERGED:
                break
            q7, before = q7 + step, size
        else:
            return None
        # v1 to v6: the rates that give the flange its twist, with joint 7 at rest
        vx, vy, vz, wx, wy, wz = twist
        vx, vy, vz = vx - wy * pz + wz * py, vy - wz * px + wx * pz, vz - wx * py + wy * px  # of the shoulder's place
        da, db, dh = vx * xx + vy * xy + vz * xz, vx * yx + vy * yy + vz * yz, vx * ax + vy * ay + vz * az
        v4 = (along * da + beside * db + ahead * dh) / lever
        v5, v6 = (db - (length - d5) * v4 * s5) / e, ((a4 - m) * v4 - da * s6 + dh * c6) / e
        wx, wy = wx - v4 * ox - v5 * fx - v6 * yx, wy - v4 * oy - v5 * fy - v6 * yy
        v3 = (c1 * wx + s1 * wy) / s2
        v1, v2 = wz - v4 * oz - v5 * fz - v6 * yz - uz * v3, c1 * wy - s1 * wx
        v7 = (rate - w1 * v1 - w2 * v2 - w3 * v3 - w4 * v4 - w5 * v5 - w6 * v6) / slope
        return (
            (q1 + n1 * step, q2 + n2 * step, q3 + n3 * step, q4 + n4 * step, q5 + n5 * step, q6 + n6 * step, q7 + step),
            (v1 + n1 * v7, v2 + n2 * v7, v3 + n3 * v7, v4 + n4 * v7, v5 + n5 * v7, v6 + n6 * v7, v7),
        )

    return state


class SphericalShoulderArm(NumericArm):
    """An arm with seven joints and a spherical shoulder. The methods are those of `arm.RobotArm`."""

    method = "closed form for each value of joint 7"

    def __init__(self, model: RobotModel, links: Sequence[Link]) -> None:
        super().__init__(model)
        self.links, self.branches_at, self._state = links, make_branches(links), make_state(links)

    def guided_state(
        self, T: Transform, near: Joints, demands: Demands, twist: Twist, rates: Sequence[float]
    ) -> tuple[Joints, Joints] | None:
        ((weights, value),), (rate,) = demands, rates
        found = self._state(T, near, twist, weights, value, rate)
        return super().guided_state(T, near, demands, twist, rates) if found is None else found

    def branches(self, T: Transform) -> tuple[Joints | None, ...]:
        """Return one solution, inside the limits if possible, with joint 7 as near to the middle of its range as the
        coarse grid allows.
        """
        for q7 in self._grid(self.middle[6], STEPS[0]):
            found, time = self._quicker(T, self.middle, q7, self.middle, inf)
            if time < inf:
                return (found,)
        return super().branches(T)

    def _least(self, T: Transform, near: Joints) -> Joints | None:
        """Return the solution inside the limits that the arm reaches soonest from `near`. If the pose is
        close to the flange's pose at `near`, return the solution that the numerical search finds from `near`.
        """
        if self.beyond(T):
            return None
        close = max(map(abs, self.missing(near, T)[1])) < CLOSE
        if close and (q := self._search(T, near, bounded=True)[0]) is not None:
            return q
        for step in STEPS:
            best, least = near, inf
            for q7 in self._grid(near[6], step):
                best, least = self._quicker(T, near, q7, best, least)
            if least < inf:
                for k in range(1, HALVINGS + 1):
                    for q7 in (best[6] - step * 0.5**k, best[6] + step * 0.5**k):
                        best, least = self._quicker(T, near, q7, best, least)
                return best
        return None if close else self._search(T, near, bounded=True)[0]

    def _grid(self, q7: float, step: float) -> list[float]:
        """Return the values q7 + k step (k an integer) in the range of joint 7, in order of their distance from q7."""
        low, high = self._limits[6]
        numbers = range(ceil((low - q7) / step), int((high - q7) / step) + 1)
        return sorted([q7 + k * step for k in numbers], key=lambda x: abs(x - q7))

    def _quicker(self, T: Transform, near: Joints, q7: float, best: Joints, least: float) -> tuple[Joints, float]:
        """Return the solution with this value of joint 7 that the arm reaches soonest from `near`, and the time it
        needs [s], if that is less than `least`.

        Otherwise return `best` and `least`, the best solution so far and its time.
        """
        if abs(q7 - near[6]) >= least * self.model.max_velocity[6]:
            return best, least
        for found in self.branches_at(T, q7):
            q, slowest = list[float](), 0.0
            for x, here, (low, high), velocity in zip(found, near, self._limits, self.model.max_velocity, strict=True):
                there = turn_within(x, here, low, high)
                if there is None or (time := abs(there - here) / velocity) >= least:
                    break
                q.append(there)
                slowest = max(slowest, time)
            else:
                best, least = tuple(q), slowest
        return best, least

    @cached_property
    def batch(self) -> NumericBatch:
        from vrs_cli.kinematics.numeric.batch import NumericBatch  # imported here because it loads numpy

        return NumericBatch(self.model, self.unchanging, self.still_joints, self.branches)
