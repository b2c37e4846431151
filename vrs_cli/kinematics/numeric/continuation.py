"""Whether the joints of an arm without a closed form lead from sample to sample of a way: proved, not sampled.

Between two samples the cubic c(t) through their joints and rates is near the joints that are looked for, where
F(t, q) = 0: what the flange misses, as the place and the vector of the sines of the turn. The theorem of Kantorovich
(Ortega and Rheinboldt, "Iterative Solution of Nonlinear Equations in Several Variables", 1970, 12.6.2) at c(t): with
beta >= |F'(c)^-1|, eta >= beta |F(c)| and |F'(p) - F'(q)| <= L |p - q|, there are such joints within 2 eta of c if
beta L eta <= 1/2, and no others within 1 / (beta L). As this holds at every t, and c is exact at both samples, one
continuous branch leads from one to the other.

The cubic is looked at in pieces of g of it each. On one, |F| is at most what it is at the worse end and g2 / 8 of
|F''|, and F' differs from the Jacobian J at the nearer end by no more than L times the way of c, which is half of the
piece at most, and |F| times |J|. Some pieces have one matrix A for all, the inverse of J in their middle: where
|1 - A F'| < 1, |F'^-1| is |A| / (1 - |1 - A F'|) at most (Neumann's series).

Of an arm with more joints than it takes F has a row for each guide too: the sum of the joints by its weights, less what
that is to be. It is linear in the joints, so it adds nothing to L.

Lengths [m], sliding joints among them, are divided by `Continuation.length` [m], so that all is in rad; norms are
Euclidean, that of the inverse Frobenius's. With n joints that turn, the second derivatives of a rotation by them are at
most n, the first at most the root of n; those of the place follow from how far the flange is from the axes at most.
"""

from __future__ import annotations

from functools import cached_property
from math import hypot, sqrt
from typing import NamedTuple

import numpy as np

from vrs_cli.kinematics.arrays import Flags, Floats
from vrs_cli.kinematics.model import levers
from vrs_cli.kinematics.numeric.batch import NumericBatch, with_guides

LENGTH = 0.4  # of the longest lever: the proof is easiest about there
MOST = 0.5  # of beta L eta
LOST = 0.9  # of |1 - A F'|: F' has an inverse where it is less than 1
BLOCKS = (6, 1)  # pieces that have one inverse for all


class Gaps(NamedTuple):
    """The ways between neighbouring samples, by the part of their time: derivatives are by that."""

    begin: Floats  # joints (k, n) [rad, m]
    end: Floats
    begin_rate: Floats
    end_rate: Floats
    bend: Floats  # (k,) bounds: of the second derivative of the flange's place [m]
    turn: Floats  # of the first of its rotation [rad]
    turn_bend: Floats  # and of the second
    guide_bend: Floats  # of that of the guides
    weights: Floats  # of r guides (r, n)

    def cubic(self, pieces: int) -> tuple[Floats, Floats, Floats]:
        """Joints and rates at the ends of pieces (k, pieces + 1, n), and the second derivatives at both ends."""
        x = np.linspace(0.0, 1.0, pieces + 1)[:, None]
        p, v, w = self.begin[:, None], self.begin_rate[:, None], self.end_rate[:, None]
        way = self.end[:, None] - p
        square, cube = 3.0 * way - 2.0 * v - w, v + w - 2.0 * way
        q = p + x * (v + x * (square + x * cube))
        return q, v + x * (2.0 * square + 3.0 * x * cube), np.concatenate((square, square + 3.0 * cube), axis=1) * 2.0


