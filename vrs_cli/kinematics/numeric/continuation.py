"""Prove that the joints of an arm without a closed form are continuous from sample to sample of a path.

Between two samples the cubic c(x) through their joints and rates, x from 0 to 1, is near the joints that solve F(x, q)
= 0: F is the error of the flange, as the place and the vector of the sines of the turn. The theorem of Kantorovich
(Ortega and Rheinboldt, "Iterative Solution of Nonlinear Equations in Several Variables", 1970, 12.6.2) at c(x): with
beta >= |F'(c)^-1|, eta >= beta |F(c)| and |F'(p) - F'(q)| <= L |p - q|, such joints exist within 2 eta of c if beta L
eta <= 1/2, and no others within 1 / (beta L). As this holds at every x, and c is exact at both samples, one continuous
branch leads from one to the other.

|F(c(x))| is at most 1/384 of its fourth derivative by x, because F and its slope are 0 at both samples (the remainder
of Hermite's interpolation; Davis, "Interpolation and Approximation", 1963, 3.1). A turn by the angles of joints and of
the path has derivatives by x that Faa di Bruno's formula bounds by the sums of theirs; those of the place are longer by
the levers, the greatest distances of the flange from the axes.

beta: c is divided into pieces of g of x each. On a piece the Jacobian J is as on the chord between its ends, up to g2 /
8 of its second derivative, and F' is J up to |F| times |J|. With A, the inverse of the mean of both ends, |1 - A F'| is
at most |A| times half of their difference, and |F'^-1| at most |A| / (1 - |1 - A F'|) (Neumann's series).

For a redundant arm F has a row for each guide: the weighted sum of the joints less its value. It is linear in the
joints and adds nothing to L.

Lengths [m], sliding joints among them, are divided by `Continuation.length` [m], so that all is in rad; norms are
Euclidean, that of the inverse Frobenius's.
"""

from __future__ import annotations

from math import hypot, sqrt
from typing import NamedTuple

import numpy as np

from vrs_cli.kinematics.arrays import Flags, Floats, Rows
from vrs_cli.kinematics.joints import MAX_RATE_ERROR
from vrs_cli.kinematics.model import levers
from vrs_cli.kinematics.numeric.batch import NumericBatch, with_guides

LENGTH = 0.4  # fraction of the longest lever at which the proof is easiest
MAX_KANTOROVICH = 0.5  # greatest beta L eta for which the theorem holds
LOST = 0.9  # greatest |1 - A F'| that is accepted: F' has an inverse where this norm is less than 1
HERMITE = 1.0 / 384.0  # fraction of a fourth derivative by which the cubic is off at most
SLOPES = 8.0 / 27.0  # fraction of an error of the slopes at both ends by which the cubic is off at most


class Cubic(NamedTuple):
    """Cubics of the unknowns between samples: values (k, n) and rates at both ends, by the part of the time between."""

    begin: Floats
    end: Floats
    begin_rate: Floats
    end_rate: Floats

    def bends(self) -> tuple[Floats, Floats, Floats]:
        """Return the second derivatives at both ends, and the third (k, n)."""
        way, v, w = self.end - self.begin, self.begin_rate, self.end_rate
        bend, third = 6.0 * way - 4.0 * v - 2.0 * w, 6.0 * (v + w - 2.0 * way)
        return bend, bend + third, third

    def at(self, parts: Floats) -> Floats:
        """Return the unknowns at parts (m,) of the time: (k, m, n)."""
        bend, _, third = self.bends()
        x = parts[:, None]
        halves = 0.5 * bend[:, None], third[:, None] / 6.0
        return np.asarray(self.begin[:, None] + x * (self.begin_rate[:, None] + x * (halves[0] + x * halves[1])))

    def most(self) -> tuple[Floats, Floats, Floats]:
        """Return bounds (k, n) of the sizes of the first three derivatives."""
        before, after, third = (np.abs(bend) for bend in self.bends())
        rates = np.maximum(np.abs(self.begin_rate), np.abs(self.end_rate)) + third / 8.0
        return rates, np.maximum(before, after), third


class Gaps(NamedTuple):
    """The gaps between neighbouring samples; derivatives are by the part of the time between them."""

    way: Cubic  # of the joints (k, n) [rad, m] between the samples
    place: Floats  # (k,) bounds of the fourth derivative of the desired place [m]
    turn: Floats  # (k, 4) bounds of the first four derivatives of the desired turn's angles, together [rad]
    guide: Floats  # (k,) bounds of the fourth derivative of the guides
    weights: Floats  # of r guides (r, n)

    def some(self, which: Rows) -> Gaps:
        """Return the gaps with the given numbers."""
        way, *rows, weights = self
        place, turn, guide = (row[which] for row in rows)
        return Gaps(Cubic(*(row[which] for row in way)), place, turn, guide, weights)


