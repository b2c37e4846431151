"""Conditions that make the joints of a short arm definite: the place exactly, the tool turned as nearly as can be.

An arm of four or five joints reaches every place in its range, in many ways, but not every turn there. Of the ways the
one is taken whose turn away from the pose that is asked for is the smallest. With the rotation R of the flange and W
the one asked for, by the angle phi away from it,

    1 - cos phi = (3 - trace(W^T R)) / 2

is least where its slope along the joints is nothing but a pull of the place, the multipliers l (Lagrange's conditions;
Nocedal and Wright, "Numerical Optimization", 2006, 12.3 and 18.1):

    P l - O e = 0,   p(q) - p = 0

with the rows P and O of what each joint does to the place and the direction [m/rad, 1], and e the axis of the turn that
is missing, as long as its sine. These are as many equations as unknowns: the joints are a function of the pose alone,
so that a path which closes brings all joints back, and a pose that the arm can have is had exactly.

How the joints go on where the pose moves follows from the derivatives of the conditions. With the unknowns x, joints
and multipliers, F(x(t), t) = 0 at all times. Its first derivative gives x'; where x is replaced by its own Taylor
polynomial of degree k - 1, the k-th derivative of F is -K x^(k), K = dF/dx. The first is exact; the others are taken
from values of F at seven times, which are near enough to each other for ten decimals.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import NamedTuple

import numpy as np

from vrs_cli.kinematics.arrays import Flags, Floats
from vrs_cli.kinematics.compiled import formulas
from vrs_cli.kinematics.joints import Joints, Twist
from vrs_cli.kinematics.serial_batch import SerialBatch
from vrs_cli.kinematics.transform import Transform

PLACES = 3
LEAST_CURVATURE = 1e-4  # of the cosine by the joints: below it a turn is next to free
FEW = 20  # rows


class Terms(NamedTuple):
    """Of N joint vectors and poses: `place` and `turn` (N, n, 3), what each joint does; `away` (N, 3), the way that is
    missing [m]; `sine` (N, 3) and `mixed` = R W^T (N, 3, 3), the turn that is missing.
    """

    place: Floats
    turn: Floats
    away: Floats
    sine: Floats
    mixed: Floats

    @property
    def angle(self) -> Floats:
        """(N,) the turn that is missing [rad]."""
        cosine = 0.5 * (np.trace(self.mixed, axis1=1, axis2=2) - 1.0)
        return np.asarray(np.arctan2(np.linalg.norm(self.sine, axis=1), cosine))


class SteadyConditions:
    """The conditions of one arm, for the place of the tip of a tool."""

    def __init__(self, batch: SerialBatch, T_flange_tool: Transform) -> None:
        self.batch, self.tool, self.joints = batch, T_flange_tool, batch.joints
        self.tip = np.array([T_flange_tool.px, T_flange_tool.py, T_flange_tool.pz])
        self.formulas = formulas(batch.model.links, batch.model.base, batch.model.flange)
        i = np.arange(self.joints)
        self.first, self.later = np.minimum.outer(i, i), np.maximum.outer(i, i)
        self.before = (i[:, None] > i)[None, :, :, None]  # [i, k]: joint k comes before joint i

    def terms(self, q: Floats, T: Floats) -> Terms:
        """Joints (N, n) and poses of the flange that are asked for (N, 3, 4)."""
        if len(q) > FEW:
            have, J = self.batch.forward(q), self.batch.jacobian(q, self.tool)
        else:  # the formulas for floats are faster
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
        """(N, 3): those with which the conditions of the free joints (N, n), of all by default, are met as nearly as
        can be.
        """
        pull, place = at.turn @ at.sine[:, :, None], at.place if free is None else at.place * free[:, :, None]
        across = np.swapaxes(place, 1, 2)
        return np.asarray(np.linalg.solve(across @ place + 1e-12 * np.eye(PLACES), across @ pull)[:, :, 0])

    def bend(self, at: Terms, multipliers: Floats) -> Floats:
        """(N, n, n): the derivatives of P l - O e by the joints.

        Of two joints the first one turns what the later one does: d O_i / d q_k = O_k x O_i, d P_i / d q_k = O x P.
        """
        moved = _cross(at.turn[:, self.first], at.place[:, self.later])
        turned = np.where(self.before, _cross(at.turn[:, None, :], at.turn[:, :, None]), 0.0)
        lost = 0.5 * (at.mixed - np.trace(at.mixed, axis1=1, axis2=2)[:, None, None] * np.eye(3))
        direct = at.turn @ lost @ np.swapaxes(at.turn, 1, 2)
        pulled = moved @ multipliers[:, None, :, None] - turned @ at.sine[:, None, :, None]
        return np.asarray(pulled[..., 0] - direct)

    def system(self, at: Terms, bend: Floats) -> Floats:
        """(N, n + 3, n + 3): the derivatives of all conditions by joints and multipliers."""
        n, count = self.joints, len(bend)
        table = np.zeros((count, n + PLACES, n + PLACES))
        table[:, :n, :n] = bend
        table[:, :n, n:] = at.place
        table[:, n:, :n] = np.swapaxes(at.place, 1, 2)
        return table

    @staticmethod
    def missed(at: Terms, multipliers: Floats) -> Floats:
        """(N, n + 3): by how much the conditions are not met."""
        slope = at.place @ multipliers[:, :, None] - at.turn @ at.sine[:, :, None]
        return np.concatenate((slope[:, :, 0], -at.away), axis=1)

    @staticmethod
    def gained(at: Terms, twists: Floats) -> Floats:
        """(N, n + 3): what the conditions ask of the rates of the unknowns, for twists of the tool (N, 6)."""
        trace = np.trace(at.mixed, axis1=1, axis2=2)[:, None, None]
        turned = 0.5 * (trace * np.eye(3) - np.swapaxes(at.mixed, 1, 2)) @ twists[:, 3:, None]
        return np.concatenate(((at.turn @ turned)[:, :, 0], twists[:, :3]), axis=1)

    def is_least(self, at: Terms, bend: Floats) -> Flags:
        """(N,): whether every way that keeps the place turns the tool away, and not nearer."""
        normal = np.swapaxes(at.place, 1, 2) @ at.place + 1e-12 * np.eye(PLACES)
        along = np.eye(self.joints) - at.place @ np.linalg.solve(normal, np.swapaxes(at.place, 1, 2))
        symmetric = 0.5 * (bend + np.swapaxes(bend, 1, 2))
        curved = along @ symmetric @ along + (np.eye(self.joints) - along)
        return np.asarray(np.linalg.eigvalsh(curved)[:, 0] > LEAST_CURVATURE)


def _cross(a: Floats, b: Floats) -> Floats:
    """numpy's takes several times as long for a few."""
    x, y, z = a[..., 0], a[..., 1], a[..., 2]
    u, v, w = b[..., 0], b[..., 1], b[..., 2]
    return np.stack((y * w - z * v, z * u - x * w, x * v - y * u), axis=-1)