class Continuation:
    """The proof for one arm, whose joints are as many as the parts of its task and its guides."""

    def __init__(self, batch: NumericBatch) -> None:
        self.batch, model = batch, batch.model
        self.turns = batch.turning
        _, reached = levers(model)
        self.length = LENGTH * reached[0]
        sliding = np.cumsum(~batch.turning[::-1])[::-1]  # joints beyond their ranges, by a length at most
        self.levers = np.where(self.turns, np.array(reached) / self.length + sliding, 1.0)
        self.units = np.where(self.turns, 1.0, self.length)
        self.places = sum(model.task.counts[:3])

    @cached_property
    def place_bend(self) -> float:
        """A bound of the second derivatives of the flange's place: of two joints the later one's lever counts."""
        n = len(self.turns)
        first, later = np.minimum.outer(range(n), range(n)), np.maximum.outer(range(n), range(n))
        return float(np.linalg.norm(np.where(self.turns[first], self.levers[later], 0.0), 2))

    def proved(self, gaps: Gaps, T: Floats, guided: Floats) -> Flags:
        """(k,): of each gap; T (k, pieces + 1, 3, 4) are the poses of the flange at the ends of pieces, `guided`
        (k, pieces + 1, r) what the guides ask there.
        """
        k, count = T.shape[:2]
        g = 1.0 / (count - 1)
        q, rates, bends = gaps.cubic(count - 1)
        J, missed = self._at(
            q.reshape(k * count, -1), T.reshape(k * count, 3, 4), gaps.weights, guided.reshape(k * count, -1)
        )
        beta, lost = _inverses(J.reshape(k, count, *J.shape[1:]))
        missed = _worse_end(missed.reshape(k, count))
        bend = self._size(bends).max(axis=1)[:, None]
        speed = _worse_end(self._size(rates)) + 0.5 * g * bend
        n = float(self.turns.sum())
        lipschitz = hypot(self.place_bend, n)
        place = gaps.bend[:, None] / self.length + self.place_bend * speed**2 + np.linalg.norm(self.levers) * bend
        turn = gaps.turn_bend[:, None] + 2.0 * gaps.turn[:, None] * sqrt(n) * speed + n * speed**2 + sqrt(n) * bend
        guide = gaps.guide_bend[:, None] + np.linalg.norm(gaps.weights * self.units) * bend
        missed = missed + g * g / 8.0 * np.hypot(np.hypot(place, turn), guide)
        lost = lost + beta * (lipschitz * 0.5 * g * speed + sqrt(n) * missed)
        beta = beta / np.where(lost < LOST, 1.0 - lost, np.nan)
        sure: Flags = (beta * beta * lipschitz * missed <= MOST) & (beta * missed <= MOST)
        return np.asarray(sure.all(axis=1))

    def _at(self, q: Floats, T: Floats, weights: Floats, guided: Floats) -> tuple[Floats, Floats]:
        """Of joints (N, n) for poses (N, 3, 4) and guides (N, r): J (N, n, n), and how much is missed (N,)."""
        J, missed = with_guides(*self.batch.error(q, T), q, weights, guided)
        J = J * self.units
        J[:, : self.places] /= self.length
        missed[:, : self.places] /= self.length
        return J, np.linalg.norm(missed, axis=1)

    def _size(self, changes: Floats) -> Floats:
        """(..., n) -> (...): of a change of the joints."""
        return np.asarray(np.linalg.norm(changes / self.units, axis=-1))


def _worse_end(values: Floats) -> Floats:
    """(k, pieces + 1) -> (k, pieces)."""
    return np.maximum(values[:, 1:], values[:, :-1])


def _inverses(J: Floats) -> tuple[Floats, Floats]:
    """Of J (k, pieces + 1, n, n), by pieces (k, pieces): |A| of the inverse A in the middle of some pieces, NaN
    where there is none, and |1 - A J| at the worse end.
    """
    k, count, n, _ = J.shape
    block = next(size for size in BLOCKS if (count - 1) % size == 0)
    first = np.arange(0, count - 1, block)
    inverse = _inverse(J[:, first + block // 2])
    J = J[:, first[:, None] + np.arange(block + 1)]
    off = np.sqrt(((inverse[:, :, None] @ J - np.eye(n)) ** 2).sum(axis=(3, 4)))
    off = np.maximum(off[..., 1:], off[..., :-1]).reshape(k, -1)
    return np.repeat(np.sqrt((inverse * inverse).sum(axis=(2, 3))), block, axis=1), off


def _inverse(J: Floats) -> Floats:
    try:
        return np.asarray(np.linalg.inv(J), dtype=np.float64)
    except np.linalg.LinAlgError:  # in one of them at least
        inverse = np.asarray(np.linalg.pinv(J), dtype=np.float64)
        inverse[np.linalg.matrix_rank(J) < J.shape[-1]] = np.nan
        return inverse
