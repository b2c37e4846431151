"""State the conditions for the joints of a short arm (exact place, nearest turn), and choose starts of searches.

An arm of four or five joints reaches each position in its range with many joint vectors, but not with every
orientation. It takes the joints whose orientation is nearest to the desired one. With the rotation R of the flange and
W the desired one, by the angle phi away from it,

    1 - cos phi = (3 - trace(W^T R)) / 2

is a minimum where its gradient by the joints is a linear combination of the gradients of the position, with multipliers
l (Lagrange's conditions; Nocedal and Wright, "Numerical Optimization", 2006, 12.3 and 18.1):

    P l - O e = 0,   p(q) - p = 0

with the rows P and O of the effect of each joint on position and orientation [m/rad, 1], and e the axis of the missing
turn, as long as its sine. There are as many equations as unknowns, so the joints are a function of the pose alone: a
closed path brings all joints back, and a possible pose is reached exactly.

The derivatives of the joints along a path follow from those of the conditions. With the unknowns x, joints and
multipliers, F(x(t), t) = 0 at all times. Its first derivative gives x'; if x is replaced by its own Taylor polynomial
of degree k - 1, the k-th derivative of F is -K x^(k), K = dF/dx. The first derivative is exact; the higher ones are
computed from values of F at seven times, near enough to each other for ten decimals.

Arms with parallel joints 2 to 4, as most arms for teaching, start from a table. For an angle of the last joint of five,
joint 1 follows from the place of the tip: it turns the plane of joints 2 to 4 to the distance of the tip from it, in
two ways. For each direction of the hand in that plane joints 2 and 3 are two bars that reach a point, in two ways
(complex numbers are vectors of the plane). So all joints that reach a place are a table over the angle of the last
joint and the direction of the hand, and each least turn is near an entry that is less than its neighbours. Axes need to
be parallel only as nearly as those of a measured robot: a search makes the joints exact. Other arms start from those of
many sample joints that bring the tip nearest to the place.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cached_property
from itertools import islice
from math import cos, pi, sqrt
from typing import NamedTuple

import numpy as np

from vrs_cli.kinematics.arrays import Flags, Floats, rotation_about_batch
from vrs_cli.kinematics.compiled import formulas
from vrs_cli.kinematics.joints import TURN, Joints, Twist
from vrs_cli.kinematics.model import RobotModel, joint_axes, link_frames, some_joints
from vrs_cli.kinematics.serial_batch import SerialBatch
from vrs_cli.kinematics.transform import Transform

PLACES = 3
LEAST_CURVATURE = 1e-4  # minimum second derivative of the cosine by the joints; below it a turn is nearly free


class Terms(NamedTuple):
    """The terms of the conditions for N joint vectors and poses.

    `place`, `turn` (N, n, 3): the effect of each joint on position and orientation. `away` (N, 3): the distance to the
    desired position [m]. `sine` (N, 3) and `mixed` = R W^T (N, 3, 3): the missing turn.
    """

    place: Floats
    turn: Floats
    away: Floats
    sine: Floats
    mixed: Floats

    @property
    def angle(self) -> Floats:
        """Return the missing turn (N,) [rad]."""
        cosine = 0.5 * (np.trace(self.mixed, axis1=1, axis2=2) - 1.0)
        return np.asarray(np.arctan2(np.linalg.norm(self.sine, axis=1), cosine))


class SteadyConditions:
    """The equations for the joints of one arm whose tool tip is at a given position."""

    def __init__(self, batch: SerialBatch, T_flange_tool: Transform) -> None:
        self.batch, self.tool, self.joints = batch, T_flange_tool, batch.joints
        self.tip = np.array([T_flange_tool.px, T_flange_tool.py, T_flange_tool.pz])
        self.formulas = formulas(batch.model.links, batch.model.base, batch.model.flange)
        i = np.arange(self.joints)
        self.first, self.later = np.minimum.outer(i, i), np.maximum.outer(i, i)
        self.before = (i[:, None] > i)[None, :, :, None]  # [i, k] is true if joint k comes before joint i

    def terms(self, q: Floats, T: Floats) -> Terms:
        """Return the terms for joints (N, n) and desired poses of the flange (N, 3, 4)."""
        if len(q) > 20:  # minimum number of rows for which arrays are faster
            have, J = self.batch.forward(q), self.batch.jacobian(q, self.tool)
        else:  # formulas for floats are faster for few rows
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
        """Return the multipliers (N, 3) that best satisfy the conditions of the free joints (N, n); by default all
        joints are free."""
        pull, place = at.turn @ at.sine[:, :, None], at.place if free is None else at.place * free[:, :, None]
        across = np.swapaxes(place, 1, 2)
        return np.asarray(np.linalg.solve(across @ place + 1e-12 * np.eye(PLACES), across @ pull)[:, :, 0])

    def bend(self, at: Terms, multipliers: Floats) -> Floats:
        """Return the derivatives of P l - O e by the joints (N, n, n).

        The first of two joints turns the effect of the later one: d O_i / d q_k = O_k x O_i, d P_i / d q_k = O x P.
        """
        moved = _cross(at.turn[:, self.first], at.place[:, self.later])
        turned = np.where(self.before, _cross(at.turn[:, None, :], at.turn[:, :, None]), 0.0)
        lost = 0.5 * (at.mixed - np.trace(at.mixed, axis1=1, axis2=2)[:, None, None] * np.eye(3))
        direct = at.turn @ lost @ np.swapaxes(at.turn, 1, 2)
        pulled = moved @ multipliers[:, None, :, None] - turned @ at.sine[:, None, :, None]
        return np.asarray(pulled[..., 0] - direct)

    def system(self, at: Terms, bend: Floats) -> Floats:
        """Return the derivatives of all conditions by joints and multipliers (N, n + 3, n + 3)."""
        n, count = self.joints, len(bend)
        table = np.zeros((count, n + PLACES, n + PLACES))
        table[:, :n, :n] = bend
        table[:, :n, n:] = at.place
        table[:, n:, :n] = np.swapaxes(at.place, 1, 2)
        return table

    @staticmethod
    def residual(at: Terms, multipliers: Floats) -> Floats:
        """Return the residuals of the conditions (N, n + 3)."""
        slope = at.place @ multipliers[:, :, None] - at.turn @ at.sine[:, :, None]
        return np.concatenate((slope[:, :, 0], -at.away), axis=1)

    @staticmethod
    def wanted_rates(at: Terms, twists: Floats) -> Floats:
        """Return the right sides (N, n + 3) of the equations for the unknowns' rates, for twists of the tool (N, 6)."""
        trace = np.trace(at.mixed, axis1=1, axis2=2)[:, None, None]
        turned = 0.5 * (trace * np.eye(3) - np.swapaxes(at.mixed, 1, 2)) @ twists[:, 3:, None]
        return np.concatenate(((at.turn @ turned)[:, :, 0], twists[:, :3]), axis=1)

    def is_least(self, at: Terms, bend: Floats) -> Flags:
        """Return whether every motion that keeps the position turns the tool away from the desired pose (N,)."""
        normal = np.swapaxes(at.place, 1, 2) @ at.place + 1e-12 * np.eye(PLACES)
        along = np.eye(self.joints) - at.place @ np.linalg.solve(normal, np.swapaxes(at.place, 1, 2))
        symmetric = 0.5 * (bend + np.swapaxes(bend, 1, 2))
        curved = along @ symmetric @ along + (np.eye(self.joints) - along)
        return np.asarray(np.linalg.eigvalsh(curved)[:, 0] > LEAST_CURVATURE)


