"""Search many poses of a numerical arm at once, each row independently, and prove that its joints are continuous from
sample to sample of a path.

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

To bound beta, c is divided into pieces, each of a length g in x. On a piece the Jacobian J is as on the chord between
its ends, up to g2 / 8 of its second derivative, and F' is J up to |F| times |J|. With A, the inverse of the mean of
both ends, |1 - A F'| is at most |A| times half of their difference, and |F'^-1| at most |A| / (1 - |1 - A F'|)
(Neumann's series).

For a redundant arm F has a row for each guide: the weighted sum of the joints less its value. It is linear in the
joints and adds nothing to L.

Lengths [m], sliding joints among them, are divided by `Continuation.length` [m], so that all is in rad; norms are
Euclidean, that of the inverse Frobenius's.
"""

from __future__ import annotations

from collections.abc import Callable
from math import hypot, sqrt
from typing import NamedTuple

import numpy as np

from vrs_cli.kinematics.arrays import Flags, Floats, Rows
from vrs_cli.kinematics.clearance import Unchanging
from vrs_cli.kinematics.joints import MAX_RATE_ERROR, NONE, Configuration, Joints
from vrs_cli.kinematics.model import LEVEL, STRAIGHT, ArmTask, RobotModel, levers
from vrs_cli.kinematics.numeric.search import CONVERGED, DAMPING, FREE_STEPS, LARGEST_STEP, LEAST_DAMPING, STEPS, rounds
from vrs_cli.kinematics.serial_batch import SerialBatch
from vrs_cli.kinematics.transform import Transform

SINGULAR = 5e-9  # [m, rad] allowed error in a singular pose, where further steps do not reduce it


