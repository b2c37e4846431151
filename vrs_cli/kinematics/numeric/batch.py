"""Search the joints for many poses of a numerical arm at once, each independently, and prove that the joints are
continuous between neighbouring samples of a path.

Let c(x), with x from 0 to 1, be the cubic through the joints and rates at two samples. Between the samples it is near
the joints that solve F(x, q) = 0, where F is the error of the flange: of its position, and the vector of the sines of
its rotation error. The theorem of Kantorovich (Ortega and Rheinboldt, "Iterative Solution of Nonlinear Equations in
Several Variables", 1970, 12.6.2) is applied at c(x): with beta >= |F'(c)^-1|, eta >= beta |F(c)| and |F'(p) - F'(q)| <=
L |p - q|, a solution exists within 2 eta of c if beta L eta <= 1/2, and no other solution within 1 / (beta L). As this
is true at every x, and c is exact at both samples, one continuous branch of solutions connects the samples.

|F(c(x))| is at most 1/384 of its fourth derivative by x, because F and its slope are 0 at both samples (the remainder
of Hermite's interpolation; Davis, "Interpolation and Approximation", 1963, 3.1). Derivatives of the rotation by x are
bounded by Faa di Bruno's formula, from the sums of the derivatives of all angles (of joints and of the path). For the
position, they are multiplied by the levers, the greatest distances of the flange from the axes.

To bound beta, c is divided into pieces, each of length g in x. On a piece the Jacobian J differs from the chord between
its values at the ends by at most g2 / 8 times its second derivative, and F' differs from J by at most |F| |J|. With A
the inverse of the mean of J at both ends, |1 - A F'| is at most |A| times half of the difference between the ends (plus
these errors), and |F'^-1| is at most |A| / (1 - |1 - A F'|) (Neumann series).

For a redundant arm F has one more row for each guide: the weighted sum of the joints minus its prescribed value. This
row is linear in the joints and does not change L.

Lengths [m], including those of prismatic joints, are divided by `Continuation.length` [m], so that all unknowns are in
rad. Norms of vectors are Euclidean, those of inverse matrices Frobenius norms.
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

# [m, rad] a result with this error is accepted after all steps: in a singular pose further steps would not reduce it
SINGULAR = 5e-9


class NumericBatch(SerialBatch):
    """The functions of `NumericArm` for arrays. Joints are NaN in rows whose search does not converge.

    `solve`: a function that solves a single pose, used in `inverse` in place of the search; it returns what
    `RobotArm.branches` returns. `held`: the indexes of the joints that keep their values.
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
        """For each pose, return the result of the first successful search; only searches from the first round of
        starting points are considered.
        """
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
        """Return the solutions for one pose that the first successful round of starts finds. `inside`: a function that
        brings joints inside the limits, nearest to `near`, by whole turns, and returns None if that is impossible.
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
        """Search joints (N, n) for poses (N, 3, 4) from starts (N, n) or (n,), within the limits if `bounded`. Return
        NaN for rows that fail.

        `guides`: the weights (r, n) of prescribed sums of the joints, and the values (N, r) of these sums.
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
            # take one extra step, so that searches from different starts give the same digits
            found[rows[done]] = q[rows[done]]
            rows, before = rows[~done], before[~done]
            if self.short:
                stuck = rows[np.abs(q[rows] - before).max(axis=1) < CONVERGED]
                missing = self._missing(self.forward(q[stuck]), T[stuck])
                away, turned = np.linalg.norm(missing[:, :3], axis=1), np.linalg.norm(missing[:, 3:], axis=1)
                # errors this small do not show in three decimals, so the pose counts as reached
                there = stuck[(away <= LEVEL) & (turned <= STRAIGHT)]
                found[there] = q[there]
                rows = np.setdiff1d(rows, stuck)
        if guides is None and len(rows):  # accept singular poses, but not on lines (with guides)
            there = rows[np.abs(self.error(q[rows], T[rows])[1]).max(axis=1) < SINGULAR]
            found[there] = q[there]
        return found

    def _next_joints(self, q: Floats, J: Floats, error: Floats, *, bounded: bool) -> Floats:
        """Return the joints after one damped least-squares step. With `bounded`, joints at a limit do not move if the
        step would push them outside.
        """
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
        """Return the m rows of the Jacobian that count for the task (N, m, n), and the remaining errors from q to T in
        these rows (N, m) [m, rad].

        Rotations are expressed in the axes of the flange if only a part of the pose counts.
        """
        have, J = self.forward_and_jacobian(q)
        missing = self._missing(have, T)
        if self.counts.all():
            return J, missing
        turned = np.einsum("nji,nj->ni", have[..., :3], missing[:, 3:])
        missing = np.concatenate((missing[:, :3], turned), axis=1)
        return self._that_count(have, J), missing[:, self.counts]

    def rows(self, q: Floats) -> Floats:
        """Return the rows of the Jacobian that count for the task (N, m, n)."""
        return self.jacobian(q) if self.counts.all() else self._that_count(*self.forward_and_jacobian(q))

    def _that_count(self, have: Floats, J: Floats) -> Floats:
        turned = np.swapaxes(have[..., :3], -1, -2) @ J[:, 3:]
        return np.concatenate((J[:, :3], turned), axis=1)[:, self.counts]

    def _missing(self, have: Floats, T: Floats) -> Floats:
        """Return the displacements and rotation vectors that take the flange poses `have` to the poses T, as an array
        of shape (N, 6) [m, rad].
        """
        if self.model.task is ArmTask.POINTING:
            a, b = have[..., 2], T[..., 2]
            turn = _as_long_as_angle(np.cross(a, b), (a * b).sum(axis=1))
        else:
            h, w = have[..., :3], T[..., :3]
            v = 0.5 * np.cross(h, w, axis=1).sum(axis=2)
            turn = _as_long_as_angle(v, 0.5 * ((h * w).sum(axis=(1, 2)) - 1.0))
        return np.concatenate((T[..., 3] - have[..., 3], turn), axis=1)