def _cross(a: Floats, b: Floats) -> Floats:
    """Return cross products; numpy's take several times as long for few rows."""
    x, y, z = a[..., 0], a[..., 1], a[..., 2]
    u, v, w = b[..., 0], b[..., 1], b[..., 2]
    return np.stack((y * w - z * v, z * u - x * w, x * v - y * u), axis=-1)


OFFSETS = np.arange(-3.0, 4.0)
# central differences of the second and third derivative, of sixth and fourth order: Fornberg, "Generation of Finite
# Difference Formulas on Arbitrarily Spaced Grids", Mathematics of Computation 51 (1988), table 1
SECOND = np.array([1 / 90, -3 / 20, 3 / 2, -49 / 18, 3 / 2, -3 / 20, 1 / 90])
THIRD = np.array([1 / 8, -1.0, 13 / 8, 0.0, -13 / 8, 1.0, -1 / 8])
STRIDE = 0.02  # [rad, m] maximum change of a joint from one of these times to the next


class CannotFollow(Exception):
    """Raised in a singular pose, where no joint rates can follow the path."""


class Way:
    """One arm at the joints q for the desired pose T_base_flange."""

    def __init__(self, conditions: SteadyConditions, q: Joints, T: Transform) -> None:
        self.conditions, self.q = conditions, np.array(q)
        self.at = conditions.terms(self.q[None], np.reshape(T, (1, 3, 4)))
        self.multipliers = conditions.multipliers(self.at)

    @property
    def freedom(self) -> float:
        """Return how well the joints move the position, times how well they turn the tool at a fixed position."""
        bend = self.at.turn @ np.swapaxes(self.at.turn, 1, 2)  # its value if no turn is missing
        table = self.conditions.system(self.at, bend)
        return float(np.sqrt(abs(np.linalg.det(table[0]))))

    def rates(self, twist: Twist, poses: Callable[[float], Transform], order: int) -> tuple[Joints, ...]:
        """Return the first `order` derivatives of the joints [rad/s, rad/s2, rad/s3] for the desired twist of the tool.

        `poses`: the desired poses of the flange by the time from now [s]. Raises CannotFollow.
        """
        first = self._solve(self.conditions.wanted_rates(self.at, np.array([twist]))[0])
        if order == 1:
            return (self._of_joints(first),)
        h = float(STRIDE / max(np.abs(first[: len(self.q)]).max(), STRIDE / 0.005))  # [s] interval of the seven times
        T = np.array([poses(offset * h) for offset in OFFSETS.tolist()]).reshape(-1, 3, 4)
        second = self._solve(-SECOND @ self._residuals(first, np.zeros_like(first), T, h) / h**2)
        if order == 2:
            return self._of_joints(first), self._of_joints(second)
        third = self._solve(-THIRD @ self._residuals(first, second, T, h) / h**3)
        return self._of_joints(first), self._of_joints(second), self._of_joints(third)

    def _residuals(self, first: Floats, second: Floats, T: Floats, h: float) -> Floats:
        """Return F (7, n + 3) at seven times, for unknowns extrapolated with these derivatives."""
        t, n = (h * OFFSETS)[:, None], len(self.q)
        x = np.concatenate((self.q, self.multipliers[0])) + t * first + 0.5 * t * t * second
        return self.conditions.residual(self.conditions.terms(x[:, :n], T), x[:, n:])

    @cached_property
    def _table(self) -> Floats:
        table: Floats = self.conditions.system(self.at, self.conditions.bend(self.at, self.multipliers))[0]
        sizes = np.linalg.svd(table, compute_uv=False)
        if sizes[-1] <= 1e-12 * sizes[0]:  # smaller fractions of the largest singular value of K count as 0
            raise CannotFollow
        return table

    def _solve(self, wanted: Floats) -> Floats:
        return np.asarray(np.linalg.solve(self._table, wanted))

    def _of_joints(self, x: Floats) -> Joints:
        return tuple(x[: len(self.q)].tolist())