class NumericBatch(SerialBatch):
    """`NumericArm` over arrays. Rows that do not converge are NaN.

    `solve`: a function that solves one pose instead of this search; it returns joints as `branches` does.
    """

    def __init__(
        self,
        model: RobotModel,
        unchanging: Unchanging,
        held: tuple[int, ...],
        solve: Callable[[Transform], tuple[Joints | None, ...]] | None = None,
    ) -> None:
        super().__init__(model, (NONE,), unchanging)
        self.solve = solve
        self.still_joints, self.short = held, model.joint_count < model.task.size
        self.counts = np.array(model.counts)

    def inverse(self, T: Floats) -> tuple[Floats, Flags]:
        """Return for each pose the joints from the first start whose search succeeds."""
        q, middle = np.full((len(T), self.joints), np.nan), (self.lower + self.upper) / 2
        if self.solve is not None:
            for row, pose in enumerate(T.reshape(-1, 12).tolist()):
                q[row] = self.solve(Transform(*pose))[0] or np.nan
            return q[:, None], self.inside(q)[:, None]
        for start in next(rounds(self.model, tuple(middle))):
            for bounded in (False, True):
                missing = np.flatnonzero(np.isnan(q[:, 0]))
                if not len(missing):
                    break
                found = self.turned_near(self.search(T[missing], np.array(start), bounded=bounded), middle)
                q[missing] = np.where(self.inside(found)[:, None], found, np.nan)
        return q[:, None], self.inside(q)[:, None]

    def solutions(self, T: Transform, near: Joints, inside: Callable[[Joints, Joints], Joints | None]) -> list[Joints]:
        """Return joints of one pose inside the limits, nearest to `near`, from the first round of starts that finds
        any.
        """
        for begin in rounds(self.model, near):
            poses = np.broadcast_to(np.reshape(T, (3, 4)), (len(begin), 3, 4))
            for bounded in (False, True):
                q = self.search(poses, np.array(begin), bounded=bounded, steps=STEPS if bounded else FREE_STEPS)
                turned = [inside(tuple(row), near) for row in q[~np.isnan(q[:, 0])].tolist()]
                if found := [joints for joints in turned if joints is not None]:
                    return found
        return []

    def inverse_branch(self, T: Floats, configuration: Configuration, near: Floats) -> Floats:  # noqa: ARG002
        axes = np.eye(self.joints)[list(self.still_joints)]
        return self.solve_guided(
            T, near, axes, np.broadcast_to(near, (len(T), self.joints))[:, list(self.still_joints)]
        )

    def solve_guided(self, T: Floats, near: Floats, weights: Floats, values: Floats) -> Floats:
        return self.search(T, near, bounded=False, guides=(weights, values))

    def search(
        self, T: Floats, near: Floats, *, bounded: bool, guides: tuple[Floats, Floats] | None = None, steps: int = STEPS
    ) -> Floats:
        """Return joints (N, n) for poses (N, 3, 4) from starts (N, n) or (n,).

        `guides`: the weights (r, n) of sums of the joints, and their values (N, r).
        """
        q = np.array(np.broadcast_to(near, (len(T), self.joints)))
        found = np.full_like(q, np.nan)
        rows = np.flatnonzero(self.in_task(T))
        for _ in range(steps):
            if not len(rows):
                break
            J, error = self.error(q[rows], T[rows])
            if guides is not None:
                weights, values = guides
                J, error = with_guides(J, error, q[rows], weights, values[rows])
            done = np.abs(error).max(axis=1) < CONVERGED
            before = q[rows]
            q[rows] = self._next_joints(before, J, error, bounded=bounded)
            found[rows[done]] = q[rows[done]]  # one extra step, so that different searches converge to equal values
            rows, before = rows[~done], before[~done]
            if self.short:
                stuck = rows[np.abs(q[rows] - before).max(axis=1) < CONVERGED]
                missing = self._missing(self.forward(q[stuck]), T[stuck])
                away, turned = np.linalg.norm(missing[:, :3], axis=1), np.linalg.norm(missing[:, 3:], axis=1)
                there = stuck[(away <= LEVEL) & (turned <= STRAIGHT)]  # an error that three decimals do not show
                found[there] = q[there]
                rows = np.setdiff1d(rows, stuck)
        if guides is None and len(rows):  # only a single pose, not a line
            there = rows[np.abs(self.error(q[rows], T[rows])[1]).max(axis=1) < SINGULAR]
            found[there] = q[there]
        return found

    def _next_joints(self, q: Floats, J: Floats, error: Floats, *, bounded: bool) -> Floats:
        """Return the joints after one damped step. Joints that the step would push out of their range do not move."""
        still = np.zeros(q.shape, dtype=np.bool_)
        step = self._step(J, error, still)
        if bounded:
            for _ in range(self.joints):
                pushed = ~still & (((q <= self.lower) & (step < 0.0)) | ((q >= self.upper) & (step > 0.0)))
                if not pushed.any():
                    break
                still |= pushed
                step = self._step(J, error, still)
        largest = np.abs(step).max(axis=1, keepdims=True)
        q = q + step * np.minimum(1.0, LARGEST_STEP / np.maximum(largest, 1e-300))
        return np.clip(q, self.lower, self.upper) if bounded else q

    def _step(self, J: Floats, error: Floats, still: Flags) -> Floats:
        J = np.where(still[:, None, :], 0.0, J)
        damping = DAMPING * (error * error).sum(axis=1) + LEAST_DAMPING
        gram = J @ np.swapaxes(J, 1, 2) + damping[:, None, None] * np.eye(J.shape[1])
        step: Floats = np.einsum("nij,ni->nj", J, np.linalg.solve(gram, error[..., None])[..., 0])
        return step

    def error(self, q: Floats, T: Floats) -> tuple[Floats, Floats]:
        """Return the rows of the Jacobian that count (N, m, n) and the error in them (N, m) [m, rad].

        Turns are about the axes of the flange.
        """
        have, J = self.forward_and_jacobian(q)
        missing = self._missing(have, T)
        if self.counts.all():
            return J, missing
        turned = np.einsum("nji,nj->ni", have[..., :3], missing[:, 3:])
        missing = np.concatenate((missing[:, :3], turned), axis=1)
        return self._that_count(have, J), missing[:, self.counts]

    def rows(self, q: Floats) -> Floats:
        """Return the rows of the Jacobian that count (N, m, n)."""
        return self.jacobian(q) if self.counts.all() else self._that_count(*self.forward_and_jacobian(q))

    def _that_count(self, have: Floats, J: Floats) -> Floats:
        turned = np.swapaxes(have[..., :3], -1, -2) @ J[:, 3:]
        return np.concatenate((J[:, :3], turned), axis=1)[:, self.counts]

    def _missing(self, have: Floats, T: Floats) -> Floats:
        """Return the displacement and the turn from poses of the flange to other poses (N, 6) [m, rad]."""
        if self.model.task is ArmTask.POINTING:
            a, b = have[..., 2], T[..., 2]
            turn = _as_long_as_angle(np.cross(a, b), (a * b).sum(axis=1))
        else:
            h, w = have[..., :3], T[..., :3]
            v = 0.5 * np.cross(h, w, axis=1).sum(axis=2)
            turn = _as_long_as_angle(v, 0.5 * ((h * w).sum(axis=(1, 2)) - 1.0))
        return np.concatenate((T[..., 3] - have[..., 3], turn), axis=1)