def with_guides(J: Floats, error: Floats, q: Floats, weights: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Append a row for each of r guides to the Jacobians (N, m, n) and errors (N, m), and return both (N, m + r, ...).
    `weights` (r, n) and `values` (N, r): see `search`.
    """
    rows = np.broadcast_to(weights, (len(J), *weights.shape))
    return np.concatenate((J, rows), axis=1), np.concatenate((error, values - q @ weights.T), axis=1)


def _as_long_as_angle(v: Floats, cosine: Floats) -> Floats:
    """Return vectors v (N, 3), scaled so that their lengths are angles [rad] in place of the sines of these angles.
    `cosine` (N,): the cosines of the angles.
    """
    sine = np.linalg.norm(v, axis=1)
    factor = np.arctan2(sine, cosine) / np.maximum(sine, 1e-12)
    half = (sine < 1e-12) & (cosine < 0.0)  # at 180 deg the axis is unknown: use any, because the next step corrects it
    turn = v * np.where(sine < 1e-12, 1.0, factor)[:, None]
    turn[half] = (1e-3, 0.0, 0.0)
    return turn


# --- the proof of continuous joints ----------------------------------------------------------------------------------

LENGTH = 0.4  # unit of length in proofs, as a fraction of the longest lever; proofs succeed most often with this value
MAX_KANTOROVICH = 0.5  # the theorem of Kantorovich is valid if beta L eta (see above) is at most this
LOST = 0.9  # a proof succeeds only if |1 - A F'| (see above) is below this value; below 1, F' certainly has an inverse
HERMITE = 1.0 / 384.0  # maximum interpolation error of the cubic, as a fraction of the fourth derivative
# maximum error of the cubic caused by errors of its slopes at both ends, as a fraction of these errors
SLOPES = 8.0 / 27.0


class Cubic(NamedTuple):
    """Cubic polynomials of n unknowns in k gaps between samples, given by the values and rates (k, n) at both ends. The
    parameter is the fraction of the time between the samples, 0 to 1.
    """

    begin: Floats
    end: Floats
    begin_rate: Floats
    end_rate: Floats

    def bends(self) -> tuple[Floats, Floats, Floats]:
        """Return the second derivatives at both ends, and the constant third derivative (k, n)."""
        way, v, w = self.end - self.begin, self.begin_rate, self.end_rate
        bend, third = 6.0 * way - 4.0 * v - 2.0 * w, 6.0 * (v + w - 2.0 * way)
        return bend, bend + third, third

    def at(self, parts: Floats) -> Floats:
        """Return the values of the unknowns (k, m, n) at fractions (m,) of the time."""
        bend, _, third = self.bends()
        x = parts[:, None]
        halves = 0.5 * bend[:, None], third[:, None] / 6.0
        return np.asarray(self.begin[:, None] + x * (self.begin_rate[:, None] + x * (halves[0] + x * halves[1])))

    def most(self) -> tuple[Floats, Floats, Floats]:
        """Return upper bounds (k, n) of the absolute values of the first three derivatives."""
        before, after, third = (np.abs(bend) for bend in self.bends())
        rates = np.maximum(np.abs(self.begin_rate), np.abs(self.end_rate)) + third / 8.0
        return rates, np.maximum(before, after), third


class Gaps(NamedTuple):
    """k gaps: the intervals between neighbouring samples of a path. All derivatives are by the fraction of the time
    between the samples, 0 to 1.
    """

    way: Cubic  # cubics through the joints and rates at both samples (k, n) [rad, m]
    place: Floats  # (k,) bounds of the fourth derivative of the desired position [m]
    turn: Floats  # (k, 4) bounds of the first four derivatives of the desired rotation's angles, added up [rad]
    guide: Floats  # (k,) bounds of the fourth derivative of the guides' values
    weights: Floats  # (r, n) weights of the joints in r guides (prescribed sums)

    def some(self, which: Rows) -> Gaps:
        """Return the subset of the gaps (intervals between samples) with the given indices."""
        way, *rows, weights = self
        place, turn, guide = (row[which] for row in rows)
        return Gaps(Cubic(*(row[which] for row in way)), place, turn, guide, weights)


class Continuation:
    """Proves for one arm that joints are continuous between samples. The arm has as many joints as the parts of a pose
    that count and the guides together.

    `sure`: if start joints are closer than this to the proved joints [rad, m], Newton's method converges to the proved
    joints without a check.
    """

    sure = 0.1

    def __init__(self, batch: NumericBatch) -> None:
        self.batch, model = batch, batch.model
        self.turns = batch.turning
        _, reached = levers(model)
        self.length = LENGTH * reached[0]
        # for each joint: the number of prismatic joints from it to the end of the arm; each of these may be one unit of
        # length beyond its range, which lengthens the lever of the joint
        sliding = np.cumsum(~batch.turning[::-1])[::-1]
        self.levers = np.where(self.turns, np.array(reached) / self.length + sliding, 1.0)
        self.longest = np.maximum.accumulate(self.levers[::-1])[
            ::-1
        ]  # for each joint, the longest lever among it and all later joints
        self.units = np.where(self.turns, 1.0, self.length)
        self.places = sum(model.counts[:3])
        n = model.joint_count
        first, later = np.minimum.outer(range(n), range(n)), np.maximum.outer(range(n), range(n))
        # bound of the second derivatives of the flange's position: the derivative by two joints is at most the lever of
        # the later one
        self.place_bend = float(np.linalg.norm(np.where(self.turns[first], self.levers[later], 0.0), 2))

    def prove(self, gaps: Gaps, pieces: int) -> Flags:
        """Return for each gap (interval between samples) whether the joints are proved to be continuous in it (k,). The
        proof divides each gap into `pieces` pieces.
        """
        n = float(self.turns.sum())
        missed, bend = self._bounds(gaps)
        q = gaps.way.at(np.linspace(0.0, 1.0, pieces + 1))  # joints of the cubic at the ends of the pieces
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
        """Return joints (N, n) after one step of Newton's method from q to poses T (N, 3, 4).

        `guides`: the weights (r, n) of prescribed sums of the joints, and the values (N, r) of these sums.
        """
        J, error = self.batch.error(q, T)
        if guides is not None:
            J, error = with_guides(J, error, q, *guides)
        return np.asarray(q + (inverses(J) @ error[:, :, None])[:, :, 0])

    def _bounds(self, gaps: Gaps) -> tuple[Floats, Floats]:
        """Return for each gap bounds (k,) of |F| and of the second derivative of J by x, on the cubic."""
        changes = np.stack(gaps.way.most()) / self.units  # bounds of the joints' first three derivatives (3, k, n)
        first, second, third = changes.sum(axis=2)  # these bounds, summed over the joints (k,)
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
    """Return a bound of the fourth derivative of a rotation matrix, from bounds of the first four derivatives of the
    sum of its angles.
    """
    square = first * first
    return np.asarray(square * square + 6.0 * square * second + 3.0 * second * second + 4.0 * first * third + fourth)


def inverse_bound(ends: Floats, off: Floats) -> Floats:
    """Return bounds (k, m) of |F'^-1| on m pieces of each gap, from F' at their ends (k, m + 1, n, n); NaN where F' may
    be singular.

    `off` (k,): bounds of the difference between F' and the chord between its values at the ends of a piece.
    """
    A = inverses(0.5 * (ends[:, 1:] + ends[:, :-1]))
    size = _norm(A)
    lost = 0.5 * _norm(A @ (ends[:, 1:] - ends[:, :-1])) + size * off[:, None]
    return np.asarray(size / np.where(lost < LOST, 1.0 - lost, np.nan))


def _norm(matrices: Floats) -> Floats:
    """Return the Frobenius norms (...) of matrices (..., m, n)."""
    return np.asarray(np.sqrt(np.einsum("...ij,...ij->...", matrices, matrices)))


def inverses(J: Floats) -> Floats:
    """Return the inverses (..., n, m) of matrices (..., m, n), or their pseudo-inverses if m > n; NaN for singular
    matrices.
    """
    if J.shape[-2] > J.shape[-1]:
        return np.asarray(np.linalg.pinv(J), dtype=np.float64)
    try:
        return np.asarray(np.linalg.inv(J), dtype=np.float64)
    except np.linalg.LinAlgError:  # at least one matrix is singular: invert them one by one
        inverse = np.asarray(np.linalg.pinv(J), dtype=np.float64)
        inverse[np.linalg.matrix_rank(J) < J.shape[-1]] = np.nan
        return inverse