FIRST = 4  # the first four joints: joint 1 turns the plane of the arm, the other three move within it
PARALLEL = 0.01  # [rad] angle between axes that count as parallel
MIN_BAR_M = 1e-3  # [m] minimum length of a bar
ROLLS, DIRECTIONS = (
    24,
    24,
)  # number of angles of the last joint, and of hand directions on either side of the shoulder
# Fractions of the range of directions. They are dense near the ends, where the bars turn fast, and leave out the ends,
# where the bars are in line and a search cannot choose the bend.
PARTS = 0.5 - 0.5 * np.cos(np.linspace(0.02, pi - 0.02, DIRECTIONS))
BEYOND = 0.02  # fraction of the length of both bars by which a position may be out of reach at an entry
OUTSIDE = 8.0  # [rad/rad] missing turn that counts as much as an angle outside its range
WORSE = 0.5  # [rad] entries that are worse than the best entry by more than this are not used as starts
MAX_STARTS = 16


def is_planar(batch: SerialBatch) -> bool:
    """Return whether joints 2 to 4 of an arm have parallel axes."""
    if batch.joints not in (FIRST, FIRST + 1) or not batch.turning.all():
        return False
    points, ways = (np.array(rows) for rows in zip(*joint_axes(batch.model), strict=True))
    bars = np.cross(ways[1], np.diff(points[1:FIRST], axis=0))
    leaning = np.linalg.norm(np.cross(ways[1], np.stack((ways[0], *ways[2:FIRST]))), axis=1)
    return bool(
        leaning[0] > 0.5 and (leaning[1:] < PARALLEL).all() and (np.linalg.norm(bars, axis=1) > MIN_BAR_M).all()
    )