def with_guides(J: Floats, error: Floats, q: Floats, weights: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Return rows of the Jacobian (N, m, n) and the error (N, m) with those of r guides added: (N, m + r, ...)."""
    rows = np.broadcast_to(weights, (len(J), *weights.shape))
    return np.concatenate((J, rows), axis=1), np.concatenate((error, values - q @ weights.T), axis=1)


def _as_long_as_angle(v: Floats, cosine: Floats) -> Floats:
    """Return vectors (N, 3) whose lengths are angles, from vectors whose lengths are the sines of these angles."""
    sine = np.linalg.norm(v, axis=1)
    factor = np.arctan2(sine, cosine) / np.maximum(sine, 1e-12)
    half = (sine < 1e-12) & (cosine < 0.0)  # half a turn: take any axis, because the next step corrects it
    turn = v * np.where(sine < 1e-12, 1.0, factor)[:, None]
    turn[half] = (1e-3, 0.0, 0.0)
    return turn


# --- the proof of continuous joints ----------------------------------------------------------------------------------

LENGTH = 0.4  # unit of length, as a fraction of the longest lever, that makes the proof easiest
MAX_KANTOROVICH = 0.5  # maximum beta L eta for which the theorem holds
LOST = 0.9  # maximum |1 - A F'| that is accepted: F' has an inverse where this norm is less than 1
HERMITE = 1.0 / 384.0  # maximum error of the cubic, as a fraction of the fourth derivative
SLOPES = 8.0 / 27.0  # maximum error of the cubic, as a fraction of the error of the slopes at both ends


class Cubic(NamedTuple):
    """Cubics of the unknowns between samples: values (k, n) and rates at both ends. Rates are by the fraction of the
    time between the samples."""

    begin: Floats
    end: Floats
    begin_rate: Floats
    end_rate: Floats

    def bends(self) -> tuple[Floats, Floats, Floats]:
        """Return the second derivatives at both ends, and the third derivative (k, n)."""
        way, v, w = self.end - self.begin, self.begin_rate, self.end_rate
        bend, third = 6.0 * way - 4.0 * v - 2.0 * w, 6.0 * (v + w - 2.0 * way)
        return bend, bend + third, third

    def at(self, parts: Floats) -> Floats:
        """Return the unknowns at fractions (m,) of the time: (k, m, n)."""
        bend, _, third = self.bends()
        x = parts[:, None]
        halves = 0.5 * bend[:, None], third[:, None] / 6.0
        return np.asarray(self.begin[:, None] + x * (self.begin_rate[:, None] + x * (halves[0] + x * halves[1])))

    def most(self) -> tuple[Floats, Floats, Floats]:
        """Return upper bounds (k, n) of the sizes of the first three derivatives."""
        before, after, third = (np.abs(bend) for bend in self.bends())
        rates = np.maximum(np.abs(self.begin_rate), np.abs(self.end_rate)) + third / 8.0
        return rates, np.maximum(before, after), third


class Gaps(NamedTuple):
    """The gaps between neighbouring samples. Derivatives are by the fraction of the time between the samples."""

    way: Cubic  # the joints between the samples (k, n) [rad, m]
    place: Floats  # (k,) bounds of the fourth derivative of the desired position [m]
    turn: Floats  # (k, 4) bounds of the first four derivatives of the angles of the desired turn, summed [rad]
    guide: Floats  # (k,) bounds of the fourth derivative of the guides
    weights: Floats  # weights of r guides (r, n)

    def some(self, which: Rows) -> Gaps:
        """Return the gaps with the given numbers."""
        way, *rows, weights = self
        place, turn, guide = (row[which] for row in rows)
        return Gaps(Cubic(*(row[which] for row in way)), place, turn, guide, weights)


class Continuation:
    """The proof for one arm. The number of its joints equals the number of parts of its task plus the number of guides.

    `sure`: the maximum distance of joints [rad, m] from which Newton's method finds the proved joints of a line.
    """

    sure = 0.1

    def __init__(self, batch: NumericBatch) -> None:
        self.batch, model = batch, batch.model
        self.turns = batch.turning
        _, reached = levers(model)
        self.length = LENGTH * reached[0]
        # the number of sliding joints from each joint on: each may be up to one unit beyond its range
        sliding = np.cumsum(~batch.turning[::-1])[::-1]
        self.levers = np.where(self.turns, np.array(reached) / self.length + sliding, 1.0)
        self.longest = np.maximum.accumulate(self.levers[::-1])[
            ::-1
        ]  # the longest lever of a joint and of all later joints
        self.units = np.where(self.turns, 1.0, self.length)
        self.places = sum(model.counts[:3])
        n = model.joint_count
        first, later = np.minimum.outer(range(n), range(n)), np.maximum.outer(range(n), range(n))
        # a bound of the second derivatives of the flange's position: the lever of the later joint counts
        self.place_bend = float(np.linalg.norm(np.where(self.turns[first], self.levers[later], 0.0), 2))

    def prove(self, gaps: Gaps, pieces: int) -> Flags:
        """Return whether the joints are proved continuous in each gap (k,)."""
        n = float(self.turns.sum())
        missed, bend = self._bounds(gaps)
        q = gaps.way.at(np.linspace(0.0, 1.0, pieces + 1))  # the ends of the pieces
        rows = self.batch.rows(q.reshape(-1, q.shape[2])).reshape(*q.shape[:2], -1, q.shape[2])
        J = np.empty((*q.shape[:2], rows.shape[2] + len(gaps.weights), q.shape[2]))
        J[:, :, : rows.shape[2]] = rows
        J[:, :, rows.shape[2] :] = gaps.weights
        J *= self.units
        J[:, :, : self.places] /= self.length
        beta = inverse_bound(J, bend / (8.0 * pieces**2) + sqrt(n) * missed)
        least = np.fmin(MAX_KANTOROVICH, MAX_KANTOROVICH / (beta * hypot(self.place_bend, n)))
        return np.asarray((beta * missed[:, None] <= least).all(axis=1))

    def step(self, q: Floats, T: Floats, guides: tuple[Floats, Floats] | None) -> Floats:
        """Return joints (N, n) after one step of Newton's method to poses (N, 3, 4).

        `guides`: the weights (r, n) of sums of the joints, and their values (N, r).
        """
        J, error = self.batch.error(q, T)
        if guides is not None:
            J, error = with_guides(J, error, q, *guides)
        return np.asarray(q + (inverses(J) @ error[:, :, None])[:, :, 0])

    def _bounds(self, gaps: Gaps) -> tuple[Floats, Floats]:
        """Return bounds (k,) of |F| on the cubic, and of the second derivative of J on it."""
        changes = np.stack(gaps.way.most()) / self.units  # bounds of three derivatives (3, k, n)
        first, second, third = changes.sum(axis=2)  # bounds (k,) of each derivative, summed over the joints
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


def inverse_bound(ends: Floats, off: Floats) -> Floats:
    """Return bounds (k, m) of |F'^-1| on pieces, from F' at their ends (k, m + 1, n, n); NaN if F' may be singular.

    `off` (k,): bounds of the distance of F' from the chord between the ends of a piece.
    """
    A = inverses(0.5 * (ends[:, 1:] + ends[:, :-1]))
    size = _norm(A)
    lost = 0.5 * _norm(A @ (ends[:, 1:] - ends[:, :-1])) + size * off[:, None]
    return np.asarray(size / np.where(lost < LOST, 1.0 - lost, np.nan))


def _norm(matrices: Floats) -> Floats:
    """Return Frobenius norms (...) of matrices (..., m, n)."""
    return np.asarray(np.sqrt(np.einsum("...ij,...ij->...", matrices, matrices)))


def inverses(J: Floats) -> Floats:
    """Return inverses (..., n, m) of matrices (..., m, n); NaN if singular, pseudo-inverses if m > n."""
    if J.shape[-2] > J.shape[-1]:
        return np.asarray(np.linalg.pinv(J), dtype=np.float64)
    try:
        return np.asarray(np.linalg.inv(J), dtype=np.float64)
    except np.linalg.LinAlgError:  # at least one matrix is singular
        inverse = np.asarray(np.linalg.pinv(J), dtype=np.float64)
        inverse[np.linalg.matrix_rank(J) < J.shape[-1]] = np.nan
        return inverse
