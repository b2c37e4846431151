"""How the joints go on where the pose that is asked for moves: their derivatives, from those of the conditions.

With the unknowns x, joints and multipliers, F(x(t), t) = 0 at all times. Its first derivative gives x'; where x is
replaced by its own Taylor polynomial of degree k - 1, the k-th derivative of F is -K x^(k), K = dF/dx. The first is
exact; the others are taken from values of F at seven times, which are near enough to each other for ten decimals.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property

import numpy as np

from vrs_cli.kinematics.arrays import Floats
from vrs_cli.kinematics.jacobian import Twist
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.numeric.steady.conditions import SteadyConditions
from vrs_cli.kinematics.transform import Transform

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
        """How well the joints move the place, times how well they turn the tool while it stays."""
        bend = self.at.turn @ np.swapaxes(self.at.turn, 1, 2)  # where nothing is missing
        table = self.conditions.system(self.at, bend)
        return float(np.sqrt(abs(np.linalg.det(table[0]))))

    def velocity(self, twist: Twist) -> Joints:
        """[rad/s] for the twist of the tool that is asked for. Raises Lost."""
        return self._of_joints(self._first(twist))

    def acceleration(self, twist: Twist, poses: Callable[[float], Transform]) -> Joints:
        """[rad/s2]; `poses`: those of the flange that are asked for, by the time from now [s]. Raises Lost."""
        first = self._first(twist)
        h = self._stride(first)
        return self._of_joints(self._second(first, self._poses(poses, h), h))

    def acceleration_and_jerk(self, twist: Twist, poses: Callable[[float], Transform]) -> tuple[Joints, Joints]:
        """[rad/s2, rad/s3]. Raises Lost."""
        first = self._first(twist)
        h = self._stride(first)
        T = self._poses(poses, h)
        second = self._second(first, T, h)
        third = self._solved(-THIRD @ self._missed(first, second, T, h) / h**3)
        return self._of_joints(second), self._of_joints(third)

    def _first(self, twist: Twist) -> Floats:
        return self._solved(self.conditions.gained(self.at, np.array([twist]))[0])

    def _second(self, first: Floats, T: Floats, h: float) -> Floats:
        return self._solved(-SECOND @ self._missed(first, np.zeros_like(first), T, h) / h**2)

    def _missed(self, first: Floats, second: Floats, T: Floats, h: float) -> Floats:
        """(7, n + 3): F at the seven times, where the unknowns go on by these derivatives."""
        t, n = (h * OFFSETS)[:, None], len(self.q)
        x = np.concatenate((self.q, self.multipliers[0])) + t * first + 0.5 * t * t * second
        return self.conditions.missed(self.conditions.terms(x[:, :n], T), x[:, n:])

    @staticmethod
    def _poses(poses: Callable[[float], Transform], h: float) -> Floats:
        return np.array([poses(offset * h) for offset in OFFSETS.tolist()]).reshape(-1, 3, 4)

    def _stride(self, first: Floats) -> float:
        return float(STRIDE / max(np.abs(first[: len(self.q)]).max(), STRIDE / LONGEST))

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