class PlanarStarts:
    """Starts from a table, for one arm and the tip of one tool (3,) in the frame of the flange."""

    def __init__(self, batch: SerialBatch, tip: Floats) -> None:
        model, self.tip = batch.model, tip
        points, ways = (np.array(rows) for rows in zip(*joint_axes(model), strict=True))
        T = np.reshape(link_frames(model, (0.0,) * batch.joints)[-1], (3, 4))
        self.axis, self.point, self.normal = ways[0], points[0], ways[1]
        across = np.cross(self.normal, self.axis)
        across /= np.linalg.norm(across)
        self.plane = across + 1j * np.cross(self.normal, across)  # (3,) for converting vectors to complex numbers
        self.signs = np.sign(ways[2:FIRST] @ self.normal)
        self.rolls = np.linspace(batch.lower[-1], batch.upper[-1], ROLLS) if batch.joints > FIRST else np.zeros(1)
        turns = rotation_about_batch(ways[-1], self.rolls if batch.joints > FIRST else np.zeros(1))[:, :, :3]
        self.hands = turns @ T[:, :3]  # rotations of the hand (rolls, 3, 3)
        tips = points[-1] + turns @ (T[:, :3] @ tip + T[:, 3] - points[-1])
        self.beside = (tips - points[1]) @ self.normal  # distance of the tip out of the plane (rolls,)
        self.shoulder = points[1]
        self.upper, self.fore = np.diff(points[1:FIRST], axis=0) @ self.plane
        self.hand = ((tips - points[FIRST - 1]) @ self.plane)[:, None]  # hand, in the plane (rolls, 1)
        self.bends, *reach = (np.array(rows) for rows in zip(*self._reach(model), strict=True))
        self.reach, self.slack = np.stack(reach), BEYOND * (abs(self.upper) + abs(self.fore))
        self.joints, self.middle, self.half = (
            batch.joints,
            (batch.lower + batch.upper) / 2,
            (batch.upper - batch.lower) / 2,
        )

    def of(self, T: Floats) -> Floats | None:
        """Return joints (k, n) near those that bring the tip to the position of a pose (3, 4) with the least missing
        turn.

        Return no rows if the position is out of reach, and None if joint 1 may have any value.
        """
        out = T[:, :3] @ self.tip + T[:, 3] - self.point
        outward, sideways = out - self.axis * (self.axis @ out), np.cross(self.axis, out)
        a, b = self.normal @ outward, -self.normal @ sideways
        far = np.hypot(a, b)
        if far < 1e-6:  # [m] distance of the tip from axis 1 below which joint 1 may have any value
            return None
        part = (self.beside + self.normal @ (self.shoulder - self.point - self.axis * (self.axis @ out))) / far
        reached = np.abs(part) * far < far + self.slack  # (rolls,)
        q1 = np.arctan2(b, a) + np.arccos(np.clip(part, -1.0, 1.0))[:, None] * (1.0, -1.0)  # (rolls, 2)
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
        # if the bars just reach a position, all directions give the same joints: keep one direction
        _, once = np.unique(np.round(joints[least], 6), axis=0, return_index=True)
        found, size = joints[least][once], (missed + OUTSIDE * outside)[least][once]
        order = np.argsort(size)[:MAX_STARTS]
        return np.asarray(found[order][size[order] < within.min() + WORSE])

    def _reach(self, model: RobotModel) -> Iterator[tuple[float, float, float]]:
        """Yield each sign of the angle between the bars in the range of joint 3, with the minimum and maximum reach
        [m]."""
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
        """Return joints 2 to 4 (rolls, 2, 2, bends, directions) for positions of the tip from the shoulder (rolls, 2).

        Also return how much the bars are too short or too long to reach the wrist there [m].
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
        """Return the missing turn of the hand [rad], from the trace of a product of rotations, one of them about the
        normal.
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
    """Return the entries of a table that are not above their neighbours."""
    wide = np.pad(missed, ((1, 1), (0, 0), (0, 0), (0, 0), (1, 1)), constant_values=np.inf)
    least = np.isfinite(missed)
    for i in range(3):
        for k in range(3):
            least &= missed <= wide[i : i + missed.shape[0], ..., k : k + missed.shape[-1]]
    return least


SAMPLES = 512
FIRST_SAMPLES, OTHERS = 16, 32  # number of starts of one pose in the first search, and in the next one
TURN_COUNTS = 0.1  # [lengths of the arm/rad] weight of a missing turn relative to a distance


class SampledStarts:
    """Starts from samples, for one arm and the tip of one tool (3,) in the frame of the flange."""

    def __init__(self, batch: SerialBatch, tip: Floats) -> None:
        self.tip, self.joints = tip, np.array(list(islice(some_joints(batch.model), SAMPLES)))
        self.poses = batch.forward(self.joints)
        self.tips = self.poses[:, :, :3] @ tip + self.poses[:, :, 3]
        self.length = np.ptp(self.tips, axis=0).max() / 2.0

    def near(self, T: Floats, after: int, count: int) -> Floats:
        """Return the `count` samples nearest to a pose (3, 4), without the `after` nearest ones: (count, n)."""
        away = np.linalg.norm(self.tips - (T[:, :3] @ self.tip + T[:, 3]), axis=1)
        cosine = 0.5 * (np.einsum("nij,ij->n", self.poses[:, :, :3], T[:, :3]) - 1.0)
        missed = away / self.length + TURN_COUNTS * np.arccos(np.clip(cosine, -1.0, 1.0))
        return np.asarray(self.joints[np.argsort(missed)[after : after + count]])