class Continuation:
    """The proof for one arm with as many joints as parts of its task and guides.

    `sure`: from joints this near [rad, m] Newton's method leads to the proved joints of a line.
    """

    sure = 0.1

    def __init__(self, batch: NumericBatch) -> None:
        self.batch, model = batch, batch.model
        self.turns = batch.turning
        _, reached = levers(model)
        self.length = LENGTH * reached[0]
        sliding = np.cumsum(~batch.turning[::-1])[::-1]  # joints up to a length beyond their ranges
        self.levers = np.where(self.turns, np.array(reached) / self.length + sliding, 1.0)
        self.longest = np.maximum.accumulate(self.levers[::-1])[
            ::-1
        ]  # the longest lever of a joint and of the joints after it
        self.units = np.where(self.turns, 1.0, self.length)
        self.places = sum(model.counts[:3])
        n = model.joint_count
        first, later = np.minimum.outer(range(n), range(n)), np.maximum.outer(range(n), range(n))
        # a bound of the second derivatives of the flange's place: the lever of the later joint counts
        self.place_bend = float(np.linalg.norm(np.where(self.turns[first], self.levers[later], 0.0), 2))

    def prove(self, gaps: Gaps, pieces: int) -> Flags:
        """Return for each gap whether it is proved (k,)."""
        n = float(self.turns.sum())
        missed, bend = self._bounds(gaps)
        q = gaps.way.at(np.linspace(0.0, 1.0, pieces + 1))  # the ends of the pieces
        rows = self.batch.rows(q.reshape(-1, q.shape[2])).reshape(*q.shape[:2], -1, q.shape[2])
        J = np.empty((*q.shape[:2], rows.shape[2] + len(gaps.weights), q.shape[2]))
        J[:, :, : rows.shape[2]] = rows
        J[:, :, rows.shape[2] :] = gaps.weights
        J *= self.units
        J[:, :, : self.places] /= self.length
        A = inverse_or_nan(0.5 * (J[:, 1:] + J[:, :-1]))
        size = norm(A)
        lost = 0.5 * norm(A @ (J[:, 1:] - J[:, :-1]))
        lost = lost + size * (bend / (8.0 * pieces**2) + sqrt(n) * missed)[:, None]
        beta = size / np.where(lost < LOST, 1.0 - lost, np.nan)
        least = np.fmin(MAX_KANTOROVICH, MAX_KANTOROVICH / (beta * hypot(self.place_bend, n)))
        return np.asarray((beta * missed[:, None] <= least).all(axis=1))

    def step(self, q: Floats, T: Floats, guides: tuple[Floats, Floats] | None) -> Floats:
        """Return joints (N, n) after one step of Newton's method to poses (N, 3, 4).

        `guides`: the weights (r, n) of sums of the joints, and their values (N, r).
        """
        J, error = self.batch.error(q, T)
        if guides is not None:
            J, error = with_guides(J, error, q, *guides)
        return np.asarray(q + (inverse_or_nan(J) @ error[:, :, None])[:, :, 0])

    def _bounds(self, gaps: Gaps) -> tuple[Floats, Floats]:
        """Return bounds (k,) of |F| on the cubic, and of the second derivative of J on it."""
        changes = np.stack(gaps.way.most()) / self.units  # (3, k, n)
        first, second, third = changes.sum(axis=2)  # bounds (k,) of the first three derivatives of the joints, together
        far1, far2, far3 = changes @ self.longest
        turn = [own + asked for own, asked in zip((first, second, third, 0.0), gaps.turn.T, strict=True)]
        place = first**2 * (far1 * first + 6.0 * far2) + 3.0 * far2 * second
        place = place + 4.0 * far3 * first + gaps.place / self.length
        sums = np.linalg.norm(gaps.weights * self.units)
        fourth = np.sqrt(fourth_of_turn(*turn) ** 2 + place * place + gaps.guide**2)
        missed = HERMITE * fourth + SLOPES * MAX_RATE_ERROR * ((1.0 + sums) * first + far1)
        size = hypot(float(np.linalg.norm(self.longest)), sqrt(float(self.turns.sum())))
        return missed, size * (first**2 + second)


def fourth_of_turn(first: Floats, second: Floats, third: Floats, fourth: Floats) -> Floats:
    """Return a bound of the fourth derivative of a turn, from bounds of the derivatives of its angles together."""
    square = first * first
    return np.asarray(square * square + 6.0 * square * second + 3.0 * second * second + 4.0 * first * third + fourth)


def norm(matrices: Floats) -> Floats:
    """Return Frobenius norms (...) of matrices (..., m, n)."""
    return np.asarray(np.sqrt(np.einsum("...ij,...ij->...", matrices, matrices)))


def inverse_or_nan(J: Floats) -> Floats:
    """Return inverses (..., n, m) of matrices (..., m, n); NaN if singular, pseudo-inverses if m > n."""
    if J.shape[-2] > J.shape[-1]:
        return np.asarray(np.linalg.pinv(J), dtype=np.float64)
    try:
        return np.asarray(np.linalg.inv(J), dtype=np.float64)
    except np.linalg.LinAlgError:  # at least one matrix is singular
        inverse = np.asarray(np.linalg.pinv(J), dtype=np.float64)
        inverse[np.linalg.matrix_rank(J) < J.shape[-1]] = np.nan
        return inverse
