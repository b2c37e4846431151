"""State the equations for the joints of an arm of four or five joints (exact position, nearest orientation), and choose
start joints of searches.

An arm of four or five joints reaches each position in its range with many joint vectors, but not with every
orientation. It takes the joints whose orientation is nearest to the desired one. Let R be the rotation of the flange, W
the desired rotation, and phi the angle between them (the rotation error). Then

    1 - cos phi = (3 - trace(W^T R)) / 2

has a minimum only where its gradient by the joints is a linear combination of the gradients of the position, with
multipliers l (Lagrange's conditions; Nocedal and Wright, "Numerical Optimization", 2006, 12.3 and 18.1):

    P l - O e = 0,   p(q) - p = 0

where the rows of P and O are the effect of each joint on position and orientation [m/rad, 1], and e is the vector along
the axis of the rotation error whose length is the sine of its angle. There are as many equations as unknowns, so the
joints depend only on the pose: a closed path brings all joints back, and a possible pose is reached exactly.

The derivatives of the joints along a path follow from those of the conditions. The unknowns x (joints and multipliers)
satisfy F(x(t), t) = 0 at all times. The first derivative of this equation gives x'. If x is replaced by its own Taylor
polynomial of degree k - 1, the k-th derivative of F is -K x^(k), with K = dF/dx. The first derivative is exact; the
higher derivatives are computed from values of F at seven times, so close to each other that ten decimals are correct.

For arms whose axes 2 to 4 are parallel, such as most arms for teaching, searches start from a table. For each angle of
the last joint (of five), the position of the tip determines joint 1, with two solutions: the tip is at a known distance
from the plane in which joints 2 to 4 move. For each direction of the hand in this plane, joints 2 and 3 move two links
(from axis 2 to 3, and from axis 3 to 4), whose end must reach a known point, again with two solutions (vectors in the
plane are complex numbers). So the table contains all joints that reach a position, by the angle of the last joint and
the direction of the hand. Each local minimum of the rotation error is near an entry that is less than its neighbours.
The axes need to be parallel only within the accuracy of a measured robot, because a search makes the joints exact. For
other arms, searches start from the sample joints that bring the tool nearest to the pose.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cached_property
from math import cos, pi, sqrt
from typing import NamedTuple

import numpy as np

from vrs_cli.kinematics.arrays import Flags, Floats, rotation_about_batch
from vrs_cli.kinematics.compiled import formulas
from vrs_cli.kinematics.joints import TURN, Joints, Twist
from vrs_cli.kinematics.model import RobotModel, joint_axes, link_frames
from vrs_cli.kinematics.serial_batch import SerialBatch
from vrs_cli.kinematics.transform import Transform

PLACES = 3
# minimum curvature (second derivative of 1 - cos phi by the joints) of a local minimum; below this curvature, the
# direction is treated as undetermined
LEAST_CURVATURE = 1e-4


class Terms(NamedTuple):
    """The terms of the conditions (see above) for N joint vectors and desired poses.

    `place`, `turn` (N, n, 3): the effect of each joint on position and orientation (P and O). `away` (N, 3): the vector
    to the desired position [m]. `sine` (N, 3): e; `mixed` (N, 3, 3): R W^T, the rotation error as a matrix.
    """

    place: Floats
    turn: Floats
    away: Floats
    sine: Floats
    mixed: Floats

    @property
    def angle(self) -> Floats:
        """Return the rotation errors (N,) [rad]."""
        cosine = 0.5 * (np.trace(self.mixed, axis1=1, axis2=2) - 1.0)
        return np.asarray(np.arctan2(np.linalg.norm(self.sine, axis=1), cosine))


class SteadyConditions:
    """The conditions (equations) for the joints of one arm with one tool."""

    def __init__(self, batch: SerialBatch, T_flange_tool: Transform) -> None:
        self.batch, self.tool, self.joints = batch, T_flange_tool, batch.joints
        self.tip = np.array([T_flange_tool.px, T_flange_tool.py, T_flange_tool.pz])
        self.formulas = formulas(batch.model.links, batch.model.base, batch.model.flange)
        i = np.arange(self.joints)
        self.first, self.later = np.minimum.outer(i, i), np.maximum.outer(i, i)
        self.before = (i[:, None] > i)[None, :, :, None]  # [i, k] is true if joint k comes before joint i

    def terms(self, q: Floats, T: Floats) -> Terms:
        """Return the terms of the conditions for joints (N, n) and desired poses of the flange (N, 3, 4)."""
        if len(q) > 20:  # with more rows than this, functions for arrays are faster
            have, J = self.batch.forward(q), self.batch.jacobian(q, self.tool)
        else:  # for few rows, functions for floats are faster
            rows = q.tolist()
            have = np.array([self.formulas.forward(row) for row in rows]).reshape(-1, 3, 4)
            J = np.array([self.formulas.jacobian(row, *self.tool[3::4]) for row in rows]).reshape(-1, 6, self.joints)
        away = T[:, :, 3] - have[:, :, 3]
        if self.tip.any():
            away = away + (T[:, :, :3] - have[:, :, :3]) @ self.tip
        mixed = have[:, :, :3] @ np.swapaxes(T[:, :, :3], 1, 2)
        sine = 0.5 * np.stack(
            (mixed[:, 1, 2] - mixed[:, 2, 1], mixed[:, 2, 0] - mixed[:, 0, 2], mixed[:, 0, 1] - mixed[:, 1, 0]), axis=1
        )
        columns = np.swapaxes(J, 1, 2)
        return Terms(columns[:, :, :3], columns[:, :, 3:], away, sine, mixed)

    def multipliers(self, at: Terms, free: Flags | None = None) -> Floats:
        """Return the multipliers (N, 3) that satisfy the conditions of the free joints best (least squares). `free` (N,
        n): which joints are free; by default all.
        """
        pull, place = at.turn @ at.sine[:, :, None], at.place if free is None else at.place * free[:, :, None]
        across = np.swapaxes(place, 1, 2)
        return np.asarray(np.linalg.solve(across @ place + 1e-12 * np.eye(PLACES), across @ pull)[:, :, 0])

    def bend(self, at: Terms, multipliers: Floats) -> Floats:
        """Return the derivatives of P l - O e by the joints (N, n, n).

        An earlier joint rotates the effect of a later joint: d O_i / d q_k = O_k x O_i if k comes before i, else 0; d
        P_i / d q_k = O x P with O of the first joint and P of the later one.
        """
        moved = _cross(at.turn[:, self.first], at.place[:, self.later])
        turned = np.where(self.before, _cross(at.turn[:, None, :], at.turn[:, :, None]), 0.0)
        lost = 0.5 * (at.mixed - np.trace(at.mixed, axis1=1, axis2=2)[:, None, None] * np.eye(3))
        direct = at.turn @ lost @ np.swapaxes(at.turn, 1, 2)
        pulled = moved @ multipliers[:, None, :, None] - turned @ at.sine[:, None, :, None]
        return np.asarray(pulled[..., 0] - direct)

    def system(self, at: Terms, bend: Floats) -> Floats:
        """Return the matrix K of derivatives of all conditions by joints and multipliers (N, n + 3, n + 3). `bend`: the
        result of `bend`.
        """
        n, count = self.joints, len(bend)
        table = np.zeros((count, n + PLACES, n + PLACES))
        table[:, :n, :n] = bend
        table[:, :n, n:] = at.place
        table[:, n:, :n] = np.swapaxes(at.place, 1, 2)
        return table

    @staticmethod
    def residual(at: Terms, multipliers: Floats) -> Floats:
        """Return the residuals F of the conditions (N, n + 3)."""
        slope = at.place @ multipliers[:, :, None] - at.turn @ at.sine[:, :, None]
        return np.concatenate((slope[:, :, 0], -at.away), axis=1)

    @staticmethod
    def wanted_rates(at: Terms, twists: Floats) -> Floats:
        """Return the right sides (N, n + 3) of the equations K x' = ... for the rates of the unknowns, for desired
        twists of the tool (N, 6).
        """
        trace = np.trace(at.mixed, axis1=1, axis2=2)[:, None, None]
        turned = 0.5 * (trace * np.eye(3) - np.swapaxes(at.mixed, 1, 2)) @ twists[:, 3:, None]
        return np.concatenate(((at.turn @ turned)[:, :, 0], twists[:, :3]), axis=1)

    def newton(self, at: Terms, bend: Floats) -> tuple[Floats, Floats]:
        """Return the step of Newton's method (N, n) towards joints that satisfy the conditions, and the multipliers
        after the step (N, 3).
        """
        n = self.joints
        wanted = np.concatenate(((at.turn @ at.sine[:, :, None])[:, :, 0], at.away), axis=1)
        table = self.system(at, bend)
        table[:, n:, n:] -= 1e-13 * np.eye(PLACES)  # keeps the matrix regular if no joint changes the position
        try:
            solved = np.linalg.solve(table, wanted[:, :, None])[:, :, 0]
        except np.linalg.LinAlgError:  # at least one matrix is singular
            solved = (np.linalg.pinv(table) @ wanted[:, :, None])[:, :, 0]
        return np.asarray(solved[:, :n]), np.asarray(solved[:, n:])

    def is_least(self, at: Terms, bend: Floats) -> Flags:
        """Return whether the rotation error is a local minimum (N,): every joint motion that keeps the position
        increases it.
        """
        normal = np.swapaxes(at.place, 1, 2) @ at.place + 1e-12 * np.eye(PLACES)
        along = np.eye(self.joints) - at.place @ np.linalg.solve(normal, np.swapaxes(at.place, 1, 2))
        symmetric = 0.5 * (bend + np.swapaxes(bend, 1, 2))
        curved = along @ symmetric @ along + (np.eye(self.joints) - along)
        return np.asarray(np.linalg.eigvalsh(curved)[:, 0] > LEAST_CURVATURE)


def _cross(a: Floats, b: Floats) -> Floats:
    """Return cross products of vectors (..., 3). For few rows `np.cross` takes several times as long."""
    x, y, z = a[..., 0], a[..., 1], a[..., 2]
    u, v, w = b[..., 0], b[..., 1], b[..., 2]
    return np.stack((y * w - z * v, z * u - x * w, x * v - y * u), axis=-1)


OFFSETS = np.arange(-3.0, 4.0)
# weights of central differences at these offsets for the second and third derivative, of sixth and fourth order:
# Fornberg, "Generation of Finite Difference Formulas on Arbitrarily Spaced Grids", Mathematics of Computation 51
# (1988), table 1
SECOND = np.array([1 / 90, -3 / 20, 3 / 2, -49 / 18, 3 / 2, -3 / 20, 1 / 90])
THIRD = np.array([1 / 8, -1.0, 13 / 8, 0.0, -13 / 8, 1.0, -1 / 8])
STRIDE = 0.02  # [rad, m] maximum change of a joint between neighbouring times of the difference formulas


class CannotFollow(Exception):
    """Raised in a singular pose, where no joint rates can follow the path."""


class PointConditions:
    """The conditions at one point of a path: at joints q that solve the desired pose T_base_flange."""

    def __init__(self, conditions: SteadyConditions, q: Joints, T: Transform) -> None:
        self.conditions, self.q = conditions, np.array(q)
        self.at = conditions.terms(self.q[None], np.reshape(T, (1, 3, 4)))
        self.multipliers = conditions.multipliers(self.at)

    @property
    def freedom(self) -> float:
        """Return how well the joints move the tip, times how well they turn the tool while the tip is at rest. The
        product is the square root of |det K|, computed as if the orientation were reached exactly.
        """
        bend = self.at.turn @ np.swapaxes(self.at.turn, 1, 2)  # the value of `bend` if the rotation error is 0
        table = self.conditions.system(self.at, bend)
        return float(np.sqrt(abs(np.linalg.det(table[0]))))

    def rates(self, twist: Twist, poses: Callable[[float], Transform], order: int) -> tuple[Joints, ...]:
        """Return the first `order` derivatives of the joints [rad/s, rad/s2, rad/s3] along a path on which the tool
        should have this twist.

        `poses`: a function of the time from now [s] that returns the desired T_base_flange. Raises CannotFollow in a
        singular pose.
        """
        first = self._solve(self.conditions.wanted_rates(self.at, np.array([twist]))[0])
        if order == 1:
            return (self._of_joints(first),)
        # [s] interval between the seven times
        h = float(STRIDE / max(np.abs(first[: len(self.q)]).max(), STRIDE / 0.005))
        T = np.array([poses(offset * h) for offset in OFFSETS.tolist()]).reshape(-1, 3, 4)
        second = self._solve(-SECOND @ self._residuals(first, np.zeros_like(first), T, h) / h**2)
        if order == 2:
            return self._of_joints(first), self._of_joints(second)
        third = self._solve(-THIRD @ self._residuals(first, second, T, h) / h**3)
        return self._of_joints(first), self._of_joints(second), self._of_joints(third)

    def _residuals(self, first: Floats, second: Floats, T: Floats, h: float) -> Floats:
        """Return F (7, n + 3) at seven times, for unknowns that are extrapolated with their first and second
        derivatives.
        """
        t, n = (h * OFFSETS)[:, None], len(self.q)
        x = np.concatenate((self.q, self.multipliers[0])) + t * first + 0.5 * t * t * second
        return self.conditions.residual(self.conditions.terms(x[:, :n], T), x[:, n:])

    @cached_property
    def _table(self) -> Floats:
        table: Floats = self.conditions.system(self.at, self.conditions.bend(self.at, self.multipliers))[0]
        sizes = np.linalg.svd(table, compute_uv=False)
        # K counts as singular if its smallest singular value is below this fraction of the largest
        if sizes[-1] <= 1e-12 * sizes[0]:
            raise CannotFollow
        return table

    def _solve(self, wanted: Floats) -> Floats:
        return np.asarray(np.linalg.solve(self._table, wanted))

    def _of_joints(self, x: Floats) -> Joints:
        return tuple(x[: len(self.q)].tolist())


FIRST = 4  # number of joints in the table of starts: joint 1 turns the plane of the arm, joints 2 to 4 move within it
PARALLEL = 0.01  # [rad] maximum angle between axes that count as parallel
MIN_BAR_M = 1e-3  # [m] minimum length of a link for the table of starts
ROLLS, DIRECTIONS = (
    24,
    24,
)  # size of the table: number of angles of the last joint, and number of hand directions on each side of the shoulder
# hand directions, as fractions of their possible range. They are dense near the ends, where the links between axes 2
# and 4 turn fast, and leave out the ends, where the links are in line and a search could not choose the sign of the
# elbow angle.
PARTS = 0.5 - 0.5 * np.cos(np.linspace(0.02, pi - 0.02, DIRECTIONS))
# an entry of the table counts as reachable if it is out of reach by less than this fraction of the total length of both
# links
BEYOND = 0.02
OUTSIDE = 8.0  # [rad/rad] weight of the angles by which joints are outside their ranges, relative to the rotation error
# [rad] a table entry is not used as the starting point of a search if its rotation error exceeds the smallest by more
# than this
WORSE = 0.5
MAX_STARTS = 16


def is_planar(batch: SerialBatch) -> bool:
    """Return whether the table of starts fits an arm: axes 2 to 4 are parallel, and axis 1 is not parallel to them."""
    if batch.joints not in (FIRST, FIRST + 1) or not batch.turning.all():
        return False
    points, ways = (np.array(rows) for rows in zip(*joint_axes(batch.model), strict=True))
    bars = np.cross(ways[1], np.diff(points[1:FIRST], axis=0))
    leaning = np.linalg.norm(np.cross(ways[1], np.stack((ways[0], *ways[2:FIRST]))), axis=1)
    return bool(
        leaning[0] > 0.5 and (leaning[1:] < PARALLEL).all() and (np.linalg.norm(bars, axis=1) > MIN_BAR_M).all()
    )


class PlanarStarts:
    """Computes start joints of searches from a table, for one arm and the tip of one tool (3,) in the frame of the
    flange.
    """

    def __init__(self, batch: SerialBatch, tip: Floats) -> None:
        model, self.tip = batch.model, tip
        points, ways = (np.array(rows) for rows in zip(*joint_axes(model), strict=True))
        T = np.reshape(link_frames(model, (0.0,) * batch.joints)[-1], (3, 4))
        self.axis, self.point, self.normal = ways[0], points[0], ways[1]
        across = np.cross(self.normal, self.axis)
        across /= np.linalg.norm(across)
        # (3,) the dot product with it converts a vector to a complex number in the plane of the arm
        self.plane = across + 1j * np.cross(self.normal, across)
        self.signs = np.sign(ways[2:FIRST] @ self.normal)
        self.rolls = np.linspace(batch.lower[-1], batch.upper[-1], ROLLS) if batch.joints > FIRST else np.zeros(1)
        turns = rotation_about_batch(ways[-1], self.rolls if batch.joints > FIRST else np.zeros(1))[:, :, :3]
        # rotation of the flange for each angle of the last joint, the other joints at 0 (rolls, 3, 3)
        self.hands = turns @ T[:, :3]
        tips = points[-1] + turns @ (T[:, :3] @ tip + T[:, 3] - points[-1])
        self.beside = (tips - points[1]) @ self.normal  # distance of the tip from the plane of the arm [m] (rolls,)
        self.shoulder = points[1]
        self.upper, self.fore = np.diff(points[1:FIRST], axis=0) @ self.plane
        # vector from axis 4 to the tip, as a complex number in the plane [m] (rolls, 1)
        self.hand = ((tips - points[FIRST - 1]) @ self.plane)[:, None]
        self.bends, *reach = (np.array(rows) for rows in zip(*self._reach(model), strict=True))
        self.reach, self.slack = np.stack(reach), BEYOND * (abs(self.upper) + abs(self.fore))
        self.joints, self.middle, self.half = (
            batch.joints,
            (batch.lower + batch.upper) / 2,
            (batch.upper - batch.lower) / 2,
        )

    def of(self, T: Floats) -> Floats | None:
        """Return start joints (k, n) for a pose (3, 4): near those that bring the tip to its position with a locally
        least rotation error.

        Return no rows if the position is out of reach, and None if the tip is on axis 1, so that joint 1 may have any
        value.
        """
        out = T[:, :3] @ self.tip + T[:, 3] - self.point
        outward, sideways = out - self.axis * (self.axis @ out), np.cross(self.axis, out)
        a, b = self.normal @ outward, -self.normal @ sideways
        far = np.hypot(a, b)
        if far < 1e-6:  # [m] the tip counts as on axis 1 below this distance
            return None
        part = (self.beside + self.normal @ (self.shoulder - self.point - self.axis * (self.axis @ out))) / far
        # for each angle of the last joint: whether joint 1 has a solution; shape (rolls,)
        reached = np.abs(part) * far < far + self.slack
        # the two solutions of joint 1 for each angle of the last joint; shape (rolls, 2)
        q1 = np.arctan2(b, a) + np.arccos(np.clip(part, -1.0, 1.0))[:, None] * (1.0, -1.0)
        turned_back = np.cos(q1)[..., None] * outward - np.sin(q1)[..., None] * sideways
        place = (turned_back + self.axis * (self.axis @ out) + self.point - self.shoulder) @ self.plane
        angles, apart = self._in_plane(place)
        reached = reached[:, None, None, None, None] & (apart < self.slack)
        joints = np.empty((*angles[0].shape, self.joints))
        joints[..., 0], joints[..., -1] = q1[:, :, None, None, None], self.rolls[:, None, None, None, None]
        for i, angle in enumerate(angles, 1):
            joints[..., i] = angle
        joints[..., :FIRST] -= TURN * np.rint((joints[..., :FIRST] - self.middle[:FIRST]) / TURN)
        missed = self._residuals(q1, T, angles[0] + self.signs[0] * angles[1] + self.signs[1] * angles[2])
        outside = np.maximum(np.abs(joints - self.middle) - self.half, 0.0).sum(axis=-1)
        missed = np.where(reached, missed, np.inf)
        within = np.where(outside > 0.0, np.inf, missed)
        least = _least(within) | _least(missed + OUTSIDE * outside)
        # if the links only just reach a position, several directions give the same joints: keep one of them
        _, once = np.unique(np.round(joints[least], 6), axis=0, return_index=True)
        found, size = joints[least][once], (missed + OUTSIDE * outside)[least][once]
        order = np.argsort(size)[:MAX_STARTS]
        return np.asarray(found[order][size[order] < within.min() + WORSE])

    def _reach(self, model: RobotModel) -> Iterator[tuple[float, float, float]]:
        """Yield the signs of the elbow angle (between the two links) that the range of joint 3 allows, each with the
        minimum and maximum distance from shoulder to wrist [m].
        """
        upper, fore = abs(self.upper), abs(self.fore)
        straight = np.angle(self.fore) - np.angle(self.upper)
        ends = sorted((self.signs[0] * model.lower[2] + straight, self.signs[0] * model.upper[2] + straight))
        for sign in (1.0, -1.0):
            low, high = ends if sign > 0.0 else (-ends[1], -ends[0])
            turns = [TURN * k for k in range(-3, 4) if low - TURN * k <= pi and high - TURN * k >= 0.0]
            if turns:
                least = max(min([low - turn for turn in turns]), 0.0)
                most = min(max([high - turn for turn in turns]), pi)
                square, twice = upper * upper + fore * fore, 2.0 * upper * fore
                yield sign, sqrt(square + twice * cos(most)), sqrt(square + twice * cos(least))

    def _in_plane(self, place: Floats) -> tuple[tuple[Floats, Floats, Floats], Floats]:
        """Return joints 2 to 4, each with the dimensions (rolls, 2, 2, bends, directions): angles of the last joint, 2
        solutions of joint 1, 2 sides of the shoulder, signs of the elbow angle (bends), and hand directions. `place`
        (rolls, 2): the position of the tip relative to the shoulder, in the plane of the arm, as complex numbers.

        Also return, with the same dimensions, how far the wrist is beyond the reach of the two links between axes 2 and
        4 [m]; negative: within reach.
        """
        upper, fore, hand = np.abs(self.upper), np.abs(self.fore), np.maximum(np.abs(self.hand), MIN_BAR_M)[..., None]
        far = np.maximum(np.abs(place), MIN_BAR_M)[..., None]
        first, last = (
            np.arccos(np.clip((far**2 + hand**2 - r**2) / (2.0 * far * hand), -1.0, 1.0)) for r in self.reach
        )
        swing = first[..., None] + (last - first)[..., None] * PARTS
        shoulder = (np.angle(place) - np.angle(self.hand))[..., None, None, None]
        directions = shoulder + np.stack((swing, -swing), axis=2)
        wrist = place[..., None, None, None] - np.exp(1j * directions) * self.hand[..., None, None, None]
        reach = np.abs(wrist)
        apart = np.maximum(reach - self.reach[1, :, None], self.reach[0, :, None] - reach)
        bent = (
            np.arccos(np.clip((reach**2 - upper**2 - fore**2) / (2.0 * upper * fore), -1.0, 1.0)) * self.bends[:, None]
        )
        q2 = np.angle(wrist) - np.angle(upper + fore * np.exp(1j * bent)) - np.angle(self.upper)
        q3 = self.signs[0] * (bent - np.angle(self.fore) + np.angle(self.upper))
        return (q2, q3, self.signs[1] * (directions - q2 - self.signs[0] * q3)), apart

    def _residuals(self, q1: Floats, T: Floats, direction: Floats) -> Floats:
        """Return the rotation errors [rad] of the table's entries for a pose T. `direction`: the angle by which joints
        2 to 4 together rotate the hand about the normal of the plane.
        """
        back = rotation_about_batch(self.axis, q1.ravel())[:, :, :3].reshape(*q1.shape, 3, 3)
        rest = (self.hands @ T[:, :3].T)[:, None] @ back
        along = np.einsum("i,...ij,j->...", self.normal, rest, self.normal)
        across = np.trace(rest, axis1=-2, axis2=-1) - along
        x, y, z = self.normal
        around = (
            x * (rest[..., 1, 2] - rest[..., 2, 1])
            + y * (rest[..., 2, 0] - rest[..., 0, 2])
            + z * (rest[..., 0, 1] - rest[..., 1, 0])
        )
        along, across, around = (one[..., None, None, None] for one in (along, across, around))
        cosine = 0.5 * (along + across * np.cos(direction) + around * np.sin(direction) - 1.0)
        return np.asarray(np.arccos(np.clip(cosine, -1.0, 1.0)))


def _least(missed: Floats) -> Flags:
    """Return which entries of the table are not above their neighbours (in the first and last dimension)."""
    wide = np.pad(missed, ((1, 1), (0, 0), (0, 0), (0, 0), (1, 1)), constant_values=np.inf)
    least = np.isfinite(missed)
    for i in range(3):
        for k in range(3):
            least &= missed <= wide[i : i + missed.shape[0], ..., k : k + missed.shape[-1]]
    return least