OFFSETS = np.arange(-3.0, 4.0)
# central differences of the second and third derivative, of sixth and fourth order: Fornberg, "Generation of Finite
# Difference Formulas on Arbitrarily Spaced Grids", Mathematics of Computation 51 (1988), table 1
SECOND = np.array([1 / 90, -3 / 20, 3 / 2, -49 / 18, 3 / 2, -3 / 20, 1 / 90])
THIRD = np.array([1 / 8, -1.0, 13 / 8, 0.0, -13 / 8, 1.0, -1 / 8])
STRIDE = 0.02  # [rad, m] of a joint from one of these times to the next at most
LONGEST = 0.005  # [s] between them
LOST = 1e-12  # of the largest singular value of K: a lesser one is none


class CannotFollow(Exception):
    """The joints cannot follow at all: a singular pose."""


class Way:
    """One arm at joints q that belong to the pose T_base_flange that is asked for."""

    def __init__(self, conditions: SteadyConditions, q: Joints, T: Transform) -> None:
        self.conditions, self.q = conditions, np.array(q)
        self.at = conditions.terms(self.q[None], np.reshape(T, (1, 3, 4)))
        self.multipliers = conditions.multipliers(self.at)

    @property
    def freedom(self) -> float:
        """Return how well the joints move the place, times how well they turn the tool while it stays."""
        bend = self.at.turn @ np.swapaxes(self.at.turn, 1, 2)  # where nothing is missing
        table = self.conditions.system(self.at, bend)
        return float(np.sqrt(abs(np.linalg.det(table[0]))))

    def rates(self, twist: Twist, poses: Callable[[float], Transform], order: int) -> tuple[Joints, ...]:
        """The first `order` derivatives of the joints [rad/s, rad/s2, rad/s3], for the twist of the tool that is asked
        for; `poses`: those of the flange that are asked for, by the time from now [s]. Raises CannotFollow.
        """
        first = self._solved(self.conditions.gained(self.at, np.array([twist]))[0])
        if order == 1:
            return (self._of_joints(first),)
        h = float(STRIDE / max(np.abs(first[: len(self.q)]).max(), STRIDE / LONGEST))
        T = np.array([poses(offset * h) for offset in OFFSETS.tolist()]).reshape(-1, 3, 4)
        second = self._solved(-SECOND @ self._missed(first, np.zeros_like(first), T, h) / h**2)
        if order == 2:
            return self._of_joints(first), self._of_joints(second)
        third = self._solved(-THIRD @ self._missed(first, second, T, h) / h**3)
        return self._of_joints(first), self._of_joints(second), self._of_joints(third)

    def _missed(self, first: Floats, second: Floats, T: Floats, h: float) -> Floats:
        """(7, n + 3): F at the seven times, where the unknowns go on by these derivatives."""
        t, n = (h * OFFSETS)[:, None], len(self.q)
        x = np.concatenate((self.q, self.multipliers[0])) + t * first + 0.5 * t * t * second
        return self.conditions.missed(self.conditions.terms(x[:, :n], T), x[:, n:])

    @cached_property
    def _table(self) -> Floats:
        table: Floats = self.conditions.system(self.at, self.conditions.bend(self.at, self.multipliers))[0]
        sizes = np.linalg.svd(table, compute_uv=False)
        if sizes[-1] <= LOST * sizes[0]:
            raise CannotFollow
        return table

    def _solved(self, wanted: Floats) -> Floats:
        return np.asarray(np.linalg.solve(self._table, wanted))

    def _of_joints(self, x: Floats) -> Joints:
        return tuple(x[: len(self.q)].tolist())
